"""The scene as kernels read it: flat arrays, moved so that float32 holds it, and Embree's structure over them.

A mesh that stands in the world once is stored in world space and traced directly; one that stands there more often is
stored once in its own space, and traced through instances. "World space" inside the renderer is the world moved so
that a scene far from the origin lies about it: float32 has 24 bits, and would lose them there.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .embree import PlacedTriangles, Traversal, build_scene
from .errors import SceneError
from .instructions import NONE
from .packed_materials import MaterialArrays, pack_materials
from .programs import Programs
from .scene import VISIBLE_TO_SHADOWS, Instance, Material, Mesh, Scene
from .shared_use import SharedUse

#: Farther out than this, in metres, the volumes that Embree's test of a triangle compares overflow float32.
FARTHEST = 1e12

#: A bit beside `scene.VISIBLE_TO_SHADOWS`, and in its place, of what tints shadows rather than to make them black.
TINTS_SHADOWS = 32


#: Columns of `Geometry.first`: where a mesh's part of an array begins, or NONE. From FIRST_ATTRIBUTE on there is one
#: for each attribute that a program asks for.
VERTEX, TRIANGLE, CORNER_NORMAL, CORNER_UV, TANGENT, SLOT, FIRST_ATTRIBUTE = range(7)

#: Columns of `Geometry.placements`: its mesh; whether that is in its own space; -1 where a mirroring matrix turned the
#: triangles inside out, else 1; where its materials begin in `slot_materials`, and the number of its last slot.
MESH, INSTANCED, HANDEDNESS, FIRST_MATERIAL, LAST_SLOT = range(5)


class Geometry(NamedTuple):
    """Meshes and placements for kernels. Sizes: M meshes, P placements.

    Few and wide arrays: each that a kernel is given takes time to compile, and to pass on.
    """

    vertices: np.ndarray  # (V, 3)
    triangles: np.ndarray  # (T, 3) uint32, into the mesh's own vertices
    corner_normals: np.ndarray  # (·, 3, 3), of the smooth meshes
    uvs: np.ndarray  # (·, 3, 2), of the meshes that have them
    tangents: np.ndarray  # (·, 3, 4), likewise
    attributes: np.ndarray  # (·, 3, 3): the corners' colours
    slots: np.ndarray  # (·,) uint16, of the meshes with several materials
    first: np.ndarray  # (M, FIRST_ATTRIBUTE + attributes) int64
    placements: np.ndarray  # (P, 5) int64
    lift_below: np.ndarray  # (P,) float32: `Instance.lift_shadows_below`
    to_world: np.ndarray  # (P, 3, 4) float32, re-centred; of instanced placements
    normal_to_world: np.ndarray  # (P, 3, 3)
    to_object: np.ndarray  # (P, 3, 4): from world space, or from the mesh's own where instanced
    to_generated: np.ndarray  # (P, 3, 4): likewise
    slot_materials: np.ndarray  # int64: the material of each slot of each placement
    center: np.ndarray  # (3,) float32: what was subtracted from world positions


class SceneArrays(NamedTuple):
    """What kernels know of the scene."""

    geometry: Geometry
    materials: MaterialArrays


@dataclass(frozen=True)
class PackedScene:
    """`arrays` and `traversal` for kernels; `center` (3,) float64 is what has to be subtracted from world positions.

    `structure` is Embree's, over `entries`, to be let go of once; it takes `memory` bytes.
    """

    arrays: SceneArrays
    programs: Programs
    entries: list[PlacedTriangles]
    traversal: Traversal
    structure: SharedUse
    memory: int
    center: np.ndarray


def pack_scene(scene: Scene, threads: int, before: PackedScene | None = None) -> PackedScene:
    """Check `scene`, flatten it and build Embree's structure with `threads` threads.

    Where nothing has moved since `before`, its structure is shared: each that holds it lets go of it once.

    Raises:
        SceneError: an array has the wrong shape, or numbers that are not finite.
    """
    instances = [instance for instance in scene.instances if len(instance.mesh.triangles)]
    meshes = list({id(instance.mesh): instance.mesh for instance in instances}.values())
    for mesh in meshes:
        _check_mesh(mesh)
    for instance in instances:
        if np.shape(instance.matrix) != (4, 4) or not np.isfinite(instance.matrix).all():
            raise SceneError(f"{_name(instance)}: its matrix is not one of 4 × 4 finite numbers")
    own, boxes = _boxes(instances)
    center = _center(boxes)
    _check_reach(instances, own, boxes, center)
    uses = Counter(id(instance.mesh) for instance in instances)
    alone = {id(instance.mesh): instance for instance in instances if uses[id(instance.mesh)] == 1}

    placements = _pack_placements(instances, meshes, alone, center)
    materials, slot_materials, programs = pack_materials(placements.pop("material_list"), scene.world)
    fields, parts = _pack_meshes(meshes, alone, center, programs.attributes)
    geometry = Geometry(**fields, **placements, slot_materials=slot_materials, center=center.astype(np.float32))
    passes = np.array([material.may_pass for material in programs.materials], bool)
    entries = []
    for i, (instance, row) in enumerate(zip(instances, geometry.placements, strict=True)):
        first, last = row[FIRST_MATERIAL], row[FIRST_MATERIAL] + row[LAST_SLOT]
        matrix = geometry.to_world[i] if row[INSTANCED] else None
        mask = _mask(instance, passes[slot_materials[first : last + 1]].any())
        entries.append(PlacedTriangles(*parts[row[MESH]], matrix, mask))
    arrays = SceneArrays(geometry, materials)
    if before is not None and _are_same(entries, before.entries) and before.structure.join():
        return PackedScene(arrays, programs, before.entries, before.traversal, before.structure, before.memory, center)
    embree = build_scene(entries, threads)
    return PackedScene(arrays, programs, entries, embree.traversal, SharedUse(embree.close), embree.memory, center)


def _are_same(entries: Sequence[PlacedTriangles], others: Sequence[PlacedTriangles]) -> bool:
    return len(entries) == len(others) and all(
        entry.mask == other.mask and all(map(np.array_equal, entry[:3], other[:3]))
        for entry, other in zip(entries, others, strict=True)
    )


def _mask(instance: Instance, may_pass: bool) -> int:
    """The kinds of ray that hit a placement: shadow rays look at those apart that light may pass straight through."""
    if may_pass and instance.visibility & VISIBLE_TO_SHADOWS:
        return instance.visibility ^ VISIBLE_TO_SHADOWS | TINTS_SHADOWS
    return instance.visibility


def affine(matrix: np.ndarray, center: np.ndarray | None = None) -> np.ndarray:
    """The upper three rows of a (4, 4) matrix, float64, moved by -`center`."""
    rows = np.array(matrix, np.float64, order="C")[:3]  # kernels are compiled for this order alone
    if center is not None:
        rows[:, 3] -= center
    return rows


def _name(instance: Instance) -> str:
    return f"object {(instance.name or instance.mesh.name)!r}"


def _check_mesh(mesh: Mesh) -> None:
    count = len(mesh.triangles)
    shapes = {
        "vertices": (mesh.vertices, (len(mesh.vertices), 3)),
        "triangles": (mesh.triangles, (count, 3)),
        "corner normals": (mesh.corner_normals, (count, 3, 3)),
        "UVs": (mesh.uvs, (count, 3, 2)),
        "material slots": (mesh.material_slots, (count,)),
        "tangents": (mesh.tangents, (count, 3, 4)),
        **{f"colours {name!r}": (colors, (count, 3, 3)) for name, colors in mesh.attributes.items()},
    }
    for what, (array, shape) in shapes.items():
        if array is not None and np.shape(array) != shape:
            raise SceneError(f"mesh {mesh.name!r}: its {what} have the shape {np.shape(array)}, not {shape}")
    bad = int((~np.isfinite(mesh.vertices)).any(axis=1).sum())
    if bad:
        raise SceneError(f"mesh {mesh.name!r}: {bad} of its vertices are not finite numbers: remove or repair them")
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices):
        raise SceneError(f"mesh {mesh.name!r}: a triangle names a vertex that is not there")


def _boxes(instances: Sequence[Instance]) -> tuple[np.ndarray, np.ndarray]:
    """The corners of a box around each instance, float64 (I, 8, 3), in its mesh's own space and in the world's."""
    meshes = {id(instance.mesh): instance.mesh for instance in instances}
    boxes = {key: _corners(mesh.vertices) for key, mesh in meshes.items()}
    own = np.array([boxes[id(instance.mesh)] for instance in instances]).reshape(-1, 8, 3)
    matrices = np.array([instance.matrix for instance in instances], np.float64).reshape(-1, 4, 4)
    return own, own @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]


def _center(boxes: np.ndarray) -> np.ndarray:
    """What to subtract from the world, float64 (3,): the middle of all boxes, as far as no point loses by it.

    Nothing comes to lie farther from the centre, along any axis, than it was from the origin: where there are things
    on both sides of that it stays the centre, and a moon takes no digits from the scene that it shines on.
    """
    if len(boxes) == 0:
        return np.zeros(3)
    low, high = boxes.min(axis=(0, 1)), boxes.max(axis=(0, 1))
    return np.clip((low + high) / 2, 2 * np.minimum(high, 0), 2 * np.maximum(low, 0))


def _check_reach(instances: Sequence[Instance], own: np.ndarray, boxes: np.ndarray, center: np.ndarray) -> None:
    reach = np.maximum(np.abs(boxes - center).max(axis=(1, 2)), np.abs(own).max(axis=(1, 2)))
    too_far = np.flatnonzero(~(reach < FARTHEST))
    if len(too_far):
        first = too_far[0]
        raise SceneError(
            f"{_name(instances[first])} reaches {reach[first]:.1e} m far: rays find nothing farther out than "
            f"{FARTHEST:.0e} m, so make it smaller or bring it nearer"
        )


def _corners(vertices: np.ndarray) -> np.ndarray:
    """The 8 corners of the box around vertices, float64 (8, 3)."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return np.array(list(itertools.product(*zip(low, high, strict=True))), np.float64)


