"""Finding one's way in a shader node tree: through links, reroutes, muted nodes and groups, to what feeds a socket.

A socket is fed by another node's output or by its own value. `trace` returns either as a `Source`. Group nodes are
entered and left on the way, which is why a source remembers the groups that it lies in. Sockets are found by their
identifiers: their names change from version to version.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Source:
    """What feeds a socket: output `output` of `node`, or, where `node` is None, the unlinked input `socket`'s value.

    `groups` are the group nodes around it, outermost first. `types` are the types of all sockets that the value passes,
    from its own to that of the socket that is fed: Blender converts at each.
    """

    node: bpy.types.Node | None
    output: bpy.types.NodeSocket | None
    socket: bpy.types.NodeSocket
    groups: tuple[bpy.types.Node, ...]
    types: tuple[str, ...]

    @property
    def is_constant(self) -> bool:
        return self.node is None

    @property
    def is_unlinked(self) -> bool:
        """Whether nothing is linked to the socket that is fed, not even a group's input that has a value."""
        return self.node is None and len(self.types) == 1

    def input(self, identifier: str) -> Source | None:
        """What feeds the input `identifier` of this source's node, or None where it has no such input."""
        socket = find_input(self.node, identifier)
        return None if socket is None else trace(socket, self.groups)


def find_input(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket | None:
    return _by_identifier(node.inputs, identifier)


def trace(socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...] = ()) -> Source:
    """Follow the link into an input socket to the node that really makes the value."""
    types = (socket.type,)
    while (link := _active_link(socket)) is not None:
        node, output = link.from_node, link.from_socket
        inner = groups
        if node.type == "REROUTE":
            following = node.inputs[0]
        elif node.mute:
            following = _behind_muted(node, output)
        elif node.type == "GROUP" and node.node_tree is not None:
            following, inner = _group_result(node, output), (*groups, node)
        elif node.type == "GROUP_INPUT" and groups:
            following, inner = _by_identifier(groups[-1].inputs, output.identifier), groups[:-1]
        else:
            return Source(node, output, socket, groups, (output.type, *types))
        if following is None:
            break  # a muted node lets nothing through: as if there were no link
        types = (following.type, output.type, *types)
        socket, groups = following, inner
    return Source(None, None, socket, groups, types)


def surface_of(tree: bpy.types.NodeTree) -> Source | None:
    """What feeds the Surface of the output node that a final render uses, or None without one."""
    output = tree.get_output_node("CYCLES")
    if output is None:
        return None
    source = trace(output.inputs["Surface"])
    return None if source.is_constant else source


def constant_color(source: Source) -> Color | None:
    """The value of an unlinked colour (or number), or of an RGB or Value node; None for anything else."""
    if source.is_constant:
        value = socket_value(source.socket)
    elif source.node.type in ("RGB", "VALUE"):
        value = socket_value(source.output)
    else:
        return None
    return value if isinstance(value, tuple) else (value, value, value)


def constant_number(source: Source) -> float | None:
    """The value of an unlinked number, or of a Value node; None for anything else."""
    color = constant_color(source)
    return None if color is None else sum(color) / 3.0


def socket_value(socket: bpy.types.NodeSocket) -> float | Color:
    """What an unlinked socket holds: a number, or the first three components of a colour or a vector."""
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


def _group_result(group: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    results = (node for node in group.node_tree.nodes if node.type == "GROUP_OUTPUT" and node.is_active_output)
    return next((_by_identifier(node.inputs, output.identifier) for node in results), None)


def _by_identifier(sockets, identifier: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)
