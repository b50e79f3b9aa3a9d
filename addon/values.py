"""Node trees that compute colours, numbers and vectors as the renderer's values (`core.values`).

`ValueReader` follows the links and converts between kinds of socket as Blender does. What each kind of node computes
stands in `texture_nodes`, `math_nodes` and `hit_nodes`. A node that feeds several sockets becomes one object.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from . import attributes, hit_nodes, math_nodes, texture_nodes
from ._core import core
from .arithmetic import converted
from .folding import constant_of
from .images import Images
from .losses import Losses
from .meshes import Needs
from .nodes import Color, Source, find_input, reached_outputs, socket_value, trace

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
    """Reads the values of one material's, world's or lamp's tree.

    `losses` gets what is not known; `needs` is what the values look up on the mesh. Where meshes are not `is_deformed`,
    generated coordinates need not be stored with them. `of_world`: there is no surface, but a direction.
    """

    def __init__(self, images: Images, losses: Losses, of_world: bool = False, is_deformed: bool = False) -> None:
        self.images = images
        self.losses = losses
        self.of_world = of_world
        self.needs = Needs()
        self._is_deformed = is_deformed
        self._readers = WORLD_READERS if of_world else READERS
        self._known: dict[Hashable, Value] = {}
        self._reached: set[Hashable] | None = None

    def input(self, source: Source, identifier: str, default: Value = 0.0) -> Value:
        """The value of an input of a source's node; `default` where this version of Blender has no such input."""
        feed = source.input(identifier)
        return default if feed is None else self.value(feed)

    def limited(self, source: Source, identifier: str, least: float, largest: float) -> Value:
        """An input that the renderer takes for the nearest number from `least` to `largest`; told of a constant."""
        value = self.input(source, identifier)
        constant = constant_of(value)
        if constant is not None:
            given = np.float32(constant[0])  # as Blender has it, which a limit may be rounded from
            nearest = min(max(given, np.float32(least)), np.float32(largest))
            if nearest != given and not np.isnan(given):  # samples of what is no number are dropped, and counted
                problem = rpt_("its {input} of {value:g} is taken for {nearest:g}")
                name = find_input(source.node, identifier).name
                self.losses.add_for(source.node, problem.format(input=name, value=given, nearest=nearest))
        return value

    def constant(self, source: Source, identifier: str) -> Color:
        """An input that has to be the same everywhere: where it is not, the socket's own value."""
        constant = constant_of(self.input(source, identifier))
        if constant is None:
            self.losses.ignore(identifier, source.node)
            constant = constant_of(socket_value(find_input(source.node, identifier)))
        return constant

    def value(self, source: Source) -> Value:
        """What arrives at a socket."""
        value = socket_value(source.socket) if source.is_constant else self._output(source)
        for start, end in zip(source.types, source.types[1:], strict=False):
            value = converted(value, start, end)
        return value

    def uv(self, node: bpy.types.Node) -> Value:
        """The UV map that is active for renders, for a node that asks for it."""
        if self.of_world:
            self.losses.add_for(node, rpt_("there is no UV map, and its coordinates are the direction"))
            return core_values.GENERATED
        self.needs = replace(self.needs, uvs=True)
        return core_values.UV

    def generated(self) -> Value:
        """Generated coordinates: for the world the direction."""
        return self.attribute(attributes.GENERATED) if self._is_deformed else core_values.GENERATED

    def attribute(self, name: str) -> Value:
        self.needs = replace(self.needs, attributes=self.needs.attributes | {name})
        return core_values.Attribute(name)

    def normal(self, source: Source, identifier: str = "Normal") -> Expression | None:
        """What is linked to a Normal, of length 1; None for the surface's own."""
        feed = source.input(identifier)
        if feed is None or feed.is_constant:
            return None
        if feed.node.type not in self._readers:
            self.losses.replace(feed.node)
            return None
        value = self.value(feed)
        is_normal = isinstance(value, core_values.NormalMap | core_values.Bump | core_values.Normalized)
        return value if is_normal else core_values.Normalized(value)

    def once(self, source: Source, what: str, make: Callable[[], Value]) -> Value:
        """What `make` returns, made once for this node in these groups."""
        key = (*source.key[:-1], what)
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    def _output(self, source: Source) -> Value:
        read = self._readers.get(source.node.type, type(self)._unknown)
        return self.once(source, source.output.identifier, lambda: read(self, source))

    def is_used(self, source: Source, identifier: str) -> bool:
        """Whether anything that is rendered depends on another output of a source's node."""
        if self._reached is None:
            outermost = source.groups[0] if source.groups else source.node
            self._reached = reached_outputs(outermost.id_data)
        return (*source.key[:-1], identifier) in self._reached

    def _unknown(self, source: Source) -> Value:
        """The first linked input of the same kind (for a number also a colour), else grey or coordinates."""
        self.losses.replace(source.node)
        kind = source.output.type
        of_kind = {"VALUE": ("VALUE", "RGBA"), "VECTOR": ("VECTOR",)}.get(kind, ("RGBA",))
        inputs = [trace(s, source.groups) for s in source.node.inputs if s.type in of_kind and s.enabled]
        if (linked := next((feed for feed in inputs if not feed.is_constant), None)) is not None:
            return converted(self.value(linked), linked.types[-1], kind)
        if kind == "VECTOR":
            return self.generated()
        return self.value(inputs[0]) if kind == "RGBA" and inputs else GREY
