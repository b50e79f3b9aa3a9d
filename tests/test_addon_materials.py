"""Node trees become albedo and emission; what is lost is named, once for each material."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from core.scene import DEFAULT_GREY, Checker, ImageTexture  # noqa: E402
from tests.addon_helpers import empty_scene, export, feed, material, quad, shader  # noqa: E402


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def exported(paint):
    """The core's material of a quad with this one, and the warnings."""
    quad().data.materials.append(paint)
    scene, warnings = export()
    return scene.instances[0].materials[0], warnings


def approx(*values):
    return pytest.approx(values, rel=1e-6)


def checker_image(name="Tiles", **options):
    """2 × 2 pixels: red and green below, blue and white above."""
    image = bpy.data.images.new(name, 2, 2, **options)
    image.pixels.foreach_set(np.array([1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1], np.float32))
    return image


def test_no_material_is_default_grey():
    quad()
    assert [m.albedo for m in export()[0].instances[0].materials] == [DEFAULT_GREY]


def test_diffuse():
    paint, warnings = exported(shader("ShaderNodeBsdfDiffuse", Color=(0.1, 0.2, 0.3, 1))[0])
    assert paint.albedo == approx(0.1, 0.2, 0.3)
    assert paint.emission == (0, 0, 0)
    assert warnings == []


def test_principled_base_colour_and_emission():
    color = {"Base_Color": (0.1, 0.2, 0.3, 1), "Emission_Color": (1, 0.5, 0.25, 1), "Emission_Strength": 4}
    paint, warnings = exported(shader("ShaderNodeBsdfPrincipled", **color)[0])
    assert paint.albedo == approx(0.1, 0.2, 0.3)
    assert (paint.emission, paint.emission_strength) == (approx(1, 0.5, 0.25), 4)
    assert warnings == []


def test_emission_reflects_nothing():
    paint, warnings = exported(shader("ShaderNodeEmission", Color=(1, 0.5, 0, 1), Strength=7)[0])
    assert paint.albedo == (0, 0, 0)
    assert (paint.emission, paint.emission_strength) == (approx(1, 0.5, 0), 7)
    assert warnings == []


def test_add_shader_of_diffuse_and_emission():
    paint, _tree, output = material()
    add = feed(output.inputs["Surface"], "ShaderNodeAddShader")
    feed(add.inputs[0], "ShaderNodeEmission").inputs["Strength"].default_value = 3
    feed(add.inputs[1], "ShaderNodeBsdfDiffuse").inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    result, warnings = exported(paint)
    assert (result.albedo, result.emission_strength) == (approx(0.5, 0.5, 0.5), 3)
    assert warnings == []


def test_nothing_linked_is_black():
    result, warnings = exported(material()[0])
    assert (result.albedo, result.emission, warnings) == ((0, 0, 0), (0, 0, 0), [])


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="every material has nodes from Blender 5.0 on")
def test_without_nodes_the_viewport_colour_counts():
    paint = bpy.data.materials.new("Plain")
    paint.use_nodes = False
    paint.diffuse_color = (0.1, 0.2, 0.3, 1)
    assert exported(paint)[0].albedo == approx(0.1, 0.2, 0.3)


