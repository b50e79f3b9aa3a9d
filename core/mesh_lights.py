"""Glowing meshes as lights: every triangle that emits can be chosen, and a point of it.

A triangle is chosen by the first number of a sample point, through the tree of `light_choice`; what is left of that
number and the second choose the point. So even points are spread evenly over all triangles of a lamp at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .batch import (
    ACTIVE,
    CHOSEN_CHANCE,
    CHOSEN_V,
    CHOSEN_W,
    DIRECTION,
    EMISSION,
    EMITTER,
    GEOMETRY,
    HIT_NORMAL,
    HIT_V,
    HIT_W,
    INSTANCE,
    INVALID,
    LANES,
    LIGHT_COLOR,
    LIGHT_SPREAD,
    LIGHT_VISIBILITY,
    LIGHT_WEIGHT,
    ORIGIN,
    PACKET,
    POINT,
    POSITION,
    PRIMITIVE,
    SHADOW,
    T_FAR,
    Batch,
    Y,
    Z,
)
from .instructions import NONE
from .jit import device, kernel
from .light_choice import Emitters, LightTree, build_light_tree, choose_for_surface, emitter_probability
from .packing import FIRST_MATERIAL, INSTANCED, LAST_SLOT, MESH, TRIANGLE, VERTEX, Geometry, SceneArrays
from .programs import Programs
from .scene import VISIBLE_TO_SURFACES, Scene
from .surface import corners_of, hit_placement
from .warps import INV_PI, square_to_triangle

_ZERO, _ONE = np.float32(0), np.float32(1)


class MeshLights(NamedTuple):
    """The glowing triangles for kernels, E of them, in world space, re-centred."""

    tree: LightTree
    corner: np.ndarray  # (E, 3) float32
    edge_v: np.ndarray  # (E, 3), from the corner to the second
    edge_w: np.ndarray  # (E, 3), and to the third
    area: np.ndarray  # (E,) m²
    normal: np.ndarray  # (E, 3) unit
    visibility: np.ndarray  # (E,) uint32: bits of `scene`
    placement: np.ndarray  # (E,) int64
    triangle: np.ndarray  # (E,) int64
    material: np.ndarray  # (E,) int64
    first: np.ndarray  # (P,) int64: where a placement's triangles begin in `emitter`, or NONE
    emitter: np.ndarray  # int64: the emitter that a triangle is, or NONE


def find_mesh_lights(scene: Scene, geometry: Geometry, programs: Programs) -> MeshLights:
    """All triangles whose material glows and may be sampled as a light."""
    emission = np.array([material.typical_emission for material in programs.materials], np.float64)
    instances = [instance for instance in scene.instances if len(instance.mesh.triangles)]
    found = [_NO_TRIANGLES]
    first = np.full(len(instances), NONE, np.int64)
    emitter = [np.zeros(0, np.int64)]
    count = total = 0
    for p, instance in enumerate(instances):
        chosen, materials = _glowing_triangles(instance, geometry, programs, p)
        if len(chosen) == 0:
            continue
        first[p] = total
        numbers = np.full(len(instance.mesh.triangles), NONE, np.int64)
        numbers[chosen] = count + np.arange(len(chosen))
        emitter.append(numbers)
        found.append(np.column_stack([np.full(len(chosen), p), chosen, materials]))
        count, total = count + len(chosen), total + len(numbers)
    placement, triangle, material = np.ascontiguousarray(np.concatenate(found).T)
    corners = _world_corners(geometry, placement, triangle)
    return _make_mesh_lights(
        instances, corners, placement, triangle, material, first, np.concatenate(emitter), emission
    )


_NO_TRIANGLES = np.zeros((0, 3), np.int64)


def _glowing_triangles(instance, geometry: Geometry, programs: Programs, p: int) -> tuple[np.ndarray, np.ndarray]:
    """The triangles of placement p that are lights, and their materials."""
    if not instance.visibility & VISIBLE_TO_SURFACES:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    start, last = geometry.placements[p, FIRST_MATERIAL], geometry.placements[p, LAST_SLOT]
    slots = geometry.slot_materials[start : start + last + 1]
    placed = instance.materials
    glows = np.array(
        [
            programs.materials[material].may_emit and (not placed or placed[slot].sample_as_light)
            for slot, material in enumerate(slots)
        ]
    )
    count = len(instance.mesh.triangles)
    if not glows.any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    of_triangle = instance.mesh.material_slots
    slot = np.zeros(count, np.int64) if of_triangle is None else np.minimum(of_triangle.astype(np.int64), last)
    chosen = np.flatnonzero(glows[slot])
    return chosen, slots[slot[chosen]]


def _world_corners(geometry: Geometry, placement: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """(E, 3, 3) float64: the corners as rays see them."""
    mesh = geometry.placements[placement, MESH]
    rows = geometry.triangles[geometry.first[mesh, TRIANGLE] + triangle] + geometry.first[mesh, VERTEX, None]
    corners = geometry.vertices[rows].astype(np.float64)
    instanced = geometry.placements[placement, INSTANCED] != 0
    matrix = geometry.to_world[placement[instanced]].astype(np.float64)
    corners[instanced] = corners[instanced] @ matrix[:, :, :3].transpose(0, 2, 1) + matrix[:, None, :, 3]
    return corners


def _make_mesh_lights(
    instances: list,
    corners: np.ndarray,
    placement: np.ndarray,
    triangle: np.ndarray,
    material: np.ndarray,
    first: np.ndarray,
    emitter: np.ndarray,
    emission: np.ndarray,
) -> MeshLights:
    edge_v, edge_w = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(edge_v, edge_w)
    doubled = np.linalg.norm(across, axis=1)
    normal = across / np.where(doubled > 0, doubled, 1)[:, None]
    area = doubled / 2
    count = len(area)
    tree = build_light_tree(
        Emitters(
            low=corners.min(axis=1),
            high=corners.max(axis=1),
            axis=normal,
            cone=np.zeros(count),
            falloff=np.full(count, np.pi / 2),
            two_sided=np.ones(count, bool),
            power=area * emission[material],
        )
    )
    visibility = np.array([instance.visibility & VISIBLE_TO_SURFACES for instance in instances], np.uint32)
    return MeshLights(
        tree=tree,
        corner=corners[:, 0].astype(np.float32),
        edge_v=edge_v.astype(np.float32),
        edge_w=edge_w.astype(np.float32),
        area=area.astype(np.float32),
        normal=normal.astype(np.float32),
        visibility=visibility[placement] if len(instances) else np.zeros(0, np.uint32),
        placement=placement,
        triangle=triangle,
        material=material,
        first=first,
        emitter=emitter,
    )


@kernel
def sample_mesh_lights(batch: Batch, lights: MeshLights, emission: np.ndarray, packets: int) -> None:
    """Choose a point of a glowing triangle by the points looked up last, for every lane that wants light.

    The colour is that of `emission` (K, 3); where a material has a program, `visit_emitters` looks closer.
    """
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            f[i + LIGHT_WEIGHT] = _ZERO
            emitter, chance, rest = choose_for_surface(batch, lights.tree, i)
            if chance > _ZERO:
                _, v, w = square_to_triangle(rest, f[i + POINT + Y])
                _sample_triangle(f, bits, lights, emission, i, emitter, chance, v, w)


@device
def _sample_triangle(
    f: np.ndarray,
    bits: np.ndarray,
    lights: MeshLights,
    emission: np.ndarray,
    i: int,
    emitter: int,
    chance: float,
    v: float,
    w: float,
) -> None:
    c, a, b, n = lights.corner, lights.edge_v, lights.edge_w, lights.normal
    dx = c[emitter, 0] + v * a[emitter, 0] + w * b[emitter, 0] - f[i + POSITION]
    dy = c[emitter, 1] + v * a[emitter, 1] + w * b[emitter, 1] - f[i + POSITION + Y]
    dz = c[emitter, 2] + v * a[emitter, 2] + w * b[emitter, 2] - f[i + POSITION + Z]
    square = dx * dx + dy * dy + dz * dz
    distance = np.sqrt(square)
    facing = abs(dx * n[emitter, 0] + dy * n[emitter, 1] + dz * n[emitter, 2])
    # Bounded, so that the compiler cannot make one division by distance⁴ of it, which float32 does not hold.
    cosine = min(facing / distance, _ONE)
    # The surface's cosine to come is longer by the distance.
    weight = cosine / (square * distance) if facing > _ZERO else _ZERO
    spread = lights.area[emitter] / chance
    material = lights.material[emitter]
    f[i + SHADOW + DIRECTION] = dx
    f[i + SHADOW + DIRECTION + Y] = dy
    f[i + SHADOW + DIRECTION + Z] = dz
    f[i + SHADOW + T_FAR] = _ONE
    f[i + LIGHT_WEIGHT] = weight
    f[i + LIGHT_SPREAD] = spread * weight * distance
    f[i + LIGHT_COLOR] = spread * INV_PI * emission[material, 0]
    f[i + LIGHT_COLOR + Y] = spread * INV_PI * emission[material, 1]
    f[i + LIGHT_COLOR + Z] = spread * INV_PI * emission[material, 2]
    bits[i + LIGHT_VISIBILITY] = lights.visibility[emitter]
    bits[i + EMITTER] = np.uint32(emitter)
    f[i + CHOSEN_CHANCE] = chance
    f[i + CHOSEN_V] = v
    f[i + CHOSEN_W] = w


@device
def emitter_of(bits: np.ndarray, lights: MeshLights, i: int) -> int:
    """The emitter that lane i has hit, or NONE."""
    placement = hit_placement(bits, i)
    first = lights.first[placement]
    return NONE if first == NONE else lights.emitter[first + np.int64(bits[i + PRIMITIVE])]


@device
def spread_of_emitter(
    lights: MeshLights, emitter: int, x: float, y: float, z: float, nx: float, ny: float, nz: float, facing: float
) -> float:
    """1 / the density, in steradians, with which `sample_mesh_lights` chooses a direction from (x, y, z).

    `facing` is the cosine at the emitter / distance².
    """
    chance = emitter_probability(lights.tree, emitter, x, y, z, nx, ny, nz)
    return lights.area[emitter] * facing / chance if chance > _ZERO else np.float32(np.inf)


@kernel
def visit_emitters(batch: Batch, side: Batch, lights: MeshLights, scene: SceneArrays, packets: int) -> None:
    """Put the points chosen into `side`, as if a ray had hit them, where their material has a program to run."""
    f, bits, to, to_bits = batch.floats, batch.bits, side.floats, side.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            to[i + ACTIVE] = _ZERO
            if f[i + LIGHT_WEIGHT] <= _ZERO:
                continue
            emitter = np.int64(bits[i + EMITTER])
            if scene.materials.program[lights.material[emitter]] == NONE:
                continue
            placement = lights.placement[emitter]
            instanced = scene.geometry.placements[placement, INSTANCED] != 0
            spread = lights.area[emitter] / f[i + CHOSEN_CHANCE]
            f[i + LIGHT_COLOR] = f[i + LIGHT_COLOR + Y] = f[i + LIGHT_COLOR + Z] = spread * INV_PI
            to[i + ACTIVE] = _ONE
            to_bits[i + PRIMITIVE] = np.uint32(lights.triangle[emitter])
            to_bits[i + GEOMETRY] = np.uint32(0 if instanced else placement)
            to_bits[i + INSTANCE] = np.uint32(placement) if instanced else INVALID
            to[i + HIT_V], to[i + HIT_W] = f[i + CHOSEN_V], f[i + CHOSEN_W]
            _copy_normal(to, scene.geometry, i, placement, lights.triangle[emitter])
            for row in range(3):
                to[i + ORIGIN + row * LANES] = f[i + POSITION + row * LANES]
                to[i + DIRECTION + row * LANES] = f[i + SHADOW + DIRECTION + row * LANES]
            to[i + T_FAR] = _ONE


@device
def _copy_normal(f: np.ndarray, geometry: Geometry, i: int, placement: int, triangle: int) -> None:
    """The normal that Embree would give: the cross product of the triangle's edges in its mesh's own space."""
    a, b, c = corners_of(geometry, geometry.placements[placement, MESH], triangle)
    s = geometry.vertices
    ux, uy, uz = s[b, 0] - s[a, 0], s[b, 1] - s[a, 1], s[b, 2] - s[a, 2]
    vx, vy, vz = s[c, 0] - s[a, 0], s[c, 1] - s[a, 1], s[c, 2] - s[a, 2]
    f[i + HIT_NORMAL] = uy * vz - uz * vy
    f[i + HIT_NORMAL + Y] = uz * vx - ux * vz
    f[i + HIT_NORMAL + Z] = ux * vy - uy * vx


@kernel
def color_light(batch: Batch, side: Batch, packets: int) -> None:
    """Multiply the light samples' colours with what the programs of their materials, run in `side`, emit."""
    f, of = batch.floats, side.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if of[i + ACTIVE] > _ZERO:
                f[i + LIGHT_COLOR] *= of[i + EMISSION]
                f[i + LIGHT_COLOR + Y] *= of[i + EMISSION + Y]
                f[i + LIGHT_COLOR + Z] *= of[i + EMISSION + Z]
