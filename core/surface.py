"""What a ray finds where it hits: position, normals and the material; and what it finds where it misses."""

from __future__ import annotations

import math

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    ALPHA,
    DEPTH,
    DIRECTION,
    EMISSION,
    GEOMETRIC_NORMAL,
    GEOMETRY,
    HIT_NORMAL,
    HIT_V,
    HIT_W,
    INSTANCE,
    INVALID,
    LANES,
    LIFT,
    LIFT_BELOW,
    LIFT_BEYOND,
    LOBE_COUNT,
    MASK,
    MATERIAL,
    NORMAL,
    OFFSET,
    ORIGIN,
    PACKET,
    POSITION,
    PRIMITIVE,
    SHADING_NORMAL,
    SIDE,
    T_FAR,
    THROUGHPUT,
    Batch,
    Y,
    Z,
)
from .instructions import NONE
from .jit import device, kernel
from .packing import (
    CORNER_NORMAL,
    FIRST_MATERIAL,
    HANDEDNESS,
    INSTANCED,
    LAST_SLOT,
    MESH,
    SLOT,
    TRIANGLE,
    VERTEX,
    Geometry,
    SceneArrays,
)
from .scene import VISIBLE_TO_CAMERA
from .smooth_lift import Corners, Vector, lifts

#: The step off a surface, as a share of the coordinates that went into the hit. Interpolating three vertices and
#: placing the result rounds 7 times at most and Embree's own test loses as many bits (2^-24 each): twice their sum.
STEP_OFF = np.float32(2.0**-19)
#: A hit on an edge rounds to either side of what meets the triangle there, so rays start a little inside of it: by two
#: steps off the surface, for walls that meet at an acute angle, and by this share of the coordinates, the rounding of
#: the point and of Embree's test of the other wall.
STEP_IN = np.float32(2.0**-20)
#: But by no more than this share of a triangle that is narrower than that.
MOST_STEP_IN = np.float32(2.0**-6)
#: A triangle that reaches so many times farther than the ray holds the hit less precisely than the ray does.
WIDE = np.float32(8)
#: Where a ray that leaves a surface begins to look, so that the step may be 0 where nothing was rounded.
JUST_AHEAD = np.float32(1e-30)
#: The share of the way to a lamp in which something can stand before it: a surface that it lies in does not.
SHORT_OF_LAMP = np.float32(1 - 2.0**-18)

#: Depth where a ray hits nothing, as in Blender.
MISSED_DEPTH = np.float32(1e10)

_ZERO, _ONE = np.float32(0), np.float32(1)

Edges = tuple[Vector, Vector]


@kernel
def find_surfaces(batch: Batch, scene: SceneArrays, packets: int) -> None:
    """Turn hits into surfaces: position, normals, material, and what of the material is constant.

    A ray that hits nothing arrives at the world, which is a material that only emits.
    """
    f, bits = batch.floats, batch.bits
    geometry, world = scene.geometry, np.uint32(scene.materials.world)
    albedo, emission = scene.materials.albedo, scene.materials.emission
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if f[i + ACTIVE] > _ZERO:
                if bits[i + PRIMITIVE] == INVALID:
                    bits[i + MATERIAL] = world
                    if bits[i + MASK] == np.uint32(VISIBLE_TO_CAMERA):
                        f[i + ALPHA] = _ONE - _mean_throughput(f, i)
                else:
                    _find_surface(f, bits, geometry, i, hit_placement(bits, i), np.int64(bits[i + PRIMITIVE]))
                material = bits[i + MATERIAL]
                bits[i + LOBE_COUNT] = np.uint32(0)
                _store(f, i + ALBEDO, albedo[material, 0], albedo[material, 1], albedo[material, 2])
                _store(f, i + EMISSION, emission[material, 0], emission[material, 1], emission[material, 2])


@device
def _mean_throughput(f: np.ndarray, i: int) -> float:
    """What of the world the camera sees through transparent surfaces in lane i, as Cycles has it in a film's alpha."""
    return (f[i + THROUGHPUT] + f[i + THROUGHPUT + Y] + f[i + THROUGHPUT + Z]) * np.float32(1 / 3)


@device
def hit_placement(bits: np.ndarray, i: int) -> int:
    """The placement that lane i has hit: Embree names its instance, or its geometry where it is not instanced."""
    instance = bits[i + INSTANCE]
    return np.int64(bits[i + GEOMETRY]) if instance == INVALID else np.int64(instance)


