"""Direct light: what a light sample adds to the radiance of a path, and the shadow ray that asks whether it does.

A light sample is what `lights`, `mesh_lights` and `world_light` leave: the vector to a point, a weight and a colour.
The surface reflects a part of it. Where the light could also have been met by a ray that scattered, the sample gets the
share that multiple importance sampling gives it (Veach 1997, section 9.2, power heuristic).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    BOUNCES_LEFT,
    DIRECTION,
    GEOMETRIC_NORMAL,
    LANES,
    LAST,
    LIFT,
    LIFT_BELOW,
    LIFT_BEYOND,
    LIGHT_COLOR,
    LIGHT_SPREAD,
    LIGHT_VISIBILITY,
    LIGHT_WEIGHT,
    LOBE_COUNT,
    OFFSET,
    ORIGIN,
    PACKET,
    POSITION,
    RADIANCE,
    REFLECTED,
    SHADING_NORMAL,
    SHADOW,
    T_FAR,
    T_NEAR,
    THROUGHPUT,
    TIME,
    Batch,
    Y,
    Z,
)
from .jit import device, kernel
from .light_arrays import SHINES_THROUGH, LightArrays
from .lobes import evaluate_lobes, first_lobe
from .scene import VISIBLE_TO_DIFFUSE, VISIBLE_TO_GLOSSY, VISIBLE_TO_TRANSMISSION
from .surface import JUST_AHEAD, SHORT_OF_LAMP
from .warps import INV_PI, PI, clamp01

_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)


class Clamp(NamedTuple):
    """The limit of what bounced light may add, infinite for none, and how many bounces a path may make in all."""

    limit: float
    bounces: float


@device
def clamp_limit(f: np.ndarray, clamp: Clamp, i: int, free: int) -> float:
    """The limit for a path of lane i; there is none as long as it has bounced at most `free` times."""
    return clamp.limit if f[i + BOUNCES_LEFT] < clamp.bounces - np.float32(free) else np.float32(np.inf)


@kernel
def reflect_diffusely(batch: Batch, packets: int) -> None:
    """Where all surfaces are Lambertian: multiply the weight by the surface's cosine, and make the shadow ray.

    Light that comes from behind the triangle itself, where the smooth normal sees it, counts if shadow rays are lifted.
    """
    f = batch.floats
    for p in range(packets):
        at = p * PACKET
        below = _ZERO
        for i in range(at, at + LANES):
            below = max(below, f[i + LIFT_BELOW])
        if below > _ZERO:
            for i in range(at, at + LANES):
                _reflect_diffusely(f, i, f[i + LIFT] > _ZERO, _lift(f, i, _ONE))
        else:
            for i in range(at, at + LANES):
                _reflect_diffusely(f, i, False, _ZERO)


@device
def _reflect_diffusely(f: np.ndarray, i: int, sees_beyond: bool, lift: float) -> None:
    """`sees_beyond`: light counts that only the smooth normal sees."""
    dx, dy, dz = f[i + SHADOW + DIRECTION], f[i + SHADOW + DIRECTION + Y], f[i + SHADOW + DIRECTION + Z]
    nx, ny, nz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
    cosine = dx * f[i + SHADING_NORMAL] + dy * f[i + SHADING_NORMAL + Y] + dz * f[i + SHADING_NORMAL + Z]
    weight = f[i + LIGHT_WEIGHT]
    lit = (cosine > _ZERO) & ((dx * nx + dy * ny + dz * nz > _ZERO) | sees_beyond) & (weight > _ZERO)
    f[i + LIGHT_WEIGHT] = cosine * weight if lit & (f[i + ACTIVE] > _ZERO) else _ZERO
    _make_shadow_ray(f, i, dx, dy, dz, _ONE, lift)


@kernel
def add_light(batch: Batch, lights: LightArrays, light: int, clamp: Clamp, packets: int) -> None:
    """Add what an unblocked shadow ray brings to the radiance gathered from Lambertian surfaces."""
    f, color = batch.floats, lights.color[light]
    red, green, blue = color[0], color[1], color[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            weight = f[i + LIGHT_WEIGHT] if f[i + SHADOW + T_FAR] >= _ZERO else _ZERO
            r = weight * red * f[i + ALBEDO] * f[i + THROUGHPUT]
            g = weight * green * f[i + ALBEDO + Y] * f[i + THROUGHPUT + Y]
            b = weight * blue * f[i + ALBEDO + Z] * f[i + THROUGHPUT + Z]
            add_radiance(f, i, r, g, b, clamp_limit(f, clamp, i, 0))


@kernel
def reflect(batch: Batch, lobe_stride: int, diffuse_competes: bool, packets: int) -> None:
    """Let the surfaces reflect the light sample into REFLECTED, and make its shadow ray.

    `diffuse_competes`: rays that scatter off Lambertian surfaces count this light, too, when they meet it (those off
    all others always do).
    """
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            wanted = (f[i + LIGHT_WEIGHT] > _ZERO) & (f[i + ACTIVE] > _ZERO) & (f[i + LAST] == _ZERO)
            if not wanted:
                f[i + LIGHT_WEIGHT] = _ZERO
                continue
            dx, dy, dz = f[i + SHADOW + DIRECTION], f[i + SHADOW + DIRECTION + Y], f[i + SHADOW + DIRECTION + Z]
            nx, ny, nz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
            length = np.float32(math.sqrt(dx * dx + dy * dy + dz * dz))
            scale = _ONE / length
            x, y, z = dx * scale, dy * scale, dz * scale
            cosine = x * f[i + SHADING_NORMAL] + y * f[i + SHADING_NORMAL + Y] + z * f[i + SHADING_NORMAL + Z]
            facing = x * nx + y * ny + z * nz
            lifted = f[i + LIFT] > _ZERO if cosine > _ZERO else f[i + LIFT_BEYOND] < _ZERO
            side = cosine if lifted else facing
            # 1 / the density of the light sample times that of the ray that scatters is the ratio of both densities.
            spread = f[i + LIGHT_SPREAD]
            if side * facing < _ZERO:
                # Only the smooth normal sees this light: no ray scatters there.
                nx, ny, nz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
                spread = _ZERO
            if bits[i + LOBE_COUNT] == np.uint32(0):
                seen = bits[i + LIGHT_VISIBILITY] & np.uint32(VISIBLE_TO_DIFFUSE) != np.uint32(0)
                cosine = cosine if (side > _ZERO) & (cosine > _ZERO) & seen else _ZERO
                share = cosine * share_of_light(cosine * INV_PI, spread if diffuse_competes else _ZERO)
                r, g, b = share * f[i + ALBEDO], share * f[i + ALBEDO + Y], share * f[i + ALBEDO + Z]
            else:
                r, g, b = _reflect_by_lobes(batch, lobe_stride, i, x, y, z, nx, ny, nz, spread)
                r, g, b = r * PI, g * PI, b * PI
            f[i + REFLECTED] = length * r
            f[i + REFLECTED + Y] = length * g
            f[i + REFLECTED + Z] = length * b
            if max(r, g, b) <= _ZERO:
                f[i + LIGHT_WEIGHT] = _ZERO
            sign = _ONE if side > _ZERO else -_ONE
            lift = _lift(f, i, sign) if f[i + LIFT_BELOW] > _ZERO else _ZERO
            _make_shadow_ray(f, i, dx, dy, dz, sign, lift)
            if bits[i + LIGHT_VISIBILITY] & np.uint32(SHINES_THROUGH) != np.uint32(0):
                f[i + SHADOW + T_FAR] = _ZERO  # before where the ray begins to look


@device
def share_of_light(density: float, spread: float) -> float:
    """The light sample's share by the power heuristic: `spread` is 1 / its density, `density` that of scattering."""
    ratio = density * spread
    return _ONE / (_ONE + ratio * ratio)


