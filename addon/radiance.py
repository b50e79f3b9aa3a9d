"""Shader nodes of which nothing counts but the light that they send out: those of a world and of a lamp."""

from __future__ import annotations

from ._core import core
from .arithmetic import product
from .losses import Losses
from .nodes import Color, Source, trace
from .values import Value, ValueReader

BLACK: Color = (0.0, 0.0, 0.0)


class RadianceReader:
    """Reads shaders as the radiance that they emit, which `values` are the parts of."""

    def __init__(self, values: ValueReader, losses: Losses) -> None:
        self._values = values
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
