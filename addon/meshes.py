"""Blender's evaluated meshes as the renderer's `Mesh`.

What no one asks for is not read: normals of a mesh that is flat, UVs without a texture, slots where there is one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core
from .attributes import find_attribute, is_known, read_attribute
from .mesh_arrays import corner_normals, corner_vertices, read, smooth_normals, triangle_corners, triangle_faces
from .tangents import corner_tangents

#: Farther out than this, in metres, squares of distances overflow float32.
FARTHEST = 1e18


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
    vertices = read(mesh.attributes["position"].data, "vector", (len(mesh.vertices), 3), np.float32)
    # Of NaN every comparison is False.
    wrong = len(vertices) - int((np.abs(vertices) < FARTHEST).all(axis=1).sum())
    if wrong:
        text = rpt_(
            'object "{name}": {wrong} of its {count} vertices are nowhere (NaN or infinity): '
            "mend the mesh or the modifier that makes them, or hide the object from renders"
        )
        raise core.errors.SceneError(text.format(name=name, wrong=wrong, count=len(vertices)))
    triangles = corner_vertices(mesh)[corners]
    location, size = tuple(mesh.texspace_location), tuple(mesh.texspace_size)
    return core.scene.Mesh(
        name=mesh.name,
        vertices=vertices,
        triangles=triangles,
        corner_normals=smooth_normals(mesh),
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
        tangents = _tangents(exported, mesh, needs.tangents)
    return replace(exported, uvs=uvs, tangents=tangents, attributes=attributes)


def warnings_of(mesh: bpy.types.Mesh, needs: Needs) -> list[str]:
    """What of its materials' needs a mesh cannot fulfil as in Blender."""
    warnings = _tangent_warnings(mesh, needs.tangents)
    for name in sorted(needs.attributes):
        attribute = find_attribute(mesh, name)
        if attribute is not None and not is_known(attribute):
            kind, domain = (word.lower().replace("_", " ") for word in (attribute.data_type, attribute.domain))
            text = rpt_('Rooks does not read its attribute "{name}" ({kind} on {domain})')
            warnings.append(_warning(mesh, text.format(name=attribute.name, kind=kind, domain=domain)))
    return warnings


def lost_numbers(mesh: bpy.types.Mesh, exported: core.scene.Mesh, needs: Needs) -> list[str]:
    """Warnings of corners whose texture coordinates or attributes are no numbers: those are taken for 0."""
    warnings = []
    for uvs in (exported.uvs, _uvs_of_tangents(mesh, needs.tangents)):
        if (wrong := _count_wrong(uvs)) > 0:
            text = rpt_("{count} of its texture coordinates are NaN or infinite, and taken for 0: unwrap it again")
            warnings.append(_warning(mesh, text.format(count=wrong)))
    for name, values in exported.attributes.items():
        attribute = find_attribute(mesh, name)
        if attribute is not None and (wrong := _count_wrong(values)) > 0:
            text = rpt_('{count} values of its attribute "{name}" are NaN or infinite, and taken for 0')
            warnings.append(_warning(mesh, text.format(count=wrong, name=attribute.name)))
    return warnings


def _count_wrong(values: np.ndarray | None) -> int:
    """Of how many corners, (T, 3, n), a number is none."""
    return 0 if values is None else int((~np.isfinite(values)).any(axis=2).sum())


def lost_normals(mesh: bpy.types.Mesh, exported: core.scene.Mesh) -> list[str]:
    """A warning of corner normals without a direction, of triangles that can be seen: the renderer takes the others,
    or the triangle's own.
    """
    if exported.corner_normals is None:
        return []
    squares = np.einsum("tci,tci->tc", exported.corner_normals, exported.corner_normals)
    lost = ~((squares > 0.0) & (squares < np.inf))  # of NaN every comparison is False
    concerned = lost.any(axis=1)
    a, b, c = exported.vertices[exported.triangles[concerned]].transpose(1, 0, 2)
    count = int(lost[concerned][np.cross(b - a, c - a).any(axis=1)].sum())
    if count == 0:
        return []
    text = rpt_(
        "{count} of its normals are 0, NaN or infinite, and left out: recalculate them, or clear its custom normals"
    )
    return [_warning(mesh, text.format(count=count))]