def _normal_matrix(matrix: np.ndarray) -> np.ndarray:
    """The inverse transpose of the linear part; of a flattening matrix, the transposed adjugate, which still exists."""
    linear = np.array(matrix, np.float64)[:3, :3]
    # Only directions come of it, and float32 does not hold the squares of every scale.
    a, b, c = linear.T / (np.abs(linear).max() or 1)
    cofactors = np.array([np.cross(b, c), np.cross(c, a), np.cross(a, b)]).T
    return cofactors * (-1 if np.linalg.det(linear) < 0 else 1)


def _pack_meshes(
    meshes: list[Mesh], alone: dict[int, Instance], center: np.ndarray, attributes: Sequence[str]
) -> tuple[dict, list]:
    """Concatenate the meshes' arrays. Returns the fields of `SceneArrays` and each mesh's (vertices, triangles)."""
    vertices = [_placed_vertices(mesh, alone.get(id(mesh)), center) for mesh in meshes]
    # Embree reads 16 bytes at each vertex of 12: one more row keeps the last read inside the memory.
    all_vertices = np.concatenate([*vertices, np.zeros((1, 3), np.float32)])
    all_triangles = np.concatenate(
        [np.ascontiguousarray(mesh.triangles, np.uint32) for mesh in meshes] or [np.zeros((0, 3), np.uint32)]
    )
    normals = [_placed_normals(_sound_normals(mesh), alone.get(id(mesh))) for mesh in meshes]
    uvs = [mesh.uvs for mesh in meshes]
    tangents = [_placed_tangents(mesh, alone.get(id(mesh))) for mesh in meshes]
    colors = [[mesh.attributes.get(name) for mesh in meshes] for name in attributes]
    slots = [mesh.material_slots for mesh in meshes]
    all_colors = [color for of_meshes in colors for color in of_meshes]
    fields = {
        "vertices": all_vertices,
        "triangles": all_triangles,
        "corner_normals": _concatenate(normals, (0, 3, 3), np.float32),
        "uvs": _concatenate(uvs, (0, 3, 2), np.float32),
        "tangents": _concatenate(tangents, (0, 3, 4), np.float32),
        "attributes": _concatenate(all_colors, (0, 3, 3), np.float32),
        "slots": _concatenate(slots, (0,), np.uint16),
        "first": np.column_stack(
            [
                *map(_starts, (vertices, [mesh.triangles for mesh in meshes], normals, uvs, tangents, slots)),
                *_starts(all_colors).reshape(len(attributes), len(meshes)),
            ]
        ),
    }
    first = fields["first"]
    parts = [
        (all_vertices[v : v + len(mesh.vertices)], all_triangles[t : t + len(mesh.triangles)])
        for mesh, v, t in zip(meshes, first[:, VERTEX], first[:, TRIANGLE], strict=True)
    ]
    return fields, parts


