"""Lamps: how much light reaches a surface from a sampled point of each, and the shadow ray that asks whether it does.

Each kind is one kernel that fills, for every active lane, LIGHT_WEIGHT and a shadow ray. The light reflected is
weight × colour × albedo × throughput: the weight holds the geometry and the sample's density, the colour the power and
every constant factor, the 1/π of the Lambertian surface among them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    DIRECTION,
    GEOMETRIC_NORMAL,
    LANES,
    LIGHT_WEIGHT,
    OFFSET,
    ORIGIN,
    PACKET,
    POINT,
    POSITION,
    RADIANCE,
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
from .errors import SceneError
from .jit import device, kernel
from .scene import AreaLight, Light, PointLight, SpotLight, SunLight
from .surface import JUST_AHEAD
from .warps import one_minus_cos, square_to_cap, square_to_disk

IS_RECTANGLE, IS_ELLIPSE, IS_POINT, IS_SPHERE, IS_FACING_DISK, IS_SUN = 0, 1, 2, 3, 4, 5

_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
#: A spot's edge without blend: steep enough to be a step, finite so that 0 × it stays 0.
_HARD_EDGE = 1e30
#: The share of the way to a lamp that is looked along: a lamp that lies in a surface is not shadowed by that surface.
_SHORT_OF_LAMP = np.float32(1 - 2.0**-18)


class LightArrays(NamedTuple):
    """The lamps for kernels, L of them, positions re-centred."""

    kind: np.ndarray  # (L,) int64: IS_RECTANGLE, ...
    color: np.ndarray  # (L, 3)
    position: np.ndarray  # (L, 3); a sun: the direction towards it
    axis_u: np.ndarray  # (L, 3), full edge or axis of an area light
    axis_v: np.ndarray
    normal: np.ndarray  # (L, 3), the side an area light shines to
    size: np.ndarray  # (L,) radius in metres; a sun: 1 - cos of half its angle
    extended: np.ndarray  # (L,) bool: it has a size, so that a point of it is to be sampled
    cast_shadow: np.ndarray  # (L,) bool
    spot: np.ndarray  # (L,) bool: the light stands behind a cone
    to_spot: np.ndarray  # (L, 3, 3) world to lamp space
    spot_cosine: np.ndarray  # (L,) of half the cone's angle
    spot_edge: np.ndarray  # (L,) 1 / width of the blend, in cosines


def pack_lights(lights: Sequence[Light], center: np.ndarray) -> LightArrays:
    """Check the lamps and turn them into what kernels read; those that send no light are left out.

    Raises:
        SceneError: a lamp's numbers are not finite, or it has the wrong shape.
    """
    shining = [light for light in lights if np.any(np.nan_to_num(_strength(light), nan=1) != 0)]
    count = len(shining)
    fields = {
        "kind": np.zeros(count, np.int64),
        "color": np.zeros((count, 3), np.float32),
        "position": np.zeros((count, 3), np.float32),
        "axis_u": np.zeros((count, 3), np.float32),
        "axis_v": np.zeros((count, 3), np.float32),
        "normal": np.zeros((count, 3), np.float32),
        "size": np.zeros(count, np.float32),
        "cast_shadow": np.array([light.cast_shadow for light in shining], bool),
        "spot": np.zeros(count, bool),
        "to_spot": np.zeros((count, 3, 3), np.float32),
        "spot_cosine": np.zeros(count, np.float32),
        "spot_edge": np.zeros(count, np.float32),
    }
    for i, light in enumerate(shining):
        _check_light(light)
        row = {name: array[i : i + 1] for name, array in fields.items()}
        if isinstance(light, AreaLight):
            _pack_area(row, light, center)
        elif isinstance(light, SunLight):
            _pack_sun(row, light)
        else:
            _pack_point(row, light, center)
    is_sun = fields["kind"] == IS_SUN
    fields["extended"] = (fields["kind"] != IS_POINT) & ~(is_sun & (fields["size"] == 0))
    return LightArrays(**fields)


def _check_light(light: Light) -> None:
    for name, value in vars(light).items():
        if not isinstance(value, str) and not np.isfinite(value).all():
            raise SceneError(f"lamp {light.name!r}: its {name.replace('_', ' ')} is not a finite number")
    if isinstance(light, SunLight):
        if not 0 <= light.angle <= np.pi:
            raise SceneError(f"lamp {light.name!r}: a sun's angle must lie between 0° and 180°")
        if not np.any(light.direction):
            raise SceneError(f"lamp {light.name!r}: a sun's direction must not be zero")
    elif isinstance(light, PointLight) and light.radius < 0:
        raise SceneError(f"lamp {light.name!r}: its radius must not be negative")
    elif isinstance(light, AreaLight) and light.shape not in ("rectangle", "ellipse"):
        raise SceneError(f"lamp {light.name!r}: its shape is {light.shape!r}, choose rectangle or ellipse")


def _strength(light: Light) -> tuple[float, float, float]:
    return light.irradiance if isinstance(light, SunLight) else light.power


def _pack_area(row: dict[str, np.ndarray], light: AreaLight, center: np.ndarray) -> None:
    normal = np.cross(light.axis_v, light.axis_u)
    length = np.linalg.norm(normal)
    row["kind"][:] = IS_RECTANGLE if light.shape == "rectangle" else IS_ELLIPSE
    # Radiance P / (π area), times the area that a uniform point stands for, times the surface's 1/π.
    row["color"][:] = np.array(light.power) / np.pi**2
    row["position"][:] = np.array(light.center) - center
    row["axis_u"][:], row["axis_v"][:] = light.axis_u, light.axis_v
    row["normal"][:] = normal / length if length > 0 else 0


def _pack_sun(row: dict[str, np.ndarray], light: SunLight) -> None:
    row["kind"][:] = IS_SUN
    row["color"][:] = np.array(light.irradiance) / np.pi
    row["position"][:] = np.array(light.direction) / np.linalg.norm(light.direction)
    row["size"][:] = 2 * np.sin(light.angle / 4) ** 2


def _pack_point(row: dict[str, np.ndarray], light: PointLight, center: np.ndarray) -> None:
    row["kind"][:] = IS_POINT if light.radius == 0 else IS_FACING_DISK if light.soft_falloff else IS_SPHERE
    # Radiant intensity P / 4π, times the surface's 1/π.
    row["color"][:] = np.array(light.power) / (4 * np.pi**2)
    row["position"][:] = np.array(light.position) - center
    row["size"][:] = light.radius
    if isinstance(light, SpotLight):
        cosine = np.cos(light.spot_size / 2)
        width = (1 - cosine) * light.blend
        row["spot"][:] = True
        row["to_spot"][:] = np.linalg.pinv(np.array(light.matrix, np.float64)[:3, :3])
        row["spot_cosine"][:] = cosine
        row["spot_edge"][:] = min(1 / width, _HARD_EDGE) if width > 0 else _HARD_EDGE


@kernel
def sample_light(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """Choose a point of lamp `light` by the points looked up last, for every active lane."""
    kind = lights.kind[light]
    if kind == IS_RECTANGLE:
        _sample_rectangle(batch, lights, light, packets)
    elif kind == IS_ELLIPSE:
        _sample_ellipse(batch, lights, light, packets)
    elif kind == IS_SPHERE:
        _sample_sphere(batch, lights, light, packets)
    elif kind == IS_FACING_DISK:
        _sample_facing_disk(batch, lights, light, packets)
    elif kind == IS_SUN:
        _sample_sun(batch, lights, light, packets)
    else:
        _sample_point(batch, lights, light, packets)
    if lights.spot[light]:
        _narrow_to_cone(batch, lights, light, packets)


@kernel
def _sample_rectangle(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            _light_from_area(f, lights, light, i, f[i + POINT] - _HALF, f[i + POINT + Y] - _HALF)


@kernel
def _sample_ellipse(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            s, t = square_to_disk(f[i + POINT], f[i + POINT + Y])
            _light_from_area(f, lights, light, i, s * _HALF, t * _HALF)


@device
def _light_from_area(f: np.ndarray, lights: LightArrays, light: int, i: int, s: float, t: float) -> None:
    """Light from the point center + s axis_u + t axis_v: cosine at the light / distance²."""
    o, a, b, n = lights.position, lights.axis_u, lights.axis_v, lights.normal
    x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
    dx = o[light, 0] + s * a[light, 0] + t * b[light, 0] - x
    dy = o[light, 1] + s * a[light, 1] + t * b[light, 1] - y
    dz = o[light, 2] + s * a[light, 2] + t * b[light, 2] - z
    square = dx * dx + dy * dy + dz * dz
    facing = -(dx * n[light, 0] + dy * n[light, 1] + dz * n[light, 2])
    # facing, and the surface's cosine to come, are each longer by the distance.
    weight = facing / (square * square) if facing > _ZERO else _ZERO
    _aim_shadow_ray(f, i, dx, dy, dz, _ONE, weight)


@kernel
def _sample_point(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    f, o = batch.floats, lights.position[light]
    ox, oy, oz = o[0], o[1], o[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
            dx, dy, dz = ox - x, oy - y, oz - z
            square = dx * dx + dy * dy + dz * dz
            # 1 / distance², and the surface's cosine to come is longer by the distance.
            weight = _ONE / (square * np.float32(math.sqrt(square))) if square > _ZERO else _ZERO
            _aim_shadow_ray(f, i, dx, dy, dz, _ONE, weight)


@kernel
def _sample_facing_disk(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """A disk that faces the surface."""
    f, o, radius = batch.floats, lights.position[light], lights.size[light]
    ox, oy, oz = o[0], o[1], o[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
            dx, dy, dz = ox - x, oy - y, oz - z
            distance = np.float32(math.sqrt(dx * dx + dy * dy + dz * dz))
            scale = _ONE / distance if distance > _ZERO else _ZERO
            ax, ay, az, bx, by, bz = tangents(dx * scale, dy * scale, dz * scale)
            s, t = square_to_disk(f[i + POINT], f[i + POINT + Y])
            s, t = s * radius, t * radius
            dx, dy, dz = dx + s * ax + t * bx, dy + s * ay + t * by, dz + s * az + t * bz
            square = dx * dx + dy * dy + dz * dz
            # The disk's cosine is distance / |d|, and the surface's to come is longer by |d|.
            weight = distance / (square * square) if square > _ZERO else _ZERO
            _aim_shadow_ray(f, i, dx, dy, dz, _ONE, weight)


@kernel
def _sample_sphere(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """A sphere: directions even over the cap that it fills; from inside it, over all of them."""
    f, o, radius = batch.floats, lights.position[light], lights.size[light]
    ox, oy, oz = o[0], o[1], o[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            u, v = f[i + POINT], f[i + POINT + Y]
            x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
            cx, cy, cz = ox - x, oy - y, oz - z
            square = cx * cx + cy * cy + cz * cz
            outside = square > radius * radius
            distance = np.float32(math.sqrt(square))
            scale = _ONE / distance if outside else _ZERO
            sine2 = radius * radius / square if outside else _ONE
            # From inside, the axis does not matter: a cap of 1 - cos = 2 is the whole sphere.
            cap = one_minus_cos(sine2) if outside else _TWO
            nz = cz * scale if outside else _ONE
            lx, ly, lz = square_to_cap(u, v, cap)
            dx, dy, dz = to_world(lx, ly, lz, cx * scale, cy * scale, nz)
            along = dx * cx + dy * cy + dz * cz
            root = np.float32(math.sqrt(max(_ZERO, radius * radius - square + along * along)))
            reach = along - root if outside else along + root
            _aim_shadow_ray(f, i, dx, dy, dz, reach, _TWO * cap / (radius * radius))


@kernel
def _sample_sun(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    f, n, cap = batch.floats, lights.position[light], lights.size[light]
    nx, ny, nz = n[0], n[1], n[2]
    # Irradiance E comes from the radiance E / (π sin²), over the cap's solid angle 2π (1 - cos).
    weight = _TWO / (_TWO - cap)
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            lx, ly, lz = square_to_cap(f[i + POINT], f[i + POINT + Y], cap)
            dx, dy, dz = to_world(lx, ly, lz, nx, ny, nz)
            _aim_shadow_ray(f, i, dx, dy, dz, np.float32(np.inf), weight)


@kernel
def _narrow_to_cone(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """Fade a spot's light by a smooth step over the cosine in lamp space, as Blender's spots do."""
    f, m = batch.floats, lights.to_spot[light]
    cosine_of_edge, edge = lights.spot_cosine[light], lights.spot_edge[light]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            at = i + SHADOW + DIRECTION
            dx, dy, dz = f[at], f[at + Y], f[at + Z]
            x = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
            y = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
            z = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
            length = np.float32(math.sqrt(x * x + y * y + z * z))
            # The lamp looks along its own -Z, and the shadow ray towards it.
            cosine = z / length if length > _ZERO else _ZERO
            step = min(max((cosine - cosine_of_edge) * edge, _ZERO), _ONE)
            weight = f[i + LIGHT_WEIGHT]
            f[i + LIGHT_WEIGHT] = weight * step * step * (np.float32(3) - _TWO * step) if weight > _ZERO else _ZERO


@device
def _aim_shadow_ray(f: np.ndarray, i: int, dx: float, dy: float, dz: float, reach: float, weight: float) -> None:
    """Store the weight times the surface's cosine, and a shadow ray towards the surface's position + reach × d.

    Light that comes from behind the triangle itself does not count, even where the smooth normal would see it. The ray
    starts a step off the surface, on the viewer's side.
    """
    nx, ny, nz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
    cosine = dx * f[i + SHADING_NORMAL] + dy * f[i + SHADING_NORMAL + Y] + dz * f[i + SHADING_NORMAL + Z]
    lit = (cosine > _ZERO) & (dx * nx + dy * ny + dz * nz > _ZERO) & (f[i + ACTIVE] > _ZERO)
    f[i + LIGHT_WEIGHT] = cosine * weight if lit else _ZERO
    step = f[i + OFFSET]
    # The step turns the ray, unless its end is infinitely far away.
    turn = step / reach
    f[i + SHADOW + ORIGIN] = f[i + POSITION] + step * nx
    f[i + SHADOW + ORIGIN + Y] = f[i + POSITION + Y] + step * ny
    f[i + SHADOW + ORIGIN + Z] = f[i + POSITION + Z] + step * nz
    f[i + SHADOW + T_NEAR] = JUST_AHEAD
    f[i + SHADOW + DIRECTION] = dx - turn * nx
    f[i + SHADOW + DIRECTION + Y] = dy - turn * ny
    f[i + SHADOW + DIRECTION + Z] = dz - turn * nz
    f[i + SHADOW + TIME] = _ZERO
    f[i + SHADOW + T_FAR] = reach * _SHORT_OF_LAMP


@kernel
def add_light(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """Add what an unblocked shadow ray brings to the radiance gathered."""
    f, color = batch.floats, lights.color[light]
    red, green, blue = color[0], color[1], color[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            weight = f[i + LIGHT_WEIGHT] if f[i + SHADOW + T_FAR] >= _ZERO else _ZERO
            f[i + RADIANCE] += weight * red * f[i + ALBEDO] * f[i + THROUGHPUT]
            f[i + RADIANCE + Y] += weight * green * f[i + ALBEDO + Y] * f[i + THROUGHPUT + Y]
            f[i + RADIANCE + Z] += weight * blue * f[i + ALBEDO + Z] * f[i + THROUGHPUT + Z]


@device
def to_world(x: float, y: float, z: float, nx: float, ny: float, nz: float) -> tuple[float, float, float]:
    """Turn (x, y, z) from the tangent space about the unit vector n into the space of n."""
    ax, ay, az, bx, by, bz = tangents(nx, ny, nz)
    return x * ax + y * bx + z * nx, x * ay + y * by + z * ny, x * az + y * bz + z * nz


@device
def tangents(x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Two unit vectors that make a right-handed base with the unit vector (x, y, z) (Duff et al. 2017)."""
    sign = _ONE if z >= _ZERO else -_ONE
    a = -_ONE / (sign + z)
    b = x * y * a
    return _ONE + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y
