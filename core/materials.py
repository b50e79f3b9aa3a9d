"""Running the materials' programs: an interpreter over `instructions`, one hit at a time.

What is not a finite number never becomes a lobe or a place in a table. It makes the path's light NaN instead, so that
the film drops the sample and counts it.
"""

from __future__ import annotations

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    DIRECTION,
    EMISSION,
    HIT_V,
    HIT_W,
    LANES,
    MATERIAL,
    PACKET,
    PRIMITIVE,
    RADIANCE,
    SHADING_NORMAL,
    SIDE,
    T_FAR,
    Batch,
    Y,
    Z,
    new_batch,
)
from .closures import clamp_index
from .environment import direction_to_panorama
from .fresnel import dielectric_reflectance
from .instructions import (
    AFFINE,
    ASIDE_U,
    ASIDE_V,
    ATTRIBUTE,
    AVERAGE,
    CHECKER,
    COMBINE,
    COMPONENT,
    EMIT,
    END,
    FACING,
    FRESNEL,
    GENERATED,
    GRAY,
    MAP_RANGE,
    MATH,
    MIX,
    NONE,
    NORMAL_MAP,
    NORMALIZE,
    PANORAMA,
    RAMP,
    REQUIRE_FINITE,
    UV,
    WORLD,
)
from .instructions import ALBEDO as SET_ALBEDO
from .instructions import DIRECTION as LOOK
from .jit import device, kernel
from .packed_materials import MaterialArrays, Textures
from .packing import (
    CORNER_UV,
    FIRST_ATTRIBUTE,
    INSTANCED,
    MESH,
    TANGENT,
    TRIANGLE,
    VERTEX,
    Geometry,
    SceneArrays,
)
from .programs import Programs
from .surface import corners_of, hit_placement, normalize, rotate, transform
from .surface_lobes import add_lobes, normal_of, view_of
from .textures import image_color, is_first_check
from .value_ops import gray, map_range, math_op, mix
from .warps import HALF, ONE, TWO, ZERO, clamp01

#: How far beside the hit a bump looks at its height, as a share of the ray's length: about half a pixel at usual
#: resolutions, and far enough for float32 to see a difference.
_ASIDE = np.float32(2.0**-11)
#: Slopes are computed with up to this: to float32, a steeper one has the same normal.
_VERTICAL = np.float32(1e15)
INFINITY, NAN = np.float32(np.inf), np.float32(np.nan)


def fill_constants(scene: SceneArrays, programs: Programs) -> np.ndarray:
    """Run the prologue, and fill in the constant colours of `scene`. Returns the registers as programs find them."""
    materials = scene.materials
    batch = new_batch(1, materials.largest_lobe_count, programs.registers)
    batch.floats[ACTIVE] = 1
    batch.bits[MATERIAL] = materials.world + 1
    run_programs(batch, scene, 1)
    for i, material in enumerate((*programs.materials, programs.world)):
        if material.albedo != NONE:
            materials.albedo[i] = np.maximum(batch.registers[material.albedo], 0)
        if material.emission != NONE:
            materials.emission[i] = batch.registers[material.emission]
    return batch.registers


@kernel
def run_programs(batch: Batch, scene: SceneArrays, packets: int) -> None:
    """Run the program of each active lane's material, where it has one."""
    f, bits, program = batch.floats, batch.bits, scene.materials.program
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if f[i + ACTIVE] > ZERO:
                start = program[bits[i + MATERIAL]]
                if start != NONE:
                    _run(batch, scene, i, start)


@device
def _run(batch: Batch, scene: SceneArrays, i: int, at: int) -> None:
    """Carry out the instructions from `at` on for lane i."""
    f, bits, code, r = batch.floats, batch.bits, scene.materials.code, batch.registers
    geometry, materials = scene.geometry, scene.materials
    while code[at] != END:
        operation, result = code[at], code[at + 1]
        if operation > END:
            at = _act(batch, materials, i, at)
            continue
        if operation <= ATTRIBUTE:
            x, y, z, at = _look_at_hit(f, bits, geometry, code, i, at + 2, operation)
        elif operation <= RAMP:
            x, y, z, at = _look_up(r, code, materials.textures, materials.ramps, at + 2, operation)
        elif operation <= COMBINE:
            x, y, z, at = _calculate(r, code, at + 2, operation)
        elif operation <= FACING:
            x = _view_dependent(f, r, i, operation, code[at + 2], code[at + 3])
            x, y, z, at = x, x, x, at + 4
        elif operation == NORMAL_MAP:
            x, y, z = _normal_map(f, bits, r, geometry, i, code[at + 2], code[at + 3], code[at + 4])
            at += 5
        else:
            x, y, z = _bump(f, bits, r, geometry, code, i, at + 2)
            at += 9
        r[result, 0], r[result, 1], r[result, 2] = x, y, z


