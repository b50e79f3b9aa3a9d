"""What of a node tree is rendered differently than Blender would, gathered to be told in one line."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from .nodes import Source, label


@dataclass
class Losses:
    """Each is told once, in the order in which they were found."""

    _replaced: list[str] = field(default_factory=list)
    _ignored: list[str] = field(default_factory=list)
    _problems: list[str] = field(default_factory=list)

    def replace(self, node: bpy.types.Node) -> None:
        """The nearest that is known stands in for a node."""
        self._replaced.append(f'"{label(node)}"')

    def replace_output(self, source: Source, instead: str) -> None:
        """A node is known, but not this output of it."""
        output, node = source.output.name, label(source.node)
        text = rpt_('the output {output} of the node "{node}" is not known, and {instead} taken instead')
        self._problems.append(text.format(output=output, node=node, instead=instead))

    def ignore(self, what: str, node: bpy.types.Node) -> None:
        """A node is known, but not its setting or input `what`."""
        self._ignored.append(rpt_('the {what} of the node "{node}"').format(what=what, node=label(node)))

    def add_for(self, node: bpy.types.Node, problem: str) -> None:
        """Something else that is wrong with a node."""
        self.add(rpt_('node "{name}": {problem}').format(name=label(node), problem=problem))

    def add(self, problem: str) -> None:
        """Something else, as a clause that names it."""
        self._problems.append(problem)

    def warning(self) -> str | None:
        """All that was lost, or None."""
        parts = []
        if self._replaced:
            names = ", ".join(dict.fromkeys(self._replaced))
            text = rpt_("Rooks does not know the nodes {names} and uses the nearest that it knows")
            parts.append(text.format(names=names))
        if self._ignored:
            parts.append(rpt_("Rooks does not use {parts}").format(parts=", ".join(dict.fromkeys(self._ignored))))
        parts += dict.fromkeys(self._problems)
        return "; ".join(parts) or None
