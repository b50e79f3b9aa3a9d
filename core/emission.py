"""Emission: what a ray gathers from glowing surfaces, lamps and the world that it happens to meet.

Light that a light sample could have brought as well counts by its share in multiple importance sampling, the rest of
the share that `direct_light` gives.
"""

from __future__ import annotations

import math

import numpy as np

from .area_lights import meet_area, spread_of_area
from .batch import (
    ACTIVE,
    DIRECTION,
    EMISSION,
    GEOMETRIC_NORMAL,
    INVALID,
    LANES,
    MASK,
    MATERIAL,
    ORIGIN,
    PACKET,
    PASSED,
    PRIMITIVE,
    RECEIVER,
    SEES_LAMPS,
    SPREAD,
    T_FAR,
    THROUGHPUT,
    Batch,
    Y,
    Z,
)
from .direct_light import Clamp, add_radiance, clamp_limit
from .environment import EnvironmentMap, environment_pdf
from .jit import device, kernel
from .light_arrays import IS_ELLIPSE, IS_SPHERE, IS_SUN, LightArrays
from .light_choice import next_on_ray
from .lights import chance_of_lamp, cone_share
from .mesh_lights import MeshLights, emitter_of, spread_of_emitter
from .scene import VISIBLE_TO_CAMERA
from .surface import SHORT_OF_LAMP
from .warps import PI, one_minus_cos

_ZERO, _ONE = np.float32(0), np.float32(1)


@device
def share_of_ray(ray_spread: float, light_spread: float) -> float:
    """The share of light met by a ray, given 1 / the densities of the ray and of the light sample, by the power
    heuristic. A spread of 0 is a certain direction, an infinite one a light that is not sampled.
    """
    if ray_spread == _ZERO:
        return _ONE
    ratio = ray_spread / light_spread
    return _ONE / (_ONE + ratio * ratio)


@kernel
def add_emission(
    batch: Batch,
    world: int,
    emitters: MeshLights,
    environment: EnvironmentMap,
    hide_world: bool,
    clamp: Clamp,
    packets: int,
) -> None:
    """Add what the surfaces reached emit, and the world where there is none; there paths end.

    `world` is the world's material. `hide_world`: the camera does not see it, the film being transparent.
    """
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if f[i + ACTIVE] == _ZERO:
                continue
            red, green, blue = f[i + EMISSION], f[i + EMISSION + Y], f[i + EMISSION + Z]
            escaped = np.int64(bits[i + MATERIAL]) == world
            if escaped:
                f[i + ACTIVE] = _ZERO
            if (red == _ZERO) & (green == _ZERO) & (blue == _ZERO):
                continue
            if escaped & hide_world & (bits[i + MASK] == np.uint32(VISIBLE_TO_CAMERA)):
                continue
            share = _ONE
            if f[i + SPREAD] > _ZERO:
                if escaped:
                    share = share_of_ray(f[i + SPREAD], _spread_of_world(f, environment, i))
                else:
                    share = share_of_ray(f[i + SPREAD], _spread_of_surface(f, bits, emitters, i))
            limit = clamp_limit(f, clamp, i, 1)
            _add(f, i, share * red, share * green, share * blue, limit)


@device
def _add(f: np.ndarray, i: int, red: float, green: float, blue: float, limit: float) -> None:
    red, green, blue = f[i + THROUGHPUT] * red, f[i + THROUGHPUT + Y] * green, f[i + THROUGHPUT + Z] * blue
    add_radiance(f, i, red, green, blue, limit)


@device
def _scattered_at(f: np.ndarray, i: int) -> tuple[float, float, float]:
    """Where the ray of lane i left the surface that it last scattered on, before all that it has passed through."""
    back = f[i + PASSED]
    return (
        f[i + ORIGIN] - back * f[i + DIRECTION],
        f[i + ORIGIN + Y] - back * f[i + DIRECTION + Y],
        f[i + ORIGIN + Z] - back * f[i + DIRECTION + Z],
    )


@device
def _spread_of_world(f: np.ndarray, environment: EnvironmentMap, i: int) -> float:
    if len(environment.density) == 0:
        return np.float32(np.inf)
    x, y, z = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    return _ONE / environment_pdf(environment, x, y, z)


@device
def _spread_of_surface(f: np.ndarray, bits: np.ndarray, emitters: MeshLights, i: int) -> float:
    emitter = emitter_of(bits, emitters, i)
    if emitter < 0:
        return np.float32(np.inf)
    x, y, z = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    back = f[i + PASSED]
    ox, oy, oz = _scattered_at(f, i)
    nx, ny, nz = f[i + RECEIVER], f[i + RECEIVER + Y], f[i + RECEIVER + Z]
    distance = back + f[i + T_FAR]
    facing = abs(x * f[i + GEOMETRIC_NORMAL] + y * f[i + GEOMETRIC_NORMAL + Y] + z * f[i + GEOMETRIC_NORMAL + Z])
    return spread_of_emitter(emitters, emitter, ox, oy, oz, nx, ny, nz, facing / (distance * distance))