@device
def _find_surface(f: np.ndarray, bits: np.ndarray, geometry: Geometry, i: int, placement: int, triangle: int) -> None:
    mesh = geometry.placements[placement, MESH]
    v, w = f[i + HIT_V], f[i + HIT_W]
    corners = _corners(geometry, mesh, triangle)
    rx, ry, rz = _reach(corners)
    nx, ny, nz = f[i + HIT_NORMAL], f[i + HIT_NORMAL + Y], f[i + HIT_NORMAL + Z]
    smooth = geometry.first[mesh, CORNER_NORMAL] != NONE
    between = _interpolated_normal(geometry, mesh, triangle, _ONE - v - w, v, w) if smooth else (nx, ny, nz)
    sx, sy, sz = between
    bits[i + MATERIAL] = np.uint32(_material(geometry, placement, triangle))
    instanced = geometry.placements[placement, INSTANCED] != 0
    if instanced:
        rx, ry, rz = _reach_in_world(geometry.to_world, placement, rx, ry, rz)
        nx, ny, nz = rotate(geometry.normal_to_world, placement, nx, ny, nz)
        sx, sy, sz = rotate(geometry.normal_to_world, placement, sx, sy, sz)
    else:
        sign = np.float32(geometry.placements[placement, HANDEDNESS])
        nx, ny, nz = nx * sign, ny * sign, nz * sign
    nx, ny, nz = normalize(nx, ny, nz)
    sx, sy, sz = normalize(sx, sy, sz) if smooth else (nx, ny, nz)
    # Only the error along the normal matters: a floor of kilometres, if it is level, needs a step of millionths.
    offset = STEP_OFF * (abs(nx) * rx + abs(ny) * ry + abs(nz) * rz)
    reach, of_ray = max(rx, ry, rz), _ray_reach(f, i)
    wide = reach > WIDE * of_ray
    inner_v, inner_w, mx, my, mz = v, w, _ZERO, _ZERO, _ZERO
    # Rarely so near to an edge that it matters.
    if min(v, w, _ONE - v - w) < MOST_STEP_IN:
        edges = _edges(corners)
        if instanced:
            edges = _rotate_edges(geometry.to_world, placement, edges)
        least = np.float32(2) * offset + STEP_IN * (of_ray if wide else reach)
        margin = _margin(edges, least)
        if wide:
            mx, my, mz = _off_edges(v, w, edges, max(margin, STEP_IN))
            mx, my, mz = least * mx, least * my, least * mz
        else:
            inner_v, inner_w = _step_in(v, w, margin)
    x, y, z = _point(corners, inner_v, inner_w)
    if instanced:
        x, y, z = transform(geometry.to_world, placement, x, y, z)
    if wide:
        x, y, z = _as_along_ray(f, i, x, y, z, nx, ny, nz, mx, my, mz)
    away = nx * f[i + DIRECTION] + ny * f[i + DIRECTION + Y] + nz * f[i + DIRECTION + Z] > _ZERO
    side = -_ONE if away else _ONE
    f[i + SIDE] = side
    f[i + OFFSET] = offset
    _store(f, i + POSITION, x, y, z)
    _store(f, i + GEOMETRIC_NORMAL, side * nx, side * ny, side * nz)
    _store(f, i + SHADING_NORMAL, side * sx, side * sy, side * sz)
    f[i + LIFT] = f[i + LIFT_BEYOND] = f[i + LIFT_BELOW] = _ZERO
    if smooth and geometry.lift_below[placement] > _ZERO:
        row = geometry.first[mesh, CORNER_NORMAL] + triangle
        out, inward = lifts(corners, geometry.corner_normals, row, v, w)
        # They are in the mesh's space, along normals that are shorter in between.
        tx, ty, tz = between
        if instanced:
            tx, ty, tz = rotate(geometry.to_world, placement, tx, ty, tz)
        scale = side * np.float32(math.sqrt(_square(tx, ty, tz)))
        # Smooth normals that oppose the triangle take its inside for its outside.
        outside = side * (sx * nx + sy * ny + sz * nz) > _ZERO
        f[i + LIFT_BELOW] = geometry.lift_below[placement]
        f[i + LIFT] = scale * (out if outside else inward)
        f[i + LIFT_BEYOND] = scale * (inward if outside else out)


@device
def corners_of(geometry: Geometry, mesh: int, triangle: int) -> tuple[int, int, int]:
    """The rows of `Geometry.vertices` at which a triangle of a mesh has its corners."""
    row, first = geometry.first[mesh, TRIANGLE] + triangle, geometry.first[mesh, VERTEX]
    a = first + np.int64(geometry.triangles[row, 0])
    b = first + np.int64(geometry.triangles[row, 1])
    c = first + np.int64(geometry.triangles[row, 2])
    return a, b, c


