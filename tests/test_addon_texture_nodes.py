"""Textures and their coordinates: images with their opacity, checks, ramps, mappings."""

from __future__ import annotations

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Euler, Matrix, Vector  # noqa: E402

from addon.texture_nodes import mapping_matrix, tile_matrices  # noqa: E402
from core.values import (  # noqa: E402
    GENERATED,
    OBJECT,
    UV,
    WORLD,
    Affine,
    Checker,
    ColorRamp,
    EnvironmentTexture,
    ImageTexture,
    Normalized,
)
from tests.addon_helpers import add, empty_scene, export, fed, feed, image, plain, value_of  # noqa: E402


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def picture(source, **properties):
    """The value of an Image Texture, and the warnings."""
    _node, paint = fed("ShaderNodeTexImage", image=source, name="Picture", **properties)
    return value_of(paint)


# Images


def test_an_image_is_looked_up_by_uv():
    texture, warnings = picture(image())
    assert (texture.vector, texture.extension, texture.interpolation) == (UV, "repeat", "linear")
    assert warnings == []
    assert export()[0].instances[0].mesh.uvs.shape == (2, 3, 2)


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize(("chosen", "interpolation"), [("Linear", "linear"), ("Closest", "closest")])
def test_options_of_an_image(extension, chosen, interpolation):
    texture, warnings = picture(image(), extension=extension, interpolation=chosen)
    assert (texture.extension, texture.interpolation, warnings) == (extension.lower(), interpolation, [])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"interpolation": "Cubic"}, "cubic interpolation is rendered as linear"),
        ({"projection": "BOX"}, "box projection is rendered as flat"),
    ],
)
def test_options_that_are_not_known_are_named(options, words):
    texture, warnings = picture(image(), **options)
    assert isinstance(texture, ImageTexture)
    assert len(warnings) == 1
    assert all(text in warnings[0] for text in ("Paint", "Picture", words))


def test_what_is_wrong_with_an_image_is_named():
    texture, warnings = picture(None)
    np.testing.assert_array_equal(texture.pixels, [[[1, 0, 1]]])
    assert warnings == ['material "Paint": node "Picture": no image is chosen']


def test_opacity_is_an_image_of_its_own_beside_straight_colours():
    mix, paint = fed("ShaderNodeMixRGB")
    node = feed(mix.inputs["Color1"], "ShaderNodeTexImage", "Color", image=image(opacity=0.5))
    paint.node_tree.links.new(node.outputs["Alpha"], mix.inputs["Fac"])
    mixed, _warnings = value_of(paint)
    assert (mixed.a.pixels[0, 0] == (255, 0, 0)).all()
    assert (mixed.factor.pixels.dtype, mixed.factor.pixels.shape) == (np.float32, (2, 2, 3))
    np.testing.assert_allclose(mixed.factor.pixels, 0.5, atol=0.5 / 255)


def test_colours_alone_are_multiplied_by_their_opacity():
    texture, _warnings = picture(image(opacity=0.5))
    assert (texture.pixels[0, 0] == (128, 0, 0)).all()


def test_opacity_that_leads_nowhere_is_not_used():
    texture, paint = fed("ShaderNodeTexImage", image=image(opacity=0.5))
    loose = paint.node_tree.nodes.new("ShaderNodeMath")
    paint.node_tree.links.new(texture.outputs["Alpha"], loose.inputs[0])
    assert (value_of(paint)[0].pixels[0, 0] == (128, 0, 0)).all()


def test_outside_of_a_tile_there_is_magenta():
    tiles = bpy.data.images.new("Skin", 4, 4, tiled=True)
    tiles.tiles[0].number = 1013
    value, warnings = picture(tiles)
    assert (value.factor.extension, value.a, warnings) == ("clip", (1, 0, 1), [])
    np.testing.assert_array_equal(moved(value.b.vector.matrix, (2.25, 1.5, 0)), (0.25, 0.5, 0))