def test_checker_is_generated_by_default():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    checker = feed(node.inputs["Color"], "ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value = (1, 0, 0, 1)
    checker.inputs["Color2"].default_value = (0, 0, 1, 1)
    checker.inputs["Scale"].default_value = 8
    assert exported(paint)[0].albedo == Checker((1, 0, 0), (0, 0, 1), 8, "generated")


def test_the_factor_of_a_checker_is_white_and_black():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    feed(node.inputs["Color"], "ShaderNodeTexChecker", "Fac" if bpy.app.version < (5, 1) else 1)
    albedo = exported(paint)[0].albedo
    assert (albedo.color1, albedo.color2) == ((1, 1, 1), (0, 0, 0))


@pytest.mark.parametrize(("output", "space"), [("UV", "uv"), ("Generated", "generated"), ("Object", "object")])
def test_texture_coordinates(output, space):
    paint, node = shader("ShaderNodeBsdfDiffuse")
    checker = feed(node.inputs["Color"], "ShaderNodeTexChecker")
    feed(checker.inputs["Vector"], "ShaderNodeTexCoord", output)
    result, warnings = exported(paint)
    assert (result.albedo.coordinates, warnings) == (space, [])


def test_a_mapping_that_changes_nothing_is_silent_and_another_is_named():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    checker = feed(node.inputs["Color"], "ShaderNodeTexChecker")
    mapping = feed(checker.inputs["Vector"], "ShaderNodeMapping", name="Stretch")
    feed(mapping.inputs["Vector"], "ShaderNodeTexCoord", "Object")
    result, warnings = exported(paint)
    assert (result.albedo.coordinates, warnings) == ("object", [])
    mapping.inputs["Scale"].default_value = (2, 1, 1)
    assert ["Stretch" in warning for warning in export()[1]] == [True]


def image_material(image, **properties):
    paint, node = shader("ShaderNodeBsdfDiffuse")
    feed(node.inputs["Color"], "ShaderNodeTexImage", image=image, name="Picture", **properties)
    return paint


def test_image_is_looked_up_by_uv_and_keeps_its_rows():
    result, warnings = exported(image_material(checker_image()))
    texture = result.albedo
    assert isinstance(texture, ImageTexture)
    assert (texture.coordinates, texture.extension, texture.interpolation) == ("uv", "repeat", "linear")
    assert texture.pixels.dtype == np.uint8
    np.testing.assert_array_equal(texture.pixels / 255, [[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 1]]])
    assert warnings == []
    assert export()[0].instances[0].mesh.uvs.shape == (2, 3, 2)


def test_image_options():
    texture = exported(image_material(checker_image(), extension="EXTEND", interpolation="Closest"))[0].albedo
    assert (texture.extension, texture.interpolation) == ("extend", "closest")


def test_float_images_and_data_are_linear():
    for options in ({"float_buffer": True}, {"is_data": True}):
        image = checker_image(**options)
        image.pixels.foreach_set(np.full(16, 0.2, np.float32))
        pixels = exported(image_material(image))[0].albedo.pixels
        assert pixels.dtype == np.float32
        np.testing.assert_allclose(pixels, 0.2, atol=0.5 / 255)
        empty_scene()


def test_an_image_is_read_once():
    image = checker_image()
    quad().data.materials.append(image_material(image))
    quad().data.materials.append(image_material(image))
    first, second = (instance.materials[0].albedo.pixels for instance in export()[0].instances)
    assert first is second


def test_a_missing_image_is_magenta_and_named(tmp_path):
    image = bpy.data.images.new("Lost", 1, 1)
    image.source, image.filepath = "FILE", str(tmp_path / "lost.png")
    result, warnings = exported(image_material(image))
    np.testing.assert_array_equal(result.albedo.pixels, [[[1, 0, 1]]])
    assert len(warnings) == 1
    assert all(text in warnings[0] for text in ("Paint", "Picture", "Lost"))


def test_no_image_is_magenta_and_named():
    result, warnings = exported(image_material(None))
    np.testing.assert_array_equal(result.albedo.pixels, [[[1, 0, 1]]])
    assert warnings == ['material "Paint": node "Picture": no image is chosen']


def test_packed_images_are_read(tmp_path):
    image = checker_image()
    image.filepath_raw, image.file_format = str(tmp_path / "tiles.png"), "PNG"
    image.save()
    packed = bpy.data.images.load(image.filepath_raw)
    packed.pack()
    (tmp_path / "tiles.png").unlink()
    pixels = exported(image_material(packed))[0].albedo.pixels
    np.testing.assert_array_equal(pixels[0, 0], [255, 0, 0])


def test_a_uv_map_by_name():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    picture = feed(node.inputs["Color"], "ShaderNodeTexImage", image=checker_image())
    feed(picture.inputs["Vector"], "ShaderNodeUVMap", uv_map="Second")
    obj = quad()
    obj.data.materials.append(paint)
    obj.data.uv_layers.new(name="Second").uv.foreach_set("vector", np.full(8, 0.25, np.float32))
    scene, warnings = export()
    assert warnings == []
    np.testing.assert_array_equal(scene.instances[0].mesh.uvs, 0.25)


