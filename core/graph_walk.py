"""Walking graphs of nodes that share nodes, without recursion: they may be deeper than Python's stack."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

Node = TypeVar("Node")


def children_first(
    root: Node, children: Callable[[Node], Iterable[Node]], key: Callable[[Node], Hashable] = id
) -> list[Node]:
    """All nodes below `root` and itself, each once, after its children. Nodes are the same where their `key` is."""
    done: set[Hashable] = set()
    order: list[Node] = []
    stack = [root]
    while stack:
        node = stack[-1]
        waiting = [] if key(node) in done else [child for child in children(node) if key(child) not in done]
        if waiting:
            stack.extend(reversed(waiting))
            continue
        stack.pop()
        if key(node) not in done:
            done.add(key(node))
            order.append(node)
    return order
