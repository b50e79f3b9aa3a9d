"""Lamps: how much light reaches a surface from a sampled point of each.

Sampling a lamp fills, for every lane, the vector d to the point chosen (the shadow ray's direction; its T_FAR is how
many d lie between), and LIGHT_WEIGHT. What is reflected is weight × colour × |d| × π × the surface's BSDF and cosine:
the weight holds the geometry and the sample's density, the colour the power and every constant factor, a 1/π among
them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .batch import (
    DIRECTION,
    LANES,
    LIGHT_COLOR,
    LIGHT_SPREAD,
    LIGHT_VISIBILITY,
    LIGHT_WEIGHT,
    PACKET,
    POINT,
    POSITION,
    SHADOW,
    T_FAR,
    Batch,
    Y,
    Z,
)
from .errors import SceneError
from .frames import tangents, to_world
from .jit import device, kernel
from .light_choice import Emitters, LightTree, build_light_tree, choose_for_surface, emitter_probability
from .scene import AreaLight, Light, PointLight, SpotLight, SunLight
from .warps import one_minus_cos, square_to_cap, square_to_disk

#: With more lamps than these one is chosen at each surface, by `light_choice`: looking at all would cost too much.
MOST_ONE_BY_ONE = 8

IS_RECTANGLE, IS_ELLIPSE, IS_POINT, IS_SPHERE, IS_FACING_DISK, IS_SUN = 0, 1, 2, 3, 4, 5

_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
#: A spot's edge without blend: steep enough to be a step, finite so that 0 × it stays 0.
_HARD_EDGE = 1e30
#: A bit of visibility beside those of `scene`: nothing can be in the way of this light.
SHINES_THROUGH = 64


class LightArrays(NamedTuple):
    """The lamps for kernels, L of them, positions re-centred."""

    kind: np.ndarray  # (L,) int64: IS_RECTANGLE, ...
    color: np.ndarray  # (L, 3)
    position: np.ndarray  # (L, 3); a sun: the direction towards it
    axis_u: np.ndarray  # (L, 3), full edge or axis of an area light
    axis_v: np.ndarray
    normal: np.ndarray  # (L, 3), the side an area light shines to
    size: np.ndarray  # (L,) radius in metres; a sun: 1 - cos of half its angle
    area: np.ndarray  # (L,) m², that a sphere shows; a sun: steradians, seen flat. 0 without a size
    shared_area: np.ndarray  # (L,) the same; 0 if it shines through what would block the rays that meet it
    extended: np.ndarray  # (L,) bool: it has a size, so that a point of it is to be sampled
    cast_shadow: np.ndarray  # (L,) bool
    visibility: np.ndarray  # (L,) uint32: bits of `scene`
    spot: np.ndarray  # (L,) bool: the light stands behind a cone
    to_spot: np.ndarray  # (L, 3, 3) world to lamp space
    spot_cosine: np.ndarray  # (L,) of half the cone's angle
    spot_edge: np.ndarray  # (L,) 1 / width of the blend, in cosines
    each: int  # so many lamps are sampled one by one at each surface; of the rest one is chosen
    tree: LightTree  # to choose by: its emitter k is lamp each + k


def pack_lights(lights: Sequence[Light], center: np.ndarray) -> LightArrays:
    """Check the lamps and turn them into what kernels read; those that send no light are left out.

    Raises:
        SceneError: a lamp's numbers are not finite, or it has the wrong shape.
    """
    shining = [light for light in lights if np.any(np.nan_to_num(_strength(light), nan=1) != 0)]
    count = each = len(shining)
    if count > MOST_ONE_BY_ONE:
        # Suns are infinitely far, and no tree bounds them: they come first.
        shining.sort(key=lambda light: not isinstance(light, SunLight))
        each = sum(isinstance(light, SunLight) for light in shining)
    fields = {
        "kind": np.zeros(count, np.int64),
        "color": np.zeros((count, 3), np.float32),
        "position": np.zeros((count, 3), np.float32),
        "axis_u": np.zeros((count, 3), np.float32),
        "axis_v": np.zeros((count, 3), np.float32),
        "normal": np.zeros((count, 3), np.float32),
        "size": np.zeros(count, np.float32),
        "area": np.zeros(count, np.float32),
        "visibility": np.array(
            [light.visibility | (0 if light.cast_shadow else SHINES_THROUGH) for light in shining], np.uint32
        ),
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
    fields["shared_area"] = np.where(fields["cast_shadow"], fields["area"], np.float32(0))
    fields["extended"] = (fields["kind"] != IS_POINT) & ~(is_sun & (fields["size"] == 0))
    tree = build_light_tree(_emitters([fields[name][each:] for name in _OF_EMITTERS], shining[each:]))
    return LightArrays(**fields, each=each, tree=tree)


_OF_EMITTERS = ("position", "axis_u", "axis_v", "normal", "size", "color")


def _emitters(arrays: list[np.ndarray], lights: Sequence[Light]) -> Emitters:
    """The lamps as `light_choice` sees them."""
    position, axis_u, axis_v, normal, size, color = (array.astype(np.float64) for array in arrays)
    is_area = np.array([isinstance(light, AreaLight) for light in lights], bool)
    is_spot = np.array([isinstance(light, SpotLight) for light in lights], bool)
    reach = np.where(is_area[:, None], (np.abs(axis_u) + np.abs(axis_v)) / 2, size[:, None])
    axis = normal.copy()
    axis[~is_area] = 0, 0, 1
    falloff = np.full(len(lights), np.pi / 2)
    for k in np.flatnonzero(is_spot):
        axis[k], falloff[k] = _spot_cone(lights[k])
    return Emitters(
        low=position - reach,
        high=position + reach,
        axis=axis,
        cone=np.where(is_area | is_spot, 0.0, np.pi),
        falloff=falloff,
        two_sided=np.zeros(len(lights), bool),
        power=np.abs(color).mean(axis=1),
    )


def _spot_cone(light: SpotLight) -> tuple[np.ndarray, float]:
    """Where a spot looks, and how far off that it shines, radians: of a stretched one, anywhere."""
    matrix = np.array(light.matrix, np.float64)[:3, :3]
    squares = matrix.T @ matrix
    is_round = np.allclose(squares, squares[0, 0] * np.eye(3), rtol=1e-3, atol=1e-3 * squares[0, 0])
    return -matrix[:, 2] / max(np.sqrt(squares[2, 2]), 1e-30), light.spot_size / 2 if is_round else np.pi


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
    row["area"][:] = length if light.shape == "rectangle" else length * np.pi / 4


def _pack_sun(row: dict[str, np.ndarray], light: SunLight) -> None:
    row["kind"][:] = IS_SUN
    row["color"][:] = np.array(light.irradiance) / np.pi
    row["position"][:] = np.array(light.direction) / np.linalg.norm(light.direction)
    row["size"][:] = 2 * np.sin(light.angle / 4) ** 2
    row["area"][:] = np.pi * np.sin(light.angle / 2) ** 2


def _pack_point(row: dict[str, np.ndarray], light: PointLight, center: np.ndarray) -> None:
    row["kind"][:] = IS_POINT if light.radius == 0 else IS_FACING_DISK if light.soft_falloff else IS_SPHERE
    # Radiant intensity P / 4π, times the surface's 1/π.
    row["color"][:] = np.array(light.power) / (4 * np.pi**2)
    row["position"][:] = np.array(light.position) - center
    row["size"][:] = light.radius
    row["area"][:] = np.pi * light.radius**2
    if isinstance(light, SpotLight):
        cosine = np.cos(light.spot_size / 2)
        width = (1 - cosine) * light.blend
        row["spot"][:] = True
        row["to_spot"][:] = np.linalg.pinv(np.array(light.matrix, np.float64)[:3, :3])
        row["spot_cosine"][:] = cosine
        row["spot_edge"][:] = min(1 / width, _HARD_EDGE) if width > 0 else _HARD_EDGE


@kernel
def sample_light(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """Choose a point of lamp `light` by the points looked up last, for every lane."""
    f, kind = batch.floats, lights.kind[light]
    o, n, a, b = lights.position[light], lights.normal[light], lights.axis_u[light], lights.axis_v[light]
    ox, oy, oz, nx, ny, nz = o[0], o[1], o[2], n[0], n[1], n[2]
    ax, ay, az, bx, by, bz = a[0], a[1], a[2], b[0], b[1], b[2]
    size = lights.size[light]
    for p in range(packets):
        at = p * PACKET
        if kind == IS_RECTANGLE:
            for i in range(at, at + LANES):
                s, t = f[i + POINT] - _HALF, f[i + POINT + Y] - _HALF
                _to_area(f, i, ox, oy, oz, ax, ay, az, bx, by, bz, nx, ny, nz, s, t)
        elif kind == IS_ELLIPSE:
            for i in range(at, at + LANES):
                s, t = square_to_disk(f[i + POINT], f[i + POINT + Y])
                _to_area(f, i, ox, oy, oz, ax, ay, az, bx, by, bz, nx, ny, nz, s * _HALF, t * _HALF)
        elif kind == IS_SPHERE:
            for i in range(at, at + LANES):
                _to_sphere(f, i, ox, oy, oz, size)
        elif kind == IS_FACING_DISK:
            for i in range(at, at + LANES):
                _to_facing_disk(f, i, ox, oy, oz, size)
        elif kind == IS_SUN:
            for i in range(at, at + LANES):
                _to_sun(f, i, ox, oy, oz, size)
        else:
            for i in range(at, at + LANES):
                _to_point(f, i, ox, oy, oz)


@kernel
def sample_chosen_lights(batch: Batch, lights: LightArrays, packets: int) -> None:
    """Choose a lamp from number `each` on and a point of it, for every lane that wants light, and describe it."""
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            f[i + LIGHT_WEIGHT] = _ZERO
            chosen, chance, rest = choose_for_surface(batch, lights.tree, i)
            if chance == _ZERO:
                continue
            f[i + POINT] = rest
            light = lights.each + chosen
            o, n, a, b = lights.position, lights.normal, lights.axis_u, lights.axis_v
            ox, oy, oz, size = o[light, 0], o[light, 1], o[light, 2], lights.size[light]
            kind = lights.kind[light]
            if kind <= IS_ELLIPSE:
                s, t = f[i + POINT] - _HALF, f[i + POINT + Y] - _HALF
                if kind == IS_ELLIPSE:
                    s, t = square_to_disk(f[i + POINT], f[i + POINT + Y])
                    s, t = s * _HALF, t * _HALF
                ax, ay, az = a[light, 0], a[light, 1], a[light, 2]
                bx, by, bz = b[light, 0], b[light, 1], b[light, 2]
                nx, ny, nz = n[light, 0], n[light, 1], n[light, 2]
                _to_area(f, i, ox, oy, oz, ax, ay, az, bx, by, bz, nx, ny, nz, s, t)
            elif kind == IS_SPHERE:
                _to_sphere(f, i, ox, oy, oz, size)
            elif kind == IS_FACING_DISK:
                _to_facing_disk(f, i, ox, oy, oz, size)
            else:
                _to_point(f, i, ox, oy, oz)
            _describe(f, bits, lights, light, i, _ONE / chance)
            if lights.spot[light]:
                f[i + LIGHT_WEIGHT] *= _cone(f, lights, light, i)


@device
def chance_of_lamp(
    lights: LightArrays, light: int, x: float, y: float, z: float, nx: float, ny: float, nz: float
) -> float:
    """The probability with which lamp `light` is sampled at (x, y, z), where the receiver's normal is n, or 0."""
    if light < lights.each:
        return _ONE
    return emitter_probability(lights.tree, light - lights.each, x, y, z, nx, ny, nz)