def test_reroutes_muted_nodes_and_groups_are_seen_through():
    group = bpy.data.node_groups.new("Coat", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    diffuse = feed(leave.inputs[0], "ShaderNodeBsdfDiffuse")
    group.links.new(entry.outputs[0], diffuse.inputs["Color"])

    paint, tree, output = material()
    node = feed(output.inputs["Surface"], "NodeReroute")
    inner = tree.nodes.new("ShaderNodeGroup")
    inner.node_tree = group
    tree.links.new(inner.outputs[0], node.inputs[0])
    muted = feed(inner.inputs[0], "ShaderNodeInvert", "Color")
    feed(muted.inputs["Color"], "ShaderNodeRGB").outputs[0].default_value = (0.1, 0.2, 0.3, 1)
    muted.mute = True
    result, warnings = exported(paint)
    assert (result.albedo, warnings) == (approx(0.1, 0.2, 0.3), [])


def test_a_muted_shader_is_black():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    node.mute = True
    assert exported(paint)[0].albedo == (0, 0, 0)


def test_one_warning_names_the_material_and_all_its_unknown_nodes():
    paint, _tree, output = material("Clay")
    mix = feed(output.inputs["Surface"], "ShaderNodeMixShader", name="Blend")
    diffuse = feed(mix.inputs[1], "ShaderNodeBsdfDiffuse")
    feed(diffuse.inputs["Color"], "ShaderNodeTexNoise", "Color", name="Clouds")
    _result, warnings = exported(paint)
    assert len(warnings) == 1
    assert all(name in warnings[0] for name in ("Clay", "Blend", "Clouds"))


def test_the_colour_behind_an_unknown_node_is_used():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    hue = feed(node.inputs["Color"], "ShaderNodeHueSaturation")
    feed(hue.inputs["Color"], "ShaderNodeTexImage", image=checker_image())
    result, warnings = exported(paint)
    assert isinstance(result.albedo, ImageTexture)
    assert len(warnings) == 1


def test_an_unknown_surface_keeps_its_colour():
    result, warnings = exported(shader("ShaderNodeBsdfAnisotropic", Color=(0.1, 0.2, 0.3, 1))[0])
    assert result.albedo == approx(0.1, 0.2, 0.3)
    assert len(warnings) == 1


@pytest.mark.parametrize(
    "values", [{"Metallic": 1.0}, {"Transmission_Weight": 0.5}, {"Alpha": 0.5}, {"Coat_Weight": 1.0}]
)
def test_inputs_that_are_not_used_are_named(values):
    _result, warnings = exported(shader("ShaderNodeBsdfPrincipled", **values)[0])
    name = next(iter(values)).replace("_", " ")
    assert warnings == [f'material "Paint": Rooks does not use the {name} of the node "Principled BSDF"']


def test_a_bump_is_named():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    feed(node.inputs["Normal"], "ShaderNodeBump", "Normal")
    assert "the Normal of the node" in exported(paint)[1][0]


def world_nodes(color=(1, 1, 1, 1), strength=1.0):
    world = bpy.data.worlds.new("Sky")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = color
    background.inputs["Strength"].default_value = strength
    return background


def test_world_is_colour_times_strength():
    world_nodes((1, 0.5, 0.25, 1), 2)
    scene, warnings = export()
    assert (scene.world, warnings) == (approx(2, 1, 0.5), [])


def test_no_world_is_black():
    assert export()[0].world == (0, 0, 0)


def test_a_panorama_becomes_its_mean_and_is_named():
    image = bpy.data.images.new("Hills", 8, 4, float_buffer=True)
    image.pixels.foreach_set(np.full(8 * 4 * 4, 0.3, np.float32))
    feed(world_nodes(strength=2).inputs["Color"], "ShaderNodeTexEnvironment", image=image, name="Panorama")
    scene, warnings = export()
    assert scene.world == approx(0.6, 0.6, 0.6)
    assert len(warnings) == 1
    assert all(name in warnings[0] for name in ("Sky", "Panorama"))