def test_the_first_row_and_column_of_tiles_go_on_to_minus_1():
    into, around = tile_matrices(1011)
    np.testing.assert_array_equal(
        [moved(into, (0.5, 1.5, 0)), moved(into, (-0.5, 1.5, 0))], [(0.5, 0.5, 0), (-0.5, 0.5, 0)]
    )
    np.testing.assert_array_equal([moved(around, (-1, 1, 0)), moved(around, (1, 2, 0))], [(0, 0, 0), (1, 1, 0)])


def test_tiles_beyond_the_first_are_named():
    tiles = bpy.data.images.new("Skin", 4, 4, tiled=True)
    tiles.tiles.new(1002)
    text = 'only the first tile of image "Skin" is shown, and magenta in place of the others'
    assert picture(tiles)[1] == [f'material "Paint": node "Picture": {text}']


def test_the_opacity_of_an_opaque_image_is_1():
    _node, paint = fed("ShaderNodeTexImage", "Alpha", image=image())
    assert value_of(paint) == (1.0, [])


def test_outside_of_a_clipped_image_it_is_0():
    _node, paint = fed("ShaderNodeTexImage", "Alpha", image=image(), extension="CLIP")
    texture, _warnings = value_of(paint)
    assert (texture.pixels.tolist(), texture.extension) == ([[[1, 1, 1]]], "clip")


def test_textures_of_one_image_share_its_pixels():
    first, second = picture(image())[0], picture(bpy.data.images["Tiles"])[0]
    values = [instance.materials[0].surface.color for instance in export()[0].instances]
    assert values[0].pixels is values[1].pixels
    assert first.pixels is not second.pixels  # two exports


def test_a_panorama_on_a_surface_is_looked_up_by_the_position():
    _node, paint = fed("ShaderNodeTexEnvironment", image=image())
    texture, warnings = value_of(paint)
    assert isinstance(texture, EnvironmentTexture)
    assert (texture.vector, texture.interpolation, warnings) == (WORLD, "linear", [])


# Checks and ramps


def test_checks_are_generated_unless_said_otherwise():
    node, paint = fed("ShaderNodeTexChecker")
    node.inputs["Color1"].default_value = (1, 0, 0, 1)
    node.inputs["Color2"].default_value = (0, 0, 1, 1)
    node.inputs["Scale"].default_value = 8
    assert plain(value_of(paint)) == plain((Checker((1, 0, 0), (0, 0, 1), 8.0, GENERATED), []))


def test_the_factor_of_checks_is_1_and_0():
    _node, paint = fed("ShaderNodeTexChecker", 1)
    assert plain(value_of(paint)) == plain((Checker(1.0, 0.0, 5.0, GENERATED), []))


def ramp(mode: str, output: int = 0) -> ColorRamp:
    node, paint = fed("ShaderNodeValToRGB", output)
    node.color_ramp.interpolation = mode
    node.color_ramp.elements[0].color = (1, 0.5, 0, 0.25)
    node.color_ramp.elements[1].color = (0, 0.5, 1, 0.75)
    feed(node.inputs["Fac"], "ShaderNodeTexChecker", 1)
    value, warnings = value_of(paint)
    assert warnings == []
    assert isinstance(value.factor, Checker)
    return value


def test_a_linear_ramp_is_a_smooth_table():
    value = ramp("LINEAR")
    places = np.linspace(0, 1, 256)[:, None]
    np.testing.assert_allclose(value.table, np.hstack([1 - places, 0 * places + 0.5, places]), atol=1e-6)
    assert (value.table.dtype, value.smooth) == (np.float32, True)


def test_a_constant_ramp_has_steps():
    value = ramp("CONSTANT")
    assert not value.smooth
    assert (value.table[:255] == value.table[0]).all()


def test_the_alpha_of_a_ramp():
    np.testing.assert_allclose(ramp("LINEAR", 1).table[[0, 255]], [[0.25] * 3, [0.75] * 3])


# Mappings


def moved(matrix: np.ndarray, vector) -> np.ndarray:
    return matrix @ (*vector, 1.0)


LOCATION, ROTATION, SCALE = (1.0, -2.0, 0.5), (0.3, -0.7, 1.1), (2.0, 0.5, -3.0)
SAMPLES = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.3, -0.4, 0.9)]


