"""Finding one's way in a shader node tree: through links, reroutes, muted nodes and groups, to what feeds a socket.

A socket is fed by another node's output or by its own value. `trace` returns either as a `Source`. Group nodes are
entered and left on the way, which is why a source remembers the groups that it lies in.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Source:
    """What feeds a socket: output `output` of `node`, or, where `node` is None, the unlinked input `socket`.

    `socket` is None where a muted node swallows the signal. `groups` are the group nodes around, outermost first.
    """

    node: bpy.types.Node | None
    output: bpy.types.NodeSocket | None
    socket: bpy.types.NodeSocket | None
    groups: tuple[bpy.types.Node, ...]

    @property
    def is_constant(self) -> bool:
        return self.node is None

    def input(self, name: str) -> Source | None:
        """What feeds the input `name` of this source's node, or None where it has no such input in use."""
        socket = find_input(self.node, name)
        return None if socket is None else trace(socket, self.groups)


def find_input(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in node.inputs if socket.name == name and socket.enabled), None)


def trace(socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...] = ()) -> Source:
    """Follow the link into an input socket to the node that really makes the value."""
    while (link := _active_link(socket)) is not None:
        node, output = link.from_node, link.from_socket
        if node.type == "REROUTE":
            following = node.inputs[0]
        elif node.mute:
            following = _behind_muted(node, output)
        elif node.type == "GROUP" and node.node_tree is not None:
            following, groups = _group_result(node, output), (*groups, node)
        elif node.type == "GROUP_INPUT" and groups:
            following, groups = _by_identifier(groups[-1].inputs, output.identifier), groups[:-1]
        else:
            return Source(node, output, socket, groups)
        if following is None:
            return Source(None, None, None, groups)
        socket = following
    return Source(None, None, socket, groups)


def surface_of(tree: bpy.types.NodeTree) -> Source | None:
    """What feeds the Surface of the output node that a final render uses, or None without one."""
    output = tree.get_output_node("CYCLES")
    if output is None:
        return None
    source = trace(output.inputs["Surface"])
    return None if source.is_constant else source


def constant_color(source: Source) -> Color | None:
    """The value of an unlinked colour (or number), or of an RGB or Value node; None for anything else."""
    socket = source.output if source.node is not None and source.node.type in ("RGB", "VALUE") else source.socket
    if source.node is not None and socket is source.socket:
        return None
    if socket is None:
        return (0.0, 0.0, 0.0)
    value = socket.default_value
    return (value, value, value) if isinstance(value, float | int) else (value[0], value[1], value[2])


def constant_number(source: Source) -> float | None:
    """The value of an unlinked number, or of a Value node; None for anything else."""
    color = constant_color(source)
    return None if color is None else sum(color) / 3.0


def label(node: bpy.types.Node) -> str:
    """A node's name as the node editor shows it, for warnings."""
    return node.label or node.name


def _active_link(socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
    return next((link for link in socket.links if link.is_valid and not link.is_muted), None)


def _behind_muted(node: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    return next((link.from_socket for link in node.internal_links if link.to_socket == output), None)


def _group_result(group: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    results = (node for node in group.node_tree.nodes if node.type == "GROUP_OUTPUT" and node.is_active_output)
    return next((_by_identifier(node.inputs, output.identifier) for node in results), None)


def _by_identifier(sockets, identifier: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)
