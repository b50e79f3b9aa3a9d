"""The arrays of Blender's evaluated meshes.

Reading a million triangles through `foreach_get` of their structs takes a tenth of a second and more; through the
attributes' arrays, and the address of the triangles' table, a few milliseconds.
"""

from __future__ import annotations

import ctypes

import bpy
import numpy as np


def read(collection, name: str, shape: int | tuple[int, ...], dtype: type) -> np.ndarray:
    """The field `name` of everything in a collection of Blender's."""
    values = np.empty(shape, dtype=dtype)
    collection.foreach_get(name, values.reshape(-1))
    return values


def triangle_corners(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T, 3) int32: the mesh's corners that make each triangle, or None without triangles."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return None
    # The table is plain int[count][3] in every version from 4.2 on.
    table = (ctypes.c_int32 * (3 * count)).from_address(mesh.loop_triangles[0].as_pointer())
    return np.array(table, dtype=np.int32).reshape(count, 3)


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(corners,) int32: the vertex of each corner."""
    return read(mesh.attributes[".corner_vert"].data, "value", len(mesh.loops), np.int32)


def triangle_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T,) int32: the face of each triangle."""
    return read(mesh.loop_triangle_polygons, "value", len(mesh.loop_triangles), np.int32)


def smooth_normals(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T, 3, 3) float32, a normal for each corner, or None for a mesh that is flat throughout."""
    if mesh.normals_domain == "FACE":
        return None
    corners = triangle_corners(mesh)
    if mesh.normals_domain == "POINT":
        of_vertex = read(mesh.vertex_normals, "vector", (len(mesh.vertices), 3), np.float32)
        return of_vertex[corner_vertices(mesh)[corners]]
    return read(mesh.corner_normals, "vector", (len(mesh.loops), 3), np.float32)[corners]


def corner_normals(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T, 3, 3) float32, a normal for each corner of smooth and of flat meshes."""
    normals = smooth_normals(mesh)
    if normals is None:
        of_face = read(mesh.polygon_normals, "vector", (len(mesh.polygons), 3), np.float32)
        normals = np.repeat(of_face[triangle_faces(mesh), None], 3, axis=1)
    return normals
