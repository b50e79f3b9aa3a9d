"""The world's background: one colour from all directions. Anything else becomes the nearest colour and a warning."""

from __future__ import annotations

import bpy

from . import images, versions
from .nodes import Color, Source, constant_color, constant_number, find_input, label, surface_of

BLACK: Color = (0.0, 0.0, 0.0)


def export_world(depsgraph: bpy.types.Depsgraph) -> tuple[Color, list[str]]:
    """The radiance of the background, in W/(m² sr), and warnings about what was left out."""
    world = versions.world_of(depsgraph)
    if world is None:
        return BLACK, []
    if not versions.uses_nodes(world):
        return tuple(world.color), []
    source = surface_of(world.node_tree)
    if source is None:
        return BLACK, []
    if source.node.type not in ("BACKGROUND", "EMISSION"):
        return _fallback(source), [_warning(world, [label(source.node)])]

    unknown: list[str] = []
    color = _color(source.input("Color"), find_input(source.node, "Color"), unknown)
    strength = constant_number(source.input("Strength"))
    if strength is None:
        unknown.append(label(source.input("Strength").node))
        strength = find_input(source.node, "Strength").default_value
    return tuple(channel * strength for channel in color), [_warning(world, unknown)] if unknown else []


def _color(source: Source, socket: bpy.types.NodeSocket, unknown: list[str]) -> Color:
    color = constant_color(source)
    if color is not None:
        return color
    unknown.append(label(source.node))
    if source.node.type == "TEX_ENVIRONMENT" and source.node.image is not None:
        pixels, _problem = images.read_image(source.node.image)
        return images.mean_of_panorama(pixels)
    return tuple(socket.default_value)[:3]


def _fallback(source: Source) -> Color:
    """The first constant colour among the inputs of a node that is not known, else black."""
    colors = (socket.default_value for socket in source.node.inputs if socket.type == "RGBA")
    return tuple(next(colors, BLACK))[:3]


def _warning(world: bpy.types.World, nodes: list[str]) -> str:
    names = ", ".join(f'"{name}"' for name in nodes)
    return f'world "{world.name}": Rooks renders a background of one colour, and replaced {names} by its nearest colour'
