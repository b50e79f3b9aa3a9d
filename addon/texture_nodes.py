"""Textures, and the coordinates that they look up: images, panoramas, checks, ramps, skies, mappings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Euler

from ._core import core
from .arithmetic import affine, constant_of
from .images import problem_of
from .nodes import Color, Source, find_input, label, socket_value

if TYPE_CHECKING:
    from .values import ValueReader

values = core.values
Value = core.values.Value

EXTENSIONS = {"REPEAT": "repeat", "MIRROR": "mirror", "EXTEND": "extend", "CLIP": "clip"}
AXES = ("X", "Y", "Z")
#: Entries of a color ramp's table, as in Cycles.
RAMP_SIZE = 256

#: Stands for a Sky Texture, which only Blender's own engines can compute: the mean over all directions of the sky, less
#: its sun, of a new node in Blender 4.5, in W/(m² sr).
EVEN_SKY: Color = (2.11, 2.08, 2.00)


def read_image(reader: ValueReader, source: Source) -> Value:
    """Image Texture: its Color, or its Alpha."""
    node = source.node
    if node.projection != "FLAT":
        reader.losses.add(f'node "{label(node)}": its {node.projection.lower()} projection is rendered as flat')
    _check_image(reader, node)
    vector = _coordinates(reader, source, lambda: reader.uv(node))
    look = {"extension": EXTENSIONS[node.extension], "interpolation": _interpolation(reader, node), "vector": vector}
    if source.output.identifier == "Alpha":
        opacity = reader.images.opacity(node.image)
        if opacity is None and node.extension != "CLIP":
            return 1.0
        return values.ImageTexture(np.ones((1, 1, 3), np.float32) if opacity is None else opacity, **look)
    uses_alpha = any(link.is_valid and not link.is_muted for link in node.outputs["Alpha"].links)
    return values.ImageTexture(reader.images.colors(node.image, straight=uses_alpha), **look)


def read_panorama(reader: ValueReader, source: Source) -> Value:
    """Environment Texture."""
    node = source.node
    if node.projection != "EQUIRECTANGULAR":
        reader.losses.add(f'node "{label(node)}": its mirror ball is rendered as an equirectangular panorama')
    _check_image(reader, node)
    # Without a vector it is looked up by the direction in the world, or by the position on a surface.
    direction = _coordinates(reader, source, lambda: values.GENERATED if reader.of_world else values.WORLD)
    return values.EnvironmentTexture(reader.images.colors(node.image), _interpolation(reader, node), direction)


def read_sky(reader: ValueReader, source: Source) -> Value:
    """Sky Texture, which cannot be evaluated outside of Blender's own engines."""
    reader.losses.add(
        f'node "{label(source.node)}": Rooks cannot evaluate a Sky Texture, and shows an even, sunless sky: '
        "bake it to an image (render it with Cycles through a panoramic camera) and use an Environment Texture, "
        "with a Sun lamp for the sun"
    )
    return EVEN_SKY


def read_checker(reader: ValueReader, source: Source) -> Value:
    """Checker Texture: its Color, or as its Fac 1 for the first colour."""
    vector = _coordinates(reader, source, lambda: values.GENERATED)
    scale = reader.input(source, "Scale")
    if source.output.identifier == "Fac":
        return values.Checker(1.0, 0.0, scale, vector)
    return values.Checker(reader.input(source, "Color1"), reader.input(source, "Color2"), scale, vector)


def read_color_ramp(reader: ValueReader, source: Source) -> Value:
    """Color Ramp: its Color, or its Alpha."""
    ramp = source.node.color_ramp
    entries = np.array([ramp.evaluate(place) for place in np.linspace(0, 1, RAMP_SIZE)], np.float32)
    table = np.repeat(entries[:, 3:], 3, axis=1) if source.output.identifier == "Alpha" else entries[:, :3]
    return values.ColorRamp(reader.input(source, "Fac"), table, smooth=ramp.interpolation != "CONSTANT")


def read_mapping(reader: ValueReader, source: Source) -> Value:
    """Mapping. Its location, rotation and scale have to be constant."""
    node = source.node
    location, rotation, scale = (_constant_input(reader, source, name) for name in ("Location", "Rotation", "Scale"))
    mapped = affine(reader.input(source, "Vector"), mapping_matrix(node.vector_type, location, rotation, scale))
    return values.Normalized(mapped) if node.vector_type == "NORMAL" else mapped


def mapping_matrix(kind: str, location: Color, rotation: Color, scale: Color) -> np.ndarray:
    """The (3, 4) matrix of a mapping of one of Blender's four kinds. A division by a scale of 0 gives 0."""
    turn = np.array(Euler(rotation).to_matrix(), np.float64)
    size = np.array(scale, np.float64)
    inverse = np.divide(1.0, size, out=np.zeros(3), where=size != 0.0)
    if kind == "TEXTURE":
        linear = inverse[:, None] * turn.T
        return np.column_stack([linear, -linear @ np.array(location)])
    linear = turn * (inverse if kind == "NORMAL" else size)
    return np.column_stack([linear, location if kind == "POINT" else (0.0, 0.0, 0.0)])


def _coordinates(reader: ValueReader, source: Source, default: Callable[[], Value]) -> Value:
    """What a texture looks up: its Vector, or `default` where nothing is linked, after its Texture Mapping."""

    def read() -> Value:
        feed = source.input("Vector")
        return _mapped(source.node.texture_mapping, default() if feed.is_unlinked else reader.value(feed))

    return reader.once(source, "coordinates", read)


def _mapped(mapping: bpy.types.TexMapping, vector: Value) -> Value:
    """Coordinates after the Texture Mapping panel of the node editor's sidebar: axes exchanged, then moved."""
    exchanged = np.zeros((4, 4))
    exchanged[3, 3] = 1.0
    for row, axis in enumerate((mapping.mapping_x, mapping.mapping_y, mapping.mapping_z)):
        if axis in AXES:
            exchanged[row, AXES.index(axis)] = 1.0
    steps = tuple(mapping.translation), tuple(mapping.rotation), tuple(mapping.scale)
    moved = affine(vector, mapping_matrix(mapping.vector_type, *steps) @ exchanged)
    return values.Normalized(moved) if mapping.vector_type == "NORMAL" else moved


def _constant_input(reader: ValueReader, source: Source, identifier: str) -> Color:
    """An input that has to be the same everywhere: where it is not, the socket's own value."""
    constant = constant_of(reader.input(source, identifier))
    if constant is None:
        reader.losses.ignore(identifier, source.node)
        constant = socket_value(find_input(source.node, identifier))
    return constant


def _interpolation(reader: ValueReader, node: bpy.types.Node) -> str:
    if node.interpolation in ("Cubic", "Smart"):
        reader.losses.add(f'node "{label(node)}": its {node.interpolation.lower()} interpolation is rendered as linear')
    return "closest" if node.interpolation == "Closest" else "linear"


def _check_image(reader: ValueReader, node: bpy.types.Node) -> None:
    problem = problem_of(node.image)
    if problem is not None:
        reader.losses.add(f'node "{label(node)}": {problem}')


READERS = {
    "TEX_IMAGE": read_image,
    "TEX_ENVIRONMENT": read_panorama,
    "TEX_SKY": read_sky,
    "TEX_CHECKER": read_checker,
    "VALTORGB": read_color_ramp,
    "MAPPING": read_mapping,
}