@kernel
def add_lamps(batch: Batch, lights: LightArrays, clamp: Clamp, packets: int) -> None:
    """Add the lamps that rays off surfaces that are not Lambertian meet before anything else; lamps hide nothing."""
    f = batch.floats
    one_by_one, has_more = lights.each, lights.each < len(lights.kind)
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if (f[i + ACTIVE] > _ZERO) & (f[i + SEES_LAMPS] > _ZERO):
                for light in range(one_by_one):
                    if lights.area[light] > _ZERO:
                        _add_lamp(batch, lights, light, clamp, i)
                if has_more:
                    _add_lamps_of_tree(batch, lights, clamp, i)


@device
def _add_lamps_of_tree(batch: Batch, lights: LightArrays, clamp: Clamp, i: int) -> None:
    f = batch.floats
    ox, oy, oz = _scattered_at(f, i)
    x, y, z = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    emitter, node = next_on_ray(lights.tree, 1, ox, oy, oz, x, y, z)
    while emitter >= 0:
        if lights.area[lights.each + emitter] > _ZERO:
            _add_lamp(batch, lights, lights.each + emitter, clamp, i)
        emitter, node = next_on_ray(lights.tree, node, ox, oy, oz, x, y, z)


@device
def _add_lamp(batch: Batch, lights: LightArrays, light: int, clamp: Clamp, i: int) -> None:
    f, bits = batch.floats, batch.bits
    if bits[i + MASK] & lights.visibility[light] == np.uint32(0):
        return
    if (f[i + SPREAD] > _ZERO) & (not lights.cast_shadow[light]):
        return  # it shines through what the ray would hit before it: the light samples have all of it
    x, y, z = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    back = f[i + PASSED]
    ox, oy, oz = _scattered_at(f, i)
    distance, spread = _meet(lights, light, ox, oy, oz, x, y, z)
    end = back + f[i + T_FAR] if bits[i + PRIMITIVE] != INVALID else np.float32(np.inf)
    if (distance < back) | (distance * SHORT_OF_LAMP > end) | (spread <= _ZERO):
        return
    if f[i + SPREAD] > _ZERO:
        nx, ny, nz = f[i + RECEIVER], f[i + RECEIVER + Y], f[i + RECEIVER + Z]
        chance = chance_of_lamp(lights, light, ox, oy, oz, nx, ny, nz)
        spread = spread / chance if chance > _ZERO else np.float32(np.inf)
    scale = share_of_ray(f[i + SPREAD], spread) * PI / lights.area[light]
    if lights.spot[light]:
        scale *= cone_share(lights.to_spot, light, x, y, z, lights.spot_cosine[light], lights.spot_edge[light])
    color = lights.color
    limit = clamp_limit(f, clamp, i, 1)
    _add(f, i, scale * color[light, 0], scale * color[light, 1], scale * color[light, 2], limit)


@device
def _meet(
    lights: LightArrays, light: int, ox: float, oy: float, oz: float, x: float, y: float, z: float
) -> tuple[float, float]:
    """How far along a ray lamp `light` lies, and 1 / the density of sampling it there; a spread of 0 is a miss."""
    kind, size = lights.kind[light], lights.size[light]
    cx, cy, cz = lights.position[light, 0], lights.position[light, 1], lights.position[light, 2]
    if kind == IS_SUN:
        # The direction lies in the cap: |d - n|² = 2 (1 - cos).
        dx, dy, dz = x - cx, y - cy, z - cz
        inside = dx * dx + dy * dy + dz * dz <= np.float32(2) * size
        return np.float32(np.inf), (np.float32(2) * PI * size if inside else _ZERO)
    if kind <= IS_ELLIPSE:
        distance, facing, is_met = meet_area(lights, light, ox, oy, oz, x, y, z)
        spread = spread_of_area(lights, light, ox, oy, oz, x, y, z, distance, facing) if is_met else _ZERO
        return distance, spread
    cx, cy, cz = cx - ox, cy - oy, cz - oz
    if kind == IS_SPHERE:
        return _meet_sphere(cx, cy, cz, x, y, z, size)
    return _meet_facing_disk(cx, cy, cz, x, y, z, size)


@device
def _meet_facing_disk(
    cx: float, cy: float, cz: float, x: float, y: float, z: float, radius: float
) -> tuple[float, float]:
    square, along = cx * cx + cy * cy + cz * cz, cx * x + cy * y + cz * z
    distance = square / along
    dx, dy, dz = distance * x - cx, distance * y - cy, distance * z - cz
    if (along <= _ZERO) | (dx * dx + dy * dy + dz * dz > radius * radius):
        return _ZERO, _ZERO
    return distance, np.float32(2) * PI * one_minus_cos(radius * radius / (square + radius * radius))


@device
def _meet_sphere(cx: float, cy: float, cz: float, x: float, y: float, z: float, radius: float) -> tuple[float, float]:
    along = cx * x + cy * y + cz * z
    px, py, pz = cx - along * x, cy - along * y, cz - along * z
    inside = radius * radius - (px * px + py * py + pz * pz)
    if inside < _ZERO:
        return _ZERO, _ZERO
    square = cx * cx + cy * cy + cz * cz
    if square > radius * radius:
        cap = one_minus_cos(radius * radius / square)
        return along - np.float32(math.sqrt(inside)), np.float32(2) * PI * cap
    return along + np.float32(math.sqrt(inside)), np.float32(4) * PI
