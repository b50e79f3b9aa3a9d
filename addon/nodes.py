"""Finding one's way in a shader node tree: through links, reroutes, muted nodes and groups, to what feeds a socket.

A socket is fed by another node's output or by its own value. `trace` returns either as a `Source`. Group nodes are
entered and left on the way, which is why a source remembers the groups that it lies in. Sockets are found by their
identifiers: their names change from version to version.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import bpy

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Source:
    """What feeds a socket: output `output` of `node`, or, where `node` is None, the unlinked input `socket`'s value.

    `socket` None stands for 0: what comes out of a reroute, a muted node or a group into which nothing goes. `groups`
    are the group nodes around it, outermost first. `types` are the types of all sockets that the value passes, from its
    own to that of the socket that is fed: Blender converts at each.
    """

    node: bpy.types.Node | None
    output: bpy.types.NodeSocket | None
    socket: bpy.types.NodeSocket | None
    groups: tuple[bpy.types.Node, ...]
    types: tuple[str, ...]

    @property
    def is_constant(self) -> bool:
        """Whether no node makes the value. Inputs with a default of their own, such as a Normal, then have that."""
        return self.node is None

    @property
    def key(self) -> tuple[Hashable, ...]:
        """The same for all sources that are the same output of the same node in the same groups."""
        return (*(group.as_pointer() for group in self.groups), self.node.as_pointer(), self.output.identifier)

    def input(self, identifier: str) -> Source | None:
        """What feeds the input `identifier` of this source's node, or None where it has no such input."""
        socket = find_input(self.node, identifier)
        return None if socket is None else trace(socket, self.groups)


def find_input(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket | None:
    return _by_identifier(node.inputs, identifier)


def trace(socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...] = ()) -> Source:
    """Follow the link into an input socket to the node that really makes the value."""
    types = (socket.type,)
    is_proxy = False  # whether `socket` is that of a reroute or a muted node, which has no value and no type of its own
    while (link := _active_link(socket)) is not None:
        node, output = link.from_node, link.from_socket
        if node.type == "REROUTE" or node.mute:
            following = node.inputs[0] if node.type == "REROUTE" else _behind_muted(node, output)
            if following is None:
                break  # a muted node lets nothing through: as if there were no link
            socket, is_proxy, types = following, True, (output.type, *types)
        elif (node.type == "GROUP" and node.node_tree is not None) or (node.type == "GROUP_INPUT" and groups):
            following, groups = _other_side(node, output, groups)
            if following is None:
                return Source(None, None, None, groups, (output.type, *types))
            socket, is_proxy, types = following, False, (following.type, output.type, *types)
        else:
            return Source(node, output, socket, groups, (output.type, *types))
    return Source(None, None, None if is_proxy else socket, groups, types)


def surface_of(tree: bpy.types.NodeTree) -> Source | None:
    """What feeds the Surface of the output node that a final render uses, or None without one."""
    output = tree.get_output_node("CYCLES")
    if output is None:
        return None
    source = trace(output.inputs["Surface"])
    return None if source.is_constant else source


def reached_outputs(tree: bpy.types.NodeTree) -> set[tuple[Hashable, ...]]:
    """The keys (`Source.key`) of all nodes' outputs that the output node depends on."""
    output = tree.get_output_node("CYCLES")
    waiting = [] if output is None else [trace(socket) for socket in output.inputs]
    reached: set[tuple[Hashable, ...]] = set()
    while waiting:
        source = waiting.pop()
        if not source.is_constant and source.key not in reached:
            reached.add(source.key)
            waiting += [trace(socket, source.groups) for socket in source.node.inputs]
    return reached


def socket_value(socket: bpy.types.NodeSocket | None) -> float | Color:
    """What an unlinked socket holds: a number, or the first three components of a colour or a vector. None holds 0."""
    value = getattr(socket, "default_value", 0.0)
    if isinstance(value, (bool, int, float)):
        return float(value)
    if isinstance(value, str):  # a menu or a text
        return 0.0
    components = (*value, 0.0, 0.0)
    return float(components[0]), float(components[1]), float(components[2])


def label(node: bpy.types.Node) -> str:
    """A node's name as the node editor shows it, for warnings."""
    return node.label or node.name


def _active_link(socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
    """The link into a socket; none to or from sockets that a node's settings have put out of use."""
    links = (link for link in socket.links if link.is_valid and not link.is_muted)
    return next((link for link in links if link.from_socket.enabled and link.to_socket.enabled), None)


def _behind_muted(node: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def _other_side(
    node: bpy.types.Node, output: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...]
) -> tuple[bpy.types.NodeSocket | None, tuple[bpy.types.Node, ...]]:
    """The socket inside of a group that makes its output, or that outside which feeds its input; and its groups."""
    if node.type == "GROUP_INPUT":
        return _by_identifier(groups[-1].inputs, output.identifier), groups[:-1]
    results = (inner for inner in node.node_tree.nodes if inner.type == "GROUP_OUTPUT" and inner.is_active_output)
    result = next((_by_identifier(inner.inputs, output.identifier) for inner in results), None)
    return result, (*groups, node)


def _by_identifier(sockets, identifier: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)