def _warning(mesh: bpy.types.Mesh, problem: str) -> str:
    return rpt_('mesh "{name}": {problem}').format(name=mesh.name, problem=problem)


def any_is_deformed() -> bool:
    """Whether Generated coordinates of a mesh of the file may be other than those of its evaluated vertices."""
    return any(len(obj.modifiers) or getattr(obj.data, "shape_keys", None) for obj in bpy.data.objects)


def read_uvs(mesh: bpy.types.Mesh) -> np.ndarray:
    """(T, 3, 2) of the UV map that is active for renders; zeros where there is none."""
    corners = triangle_corners(mesh)
    layer = _uv_layer(mesh, "")
    if layer is None:
        return np.zeros((len(corners), 3, 2), dtype=np.float32)
    return read(layer.uv, "vector", (len(mesh.loops), 2), np.float32)[corners]


def _material_slots(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T,) int32, or None where all faces use the first slot."""
    attribute = mesh.attributes.get("material_index")
    if attribute is None or len(attribute.data) == 0:
        return None
    of_face = read(attribute.data, "value", len(mesh.polygons), np.int32)
    if not of_face.any():
        return None
    return np.maximum(of_face[triangle_faces(mesh)], 0)


def _tangents(exported: core.scene.Mesh, mesh: bpy.types.Mesh, uv_maps: frozenset[str]) -> np.ndarray | None:
    """(T, 3, 4) by the first of these UV maps that the mesh has.

    Without any they are the normals, which a normal map leaves as they are then (unless it leans by more than 45°); and
    None, for which the renderer has a direction of its own, where the active one is asked for.
    """
    uvs = _uvs_of_tangents(mesh, uv_maps)
    if uvs is None:
        return None if "" in uv_maps else np.pad(corner_normals(mesh), ((0, 0), (0, 0), (0, 1)))
    uvs = np.where(np.isfinite(uvs), uvs, np.float32(0))
    return corner_tangents(exported.vertices[exported.triangles], corner_normals(mesh), uvs)


def _uvs_of_tangents(mesh: bpy.types.Mesh, uv_maps: frozenset[str]) -> np.ndarray | None:
    """(T, 3, 2) of the first of these UV maps that the mesh has."""
    layer = next((layer for name in sorted(uv_maps) if (layer := _uv_layer(mesh, name)) is not None), None)
    if layer is None:
        return None
    return read(layer.uv, "vector", (len(mesh.loops), 2), np.float32)[triangle_corners(mesh)]


def _tangent_warnings(mesh: bpy.types.Mesh, uv_maps: frozenset[str]) -> list[str]:
    layers = {name: _uv_layer(mesh, name) for name in sorted(uv_maps)}
    found = {layer.name for layer in layers.values() if layer is not None}
    warnings = []
    if len(found) > 1:
        warnings.append(_warning(mesh, rpt_("its normal maps use several UV maps, and get one")))
    for name in (name for name, layer in layers.items() if layer is None):
        if not name:
            problem = rpt_("it has no UV map for its normal map, which is turned as if u grew along the world's X")
        elif found:
            problem = rpt_('it has no UV map "{name}" for a normal map, which gets another one')
        else:
            problem = rpt_('it has no UV map "{name}" for its normal map, which is left out')
        warnings.append(_warning(mesh, problem.format(name=name)))
    return warnings


def _uv_layer(mesh: bpy.types.Mesh, name: str) -> bpy.types.MeshUVLoopLayer | None:
    """The UV map of a name, or the one that is active for renders for ""."""
    if name:
        return mesh.uv_layers.get(name)
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)
