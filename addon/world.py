"""The world's background as a value over directions: a colour, or an environment image and what changes its colour."""

from __future__ import annotations

import bpy

from . import versions
from ._core import core
from .arithmetic import product
from .images import Images
from .losses import Losses
from .materials import warn_of_outputs
from .nodes import Color, Source, surface_of, trace
from .values import Value, ValueReader

BLACK: Color = (0.0, 0.0, 0.0)


def export_world(depsgraph: bpy.types.Depsgraph, images: Images) -> tuple[Value, list[str]]:
    """The radiance of the background, in W/(m² sr), and warnings about what was left out."""
    world = versions.world_of(depsgraph)
    if world is None:
        return BLACK, []
    if not versions.uses_nodes(world):
        return tuple(world.color), []
    losses = Losses()
    radiance = _Reader(images, losses).radiance(surface_of(world.node_tree))
    warn_of_outputs(world.node_tree, ("Volume",), losses)
    if hidden := _hidden_from(world):
        losses.add(f"Rooks shows it to all rays, also to {', '.join(hidden)} rays")
    text = losses.warning()
    return radiance, [f'world "{world.name}": {text}'] if text else []


class _Reader:
    """Reads the shaders of a world, all of which are radiances."""

    def __init__(self, images: Images, losses: Losses) -> None:
        self._values = ValueReader(images, losses, of_world=True)
        self._losses = losses

    def radiance(self, source: Source | None) -> Value:
        if source is None or source.is_constant:
            return BLACK
        if source.types[0] != "SHADER":  # a colour or a number that is linked to a shader is emitted
            return self._values.value(source)
        if source.node.type in ("BACKGROUND", "EMISSION"):
            return product(self._values.input(source, "Color"), self._values.input(source, "Strength"))
        parts = [trace(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER"]
        if source.node.type == "MIX_SHADER":
            return core.values.Mix(self._values.input(source, "Fac"), *map(self.radiance, parts))
        if source.node.type == "ADD_SHADER":
            return core.values.Mix(1.0, *map(self.radiance, parts), "add")
        self._losses.replace(source.node)
        return self._nearest(source, parts)

    def _nearest(self, source: Source, parts: list[Source]) -> Value:
        """For an unknown shader the first that it is made from, else its colour."""
        linked = next((part for part in parts if not part.is_constant), None)
        if linked is not None:
            return self.radiance(linked)
        color = next((socket for socket in source.node.inputs if socket.type == "RGBA" and socket.enabled), None)
        return BLACK if color is None else self._values.input(source, color.identifier)


def _hidden_from(world: bpy.types.World) -> list[str]:
    """The kinds of ray that Cycles does not show the world to."""
    visibility = getattr(world, "cycles_visibility", None)
    kinds = ("camera", "diffuse", "glossy", "transmission")
    return [] if visibility is None else [kind for kind in kinds if not getattr(visibility, kind)]
