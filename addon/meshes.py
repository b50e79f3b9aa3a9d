"""Blender's evaluated meshes as the renderer's `Mesh`.

Reading a million triangles through `foreach_get` of their structs takes a tenth of a second and more; through the
attributes' arrays, and the address of the triangles' table, a few milliseconds. What no one asks for is not read:
normals of a mesh that is flat, UVs without a texture, slots where there is one.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ._core import core
from .tangents import corner_tangents

#: Farther out than this, in metres, squares of distances overflow float32.
FARTHEST = 1e18

#: Kinds of attribute: the field of Blender's that holds the value, how many numbers it has, and of which type. Colours
#: stored as bytes are made linear by Blender.
ATTRIBUTE_FIELDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}


@dataclass(frozen=True)
class Needs:
    """What materials look up on a mesh beside its surface.

    `uvs`: the UV map that is active for renders. `attributes`: names, "" for the colour that is active for renders.
    `tangents`: names of UV maps, "" for the active one.
    """

    uvs: bool = False
    attributes: frozenset[str] = frozenset()
    tangents: frozenset[str] = frozenset()

    def __or__(self, other: Needs) -> Needs:
        return Needs(self.uvs or other.uvs, self.attributes | other.attributes, self.tangents | other.tangents)


def export_mesh(mesh: bpy.types.Mesh, name: str) -> core.scene.Mesh | None:
    """A mesh without what only materials need, or None where it has no faces. `name` is the object's, for errors.

    Raises:
        SceneError: a vertex is nowhere.
    """
    corners = triangle_corners(mesh)
    if corners is None:
        return None
    vertices = _read(mesh.attributes["position"].data, "vector", (len(mesh.vertices), 3), np.float32)
    # Of NaN every comparison is False.
    wrong = len(vertices) - int((np.abs(vertices) < FARTHEST).all(axis=1).sum())
    if wrong:
        raise core.errors.SceneError(
            f'object "{name}": {wrong} of its {len(vertices)} vertices are nowhere (NaN or infinity): '
            "mend the mesh or the modifier that makes them, or hide the object from renders"
        )
    triangles = _corner_vertices(mesh)[corners]
    location, size = tuple(mesh.texspace_location), tuple(mesh.texspace_size)
    return core.scene.Mesh(
        name=mesh.name,
        vertices=vertices,
        triangles=triangles,
        corner_normals=_corner_normals(mesh, corners, triangles),
        material_slots=_material_slots(mesh),
        texture_space=(location, size),
    )


def add_needed(exported: core.scene.Mesh, mesh: bpy.types.Mesh, needs: Needs) -> core.scene.Mesh:
    """The exported mesh with all that its materials need of what it has."""
    uvs, tangents, attributes = exported.uvs, exported.tangents, dict(exported.attributes)
    if needs.uvs and uvs is None:
        uvs = read_uvs(mesh)
    for name in needs.attributes - attributes.keys():
        if (values := read_attribute(mesh, name)) is not None:
            attributes[name] = values
    if needs.tangents and tangents is None:
        tangents = _tangents(exported, mesh, min(needs.tangents))
    return replace(exported, uvs=uvs, tangents=tangents, attributes=attributes)


def warnings_of(mesh: bpy.types.Mesh, needs: Needs) -> list[str]:
    """What of its materials' needs a mesh cannot fulfil as in Blender."""
    warnings = []
    layers = {_uv_layer(mesh, name) for name in needs.tangents} - {None}
    if len(layers) > 1:
        warnings.append(f'mesh "{mesh.name}": its normal maps use several UV maps, and get one')
    for name in sorted(needs.attributes):
        attribute = _attribute(mesh, name)
        if attribute is not None and not _is_known(attribute):
            kind = f"{attribute.data_type} on {attribute.domain}".lower().replace("_", " ")
            warnings.append(f'mesh "{mesh.name}": Rooks does not read its attribute "{attribute.name}" ({kind})')
    return warnings


