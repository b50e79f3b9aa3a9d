"""The world is a radiance by direction: a colour, an environment image, and what is computed from them."""

from __future__ import annotations

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.texture_nodes import EVEN_SKY  # noqa: E402
from core.values import GENERATED, OBJECT, EnvironmentTexture, Mix  # noqa: E402
from tests.addon_helpers import add, empty_scene, export, feed, image, plain, render_with_cycles  # noqa: E402
from tests.naive_values import Hits, evaluate  # noqa: E402


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def background(color=(1, 1, 1, 1), strength=1.0) -> bpy.types.Node:
    """The Background node of a new world."""
    world = bpy.data.worlds.new("Sky")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    node = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    node.inputs["Color"].default_value = color
    node.inputs["Strength"].default_value = strength
    return node


def world() -> tuple:
    scene, warnings = export()
    return scene.world, warnings


def test_a_colour_times_a_strength():
    background((1, 0.5, 0.25, 1), 2)
    assert world() == ((2, 1, 0.5), [])


def test_no_world_and_nothing_linked_are_black():
    assert world() == ((0, 0, 0), [])
    node = background()
    node.id_data.links.clear()
    assert world() == ((0, 0, 0), [])


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="every world has nodes from Blender 5.0 on")
def test_without_nodes_the_viewport_colour_counts():
    background()
    bpy.context.scene.world.use_nodes = False
    bpy.context.scene.world.color = (1, 0.5, 0.25)
    assert world() == ((1, 0.5, 0.25), [])


def test_an_environment_image_is_looked_up_by_the_direction():
    feed(background().inputs["Color"], "ShaderNodeTexEnvironment", image=image())
    value, warnings = world()
    assert (type(value), value.vector, value.interpolation) == (EnvironmentTexture, GENERATED, "linear")
    assert (value.pixels.shape, warnings) == ((2, 2, 3), [])


def test_a_strength_of_an_image_multiplies_it():
    feed(background(strength=2).inputs["Color"], "ShaderNodeTexEnvironment", image=image())
    value, warnings = world()
    assert (type(value), value.blend, type(value.a), value.b) == (Mix, "multiply", EnvironmentTexture, 2)
    assert warnings == []


