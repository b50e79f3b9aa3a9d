"""Attributes of Blender's meshes as the renderer's: three numbers for each corner of each triangle.

Some are made from what a mesh has. Their names begin with a dot, as those of attributes that Blender hides.
"""

from __future__ import annotations

import bpy
import numpy as np

from .mesh_arrays import corner_normals, corner_vertices, read, triangle_corners, triangle_faces

#: Kinds of attribute: the field of Blender's that holds the value, how many numbers it has, and of which type. Colours
#: stored as bytes are made linear by Blender.
FIELDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}

#: Generated coordinates as they were before shape keys and modifiers moved the mesh.
GENERATED = ".generated"
#: Shading normals in the mesh's own space.
NORMAL = ".normal"
#: Before an attribute's name: the number that it is as a factor, and its opacity.
FACTOR, OPACITY = ".factor of ", ".opacity of "


def read_attribute(mesh: bpy.types.Mesh, name: str) -> np.ndarray | None:
    """(T, 3, 3) float32: numbers thrice, two numbers with a 0, colours without their opacity. None: it has none."""
    if name == GENERATED:
        return _generated(mesh)
    if name == NORMAL:
        return corner_normals(mesh)
    attribute = find_attribute(mesh, name)
    if attribute is None or not is_known(attribute):
        return None
    field, width, dtype = FIELDS[attribute.data_type]
    stored = read(attribute.data, field, (len(attribute.data), width), dtype).astype(np.float32, copy=False)
    if name.startswith(FACTOR):
        stored = stored[:, :3].mean(axis=1, keepdims=True) if width > 2 else stored[:, :1]
    elif name.startswith(OPACITY):
        stored = stored[:, 3:] if width == 4 else np.ones((len(stored), 1), np.float32)
    return _on_corners(mesh, attribute.domain, _three(stored))


def find_attribute(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    """The attribute that `name` is read from; for "" the colour that is active for renders."""
    name = name.removeprefix(FACTOR).removeprefix(OPACITY)
    if name:
        return mesh.attributes.get(name)
    index = mesh.color_attributes.render_color_index
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None


def is_known(attribute: bpy.types.Attribute) -> bool:
    return attribute.data_type in FIELDS and attribute.domain in ("CORNER", "POINT", "FACE")


def _three(stored: np.ndarray) -> np.ndarray:
    """(n, 3) of n times one to four numbers."""
    if stored.shape[1] == 1:
        return np.repeat(stored, 3, axis=1)
    return np.pad(stored, ((0, 0), (0, 1))) if stored.shape[1] == 2 else stored[:, :3]


def _on_corners(mesh: bpy.types.Mesh, domain: str, values: np.ndarray) -> np.ndarray:
    """(T, 3, 3) of values that stand on corners, vertices or faces."""
    corners = triangle_corners(mesh)
    if domain == "CORNER":
        return values[corners]
    if domain == "POINT":
        return values[corner_vertices(mesh)[corners]]
    return np.repeat(values[triangle_faces(mesh), None], 3, axis=1)


def _generated(mesh: bpy.types.Mesh) -> np.ndarray:
    # Blender keeps them for renders, not for its window, where these are the vertices as they are.
    undeformed = read(mesh.vertices, "undeformed_co", (len(mesh.vertices), 3), np.float32)
    location, size = (np.array(part, np.float32) for part in (mesh.texspace_location, mesh.texspace_size))
    return _on_corners(mesh, "POINT", (undeformed - location) / (2 * size) + np.float32(0.5))