@pytest.mark.parametrize("vector", SAMPLES)
@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR", "NORMAL"])
def test_a_mapping_is_blenders_matrices_in_their_order(kind, vector):
    rotate, scale = Euler(ROTATION).to_matrix().to_4x4(), Matrix.Diagonal((*SCALE, 1))
    forward = {
        "POINT": Matrix.Translation(LOCATION) @ rotate @ scale,
        "TEXTURE": (Matrix.Translation(LOCATION) @ rotate @ scale).inverted(),
        "VECTOR": rotate @ scale,
        "NORMAL": (rotate @ scale).inverted().transposed(),
    }[kind]
    expected = forward @ Vector(vector)
    np.testing.assert_allclose(moved(mapping_matrix(kind, LOCATION, ROTATION, SCALE), vector), expected, atol=1e-6)


@pytest.mark.parametrize("kind", ["TEXTURE", "NORMAL"])
def test_a_division_by_a_scale_of_0_gives_0(kind):
    matrix = mapping_matrix(kind, (0, 0, 0), (0, 0, 0), (0, 1, 1))
    np.testing.assert_array_equal(moved(matrix, (5, 6, 7)), (0, 6, 7))


def mapped(kind: str = "POINT", **inputs):
    """The vector of a Checker behind a Mapping of Object coordinates; the Mapping's node; and the warnings."""
    checker, paint = fed("ShaderNodeTexChecker")
    node = feed(checker.inputs["Vector"], "ShaderNodeMapping", vector_type=kind, name="Stretch")
    feed(node.inputs["Vector"], "ShaderNodeTexCoord", "Object")
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    value, warnings = value_of(paint)
    return value.vector, node, warnings


def test_a_mapping_that_changes_nothing_is_left_out():
    assert mapped()[0] is OBJECT


def test_a_mapping_is_a_matrix():
    vector, _node, warnings = mapped(Location=LOCATION, Rotation=ROTATION, Scale=SCALE)
    assert (vector.vector, warnings) == (OBJECT, [])
    np.testing.assert_allclose(vector.matrix, mapping_matrix("POINT", LOCATION, ROTATION, SCALE), atol=1e-6)


def test_a_mapping_of_normals_makes_them_one_long():
    vector, _node, _warnings = mapped("NORMAL", Scale=SCALE)
    assert (type(vector), type(vector.vector)) == (Normalized, Affine)


def test_two_mappings_are_one_matrix():
    checker, paint = fed("ShaderNodeTexChecker")
    outer = feed(checker.inputs["Vector"], "ShaderNodeMapping")
    inner = feed(outer.inputs["Vector"], "ShaderNodeMapping")
    feed(inner.inputs["Vector"], "ShaderNodeTexCoord", "UV")
    outer.inputs["Scale"].default_value, inner.inputs["Location"].default_value = (2, 2, 2), (1, 0, 0)
    vector = value_of(paint)[0].vector
    assert vector.vector is UV
    np.testing.assert_allclose(moved(vector.matrix, (0, 1, 0)), (2, 2, 0))


def test_inputs_of_a_mapping_may_be_nodes_that_are_constant():
    checker, paint = fed("ShaderNodeTexChecker")
    node = feed(checker.inputs["Vector"], "ShaderNodeMapping")
    feed(node.inputs["Vector"], "ShaderNodeTexCoord", "UV")
    feed(node.inputs["Scale"], "ShaderNodeValue").outputs[0].default_value = 4
    feed(node.inputs["Location"], "ShaderNodeCombineXYZ").inputs["X"].default_value = 1
    value, warnings = value_of(paint)
    np.testing.assert_allclose(moved(value.vector.matrix, (1, 1, 1)), (5, 4, 4))
    assert warnings == []


def test_an_input_of_a_mapping_that_varies_is_named():
    checker, paint = fed("ShaderNodeTexChecker")
    node = feed(checker.inputs["Vector"], "ShaderNodeMapping", name="Stretch")
    feed(node.inputs["Vector"], "ShaderNodeTexCoord", "UV")
    feed(node.inputs["Scale"], "ShaderNodeTexChecker")
    value, warnings = value_of(paint)
    assert value.vector is UV
    assert warnings == ['material "Paint": Rooks does not use the Scale of the node "Stretch"']