@device
def _corners(geometry: Geometry, mesh: int, triangle: int) -> Corners:
    """The corners of a triangle, in the space of its mesh."""
    a, b, c = corners_of(geometry, mesh, triangle)
    vertices = geometry.vertices
    return (
        (vertices[a, 0], vertices[a, 1], vertices[a, 2]),
        (vertices[b, 0], vertices[b, 1], vertices[b, 2]),
        (vertices[c, 0], vertices[c, 1], vertices[c, 2]),
    )


@device
def _reach(corners: Corners) -> Vector:
    """The corners' largest x, y and z: what the rounding errors of points between them are proportional to (Pharr,
    Jakob and Humphreys 2016, section 3.9).
    """
    a, b, c = corners
    return (
        max(abs(a[0]), abs(b[0]), abs(c[0])),
        max(abs(a[1]), abs(b[1]), abs(c[1])),
        max(abs(a[2]), abs(b[2]), abs(c[2])),
    )


@device
def _edges(corners: Corners) -> Edges:
    """The edges from the first corner to the others."""
    a, b, c = corners
    return (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (c[0] - a[0], c[1] - a[1], c[2] - a[2])


@device
def _rotate_edges(m: np.ndarray, k: int, edges: Edges) -> Edges:
    p, q = edges
    return rotate(m, k, p[0], p[1], p[2]), rotate(m, k, q[0], q[1], q[2])


@device
def _point(corners: Corners, v: float, w: float) -> Vector:
    """The point at barycentrics (1 - v - w, v, w), more exact than origin + t direction."""
    a, b, c = corners
    u = _ONE - v - w
    return (
        u * a[0] + v * b[0] + w * c[0],
        u * a[1] + v * b[1] + w * c[1],
        u * a[2] + v * b[2] + w * c[2],
    )


@device
def _margin(edges: Edges, least: float) -> float:
    """The share of the triangle's lowest height that `least` metres are: its barycentrics of a point so far inside."""
    p, q = edges
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    longest = max(_square(p[0], p[1], p[2]), _square(q[0], q[1], q[2]), _square(dx, dy, dz))
    # |p × q| is the lowest height × the longest edge.
    doubled = _square(p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])
    share = least * least * longest
    return MOST_STEP_IN if share >= MOST_STEP_IN * MOST_STEP_IN * doubled else np.float32(math.sqrt(share / doubled))


@device
def _step_in(v: float, w: float, margin: float) -> tuple[float, float]:
    """The barycentrics of a point near (1 - v - w, v, w) of which all three are at least `margin`, or all but so."""
    v, w = max(v, margin), max(w, margin)
    scale = min((_ONE - margin) / (v + w), _ONE)
    return v * scale, w * scale


@device
def _off_edges(v: float, w: float, edges: Edges, margin: float) -> Vector:
    """The direction away from all edges off which the barycentrics (1 - v - w, v, w) are less than `margin`."""
    p, q = edges
    x, y, z = _ZERO, _ZERO, _ZERO
    if v < margin:
        x, y, z = _across(p[0], p[1], p[2], q[0], q[1], q[2])
    if w < margin:
        dx, dy, dz = _across(q[0], q[1], q[2], p[0], p[1], p[2])
        x, y, z = x + dx, y + dy, z + dz
    if _ONE - v - w < margin:
        dx, dy, dz = _across(-p[0], -p[1], -p[2], q[0] - p[0], q[1] - p[1], q[2] - p[2])
        x, y, z = x + dx, y + dy, z + dz
    return x, y, z


@device
def _across(x: float, y: float, z: float, ex: float, ey: float, ez: float) -> Vector:
    """The part of (x, y, z) that is at right angles to the edge e, as a unit vector."""
    share = (x * ex + y * ey + z * ez) / _square(ex, ey, ez)
    return normalize(x - share * ex, y - share * ey, z - share * ez)


@device
def _ray_reach(f: np.ndarray, i: int) -> float:
    """What the rounding errors of the point at which lane i's ray ends are proportional to."""
    start = max(abs(f[i + ORIGIN]), abs(f[i + ORIGIN + Y]), abs(f[i + ORIGIN + Z]))
    return start + f[i + T_FAR] * max(abs(f[i + DIRECTION]), abs(f[i + DIRECTION + Y]), abs(f[i + DIRECTION + Z]))


