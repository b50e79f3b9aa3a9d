"""Lamps: how much light reaches a surface from a sampled point of each.

Sampling a lamp fills, for every lane, the vector d to the point chosen (the shadow ray's direction; its T_FAR is how
many d lie between), and LIGHT_WEIGHT. What is reflected is weight × colour × |d| × π × the surface's BSDF and cosine:
the weight holds the geometry and the sample's density, the colour the power and every constant factor, a 1/π among
them.
"""

from __future__ import annotations

import math

import numpy as np

from .area_lights import density_drawn_in, is_below, is_drawn_in, is_near, meet_area, place_met, see_area, towards
from .batch import (
    DIRECTION,
    LANES,
    LIGHT_COLOR,
    LIGHT_SPREAD,
    LIGHT_VISIBILITY,
    LIGHT_WEIGHT,
    LOBE_COUNT,
    PACKET,
    POINT,
    POSITION,
    SHADING_NORMAL,
    SHADOW,
    T_FAR,
    Batch,
    Y,
    Z,
)
from .frames import to_world
from .jit import device, kernel, subroutine
from .light_arrays import IS_ELLIPSE, IS_FACING_DISK, IS_RECTANGLE, IS_SPHERE, IS_SUN, LightArrays
from .light_choice import choose_for_surface, emitter_probability
from .solid_angle import Seen, direction_in
from .warps import (
    BELOW_ONE,
    INV_PI,
    INV_TWO_PI,
    clamp01,
    one_minus_cos,
    square_to_cap,
    square_to_cosine_hemisphere,
    square_to_disk,
)

_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
#: A cap of almost half of all directions is above the surface though its axis may be rounded away from the normal.
_UP_TO_ROUNDING = np.float32(1 - 1e-6)


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
            _look_closer(batch, lights, light, at)
        elif kind == IS_ELLIPSE:
            for i in range(at, at + LANES):
                s, t = square_to_disk(f[i + POINT], f[i + POINT + Y])
                _to_area(f, i, ox, oy, oz, ax, ay, az, bx, by, bz, nx, ny, nz, s * _HALF, t * _HALF)
            _look_closer(batch, lights, light, at)
        elif kind == IS_SPHERE:
            for i in range(at, at + LANES):
                _to_sphere(f, i, ox, oy, oz, size)
            _look_closer(batch, lights, light, at)
        elif kind == IS_FACING_DISK:
            for i in range(at, at + LANES):
                _to_facing_disk(f, i, ox, oy, oz, size)
            _look_closer(batch, lights, light, at)
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
            _look_closer_from(batch, lights, light, i)
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
def _look_closer(batch: Batch, lights: LightArrays, light: int, at: int) -> None:
    """`_look_closer_from` every lane of the packet from `at`, where any is near: it would keep the rest from SIMD."""
    f, near = batch.floats, 0
    for i in range(at, at + LANES):
        near += is_near(lights, light, f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z])
    if near > 0:
        for i in range(at, at + LANES):
            _look_closer_from(batch, lights, light, i)


@device
def _share_by_cosine(angle: float) -> float:
    """How many samples have the cosine's density below a light of this solid angle: next to none until few of them miss
    the light, and all below one that fills half of all directions.
    """
    filled = min(angle * INV_TWO_PI, _ONE)
    return filled * filled * filled * filled


@device
def _look_closer_from(batch: Batch, lights: LightArrays, light: int, i: int) -> None:
    """Choose a point of a lamp anew if lane i is near to it."""
    f = batch.floats
    if is_near(lights, light, f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]):
        if lights.kind[light] <= IS_ELLIPSE:
            _look_closer_at_area(batch, lights, light, i)
        elif batch.bits[i + LOBE_COUNT] == np.uint32(0):
            _look_closer_at_cap(f, lights, light, i)


