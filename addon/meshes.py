"""Blender's evaluated meshes as the renderer's `Mesh`.

Reading a million triangles through `foreach_get` of their structs takes a tenth of a second and more; through the
attributes' arrays, and the address of the triangles' table, a few milliseconds. What no one asks for is not read:
normals of a mesh that is flat, UVs without a texture, slots where there is one.
"""

from __future__ import annotations

import ctypes

import bpy
import numpy as np

from ._core import core

#: Farther out than this, in metres, squares of distances overflow float32.
FARTHEST = 1e18


def export_mesh(mesh: bpy.types.Mesh, name: str) -> core.scene.Mesh | None:
    """A mesh without UVs, or None where it has no faces. `name` is the object's, for errors.

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
    corner_vertices = _read(mesh.attributes[".corner_vert"].data, "value", len(mesh.loops), np.int32)
    triangles = corner_vertices[corners]
    location, size = tuple(mesh.texspace_location), tuple(mesh.texspace_size)
    return core.scene.Mesh(
        name=mesh.name,
        vertices=vertices,
        triangles=triangles,
        corner_normals=_corner_normals(mesh, corners, triangles),
        material_slots=_material_slots(mesh),
        texture_space=(location, size),
    )


def read_uvs(mesh: bpy.types.Mesh, uv_map: str) -> np.ndarray:
    """(T, 3, 2) of the UV map of that name, or of the one that is active for renders; zeros where there is none."""
    corners = triangle_corners(mesh)
    chosen = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    layer = mesh.uv_layers.get(uv_map) if uv_map else chosen
    if layer is None:
        return np.zeros((len(corners), 3, 2), dtype=np.float32)
    return _read(layer.uv, "vector", (len(mesh.loops), 2), np.float32)[corners]


def triangle_corners(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T, 3) int32: the mesh's corners that make each triangle, or None without triangles."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return None
    # The table is plain int[count][3] in every version from 4.2 on.
    table = (ctypes.c_int32 * (3 * count)).from_address(mesh.loop_triangles[0].as_pointer())
    return np.array(table, dtype=np.int32).reshape(count, 3)


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
    faces = _read(mesh.loop_triangle_polygons, "value", len(mesh.loop_triangles), np.int32)
    return np.maximum(of_face[faces], 0)


def _read(collection, name: str, shape: int | tuple[int, ...], dtype: type) -> np.ndarray:
    values = np.empty(shape, dtype=dtype)
    collection.foreach_get(name, values.reshape(-1))
    return values