@device
def _act(batch: Batch, materials: MaterialArrays, i: int, at: int) -> int:
    """Carry out the instruction on the surface at `at`. Returns where the next begins."""
    code, r, f = materials.code, batch.registers, batch.floats
    operation, a = code[at], code[at + 1]
    if operation == SET_ALBEDO:
        f[i + ALBEDO], f[i + ALBEDO + Y], f[i + ALBEDO + Z] = max(r[a, 0], ZERO), max(r[a, 1], ZERO), max(r[a, 2], ZERO)
        _require_finite(f, r, i, a)
        return at + 2
    if operation == REQUIRE_FINITE:
        _require_finite(f, r, i, a)
        return at + 2
    if operation == EMIT:
        f[i + EMISSION] += r[a, 0]
        f[i + EMISSION + Y] += r[a, 1]
        f[i + EMISSION + Z] += r[a, 2]
        return at + 2
    return add_lobes(batch, materials, i, at)


@device
def _require_finite(f: np.ndarray, r: np.ndarray, i: int, a: int) -> None:
    """Make the light of lane i's path NaN where register a is not finite."""
    # Not math.isfinite: the compiler's liberties with sums let it take that for granted.
    if not abs(r[a, 0]) + abs(r[a, 1]) + abs(r[a, 2]) < INFINITY:
        f[i + RADIANCE] = NAN


@device
def _look_at_hit(
    f: np.ndarray, bits: np.ndarray, geometry: Geometry, code: np.ndarray, i: int, at: int, operation: int
) -> tuple[float, float, float, int]:
    """Coordinates, directions and attributes."""
    if operation == LOOK:
        x, y, z = normalize(f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z])
        return x, y, z, at
    placement = hit_placement(bits, i)
    mesh, triangle = geometry.placements[placement, MESH], np.int64(bits[i + PRIMITIVE])
    number, where = np.int64(0), code[at]
    if operation == ATTRIBUTE:
        number, where = code[at], code[at + 1]
    u, v, w = _barycentric(f, geometry, i, placement, mesh, triangle, where)
    if operation == ATTRIBUTE:
        x, y, z = _attribute(geometry, geometry.first[mesh, FIRST_ATTRIBUTE + number], triangle, u, v, w)
        return x, y, z, at + 2
    if operation == UV:
        x, y, z = _uv(geometry, mesh, triangle, u, v, w)
        return x, y, z, at + 1
    x, y, z = _corner_mean(geometry, mesh, triangle, u, v, w)
    if operation == GENERATED:
        x, y, z = transform(geometry.to_generated, placement, x, y, z)
    elif operation == WORLD:
        if geometry.placements[placement, INSTANCED] != 0:
            x, y, z = transform(geometry.to_world, placement, x, y, z)
        c = geometry.center
        x, y, z = x + c[0], y + c[1], z + c[2]
    else:
        x, y, z = transform(geometry.to_object, placement, x, y, z)
    return x, y, z, at + 1


@device
def _barycentric(
    f: np.ndarray, geometry: Geometry, i: int, placement: int, mesh: int, triangle: int, where: int
) -> tuple[float, float, float]:
    """Where in its triangle the hit lies, or a small step beside it along one of the triangle's edges."""
    v, w = f[i + HIT_V], f[i + HIT_W]
    if where == ASIDE_U:
        v += _step(f, geometry, i, placement, mesh, triangle, 1)
    elif where == ASIDE_V:
        w += _step(f, geometry, i, placement, mesh, triangle, 2)
    return ONE - v - w, v, w


@device
def _edge(geometry: Geometry, placement: int, mesh: int, triangle: int, to: int) -> tuple[float, float, float]:
    """The edge from a triangle's first corner to another, in world space."""
    row, first = geometry.first[mesh, TRIANGLE] + triangle, geometry.first[mesh, VERTEX]
    a, b = first + np.int64(geometry.triangles[row, 0]), first + np.int64(geometry.triangles[row, to])
    s = geometry.vertices
    x, y, z = s[b, 0] - s[a, 0], s[b, 1] - s[a, 1], s[b, 2] - s[a, 2]
    if geometry.placements[placement, INSTANCED] != 0:
        return rotate(geometry.to_world, placement, x, y, z)
    return x, y, z


