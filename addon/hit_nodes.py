"""Nodes that read from where a ray hit: coordinates, attributes, normals, and how they lie to the viewer."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from . import attributes, versions
from ._core import core
from .arithmetic import affine
from .nodes import Source

if TYPE_CHECKING:
    from .values import ValueReader

values = core.values
Value = core.values.Value

#: What stands for the outputs of a Geometry node that are not known: what they are seen from the front, or on average.
UNKNOWN_GEOMETRY = {"Backfacing": 0.0, "Pointiness": 0.5, "Random Per Island": 0.5}


def read_coordinates(reader: ValueReader, source: Source) -> Value:
    """Texture Coordinate."""
    node = source.node
    _warn_of_instancer(reader, node)
    if source.output.identifier == "UV":
        return reader.uv(node)
    if source.output.identifier == "Object":
        return _object_coordinates(reader, node.object)
    if source.output.identifier == "Normal" and not reader.of_world:
        return values.Normalized(reader.attribute(attributes.NORMAL))
    if source.output.identifier != "Generated":
        reader.losses.replace_output(source, "Generated")
    return reader.generated()


def read_uv_map(reader: ValueReader, source: Source) -> Value:
    """UV Map: a map that is named is an attribute of the mesh like others."""
    node = source.node
    _warn_of_instancer(reader, node)
    return reader.attribute(node.uv_map) if node.uv_map else reader.uv(node)


def read_geometry(reader: ValueReader, source: Source) -> Value:
    """Geometry: its Position and its Normal."""
    output = source.output.identifier
    if output == "Position":
        return values.WORLD
    if output in ("Normal", "True Normal", "Incoming"):
        if output != "Normal":
            reader.losses.replace_output(source, "Normal")
        # A normal map of no strength is the surface's own normal.
        return values.NormalMap((0.5, 0.5, 1.0), 0.0, "world")
    constant = UNKNOWN_GEOMETRY.get(output, 0.0)
    reader.losses.replace_output(source, f"{constant:g}")
    return constant


def read_attribute(reader: ValueReader, source: Source) -> Value:
    """Attribute of the mesh: its Color, Vector, Fac or Alpha."""
    node = source.node
    if node.attribute_type != "GEOMETRY":
        kind = node.attribute_type.lower().replace("_", " ")
        problem = rpt_("attributes of the {kind} are not read, and taken for 0").format(kind=kind)
        reader.losses.add_for(node, problem)
        return 0.0
    return _attribute_output(reader, source, node.attribute_name) if node.attribute_name else 0.0


def read_color_attribute(reader: ValueReader, source: Source) -> Value:
    """Color Attribute; without a name, the one that is active for renders."""
    return _attribute_output(reader, source, source.node.layer_name)


def read_normal_map(reader: ValueReader, source: Source) -> Value:
    node = source.node
    color, space = reader.input(source, "Color"), node.space.lower()
    if space == "tangent":
        reader.needs = replace(reader.needs, tangents=reader.needs.tangents | {node.uv_map})
    if space.startswith("blender_"):  # Blender's old game engine had y and z the other way round
        color, space = _flipped(color, "yz"), space.removeprefix("blender_")
    if versions.normal_map_points_down(node):
        color = _flipped(color, "y")
    return values.NormalMap(color, reader.input(source, "Strength"), space)


def read_bump(reader: ValueReader, source: Source) -> Value:
    """Bump. Its Filter Width, the pixels between the heights that are compared, is the renderer's own."""
    strength, distance = reader.input(source, "Strength"), reader.input(source, "Distance")
    height, normal = reader.input(source, "Height"), reader.normal(source)
    return values.Bump(height, strength, distance, source.node.invert, normal)


def read_fresnel(reader: ValueReader, source: Source) -> Value:
    index = reader.limited(source, "IOR", core.limits.LEAST_INDEX, core.limits.LARGEST_INDEX)
    return values.Fresnel(index, reader.normal(source))


def read_layer_weight(reader: ValueReader, source: Source) -> Value:
    kind = source.output.identifier.lower()
    return values.LayerWeight(reader.input(source, "Blend"), kind, reader.normal(source))


def read_light_path(reader: ValueReader, source: Source) -> Value:
    """Light Path, which is not known: 0 chooses what Blender would show to most rays."""
    reader.losses.replace_output(source, "0")
    return 0.0


def _warn_of_instancer(reader: ValueReader, node: bpy.types.Node) -> None:
    if node.from_instancer:
        reader.losses.add_for(node, rpt_("the coordinates are the object's own, not its instancer's"))


def _object_coordinates(reader: ValueReader, other: bpy.types.Object | None) -> Value:
    """The space of the object that is hit, or that of another one."""
    if other is None:
        return values.OBJECT
    matrix = np.array(other.matrix_world, np.float64)
    if not np.isfinite(matrix).all() or np.linalg.det(matrix) == 0.0:
        text = rpt_('object "{name}", of which coordinates are used, has no size or no place')
        reader.losses.add(text.format(name=other.name))
        return values.OBJECT
    # For the world, coordinates are the direction: as if all that is seen were one metre from the origin.
    return affine(values.OBJECT if reader.of_world else values.WORLD, np.linalg.inv(matrix)[:3])


def _attribute_output(reader: ValueReader, source: Source, name: str) -> Value:
    before = {"Fac": attributes.FACTOR, "Alpha": attributes.OPACITY}.get(source.output.identifier, "")
    return reader.once(source, f"attribute_{before}", lambda: reader.attribute(before + name))


def _flipped(color: Value, axes: str) -> Value:
    """A normal map's colour with the direction of some axes turned round."""
    parts = [values.Component(color, index) for index in range(3)]
    turned = [values.Math("subtract", 1.0, part) for part in parts]
    return values.Combine(*(turned[i] if axis in axes else parts[i] for i, axis in enumerate("xyz")))


READERS = {
    "TEX_COORD": read_coordinates,
    "UVMAP": read_uv_map,
    "NEW_GEOMETRY": read_geometry,
    "ATTRIBUTE": read_attribute,
    "VERTEX_COLOR": read_color_attribute,
    "NORMAL_MAP": read_normal_map,
    "BUMP": read_bump,
    "FRESNEL": read_fresnel,
    "LAYER_WEIGHT": read_layer_weight,
    "LIGHT_PATH": read_light_path,
}
