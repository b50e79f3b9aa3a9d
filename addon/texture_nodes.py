"""Textures, and the coordinates that they look up: images, panoramas, checks, ramps, skies, mappings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from mathutils import Euler

from . import versions
from ._core import core
from .arithmetic import affine
from .images import MISSING
from .nodes import Color, Source

if TYPE_CHECKING:
    from .values import ValueReader

values = core.values
Value = core.values.Value

EXTENSIONS = {"REPEAT": "repeat", "MIRROR": "mirror", "EXTEND": "extend", "CLIP": "clip"}
AXES = ("X", "Y", "Z")
#: The pixels of an image that is 1 everywhere.
WHITE = np.ones((1, 1, 3), np.float32)
#: Entries of a color ramp's table, as in Cycles.
RAMP_SIZE = 256

#: Stands for a Sky Texture, which only Blender's own engines can compute: the mean over all directions of the sky, less
#: its sun, of a new node in Blender 4.5, in W/(m² sr).
EVEN_SKY: Color = (2.11, 2.08, 2.00)


def read_image(reader: ValueReader, source: Source) -> Value:
    """Image Texture: its Color, or its Alpha."""
    node = source.node
    image, user = node.image, node.image_user
    if node.projection != "FLAT":
        problem = rpt_("its {kind} projection is rendered as flat").format(kind=node.projection.lower())
        reader.losses.add_for(node, problem)
    _check_image(reader, node)
    vector = _coordinates(reader, source, lambda: reader.uv(node))
    is_tile = image is not None and image.source == "TILED"
    if is_tile:
        into_tile, around_tile = tile_matrices(image.tiles[0].number)
        inside = values.ImageTexture(WHITE, "clip", "closest", affine(vector, around_tile))
        vector = affine(vector, into_tile)
    look = {"extension": EXTENSIONS[node.extension], "interpolation": _interpolation(reader, node), "vector": vector}
    if source.output.identifier == "Alpha":
        opacity = reader.images.opacity(image, user)
        if opacity is None and node.extension != "CLIP":
            return 1.0
        shown, missing = values.ImageTexture(WHITE if opacity is None else opacity, **look), 1.0
    else:
        colors = reader.images.colors(image, user, straight=reader.is_used(source, "Alpha"))
        shown, missing = values.ImageTexture(colors, **look), MISSING
    return values.Mix(inside, missing, shown) if is_tile else shown


def read_panorama(reader: ValueReader, source: Source) -> Value:
    """Environment Texture."""
    node = source.node
    if node.projection != "EQUIRECTANGULAR":
        reader.losses.add_for(node, rpt_("its mirror ball is rendered as an equirectangular panorama"))
    _check_image(reader, node)
    # Without a vector it is looked up by the direction in the world, or by the position on a surface.
    direction = _coordinates(reader, source, lambda: reader.generated() if reader.of_world else values.WORLD)
    return values.EnvironmentTexture(
        reader.images.colors(node.image, node.image_user), _interpolation(reader, node), direction
    )


def read_sky(reader: ValueReader, source: Source) -> Value:
    """Sky Texture, which cannot be evaluated outside of Blender's own engines."""
    problem = rpt_(
        "Rooks cannot evaluate a Sky Texture, and shows an even, sunless sky: "
        "bake it to an image (render it with Cycles through a panoramic camera) and use an Environment Texture, "
        "with a Sun lamp for the sun"
    )
    reader.losses.add_for(source.node, problem)
    return EVEN_SKY


def read_checker(reader: ValueReader, source: Source) -> Value:
    """Checker Texture: its Color, or as its Fac 1 for the first colour."""
    vector = _coordinates(reader, source, reader.generated)
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
    location, rotation, scale = (reader.constant(source, name) for name in ("Location", "Rotation", "Scale"))
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
    """What a texture looks up: its Vector, or `default` where no node makes one, after its Texture Mapping.

    Where its Vector is a group's input, and nothing is linked to that, it depends on Blender whether its value counts.
    """

    def read() -> Value:
        feed = source.input("Vector")
        is_linked = not feed.is_constant or versions.is_looked_up(feed.socket, source.node)
        return _mapped(source.node.texture_mapping, reader.value(feed) if is_linked else default())

    return reader.once(source, "coordinates", read)


def tile_matrices(number: int) -> tuple[np.ndarray, np.ndarray]:
    """The (3, 4) matrices that move a tile (UDIM: numbers from 1001 on, ten in each row of v) to 0 … 1.

    The second does so with all that the tile is seen at: Cycles rounds towards 0, so that the tiles of the first row
    and column go on to -1.
    """
    row, column = divmod(number - 1001, 10)
    place = np.array([column, row, 0.0])
    is_first = np.array([column == 0, row == 0, False])
    around = np.column_stack([np.diag(np.where(is_first, 0.5, 1.0)), np.where(is_first, 0.5, -place)])
    return np.column_stack([np.eye(3), -place]), around


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


def _interpolation(reader: ValueReader, node: bpy.types.Node) -> str:
    if node.interpolation in ("Cubic", "Smart"):
        problem = rpt_("its {kind} interpolation is rendered as linear").format(kind=node.interpolation.lower())
        reader.losses.add_for(node, problem)
    return "closest" if node.interpolation == "Closest" else "linear"


def _check_image(reader: ValueReader, node: bpy.types.Node) -> None:
    problem = reader.images.problem_of(node.image, node.image_user)
    if problem is not None:
        reader.losses.add_for(node, problem)


READERS = {
    "TEX_IMAGE": read_image,
    "TEX_ENVIRONMENT": read_panorama,
    "TEX_SKY": read_sky,
    "TEX_CHECKER": read_checker,
    "VALTORGB": read_color_ramp,
    "MAPPING": read_mapping,
}