@device
def _reflect_by_lobes(
    batch: Batch,
    lobe_stride: int,
    i: int,
    x: float,
    y: float,
    z: float,
    nx: float,
    ny: float,
    nz: float,
    spread: float,
) -> tuple[float, float, float]:
    """Σ BSDF × cosine of lane i's lobes for light from (x, y, z), unit, less what rays that scatter there bring.

    Where n is, light is reflected, and elsewhere transmitted.
    """
    f, bits = batch.floats, batch.bits
    vx, vy, vz = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    scale = -_ONE / np.float32(math.sqrt(vx * vx + vy * vy + vz * vz))
    first = first_lobe(i, lobe_stride)
    r, g, b, density, other_r, other_g, other_b, other_density = evaluate_lobes(
        batch.lobes,
        first,
        np.int64(bits[i + LOBE_COUNT]),
        vx * scale,
        vy * scale,
        vz * scale,
        x,
        y,
        z,
        nx,
        ny,
        nz,
    )
    reflects = x * nx + y * ny + z * nz > _ZERO
    visibility, other_kind = bits[i + LIGHT_VISIBILITY], VISIBLE_TO_GLOSSY if reflects else VISIBLE_TO_TRANSMISSION
    share = other_share = _ZERO
    if visibility & np.uint32(VISIBLE_TO_DIFFUSE):
        share = share_of_light(density, spread)
    if visibility & np.uint32(other_kind):
        other_share = share_of_light(other_density, spread)
    return (
        share * r + other_share * other_r,
        share * g + other_share * other_g,
        share * b + other_share * other_b,
    )