@device
def _step(f: np.ndarray, geometry: Geometry, i: int, placement: int, mesh: int, triangle: int, to: int) -> float:
    """The step beside the hit as a share of an edge."""
    x, y, z = _edge(geometry, placement, mesh, triangle, to)
    dx, dy, dz = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    square = max(x * x + y * y + z * z, np.float32(1e-30))
    return _ASIDE * f[i + T_FAR] * np.sqrt((dx * dx + dy * dy + dz * dz) / square)


@device
def _corner_mean(
    geometry: Geometry, mesh: int, triangle: int, u: float, v: float, w: float
) -> tuple[float, float, float]:
    a, b, c = corners_of(geometry, mesh, triangle)
    s = geometry.vertices
    return (
        u * s[a, 0] + v * s[b, 0] + w * s[c, 0],
        u * s[a, 1] + v * s[b, 1] + w * s[c, 1],
        u * s[a, 2] + v * s[b, 2] + w * s[c, 2],
    )


@device
def _uv(geometry: Geometry, mesh: int, triangle: int, u: float, v: float, w: float) -> tuple[float, float, float]:
    first = geometry.first[mesh, CORNER_UV]
    if first == NONE:
        return ZERO, ZERO, ZERO
    uvs, row = geometry.uvs, first + triangle
    return (
        u * uvs[row, 0, 0] + v * uvs[row, 1, 0] + w * uvs[row, 2, 0],
        u * uvs[row, 0, 1] + v * uvs[row, 1, 1] + w * uvs[row, 2, 1],
        ZERO,
    )


@device
def _attribute(
    geometry: Geometry, first: int, triangle: int, u: float, v: float, w: float
) -> tuple[float, float, float]:
    if first == NONE:
        return ZERO, ZERO, ZERO
    c, row = geometry.attributes, first + triangle
    return (
        u * c[row, 0, 0] + v * c[row, 1, 0] + w * c[row, 2, 0],
        u * c[row, 0, 1] + v * c[row, 1, 1] + w * c[row, 2, 1],
        u * c[row, 0, 2] + v * c[row, 1, 2] + w * c[row, 2, 2],
    )


@device
def _look_up(
    r: np.ndarray, code: np.ndarray, textures: Textures, ramps: np.ndarray, at: int, operation: int
) -> tuple[float, float, float, int]:
    """Textures, and what is done to the vectors that they are looked up by."""
    a = code[at]
    x, y, z = r[a, 0], r[a, 1], r[a, 2]
    if operation == AFFINE:
        b, c, d, e = code[at + 1], code[at + 2], code[at + 3], code[at + 4]
        tx = r[b, 0] * x + r[c, 0] * y + r[d, 0] * z + r[e, 0]
        ty = r[b, 1] * x + r[c, 1] * y + r[d, 1] * z + r[e, 1]
        tz = r[b, 2] * x + r[c, 2] * y + r[d, 2] * z + r[e, 2]
        return tx, ty, tz, at + 5
    if operation == NORMALIZE:
        x, y, z = normalize(x, y, z)
        return x, y, z, at + 1
    if operation == CHECKER:
        scale, vector = r[code[at + 2], 0], code[at + 3]
        first = is_first_check(r[vector, 0] * scale, r[vector, 1] * scale, r[vector, 2] * scale)
        chosen = a if first else code[at + 1]
        return r[chosen, 0], r[chosen, 1], r[chosen, 2], at + 4
    if operation == RAMP:
        red, green, blue = _ramp(ramps, code[at + 1], code[at + 2], code[at + 3], x)
        return red, green, blue, at + 4
    if operation == PANORAMA:
        x, y = direction_to_panorama(x, y, z)
    red, green, blue = image_color(textures, code[at + 1], x, y)
    return red, green, blue, at + 2


@device
def _ramp(t: np.ndarray, first: int, count: int, smooth: int, factor: float) -> tuple[float, float, float]:
    # Written so that NaN is 0, too.
    place = min(factor if factor > ZERO else ZERO, ONE) * np.float32(count - 1)
    low = min(np.int64(place), count - 1)
    share = (place - np.float32(low)) if smooth != 0 else ZERO
    high = first + min(low + 1, count - 1)
    low += first
    return (
        t[low, 0] + share * (t[high, 0] - t[low, 0]),
        t[low, 1] + share * (t[high, 1] - t[low, 1]),
        t[low, 2] + share * (t[high, 2] - t[low, 2]),
    )