def read_uvs(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T, 3, 2) of the UV map that is active for renders; zeros where there is none."""
    corners = triangle_corners(mesh)
    layer = _uv_layer(mesh, "")
    if layer is None:
        return np.zeros((len(corners), 3, 2), dtype=np.float32)
    return _read(layer.uv, "vector", (len(mesh.loops), 2), np.float32)[corners]


def read_attribute(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    """(T, 3, 3) float32: numbers thrice, two numbers with a 0, colours without their opacity. None: it has none."""
    attribute = _attribute(mesh, name)
    if attribute is None or not _is_known(attribute):
        return None
    field, width, dtype = ATTRIBUTE_FIELDS[attribute.data_type]
    stored = _read(attribute.data, field, (len(attribute.data), width), dtype).astype(np.float32, copy=False)
    if width == 1:
        values = np.repeat(stored, 3, axis=1)
    else:
        values = np.pad(stored, ((0, 0), (0, 1))) if width == 2 else stored[:, :3]
    corners = triangle_corners(mesh)
    if attribute.domain == "CORNER":
        return values[corners]
    if attribute.domain == "POINT":
        return values[_corner_vertices(mesh)[corners]]
    return np.repeat(values[_triangle_faces(mesh), None], 3, axis=1)


def triangle_corners(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T, 3) int32: the mesh's corners that make each triangle, or None without triangles."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return None
    # The table is plain int[count][3] in every version from 4.2 on.
    table = (ctypes.c_int32 * (3 * count)).from_address(mesh.loop_triangles[0].as_pointer())
    return np.array(table, dtype=np.int32).reshape(count, 3)


def _corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(corners,) int32: the vertex of each corner."""
    return _read(mesh.attributes[".corner_vert"].data, "value", len(mesh.loops), np.int32)


def _triangle_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T,) int32: the face of each triangle."""
    return _read(mesh.loop_triangle_polygons, "value", len(mesh.loop_triangles), np.int32)


def _corner_normals(mesh: bpy.types.Mesh, corners: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """(T, 3, 3) float32, or None for a mesh that is flat throughout."""
    if mesh.normals_domain == "FACE":
        return None
    if mesh.normals_domain == "POINT":
        return _read(mesh.vertex_normals, "vector", (len(mesh.vertices), 3), np.float32)[triangles]
    return _read(mesh.corner_normals, "vector", (len(mesh.loops), 3), np.float32)[corners]


def _material_slots(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T,) int32, or None where all faces use the first slot."""
    attribute = mesh.attributes.get("material_index")
    if attribute is None or len(attribute.data) == 0:
        return None
    of_face = _read(attribute.data, "value", len(mesh.polygons), np.int32)
    if not of_face.any():
        return None
    return np.maximum(of_face[_triangle_faces(mesh)], 0)


def _tangents(exported: core.scene.Mesh, mesh: bpy.types.Mesh, uv_map: str) -> np.ndarray | None:
    """(T, 3, 4) by a UV map; None for a mesh without it."""
    layer = _uv_layer(mesh, uv_map)
    if layer is None:
        return None
    uvs = _read(layer.uv, "vector", (len(mesh.loops), 2), np.float32)[triangle_corners(mesh)]
    positions = exported.vertices[exported.triangles]
    normals = exported.corner_normals
    if normals is None:
        normals = _read(mesh.polygon_normals, "vector", (len(mesh.polygons), 3), np.float32)[_triangle_faces(mesh)]
        normals = np.repeat(normals[:, None], 3, axis=1)
    return corner_tangents(positions, normals, uvs)


def _uv_layer(mesh: bpy.types.Mesh, name: str) -> bpy.types.MeshUVLoopLayer | None:
    """The UV map of a name, or the one that is active for renders for ""."""
    if name:
        return mesh.uv_layers.get(name)
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)


def _attribute(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    """The attribute of a name, or the colour that is active for renders for ""."""
    if name:
        return mesh.attributes.get(name)
    index = mesh.color_attributes.render_color_index
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None


def _is_known(attribute: bpy.types.Attribute) -> bool:
    return attribute.data_type in ATTRIBUTE_FIELDS and attribute.domain in ("CORNER", "POINT", "FACE")


def _read(collection, name: str, shape: int | tuple[int, ...], dtype: type) -> np.ndarray:
    values = np.empty(shape, dtype=dtype)
    collection.foreach_get(name, values.reshape(-1))
    return values
