"""What feeds a socket is found through reroutes, muted nodes and groups, and converted at each socket on the way."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from core.shaders import Diffuse, Emission  # noqa: E402
from core.values import Average, Gray  # noqa: E402
from tests.addon_helpers import empty_scene, exported, fed, feed, material, plain, shader, value_of  # noqa: E402

RGB = "ShaderNodeRGB"
RED = (1, 0.5, 0.25, 1)


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def group(*sockets: tuple[str, str, str]):
    """A new node group with sockets (name, "INPUT" or "OUTPUT", type), its input node and its output node."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    for name, direction, kind in sockets:
        tree.interface.new_socket(name, in_out=direction, socket_type=f"NodeSocket{kind}")
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def use_group(socket, tree):
    node = socket.id_data.nodes.new("ShaderNodeGroup")
    node.node_tree = tree
    socket.id_data.links.new(node.outputs[0], socket)
    return node


def test_reroutes_muted_nodes_and_groups_are_seen_through():
    tree, entry, leave = group(("Tint", "INPUT", "Color"), ("Shader", "OUTPUT", "Shader"))
    diffuse = feed(leave.inputs[0], "ShaderNodeBsdfDiffuse")
    tree.links.new(entry.outputs[0], diffuse.inputs["Color"])

    paint, _nodes, output = material()
    node = feed(output.inputs["Surface"], "NodeReroute")
    inner = use_group(node.inputs[0], tree)
    muted = feed(inner.inputs[0], "ShaderNodeInvert", "Color")
    feed(muted.inputs["Color"], RGB).outputs[0].default_value = RED
    muted.mute = True
    result, warnings = exported(paint)
    assert (plain(result.surface), warnings) == (plain(Diffuse((1, 0.5, 0.25))), [])


def test_a_group_in_a_group():
    inner, entry, leave = group(("In", "INPUT", "Color"), ("Out", "OUTPUT", "Color"))
    inner.links.new(entry.outputs[0], leave.inputs[0])
    outer, entry, leave = group(("In", "INPUT", "Color"), ("Out", "OUTPUT", "Color"))
    node = use_group(leave.inputs[0], inner)
    outer.links.new(entry.outputs[0], node.inputs[0])
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    use_group(diffuse.inputs["Color"], outer).inputs[0].default_value = RED
    assert value_of(paint) == ((1, 0.5, 0.25), [])


def test_the_same_group_with_other_inputs_is_another_value():
    tree, entry, leave = group(("In", "INPUT", "Color"), ("Out", "OUTPUT", "Color"))
    invert = feed(leave.inputs[0], "ShaderNodeInvert")
    tree.links.new(entry.outputs[0], invert.inputs["Color"])
    mix, paint = fed("ShaderNodeMixRGB")
    for name, color in (("Color1", (0.25,) * 3), ("Color2", (0.75,) * 3)):
        use_group(mix.inputs[name], tree).inputs[0].default_value = (*color, 1)
    value, _ = value_of(paint)
    assert (value.a.a, value.b.a) == ((0.25,) * 3, (0.75,) * 3)


def test_a_muted_node_without_a_way_through_counts_as_no_link():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    node.mute = True
    assert exported(paint)[0].surface is None
    texture, paint = fed("ShaderNodeTexImage")
    texture.mute = True
    assert value_of(paint)[0] == pytest.approx((0.8, 0.8, 0.8))


def test_nothing_that_passes_a_muted_node_or_a_reroute_is_0():
    math, paint = fed("ShaderNodeMath")
    math.inputs[0].default_value, math.mute = 0.3, True
    assert value_of(paint) == (0.0, [])
    _reroute, paint = fed("NodeReroute")
    assert value_of(paint) == (0.0, [])


def test_a_muted_group_converts_to_the_type_of_its_output_alone():
    tree, _entry, _leave = group(("In", "INPUT", "Float"), ("Out", "OUTPUT", "Color"))
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    node = use_group(diffuse.inputs["Color"], tree)
    feed(node.inputs[0], RGB).outputs[0].default_value = RED
    node.mute = True
    assert value_of(paint) == ((1, 0.5, 0.25), [])


def test_a_group_without_an_output_node_gives_0():
    tree, _entry, leave = group(("Out", "OUTPUT", "Color"))
    tree.nodes.remove(leave)
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    use_group(diffuse.inputs["Color"], tree)
    assert value_of(paint) == (0.0, [])


def test_muted_links_are_no_links():
    _rgb, paint = fed(RGB)
    next(link for link in paint.node_tree.links if link.to_socket.name == "Color").is_muted = True
    assert value_of(paint)[0] == pytest.approx((0.8, 0.8, 0.8))


def test_links_to_sockets_that_are_out_of_use_are_no_links():
    node, paint = fed("ShaderNodeMath")
    feed(node.inputs[1], "ShaderNodeTexNoise", "Color")
    node.operation = "SQRT"
    value, warnings = value_of(paint)
    assert (value.b, warnings) == (0.5, [])


def test_numbers_are_colours_and_vectors_of_three_equal_parts():
    value, paint = fed("ShaderNodeValue")
    value.outputs[0].default_value = 0.25
    assert value_of(paint) == (0.25, [])


def test_colours_and_vectors_become_numbers_by_their_luminance_and_their_mean():
    paint, node = shader("ShaderNodeBsdfGlossy" if bpy.app.version >= (4, 5) else "ShaderNodeBsdfAnisotropic")
    feed(node.inputs["Roughness"], "ShaderNodeTexChecker", "Color")
    assert isinstance(exported(paint)[0].surface.roughness, Gray)
    feed(node.inputs["Roughness"], "ShaderNodeTexCoord", "Generated")
    assert isinstance(exported(paint)[0].surface.roughness, Average)


def test_values_are_converted_at_the_sockets_of_groups():
    tree, entry, leave = group(("In", "INPUT", "Float"), ("Out", "OUTPUT", "Color"))
    tree.links.new(entry.outputs[0], leave.inputs[0])
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    node = use_group(diffuse.inputs["Color"], tree)
    feed(node.inputs[0], "ShaderNodeTexChecker", "Color")
    assert isinstance(value_of(paint)[0], Gray)


def test_a_colour_linked_to_a_shader_is_emitted():
    paint, _tree, output = material()
    feed(output.inputs["Surface"], RGB).outputs[0].default_value = RED
    result, warnings = exported(paint)
    assert (plain(result.surface), warnings) == (plain(Emission((1, 0.5, 0.25), 1.0)), [])


def test_the_output_node_of_final_renders_counts():
    paint, _node = shader("ShaderNodeBsdfDiffuse", Color=RED)
    other = paint.node_tree.nodes.new("ShaderNodeOutputMaterial")
    paint.node_tree.links.new(feed(other.inputs["Surface"], "ShaderNodeEmission").outputs[0], other.inputs["Surface"])
    other.target, other.is_active_output = "EEVEE", True
    assert isinstance(exported(paint)[0].surface, Diffuse)
