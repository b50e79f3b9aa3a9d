"""Node trees that compute colours, numbers and vectors as the renderer's values (`core.values`).

`ValueReader` follows the links and converts between kinds of socket as Blender does. What each kind of node computes
stands in `texture_nodes`, `math_nodes` and `hit_nodes`. A node that feeds several sockets becomes one object.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace

import bpy
import numpy as np

from . import hit_nodes, math_nodes, texture_nodes
from ._core import core
from .arithmetic import converted
from .images import Images
from .losses import Losses
from .meshes import Needs
from .nodes import Source, socket_value, trace

core_values = core.values
Value = core.values.Value
Expression = core.values.Expression

#: What stands for a number or colour of which nothing is known.
GREY = 0.5

#: What computes the outputs of a node, by its type. They get the reader and the output as a source.
READERS: dict[str, Callable[[ValueReader, Source], Value]] = {
    **texture_nodes.READERS,
    **math_nodes.READERS,
    **hit_nodes.READERS,
}
#: The same for the world, which has no surface.
WORLD_READERS = {
    **texture_nodes.READERS,
    **math_nodes.READERS,
    "TEX_COORD": hit_nodes.read_coordinates,
    "LIGHT_PATH": hit_nodes.read_light_path,
}


class ValueReader:
    """Reads the values of one material's or world's tree.

    `losses` gets what is not known; `needs` is what the values look up on the mesh.
    """

    def __init__(self, images: Images, losses: Losses, of_world: bool = False) -> None:
        self.images = images
        self.losses = losses
        self.of_world = of_world
        self.needs = Needs()
        self._readers = WORLD_READERS if of_world else READERS
        self._known: dict[Hashable, Value] = {}

    def input(self, source: Source, identifier: str, default: Value = 0.0) -> Value:
        """The value of an input of a source's node; `default` where this version of Blender has no such input."""
        feed = source.input(identifier)
        return default if feed is None else self.value(feed)

    def value(self, source: Source) -> Value:
        """What arrives at a socket."""
        value = socket_value(source.socket) if source.is_constant else self._output(source)
        for start, end in zip(source.types, source.types[1:], strict=False):
            value = converted(value, start, end)
        return value

    def uv(self, node: bpy.types.Node) -> Value:
        """The UV map that is active for renders, for a node that asks for it."""
        if self.of_world:
            self.losses.replace(node)
            return core_values.GENERATED
        self.needs = replace(self.needs, uvs=True)
        return core_values.UV

    def normal(self, source: Source, identifier: str = "Normal") -> Expression | None:
        """What is linked to a Normal, of length 1; None for the surface's own."""
        feed = source.input(identifier)
        if feed is None or (feed.is_constant and not np.any(socket_value(feed.socket))):
            return None
        if not feed.is_constant and feed.node.type not in self._readers:
            self.losses.replace(feed.node)
            return None
        value = self.value(feed)
        is_normal = isinstance(value, core_values.NormalMap | core_values.Bump | core_values.Normalized)
        return value if is_normal else core_values.Normalized(value)

    def once(self, source: Source, what: str, make: Callable[[], Value]) -> Value:
        """What `make` returns, made once for this node in these groups."""
        key = (tuple(group.as_pointer() for group in source.groups), source.node.as_pointer(), what)
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    def _output(self, source: Source) -> Value:
        read = self._readers.get(source.node.type, type(self)._unknown)
        return self.once(source, source.output.identifier, lambda: read(self, source))

    def _unknown(self, source: Source) -> Value:
        """The first linked input of the same kind, else the node's own colour."""
        self.losses.replace(source.node)
        kind = "VECTOR" if source.output.type == "VECTOR" else "RGBA"
        inputs = [trace(s, source.groups) for s in source.node.inputs if s.type == kind and s.enabled]
        if (linked := next((feed for feed in inputs if not feed.is_constant), None)) is not None:
            return self.value(linked)
        if kind == "VECTOR":
            return core_values.GENERATED
        return self.value(inputs[0]) if inputs else GREY