def test_without_a_vector_a_mapping_maps_its_own_value():
    checker, paint = fed("ShaderNodeTexChecker")
    feed(checker.inputs["Vector"], "ShaderNodeMapping").inputs["Vector"].default_value = (0.25, 0.5, 0.75)
    assert value_of(paint)[0].vector == (0.25, 0.5, 0.75)


def test_the_texture_mapping_of_the_sidebar_counts():
    node, paint = fed("ShaderNodeTexChecker")
    mapping = node.texture_mapping
    mapping.vector_type, mapping.scale, mapping.translation = "POINT", (2, 3, 4), (1, 0, 0)
    mapping.mapping_x, mapping.mapping_y, mapping.mapping_z = "Y", "X", "NONE"
    vector = value_of(paint)[0].vector
    assert vector.vector is GENERATED
    np.testing.assert_allclose(moved(vector.matrix, (5, 6, 7)), (13, 15, 0))


def test_the_outputs_of_a_texture_share_their_coordinates():
    mix, paint = fed("ShaderNodeMixRGB")
    node = feed(mix.inputs["Color1"], "ShaderNodeTexImage", "Color", image=image(opacity=0.5))
    node.texture_mapping.scale = (2, 2, 2)
    paint.node_tree.links.new(node.outputs["Alpha"], mix.inputs["Fac"])
    mixed = value_of(paint)[0]
    assert mixed.a.vector is mixed.factor.vector


# Coordinates


@pytest.mark.parametrize(("output", "space"), [("UV", UV), ("Generated", GENERATED), ("Object", OBJECT)])
def test_texture_coordinates(output, space):
    checker, paint = fed("ShaderNodeTexChecker")
    feed(checker.inputs["Vector"], "ShaderNodeTexCoord", output)
    value, warnings = value_of(paint)
    assert (value.vector, warnings) == (space, [])


def test_coordinates_of_another_object_are_from_the_world():
    checker, paint = fed("ShaderNodeTexChecker")
    other = add("Projector", None, location=(1, 2, 3), rotation_euler=(0, 0, math.pi / 2), scale=(2, 2, 2))
    feed(checker.inputs["Vector"], "ShaderNodeTexCoord", "Object", object=other)
    value, warnings = value_of(paint)
    assert (value.vector.vector, warnings) == (WORLD, [])
    np.testing.assert_allclose(moved(value.vector.matrix, (1, 4, 3)), (1, 0, 0), atol=1e-6)


def test_an_object_without_a_size_is_named():
    checker, paint = fed("ShaderNodeTexChecker")
    other = add("Flat", None, scale=(1, 0, 1))
    feed(checker.inputs["Vector"], "ShaderNodeTexCoord", "Object", object=other)
    value, warnings = value_of(paint)
    assert value.vector is OBJECT
    assert 'object "Flat"' in warnings[0]


def test_other_coordinates_are_named():
    checker, paint = fed("ShaderNodeTexChecker")
    feed(checker.inputs["Vector"], "ShaderNodeTexCoord", "Camera", name="Lens")
    value, warnings = value_of(paint)
    assert value.vector is GENERATED
    text = 'the output Camera of the node "Lens" is not known, and Generated taken instead'
    assert warnings == [f'material "Paint": {text}']


@pytest.mark.parametrize("kind", ["group without values", "reroute"])
def test_a_texture_whose_vector_comes_from_nowhere_has_its_own_coordinates(kind):
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector").hide_value = True
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    checker = feed(tree.nodes.new("NodeGroupOutput").inputs[0], "ShaderNodeTexChecker")
    feed(checker.inputs["Vector"], "NodeReroute" if kind == "reroute" else "NodeGroupInput")
    _node, paint = fed("ShaderNodeGroup", node_tree=tree)
    assert value_of(paint)[0].vector is GENERATED
