"""What of a node tree is rendered differently than Blender would, gathered to be told in one line."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

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
        self._problems.append(f'the output {output} of the node "{node}" is not known, and {instead} taken instead')

    def ignore(self, what: str, node: bpy.types.Node) -> None:
        """A node is known, but not its setting or input `what`."""
        self._ignored.append(f'the {what} of the node "{label(node)}"')

    def add(self, problem: str) -> None:
        """Something else, as a clause that names it."""
        self._problems.append(problem)

    def warning(self) -> str | None:
        """All that was lost, or None."""
        parts = []
        if self._replaced:
            names = ", ".join(dict.fromkeys(self._replaced))
            parts.append(f"Rooks does not know the nodes {names} and uses the nearest that it knows")
        if self._ignored:
            parts.append(f"Rooks does not use {', '.join(dict.fromkeys(self._ignored))}")
        parts += dict.fromkeys(self._problems)
        return "; ".join(parts) or None