@pytest.mark.parametrize(("output", "space"), [("Generated", GENERATED), ("Object", OBJECT)])
def test_an_environment_image_is_turned_by_a_mapping(output, space):
    texture = feed(background().inputs["Color"], "ShaderNodeTexEnvironment", image=image())
    mapping = feed(texture.inputs["Vector"], "ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0, 0, math.pi / 2)
    feed(mapping.inputs["Vector"], "ShaderNodeTexCoord", output)
    value, warnings = world()
    assert (value.vector.vector, warnings) == (space, [])
    np.testing.assert_allclose(value.vector.matrix @ (1, 0, 0, 1), (0, 1, 0), atol=1e-7)


def test_an_environment_image_is_turned_by_an_object():
    texture = feed(background().inputs["Color"], "ShaderNodeTexEnvironment", image=image())
    handle = add("Handle", None, rotation_euler=(0, 0, math.pi / 2))
    feed(texture.inputs["Vector"], "ShaderNodeTexCoord", "Object", object=handle)
    value, warnings = world()
    assert (value.vector.vector, warnings) == (OBJECT, [])
    np.testing.assert_allclose(value.vector.matrix @ (0, 1, 0, 1), (1, 0, 0), atol=1e-7)


def test_colours_and_strengths_are_computed():
    node = background((1, 0.5, 0.25, 1))
    feed(node.inputs["Strength"], "ShaderNodeMath", operation="SQRT")
    value, warnings = world()
    assert (type(value), type(value.b).__name__, value.b.operation, warnings) == (Mix, "Math", "sqrt", [])


def test_mixed_and_added_backgrounds():
    node = background((1, 1, 1, 1))
    output = next(n for n in node.id_data.nodes if n.type == "OUTPUT_WORLD")
    mix = feed(output.inputs["Surface"], "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    node.id_data.links.new(node.outputs[0], mix.inputs[1])
    add_shader = feed(mix.inputs[2], "ShaderNodeAddShader")
    node.id_data.links.new(node.outputs[0], add_shader.inputs[0])
    white, black = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    expected = Mix(0.25, white, Mix(1.0, white, black, "add"))
    assert plain(world()) == plain((expected, []))


def test_a_colour_linked_to_the_output_is_the_radiance():
    node = background()
    output = next(n for n in node.id_data.nodes if n.type == "OUTPUT_WORLD")
    feed(output.inputs["Surface"], "ShaderNodeRGB").outputs[0].default_value = (1, 0.5, 0.25, 1)
    assert world() == ((1, 0.5, 0.25), [])


def test_coordinates_are_those_of_cycles(tmp_path):
    node = background(strength=2)
    handle = add("Handle", None, location=(0.3, -0.2, 0.5), rotation_euler=(0.2, 0.4, 0.9), scale=(1.5, 1, 0.7))
    mix = feed(node.inputs["Color"], "ShaderNodeMixRGB", blend_type="ADD")
    feed(mix.inputs["Color1"], "ShaderNodeTexCoord", "Object", object=handle)
    feed(mix.inputs["Color2"], "ShaderNodeTexCoord", "Generated")
    value, warnings = world()
    camera = bpy.context.scene.camera
    camera.data.type, camera.location, camera.rotation_euler = "PERSP", (5, 6, 7), (math.pi / 2, 0, 0)
    theirs = render_with_cycles(tmp_path / "x.exr")
    left, right, bottom, top = export()[0].camera.window
    height, width, _ = theirs.shape
    x = left + (np.arange(width) + 0.5) / width * (right - left)
    z = bottom + (np.arange(height) + 0.5) / height * (top - bottom)
    directions = np.stack([*np.meshgrid(x, z), np.ones((height, width))], axis=-1)[..., [0, 2, 1]].reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ours = evaluate(value, Hits(dict.fromkeys(("uv", "generated", "object"), directions), {}))
    assert warnings == []
    np.testing.assert_allclose(ours, theirs.reshape(-1, 3), atol=1e-4)


# What is not known


def test_a_sky_is_even_and_says_what_to_do():
    feed(background(strength=2).inputs["Color"], "ShaderNodeTexSky", name="Heaven")
    value, warnings = world()
    assert value == pytest.approx(np.multiply(EVEN_SKY, 2))
    assert len(warnings) == 1
    assert all(words in warnings[0] for words in ('world "Sky"', "Heaven", "bake it", "Environment Texture"))


def test_a_mirror_ball_is_named():
    texture = feed(background().inputs["Color"], "ShaderNodeTexEnvironment", image=image(), name="Ball")
    texture.projection = "MIRROR_BALL"
    assert "Ball" in world()[1][0]


def test_what_a_world_does_not_have_is_named():
    node = background()
    feed(node.inputs["Color"], "ShaderNodeTexImage", image=image(), name="Picture")
    feed(node.inputs["Strength"], "ShaderNodeFresnel", name="Rim")
    value, warnings = world()
    assert value.a.vector is GENERATED
    assert all(name in warnings[0] for name in ("Picture", "Rim"))


def test_a_light_path_shows_what_lights_the_scene():
    node = background()
    output = next(n for n in node.id_data.nodes if n.type == "OUTPUT_WORLD")
    mix = feed(output.inputs["Surface"], "ShaderNodeMixShader")
    feed(mix.inputs[0], "ShaderNodeLightPath", "Is Camera Ray", name="Trick")
    value, warnings = world()
    assert value.factor == 0.0
    assert "Trick" in warnings[0]


def test_a_volume_and_hidden_rays_are_named():
    node = background()
    output = next(n for n in node.id_data.nodes if n.type == "OUTPUT_WORLD")
    feed(output.inputs["Volume"], "ShaderNodeVolumeScatter")
    bpy.context.scene.world.cycles_visibility.glossy = False
    (warning,) = world()[1]
    assert "the Volume of the node" in warning
    assert "also to glossy rays" in warning