@device
def _make_shadow_ray(f: np.ndarray, i: int, dx: float, dy: float, dz: float, side: float, lift: float) -> None:
    """Aim from a step off the surface, to the viewer's `side` (1) or the other (-1), and `lift` along SHADING_NORMAL,
    at the surface's position + T_FAR × d.
    """
    nx, ny, nz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
    sx, sy, sz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    step, reach = side * f[i + OFFSET], f[i + SHADOW + T_FAR]
    mx, my, mz = step * nx + lift * sx, step * ny + lift * sy, step * nz + lift * sz
    # The step turns the ray, unless its end is infinitely far away. A sample that misses its lamp may have no reach.
    turn = _ONE / max(reach, JUST_AHEAD)
    f[i + SHADOW + ORIGIN] = f[i + POSITION] + mx
    f[i + SHADOW + ORIGIN + Y] = f[i + POSITION + Y] + my
    f[i + SHADOW + ORIGIN + Z] = f[i + POSITION + Z] + mz
    f[i + SHADOW + T_NEAR] = JUST_AHEAD
    f[i + SHADOW + DIRECTION] = dx - turn * mx
    f[i + SHADOW + DIRECTION + Y] = dy - turn * my
    f[i + SHADOW + DIRECTION + Z] = dz - turn * mz
    f[i + SHADOW + TIME] = _ZERO
    f[i + SHADOW + T_FAR] = reach * SHORT_OF_LAMP


@device
def _lift(f: np.ndarray, i: int, side: float) -> float:
    """How far along SHADING_NORMAL the shadow ray starts (`smooth_lift`): as far as that lies at grazing light, less
    the nearer the cosines are to LIFT_BELOW, in the way of Cycles.
    """
    dx, dy, dz = f[i + SHADOW + DIRECTION], f[i + SHADOW + DIRECTION + Y], f[i + SHADOW + DIRECTION + Z]
    below = f[i + LIFT_BELOW]
    scale = side / np.float32(math.sqrt(dx * dx + dy * dy + dz * dz))
    cosine = dx * f[i + SHADING_NORMAL] + dy * f[i + SHADING_NORMAL + Y] + dz * f[i + SHADING_NORMAL + Z]
    facing = dx * f[i + GEOMETRIC_NORMAL] + dy * f[i + GEOMETRIC_NORMAL + Y] + dz * f[i + GEOMETRIC_NORMAL + Z]
    in_units = scale / below if below > _ZERO else _ZERO
    cosine, facing = cosine * in_units, facing * in_units
    amount = clamp01((_TWO - cosine if cosine < _ONE else _ONE) - facing)
    return amount * (f[i + LIFT] if side > _ZERO else f[i + LIFT_BEYOND])


@kernel
def add_reflected(batch: Batch, clamp: Clamp, packets: int) -> None:
    """Add what an unblocked shadow ray brings to the radiance gathered."""
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            weight = f[i + LIGHT_WEIGHT]
            if (weight > _ZERO) & (f[i + SHADOW + T_FAR] >= _ZERO):
                r = weight * f[i + LIGHT_COLOR] * f[i + REFLECTED] * f[i + THROUGHPUT]
                g = weight * f[i + LIGHT_COLOR + Y] * f[i + REFLECTED + Y] * f[i + THROUGHPUT + Y]
                b = weight * f[i + LIGHT_COLOR + Z] * f[i + REFLECTED + Z] * f[i + THROUGHPUT + Z]
                add_radiance(f, i, r, g, b, clamp_limit(f, clamp, i, 0))


@device
def add_radiance(f: np.ndarray, i: int, red: float, green: float, blue: float, limit: float) -> None:
    """Add to RADIANCE, scaled down so that the mean of the three is at most `limit`."""
    mean = (abs(red) + abs(green) + abs(blue)) * np.float32(1 / 3)
    scale = limit / mean if mean > limit else _ONE
    f[i + RADIANCE] += scale * red
    f[i + RADIANCE + Y] += scale * green
    f[i + RADIANCE + Z] += scale * blue