@subroutine
def _look_closer_at_area(batch: Batch, lights: LightArrays, light: int, i: int) -> None:
    """Choose a point of an area light anew, by its solid angle.

    Where the light fills almost half of all directions, most of the unevenness is a Lambertian surface's cosine: so
    many samples there have the cosine's density, and all count by that of both together (Veach 1997, section 9.2.4).
    Off other surfaces it is the rays that scatter which even it out.

    For an ellipse it is the angle of the parallelogram around it. From close before the ellipse what misses it brings
    nothing, and beside it that angle does not tell how much it fills: no sample is by the cosine there.
    """
    f = batch.floats
    x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
    f[i + SHADOW + T_FAR] = f[i + LIGHT_WEIGHT] = _ZERO
    seen = see_area(lights, light, x, y, z)
    angle = np.float32(seen.angle)
    if angle == _ZERO:
        return
    if (lights.kind[light] == IS_ELLIPSE) & is_drawn_in(lights, light, x, y, z):
        _draw_in(f, lights, light, i, seen)
        return
    nx, ny, nz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    by_cosine = _ZERO
    if (batch.bits[i + LOBE_COUNT] == np.uint32(0)) & is_below(lights, light, x, y, z):
        by_cosine = _share_by_cosine(angle)
    u, v, by_angle = f[i + POINT], f[i + POINT + Y], _ONE - by_cosine
    # The upper end, which no point reaches while the share is tiny: some samplers have (0, 0) in each of their sets.
    is_within = (u < by_angle) & (lights.kind[light] == IS_RECTANGLE)
    if u < by_angle:
        dx, dy, dz = direction_in(seen, min(u / by_angle, BELOW_ONE), v)
    else:
        lx, ly, lz = square_to_cosine_hemisphere(min((u - by_angle) / by_cosine, BELOW_ONE), v)
        dx, dy, dz = to_world(lx, ly, lz, nx, ny, nz)
    reach, facing, is_met = meet_area(lights, light, x, y, z, dx, dy, dz)
    if (facing > _ZERO) & (is_met | is_within):
        cosine = max(dx * nx + dy * ny + dz * nz, _ZERO)
        density = by_angle / angle + by_cosine * cosine * INV_PI
        _aim(f, i, dx, dy, dz, reach, _ONE / (density * lights.area[light]))


@device
def _draw_in(f: np.ndarray, lights: LightArrays, light: int, i: int, seen: Seen) -> None:
    """Choose a point of an ellipse: one of the parallelogram around it, by its solid angle, that is drawn in."""
    x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
    dx, dy, dz = direction_in(seen, f[i + POINT], f[i + POINT + Y])
    reach, facing, _ = meet_area(lights, light, x, y, z, dx, dy, dz)
    if (facing <= _ZERO) | (reach <= _ZERO):
        return
    s, t = place_met(lights, light, x, y, z, reach * dx, reach * dy, reach * dz)
    # Seen edge-on, rounding may have moved the point off the light.
    s, t = clamp01(s + _HALF), clamp01(t + _HALF)
    _, _, _, drawn_from = towards(lights, light, x, y, z, s - _HALF, t - _HALF)
    s, t = square_to_disk(s, t)
    dx, dy, dz, distance = towards(lights, light, x, y, z, _HALF * s, _HALF * t)
    density, scale = density_drawn_in(np.float32(seen.angle), distance, drawn_from), _ONE / distance
    _aim(f, i, scale * dx, scale * dy, scale * dz, distance, _ONE / (density * lights.area[light]))