@device
def _calculate(r: np.ndarray, code: np.ndarray, at: int, operation: int) -> tuple[float, float, float, int]:
    """Arithmetic."""
    a = code[at]
    if operation == MIX:
        b, c = code[at + 1], code[at + 2]
        factor = clamp01(r[a, 0]) if code[at + 4] != 0 else r[a, 0]
        x, y, z = mix(code[at + 3], factor, r[b, 0], r[b, 1], r[b, 2], r[c, 0], r[c, 1], r[c, 2])
        if code[at + 5] != 0:
            x, y, z = clamp01(x), clamp01(y), clamp01(z)
        return x, y, z, at + 6
    if operation == MATH:
        x = math_op(code[at + 3], r[a, 0], r[code[at + 1], 0], r[code[at + 2], 0])
        x = clamp01(x) if code[at + 4] != 0 else x
        return x, x, x, at + 5
    if operation == MAP_RANGE:
        b, c, d, e = code[at + 1], code[at + 2], code[at + 3], code[at + 4]
        x = map_range(code[at + 5], code[at + 6], r[a, 0], r[b, 0], r[c, 0], r[d, 0], r[e, 0])
        return x, x, x, at + 7
    if operation == GRAY:
        x = gray(r[a, 0], r[a, 1], r[a, 2])
        return x, x, x, at + 1
    if operation == AVERAGE:
        x = (r[a, 0] + r[a, 1] + r[a, 2]) * np.float32(1 / 3)
        return x, x, x, at + 1
    if operation == COMPONENT:
        x = r[a, code[at + 1]]
        return x, x, x, at + 2
    return r[a, 0], r[code[at + 1], 0], r[code[at + 2], 0], at + 3


@device
def _view_dependent(f: np.ndarray, r: np.ndarray, i: int, operation: int, number: int, normal: int) -> float:
    x, y, z = view_of(f, i)
    nx, ny, nz = normal_of(f, r, i, normal)
    cosine = abs(x * nx + y * ny + z * nz)
    value, front = r[number, 0], f[i + SIDE] > ZERO
    if operation == FACING:
        blend = min(max(value, ZERO), np.float32(1 - 1e-5))
        exponent = TWO * blend if blend < HALF else HALF / (ONE - blend)
        return ONE - np.float32(min(cosine, ONE) ** exponent)
    if operation == FRESNEL:
        eta = clamp_index(value)
        return dielectric_reflectance(cosine, eta if front else ONE / eta)
    eta = max(ONE - value, np.float32(1e-5))
    return dielectric_reflectance(cosine, ONE / eta if front else eta)


@device
def _normal_map(
    f: np.ndarray,
    bits: np.ndarray,
    r: np.ndarray,
    geometry: Geometry,
    i: int,
    color: int,
    strength: int,
    space: int,
) -> tuple[float, float, float]:
    x, y, z = TWO * r[color, 0] - ONE, TWO * r[color, 1] - ONE, TWO * r[color, 2] - ONE
    share = max(r[strength, 0], ZERO)
    placement = hit_placement(bits, i)
    side = f[i + SIDE]
    sx, sy, sz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    if space == 0:
        # Strength 0 is the normal itself, and more than 1 only leans further.
        x, y, z = x * share, y * share, ONE + (z - ONE) * clamp01(share)
        tx, ty, tz, handedness = _tangent(
            geometry, placement, np.int64(bits[i + PRIMITIVE]), f[i + HIT_V], f[i + HIT_W]
        )
        nx, ny, nz = side * sx, side * sy, side * sz
        bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
        bx, by, bz = handedness * bx, handedness * by, handedness * bz
        x, y, z = x * tx + y * bx + z * nx, x * ty + y * by + z * ny, x * tz + y * bz + z * nz
        return _unit_or_normal(f, i, side * x, side * y, side * z)
    if space == 1:
        # to_object is affine: its transpose takes normals the other way.
        m = geometry.to_object
        x, y, z = (
            m[placement, 0, 0] * x + m[placement, 1, 0] * y + m[placement, 2, 0] * z,
            m[placement, 0, 1] * x + m[placement, 1, 1] * y + m[placement, 2, 1] * z,
            m[placement, 0, 2] * x + m[placement, 1, 2] * y + m[placement, 2, 2] * z,
        )
        if geometry.placements[placement, INSTANCED] != 0:
            x, y, z = rotate(geometry.normal_to_world, placement, x, y, z)
    x, y, z = _unit_or_normal(f, i, side * x, side * y, side * z)
    return _unit_or_normal(f, i, sx + share * (x - sx), sy + share * (y - sy), sz + share * (z - sz))