def _placed_vertices(mesh: Mesh, instance: Instance | None, center: np.ndarray) -> np.ndarray:
    if instance is None:
        return np.ascontiguousarray(mesh.vertices, np.float32)
    rows = affine(instance.matrix, center)
    return (mesh.vertices.astype(np.float64) @ rows[:, :3].T + rows[:, 3]).astype(np.float32)


@np.errstate(over="ignore")
def _sound_normals(mesh: Mesh) -> np.ndarray | None:
    """The corner normals, those of the triangle where they are none: degenerate faces can have them NaN or zero."""
    normals = mesh.corner_normals
    # NaN and infinity survive a sum, and of NaN every comparison is False.
    sound = None if normals is None else np.abs(normals).sum(axis=2)
    if sound is None or (good := (sound > 0) & (sound < np.inf)).all():
        return normals
    a, b, c = mesh.vertices.astype(np.float64)[mesh.triangles].transpose(1, 0, 2)
    flat = np.cross(b - a, c - a)
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = np.where(length > 0, flat / np.where(length > 0, length, 1), (0, 0, 1))
    return np.where(good[..., None], normals, flat[:, None]).astype(np.float32)


def _placed_normals(normals: np.ndarray | None, instance: Instance | None) -> np.ndarray | None:
    if normals is None or instance is None:
        return normals
    normals = normals.astype(np.float32) @ _normal_matrix(instance.matrix).T.astype(np.float32)
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    return normals / np.where(length > 0, length, 1)


