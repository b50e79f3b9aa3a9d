"""What a ray finds where it hits: position, normals, albedo and emission; and what it finds where it misses."""

from __future__ import annotations

import math

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    ALPHA,
    DEPTH,
    DIRECTION,
    GEOMETRIC_NORMAL,
    GEOMETRY,
    HIT_NORMAL,
    HIT_V,
    HIT_W,
    INSTANCE,
    INVALID,
    LANES,
    NORMAL,
    OFFSET,
    PACKET,
    POSITION,
    PRIMITIVE,
    RADIANCE,
    SHADING_NORMAL,
    T_FAR,
    THROUGHPUT,
    Batch,
    Y,
    Z,
)
from .jit import device, kernel
from .packed_materials import GENERATED, NONE, OBJECT
from .packing import SceneArrays
from .textures import texture_color

#: The step off a surface, as a share of the coordinates that went into the hit. Interpolating three vertices and
#: placing the result rounds 7 times at most and Embree's own test loses as many bits (2^-24 each): twice their sum.
STEP_OFF = np.float32(2.0**-19)
#: Where a ray that leaves a surface begins to look, so that the step may be 0 where nothing was rounded.
JUST_AHEAD = np.float32(1e-30)

#: Depth where a ray hits nothing, as in Blender.
MISSED_DEPTH = np.float32(1e10)

_ZERO, _ONE = np.float32(0), np.float32(1)