@device
def _unit_or_normal(f: np.ndarray, i: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector made one long; one of no length, which a map's mean grey stands for, is the shading normal."""
    if (x == ZERO) & (y == ZERO) & (z == ZERO):
        return f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    return normalize(x, y, z)


@device
def _tangent(
    geometry: Geometry, placement: int, triangle: int, v: float, w: float
) -> tuple[float, float, float, float]:
    """The interpolated tangent in world space, and the sign of the bitangent."""
    first = geometry.first[geometry.placements[placement, MESH], TANGENT]
    if first == NONE:
        return ONE, ZERO, ZERO, ONE
    u, t, row = ONE - v - w, geometry.tangents, first + triangle
    x = u * t[row, 0, 0] + v * t[row, 1, 0] + w * t[row, 2, 0]
    y = u * t[row, 0, 1] + v * t[row, 1, 1] + w * t[row, 2, 1]
    z = u * t[row, 0, 2] + v * t[row, 1, 2] + w * t[row, 2, 2]
    sign = t[row, 0, 3]
    if geometry.placements[placement, INSTANCED] != 0:
        x, y, z = rotate(geometry.to_world, placement, x, y, z)
        # The bitangent is a cross product in world space: a mirrored mesh has it the other way round.
        sign = -sign if _mirrors(geometry.to_world, placement) else sign
    x, y, z = normalize(x, y, z)
    return x, y, z, sign


@device
def _mirrors(m: np.ndarray, k: int) -> bool:
    """Whether matrix k of m (P, 3, 4) turns right-handed into left-handed: its determinant is negative."""
    x = m[k, 1, 1] * m[k, 2, 2] - m[k, 1, 2] * m[k, 2, 1]
    y = m[k, 1, 2] * m[k, 2, 0] - m[k, 1, 0] * m[k, 2, 2]
    z = m[k, 1, 0] * m[k, 2, 1] - m[k, 1, 1] * m[k, 2, 0]
    return m[k, 0, 0] * x + m[k, 0, 1] * y + m[k, 0, 2] * z < ZERO


@device
def _bump(
    f: np.ndarray, bits: np.ndarray, r: np.ndarray, geometry: Geometry, code: np.ndarray, i: int, at: int
) -> tuple[float, float, float]:
    """Tilt the normal against the slope of the height (Mikkelsen 2010, surface gradients)."""
    here, beside, above = r[code[at], 0], r[code[at + 1], 0], r[code[at + 2], 0]
    strength, distance = max(r[code[at + 3], 0], ZERO), r[code[at + 4], 0]
    nx, ny, nz = normal_of(f, r, i, code[at + 5])
    distance = -distance if code[at + 6] != 0 else distance
    placement = hit_placement(bits, i)
    mesh, triangle = geometry.placements[placement, MESH], np.int64(bits[i + PRIMITIVE])
    ux, uy, uz = _edge(geometry, placement, mesh, triangle, 1)
    vx, vy, vz = _edge(geometry, placement, mesh, triangle, 2)
    # Slopes along the edges, per edge.
    along_u = _steep(distance * (beside - here) / _step(f, geometry, i, placement, mesh, triangle, 1))
    along_v = _steep(distance * (above - here) / _step(f, geometry, i, placement, mesh, triangle, 2))
    # The gradient over the surface, times the determinant of the edges and the normal.
    px, py, pz = vy * nz - vz * ny, vz * nx - vx * nz, vx * ny - vy * nx
    qx, qy, qz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    determinant = ux * px + uy * py + uz * pz
    gx, gy, gz = along_u * px + along_v * qx, along_u * py + along_v * qy, along_u * pz + along_v * qz
    # What is high rises towards the viewer from behind as well, as Cycles has it: a relief would be sunk there.
    sign = ONE if determinant >= ZERO else -ONE
    size = abs(determinant)
    x, y, z = normalize(size * nx - sign * gx, size * ny - sign * gy, size * nz - sign * gz)
    rest = ONE - strength
    return normalize(strength * x + rest * nx, strength * y + rest * ny, strength * z + rest * nz)


@device
def _steep(slope: float) -> float:
    """A slope, or one as good as vertical where it is steeper; NaN stays NaN."""
    if abs(slope) > _VERTICAL:
        return _VERTICAL if slope > ZERO else -_VERTICAL
    return slope