@np.errstate(invalid="ignore")  # those of degenerate faces are raised to 0 at the end
def _placed_tangents(mesh: Mesh, instance: Instance | None) -> np.ndarray | None:
    if mesh.tangents is None or instance is None:
        return mesh.tangents
    linear = np.array(instance.matrix, np.float32)[:3, :3]
    along = mesh.tangents[..., :3].astype(np.float32) @ linear.T
    length = np.linalg.norm(along, axis=2, keepdims=True)
    sign = mesh.tangents[..., 3:] * (-1 if np.linalg.det(linear) < 0 else 1)
    return np.concatenate([along / np.where(length > 0, length, 1), sign], axis=2)


def _concatenate(arrays: Sequence[np.ndarray | None], empty: tuple[int, ...], dtype: type) -> np.ndarray:
    """One array of all that are there; what is not a finite number, as of a degenerate face, is 0."""
    present = [np.ascontiguousarray(array, dtype) for array in arrays if array is not None]
    if not present:
        return np.zeros(empty, dtype)
    joined = np.concatenate(present)
    if not np.isfinite(joined).all():
        np.nan_to_num(joined, copy=False, nan=0, posinf=0, neginf=0)
    return joined


def _starts(arrays: Sequence[np.ndarray | None]) -> np.ndarray:
    """Where each array begins in their concatenation, NONE for those that are not there."""
    starts, position = [], 0
    for array in arrays:
        starts.append(NONE if array is None else position)
        position += 0 if array is None else len(array)
    return np.array(starts, np.int64)


@np.errstate(over="ignore")  # a nearly flat object's own coordinates: samples that use infinite ones are counted
def _pack_placements(
    instances: list[Instance], meshes: list[Mesh], alone: dict[int, Instance], center: np.ndarray
) -> dict:
    index = {id(mesh): i for i, mesh in enumerate(meshes)}
    count = len(instances)
    instanced = np.array([id(instance.mesh) not in alone for instance in instances], bool)
    to_object = np.zeros((count, 3, 4))
    to_generated = np.zeros((count, 3, 4))
    materials: list[Material] = []
    first_material = np.zeros(count, np.int64)
    last_slot = np.zeros(count, np.int64)
    default = Material()
    for i, instance in enumerate(instances):
        matrix = np.eye(4)
        if not instanced[i]:
            matrix[:3] = affine(instance.matrix, center)
        # A flattened object has no way back to its own space; the least-squares one is as good as any.
        inverse = np.linalg.pinv(matrix[:3, :3])
        to_object[i] = np.column_stack([inverse, -inverse @ matrix[:3, 3]])
        location, size = (np.array(part, np.float64) for part in instance.mesh.texture_space)
        scale = 0.5 / np.where(size == 0, 1, size)
        to_generated[i] = to_object[i] * scale[:, None]
        to_generated[i, :, 3] += 0.5 - location * scale
        first_material[i] = len(materials)
        materials.extend(instance.materials or (default,))
        last_slot[i] = len(materials) - first_material[i] - 1
    matrices = np.array([affine(instance.matrix, center) for instance in instances]).reshape(count, 3, 4)
    columns = [
        [index[id(instance.mesh)] for instance in instances],
        instanced,
        np.where(instanced | (np.linalg.det(matrices[:, :, :3]) >= 0), 1, -1),
        first_material,
        last_slot,
    ]
    return {
        "placements": np.ascontiguousarray(np.array(columns, np.int64).T),
        "lift_below": np.array([instance.lift_shadows_below for instance in instances], np.float32),
        "to_world": matrices.astype(np.float32),
        "normal_to_world": np.array([_normal_matrix(m.matrix) for m in instances], np.float32).reshape(count, 3, 3),
        "to_object": to_object.astype(np.float32),
        "to_generated": to_generated.astype(np.float32),
        "material_list": materials,
    }