@kernel
def find_surfaces(batch: Batch, scene: SceneArrays, background: np.ndarray, packets: int) -> None:
    """Turn hits into surfaces and add what they emit; misses add `background` (3,) and end their path."""
    f, bits = batch.floats, batch.bits
    red, green, blue = background[0], background[1], background[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if f[i + ACTIVE] > _ZERO:
                if bits[i + PRIMITIVE] == INVALID:
                    f[i + ACTIVE] = _ZERO
                    _add_emission(f, i, red, green, blue)
                else:
                    instance, geometry = bits[i + INSTANCE], bits[i + GEOMETRY]
                    placement = np.int64(geometry) if instance == INVALID else np.int64(instance)
                    _find_surface(f, scene, i, placement, np.int64(bits[i + PRIMITIVE]))


@device
def _find_surface(f: np.ndarray, scene: SceneArrays, i: int, placement: int, triangle: int) -> None:
    mesh = scene.mesh[placement]
    v, w = f[i + HIT_V], f[i + HIT_W]
    u = _ONE - v - w
    x, y, z, rx, ry, rz = _hit_point(scene, mesh, triangle, u, v, w)
    nx, ny, nz = f[i + HIT_NORMAL], f[i + HIT_NORMAL + Y], f[i + HIT_NORMAL + Z]
    smooth = scene.first_normal[mesh] != NONE
    sx, sy, sz = _interpolated_normal(scene, mesh, triangle, u, v, w) if smooth else (nx, ny, nz)
    _find_material(f, scene, i, placement, triangle, u, v, w, x, y, z)
    if scene.instanced[placement]:
        rx, ry, rz = _reach_in_world(scene.to_world, placement, rx, ry, rz)
        x, y, z = _transform(scene.to_world, placement, x, y, z)
        nx, ny, nz = _rotate(scene.normal_to_world, placement, nx, ny, nz)
        sx, sy, sz = _rotate(scene.normal_to_world, placement, sx, sy, sz)
    else:
        sign = scene.handedness[placement]
        nx, ny, nz = nx * sign, ny * sign, nz * sign
    nx, ny, nz = _normalize(nx, ny, nz)
    sx, sy, sz = _normalize(sx, sy, sz) if smooth else (nx, ny, nz)
    away = nx * f[i + DIRECTION] + ny * f[i + DIRECTION + Y] + nz * f[i + DIRECTION + Z] > _ZERO
    side = -_ONE if away else _ONE
    _store(f, i + POSITION, x, y, z)
    _store(f, i + GEOMETRIC_NORMAL, side * nx, side * ny, side * nz)
    _store(f, i + SHADING_NORMAL, side * sx, side * sy, side * sz)
    # Only the error along the normal matters: a floor of kilometres, if it is level, needs a step of millionths.
    f[i + OFFSET] = STEP_OFF * (abs(nx) * rx + abs(ny) * ry + abs(nz) * rz)


@device
def _hit_point(
    scene: SceneArrays, mesh: int, triangle: int, u: float, v: float, w: float
) -> tuple[float, float, float, float, float, float]:
    """The point at barycentrics (u, v, w), more exact than origin + t direction, and the triangle's reach.

    The reach is its corners' largest x, y and z: what the rounding errors of the point are proportional to (Pharr,
    Jakob and Humphreys 2016, section 3.9).
    """
    row, first = scene.first_triangle[mesh] + triangle, scene.first_vertex[mesh]
    a = first + np.int64(scene.triangles[row, 0])
    b = first + np.int64(scene.triangles[row, 1])
    c = first + np.int64(scene.triangles[row, 2])
    vertices = scene.vertices
    ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
    bx, by, bz = vertices[b, 0], vertices[b, 1], vertices[b, 2]
    cx, cy, cz = vertices[c, 0], vertices[c, 1], vertices[c, 2]
    return (
        u * ax + v * bx + w * cx,
        u * ay + v * by + w * cy,
        u * az + v * bz + w * cz,
        max(abs(ax), abs(bx), abs(cx)),
        max(abs(ay), abs(by), abs(cy)),
        max(abs(az), abs(bz), abs(cz)),
    )


@device
def _interpolated_normal(
    scene: SceneArrays, mesh: int, triangle: int, u: float, v: float, w: float
) -> tuple[float, float, float]:
    n, row = scene.corner_normals, scene.first_normal[mesh] + triangle
    return (
        u * n[row, 0, 0] + v * n[row, 1, 0] + w * n[row, 2, 0],
        u * n[row, 0, 1] + v * n[row, 1, 1] + w * n[row, 2, 1],
        u * n[row, 0, 2] + v * n[row, 1, 2] + w * n[row, 2, 2],
    )


@device
def _find_material(
    f: np.ndarray,
    scene: SceneArrays,
    i: int,
    placement: int,
    triangle: int,
    u: float,
    v: float,
    w: float,
    x: float,
    y: float,
    z: float,
) -> None:
    """Store the albedo of the triangle's material and add its emission; (x, y, z) is in the mesh's stored space."""
    slot = np.int64(0)
    first_slot = scene.first_slot[scene.mesh[placement]]
    if first_slot != NONE:
        # A slot beyond the last uses the last, as in Blender.
        slot = min(np.int64(scene.slots[first_slot + triangle]), scene.last_slot[placement])
    material = scene.materials[scene.first_material[placement] + slot]
    texture = scene.albedo_texture[material]
    if texture == NONE:
        _store(f, i + ALBEDO, scene.albedo[material, 0], scene.albedo[material, 1], scene.albedo[material, 2])
    else:
        s, t, r = _coordinates(scene, texture, placement, triangle, u, v, w, x, y, z)
        red, green, blue = texture_color(scene, texture, s, t, r)
        _store(f, i + ALBEDO, red, green, blue)
    if scene.emits[material]:
        red, green, blue = scene.emission[material, 0], scene.emission[material, 1], scene.emission[material, 2]
        texture = scene.emission_texture[material]
        if texture != NONE:
            s, t, r = _coordinates(scene, texture, placement, triangle, u, v, w, x, y, z)
            tr, tg, tb = texture_color(scene, texture, s, t, r)
            red, green, blue = red * tr, green * tg, blue * tb
        _add_emission(f, i, red, green, blue)


@device
def _add_emission(f: np.ndarray, i: int, red: float, green: float, blue: float) -> None:
    f[i + RADIANCE] += f[i + THROUGHPUT] * red
    f[i + RADIANCE + Y] += f[i + THROUGHPUT + Y] * green
    f[i + RADIANCE + Z] += f[i + THROUGHPUT + Z] * blue


@device
def _coordinates(
    scene: SceneArrays,
    texture: int,
    placement: int,
    triangle: int,
    u: float,
    v: float,
    w: float,
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float]:
    space = scene.texture_space[texture]
    if space == GENERATED:
        return _transform(scene.to_generated, placement, x, y, z)
    if space == OBJECT:
        return _transform(scene.to_object, placement, x, y, z)
    first = scene.first_uv[scene.mesh[placement]]
    if first == NONE:
        return _ZERO, _ZERO, _ZERO
    uvs, row = scene.uvs, first + triangle
    return (
        u * uvs[row, 0, 0] + v * uvs[row, 1, 0] + w * uvs[row, 2, 0],
        u * uvs[row, 0, 1] + v * uvs[row, 1, 1] + w * uvs[row, 2, 1],
        _ZERO,
    )


@device
def _transform(m: np.ndarray, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The point (x, y, z) under matrix k of m (P, 3, 4)."""
    return (
        m[k, 0, 0] * x + m[k, 0, 1] * y + m[k, 0, 2] * z + m[k, 0, 3],
        m[k, 1, 0] * x + m[k, 1, 1] * y + m[k, 1, 2] * z + m[k, 1, 3],
        m[k, 2, 0] * x + m[k, 2, 1] * y + m[k, 2, 2] * z + m[k, 2, 3],
    )


@device
def _rotate(m: np.ndarray, k: int, x: float, y: float, z: float) -> tuple[float, float, float]:
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
def _normalize(x: float, y: float, z: float) -> tuple[float, float, float]:
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
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            hit = f[i + ACTIVE] > _ZERO
            f[i + ALPHA] = _ONE if hit else _ZERO
            f[i + DEPTH] = f[i + T_FAR] if hit else MISSED_DEPTH
            f[i + NORMAL] = f[i + SHADING_NORMAL] if hit else _ZERO
            f[i + NORMAL + Y] = f[i + SHADING_NORMAL + Y] if hit else _ZERO
            f[i + NORMAL + Z] = f[i + SHADING_NORMAL + Z] if hit else _ZERO