@kernel
def describe_light(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """Fill in the light sample's colour, spread and visibility, where lanes look at them."""
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            _describe(f, bits, lights, light, i, _ONE)


@device
def _describe(f: np.ndarray, bits: np.ndarray, lights: LightArrays, light: int, i: int, one_in: float) -> None:
    """`one_in`: 1 / the probability with which this light was chosen."""
    dx, dy, dz = f[i + SHADOW + DIRECTION], f[i + SHADOW + DIRECTION + Y], f[i + SHADOW + DIRECTION + Z]
    distance = np.float32(math.sqrt(dx * dx + dy * dy + dz * dz))
    f[i + LIGHT_COLOR] = lights.color[light, 0] * one_in
    f[i + LIGHT_COLOR + Y] = lights.color[light, 1] * one_in
    f[i + LIGHT_COLOR + Z] = lights.color[light, 2] * one_in
    f[i + LIGHT_SPREAD] = lights.shared_area[light] * f[i + LIGHT_WEIGHT] * distance * one_in
    bits[i + LIGHT_VISIBILITY] = lights.visibility[light]


@device
def _to_area(
    f: np.ndarray,
    i: int,
    ox: float,
    oy: float,
    oz: float,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
    nx: float,
    ny: float,
    nz: float,
    s: float,
    t: float,
) -> None:
    """The point o + s a + t b of an area light that faces n: cosine at the light / distance²."""
    dx = ox + s * ax + t * bx - f[i + POSITION]
    dy = oy + s * ay + t * by - f[i + POSITION + Y]
    dz = oz + s * az + t * bz - f[i + POSITION + Z]
    square = dx * dx + dy * dy + dz * dz
    distance = np.float32(math.sqrt(square))
    facing = -(dx * nx + dy * ny + dz * nz)
    # Bounded, so that the compiler cannot make one division by distance⁴ of it, which float32 does not hold.
    cosine = min(facing / distance, _ONE)
    # The surface's cosine to come is longer by the distance.
    _aim(f, i, dx, dy, dz, _ONE, cosine / (square * distance) if facing > _ZERO else _ZERO)


@device
def _to_point(f: np.ndarray, i: int, ox: float, oy: float, oz: float) -> None:
    dx, dy, dz = ox - f[i + POSITION], oy - f[i + POSITION + Y], oz - f[i + POSITION + Z]
    square = dx * dx + dy * dy + dz * dz
    # 1 / distance², and the surface's cosine to come is longer by the distance.
    weight = _ONE / (square * np.float32(math.sqrt(square))) if square > _ZERO else _ZERO
    _aim(f, i, dx, dy, dz, _ONE, weight)


@device
def _to_facing_disk(f: np.ndarray, i: int, ox: float, oy: float, oz: float, radius: float) -> None:
    """A disk that faces the surface."""
    dx, dy, dz = ox - f[i + POSITION], oy - f[i + POSITION + Y], oz - f[i + POSITION + Z]
    distance = np.float32(math.sqrt(dx * dx + dy * dy + dz * dz))
    scale = _ONE / distance if distance > _ZERO else _ZERO
    ax, ay, az, bx, by, bz = tangents(dx * scale, dy * scale, dz * scale)
    s, t = square_to_disk(f[i + POINT], f[i + POINT + Y])
    s, t = s * radius, t * radius
    dx, dy, dz = dx + s * ax + t * bx, dy + s * ay + t * by, dz + s * az + t * bz
    square = dx * dx + dy * dy + dz * dz
    length = np.float32(math.sqrt(square))
    cosine = min(distance / length, _ONE)
    # The surface's cosine to come is longer by |d|.
    _aim(f, i, dx, dy, dz, _ONE, cosine / (square * length) if square > _ZERO else _ZERO)


@device
def _to_sphere(f: np.ndarray, i: int, ox: float, oy: float, oz: float, radius: float) -> None:
    """A sphere: directions even over the cap that it fills; from inside it, over all of them."""
    cx, cy, cz = ox - f[i + POSITION], oy - f[i + POSITION + Y], oz - f[i + POSITION + Z]
    square = cx * cx + cy * cy + cz * cz
    outside = square > radius * radius
    scale = _ONE / np.float32(math.sqrt(square)) if outside else _ZERO
    sine2 = radius * radius / square if outside else _ONE
    # From inside, the axis does not matter: a cap of 1 - cos = 2 is the whole sphere.
    cap = one_minus_cos(sine2) if outside else _TWO
    nz = cz * scale if outside else _ONE
    lx, ly, lz = square_to_cap(f[i + POINT], f[i + POINT + Y], cap)
    dx, dy, dz = to_world(lx, ly, lz, cx * scale, cy * scale, nz)
    along = dx * cx + dy * cy + dz * cz
    root = np.float32(math.sqrt(max(_ZERO, radius * radius - square + along * along)))
    reach = along - root if outside else along + root
    _aim(f, i, dx, dy, dz, reach, _TWO * cap / (radius * radius))


@device
def _to_sun(f: np.ndarray, i: int, nx: float, ny: float, nz: float, cap: float) -> None:
    lx, ly, lz = square_to_cap(f[i + POINT], f[i + POINT + Y], cap)
    dx, dy, dz = to_world(lx, ly, lz, nx, ny, nz)
    # Irradiance E comes from the radiance E / (π sin²), over the cap's solid angle 2π (1 - cos).
    _aim(f, i, dx, dy, dz, np.float32(np.inf), _TWO / (_TWO - cap))


@device
def _aim(f: np.ndarray, i: int, dx: float, dy: float, dz: float, reach: float, weight: float) -> None:
    f[i + SHADOW + DIRECTION] = dx
    f[i + SHADOW + DIRECTION + Y] = dy
    f[i + SHADOW + DIRECTION + Z] = dz
    f[i + SHADOW + T_FAR] = reach
    f[i + LIGHT_WEIGHT] = weight


@kernel
def narrow_to_cone(batch: Batch, lights: LightArrays, light: int, packets: int) -> None:
    """Fade a spot's light towards the edge of its cone."""
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            f[i + LIGHT_WEIGHT] *= _cone(f, lights, light, i)


@device
def _cone(f: np.ndarray, lights: LightArrays, light: int, i: int) -> float:
    """The share of a spot's light that comes this way: a smooth step over the cosine in lamp space, as in Blender."""
    m = lights.to_spot
    dx, dy, dz = f[i + SHADOW + DIRECTION], f[i + SHADOW + DIRECTION + Y], f[i + SHADOW + DIRECTION + Z]
    return cone_share(m, light, dx, dy, dz, lights.spot_cosine[light], lights.spot_edge[light])


@device
def cone_share(
    to_spot: np.ndarray, light: int, dx: float, dy: float, dz: float, cosine_of_edge: float, edge: float
) -> float:
    x = to_spot[light, 0, 0] * dx + to_spot[light, 0, 1] * dy + to_spot[light, 0, 2] * dz
    y = to_spot[light, 1, 0] * dx + to_spot[light, 1, 1] * dy + to_spot[light, 1, 2] * dz
    z = to_spot[light, 2, 0] * dx + to_spot[light, 2, 1] * dy + to_spot[light, 2, 2] * dz
    length = np.float32(math.sqrt(x * x + y * y + z * z))
    # The lamp looks along its own -Z, and d towards it.
    cosine = z / length if length > _ZERO else _ZERO
    step = min(max((cosine - cosine_of_edge) * edge, _ZERO), _ONE)
    return step * step * (np.float32(3) - _TWO * step)