@device
def _as_along_ray(
    f: np.ndarray,
    i: int,
    x: float,
    y: float,
    z: float,
    nx: float,
    ny: float,
    nz: float,
    mx: float,
    my: float,
    mz: float,
) -> Vector:
    """The point of (x, y, z)'s plane, whose normal is n, to which the ray leads, and m on from there."""
    t = f[i + T_FAR]
    dx = f[i + ORIGIN] + t * f[i + DIRECTION] + mx - x
    dy = f[i + ORIGIN + Y] + t * f[i + DIRECTION + Y] + my - y
    dz = f[i + ORIGIN + Z] + t * f[i + DIRECTION + Z] + mz - z
    off = dx * nx + dy * ny + dz * nz
    return x + (dx - off * nx), y + (dy - off * ny), z + (dz - off * nz)


@device
def _square(x: float, y: float, z: float) -> float:
    return x * x + y * y + z * z


@device
def _interpolated_normal(
    geometry: Geometry, mesh: int, triangle: int, u: float, v: float, w: float
) -> tuple[float, float, float]:
    n, row = geometry.corner_normals, geometry.first[mesh, CORNER_NORMAL] + triangle
    return (
        u * n[row, 0, 0] + v * n[row, 1, 0] + w * n[row, 2, 0],
        u * n[row, 0, 1] + v * n[row, 1, 1] + w * n[row, 2, 1],
        u * n[row, 0, 2] + v * n[row, 1, 2] + w * n[row, 2, 2],
    )


@device
def _material(geometry: Geometry, placement: int, triangle: int) -> int:
    slot = np.int64(0)
    first_slot = geometry.first[geometry.placements[placement, MESH], SLOT]
    if first_slot != NONE:
        # A slot beyond the last uses the last, as in Blender.
        slot = min(np.int64(geometry.slots[first_slot + triangle]), geometry.placements[placement, LAST_SLOT])
    return geometry.slot_materials[geometry.placements[placement, FIRST_MATERIAL] + slot]


@device
def transform(m: np.ndarray, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The point (x, y, z) under matrix k of m (P, 3, 4)."""
    return (
        m[k, 0, 0] * x + m[k, 0, 1] * y + m[k, 0, 2] * z + m[k, 0, 3],
        m[k, 1, 0] * x + m[k, 1, 1] * y + m[k, 1, 2] * z + m[k, 1, 3],
        m[k, 2, 0] * x + m[k, 2, 1] * y + m[k, 2, 2] * z + m[k, 2, 3],
    )


@device
def rotate(m: np.ndarray, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The vector (x, y, z) under matrix k of m (P, 3, 3)."""
    return (
        m[k, 0, 0] * x + m[k, 0, 1] * y + m[k, 0, 2] * z,
        m[k, 1, 0] * x + m[k, 1, 1] * y + m[k, 1, 2] * z,
        m[k, 2, 0] * x + m[k, 2, 1] * y + m[k, 2, 2] * z,
    )


@device
def _reach_in_world(m: np.ndarray, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """How large coordinates can become, on the way and in the end, under matrix k of m (P, 3, 4)."""
    return (
        abs(m[k, 0, 0]) * x + abs(m[k, 0, 1]) * y + abs(m[k, 0, 2]) * z + abs(m[k, 0, 3]),
        abs(m[k, 1, 0]) * x + abs(m[k, 1, 1]) * y + abs(m[k, 1, 2]) * z + abs(m[k, 1, 3]),
        abs(m[k, 2, 0]) * x + abs(m[k, 2, 1]) * y + abs(m[k, 2, 2]) * z + abs(m[k, 2, 3]),
    )


@device
def normalize(x: float, y: float, z: float) -> tuple[float, float, float]:
    # Scaled first: the cross product of a tiny or huge triangle's edges would leave float32 when squared.
    largest = max(abs(x), abs(y), abs(z))
    if largest == _ZERO:
        return _ZERO, _ZERO, _ONE
    scale = _ONE / largest
    x, y, z = x * scale, y * scale, z * scale
    scale = _ONE / np.float32(math.sqrt(x * x + y * y + z * z))
    return x * scale, y * scale, z * scale


@device
def _store(f: np.ndarray, at: int, x: float, y: float, z: float) -> None:
    f[at] = x
    f[at + Y] = y
    f[at + Z] = z


@kernel
def record_first_hits(batch: Batch, packets: int) -> None:
    """Keep what the passes want of the camera rays' hits: coverage, depth and normal."""
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            hit = bits[i + PRIMITIVE] != INVALID
            f[i + ALPHA] = _ONE if hit else _ZERO
            f[i + DEPTH] = f[i + T_FAR] if hit else MISSED_DEPTH
            f[i + NORMAL] = f[i + SHADING_NORMAL] if hit else _ZERO
            f[i + NORMAL + Y] = f[i + SHADING_NORMAL + Y] if hit else _ZERO
            f[i + NORMAL + Z] = f[i + SHADING_NORMAL + Z] if hit else _ZERO