@subroutine
def _look_closer_at_cap(f: np.ndarray, lights: LightArrays, light: int, i: int) -> None:
    """Choose a point of a sphere or a facing disk anew, for a Lambertian surface that has all of its cap above it, or
    that is inside of the sphere: by the cosine's density, so that all points count the same.

    The cap's rim bounds a flat disk. Seen along the normal, what is even over this disk is even over its outline, and
    lifted from there to the unit sphere it has that density (Nusselt's analogue, 1928).
    """
    cx = lights.position[light, 0] - f[i + POSITION]
    cy = lights.position[light, 1] - f[i + POSITION + Y]
    cz = lights.position[light, 2] - f[i + POSITION + Z]
    nx, ny, nz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    square, radius2 = cx * cx + cy * cy + cz * cz, lights.size[light] * lights.size[light]
    is_sphere = lights.kind[light] == IS_SPHERE
    ax, ay, az, sine2 = nx, ny, nz, _ONE  # from inside all that is above the surface
    if (square > radius2) | (not is_sphere):
        scale = _ONE / np.float32(math.sqrt(square)) if square > _ZERO else _ZERO
        ax, ay, az = scale * cx, scale * cy, scale * cz
        sine2 = radius2 / (square if is_sphere else square + radius2)
    raised = ax * nx + ay * ny + az * nz
    if (raised <= _ZERO) | (raised * raised < sine2 * _UP_TO_ROUNDING):
        return
    x, y = square_to_disk(f[i + POINT], f[i + POINT + Y])
    sine, cosine = np.float32(math.sqrt(sine2)), np.float32(math.sqrt(_ONE - sine2))
    mx, my, mz = to_world(sine * x, sine * y, cosine, ax, ay, az)
    height = mx * nx + my * ny + mz * nz
    up = np.float32(math.sqrt(height * height + sine2 * max(_ONE - (x * x + y * y), _ZERO)))
    lift = up - height
    dx, dy, dz = mx + lift * nx, my + lift * ny, mz + lift * nz
    along = dx * cx + dy * cy + dz * cz
    reach = _reach_of_sphere(along, square, radius2) if is_sphere else square / along
    density = up * INV_PI / (sine2 * raised)
    if (density > _ZERO) & (is_sphere | (along > _ZERO)):
        _aim(f, i, dx, dy, dz, reach, _ONE / (density * lights.area[light]))


@device
def _to_point(f: np.ndarray, i: int, ox: float, oy: float, oz: float) -> None:
    dx, dy, dz = ox - f[i + POSITION], oy - f[i + POSITION + Y], oz - f[i + POSITION + Z]
    square = dx * dx + dy * dy + dz * dz
    # 1 / distance², and the surface's cosine to come is longer by the distance.
    weight = _ONE / (square * np.float32(math.sqrt(square))) if square > _ZERO else _ZERO
    _aim(f, i, dx, dy, dz, _ONE, weight)


@device
def _to_facing_disk(f: np.ndarray, i: int, ox: float, oy: float, oz: float, radius: float) -> None:
    """A disk that faces the surface: directions even over the cap that it fills, at most half of all."""
    cx, cy, cz = ox - f[i + POSITION], oy - f[i + POSITION + Y], oz - f[i + POSITION + Z]
    square = cx * cx + cy * cy + cz * cz
    distance = np.float32(math.sqrt(square))
    scale = _ONE / distance if distance > _ZERO else _ZERO
    cap = one_minus_cos(radius * radius / (square + radius * radius))
    lx, ly, lz = square_to_cap(f[i + POINT], f[i + POINT + Y], cap)
    dx, dy, dz = to_world(lx, ly, lz, cx * scale, cy * scale, cz * scale)
    lit = (distance > _ZERO) & (lz > _ZERO)
    _aim(f, i, dx, dy, dz, distance / lz if lit else _ZERO, _TWO * cap / (radius * radius) if lit else _ZERO)


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
    reach = _reach_of_sphere(dx * cx + dy * cy + dz * cz, square, radius * radius)
    _aim(f, i, dx, dy, dz, reach, _TWO * cap / (radius * radius))


@device
def _reach_of_sphere(along: float, square: float, radius2: float) -> float:
    """How far a sphere is in a direction in which its centre, whose squared distance is `square`, is `along` ahead."""
    root = np.float32(math.sqrt(max(_ZERO, radius2 - square + along * along)))
    return along - root if square > radius2 else along + root


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
