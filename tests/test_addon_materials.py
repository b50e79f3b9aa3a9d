"""Materials become the core's once each, with one warning that names all that is lost."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from core.programs import compile_programs  # noqa: E402
from core.scene import DEFAULT_GREY  # noqa: E402
from core.shaders import Diffuse, Transparent  # noqa: E402
from core.values import Checker, Gray, ImageTexture, Mix  # noqa: E402
from tests.addon_helpers import (  # noqa: E402
    empty_scene,
    export,
    exported,
    fed,
    feed,
    image,
    material,
    plain,
    quad,
    shader,
    value_of,
)


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def test_no_material_is_default_grey():
    quad()
    assert [plain(m.surface) for m in export()[0].instances[0].materials] == [plain(Diffuse(DEFAULT_GREY))]


def test_nothing_linked_is_black():
    result, warnings = exported(material("Void")[0])
    assert (result.name, result.surface, warnings) == ("Void", None, [])


def test_light_goes_through_what_is_only_a_volume():
    paint, _tree, output = material("Fog")
    feed(output.inputs["Volume"], "ShaderNodeVolumeScatter")
    result, warnings = exported(paint)
    assert plain(result.surface) == plain(Transparent())
    assert warnings == [
        'material "Fog": Rooks does not use the Volume of the node "Material Output"; '
        "it is a volume without a surface, and transparent"
    ]


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="every material has nodes from Blender 5.0 on")
def test_without_nodes_the_viewport_colour_counts():
    paint = bpy.data.materials.new("Plain")
    paint.use_nodes = False
    paint.diffuse_color = (0.1, 0.2, 0.3, 1)
    assert plain(exported(paint)[0].surface) == plain(Diffuse((0.1, 0.2, 0.3)))


def test_a_material_is_exported_once():
    paint, _node = shader("ShaderNodeBsdfDiffuse")
    quad().data.materials.append(paint)
    quad().data.materials.append(paint)
    first, second = export()[0].instances
    assert first.materials[0] is second.materials[0]


def test_a_node_that_feeds_two_sockets_is_one_object():
    mix, paint = fed("ShaderNodeMixRGB")
    checker = feed(mix.inputs["Color1"], "ShaderNodeTexChecker")
    paint.node_tree.links.new(checker.outputs[0], mix.inputs["Color2"])
    value = value_of(paint)[0]
    assert isinstance(value.a, Checker)
    assert value.a is value.b


@pytest.mark.parametrize(("choice", "is_sampled"), [("NONE", False), ("FRONT", True), ("AUTO", True)])
def test_emission_that_cycles_does_not_sample_is_not_sampled(choice, is_sampled):
    paint, _node = shader("ShaderNodeEmission")
    paint.cycles.emission_sampling = choice
    assert exported(paint)[0].sample_as_light == is_sampled


def test_one_warning_names_the_material_and_all_its_unknown_nodes():
    paint, _tree, output = material("Clay")
    feed(output.inputs["Displacement"], "ShaderNodeDisplacement")
    mix = feed(output.inputs["Surface"], "ShaderNodeMixShader")
    diffuse = feed(mix.inputs[1], "ShaderNodeBsdfDiffuse")
    feed(diffuse.inputs["Color"], "ShaderNodeTexNoise", "Color", name="Clouds")
    feed(mix.inputs[2], "ShaderNodeBsdfToon", name="Comic")
    _result, warnings = exported(paint)
    assert warnings == [
        'material "Clay": Rooks does not know the nodes "Clouds", "Comic" and uses the nearest that it knows; '
        'Rooks does not use the Displacement of the node "Material Output"'
    ]


def test_the_colour_behind_an_unknown_node_is_used():
    curves, paint = fed("ShaderNodeRGBCurve")
    feed(curves.inputs["Color"], "ShaderNodeTexImage", image=image())
    value, warnings = value_of(paint)
    assert isinstance(value, ImageTexture)
    assert len(warnings) == 1


def test_an_unknown_node_without_colours_is_grey():
    _noise, paint = fed("ShaderNodeTexNoise", "Color")
    assert value_of(paint)[0] == 0.5


def test_a_number_from_an_unknown_node_is_a_number():
    bricks, paint = fed("ShaderNodeTexBrick", "Fac")
    assert value_of(paint)[0] == 0.5
    bricks.inputs["Scale"].default_value = 3
    feed(bricks.inputs["Color1"], "ShaderNodeTexImage", image=image())
    assert isinstance(value_of(paint)[0], Gray)


def test_vectors_behind_an_unknown_node_are_used():
    checker, paint = fed("ShaderNodeTexChecker")
    rotate = feed(checker.inputs["Vector"], "ShaderNodeVectorRotate")
    feed(rotate.inputs["Vector"], "ShaderNodeTexCoord", "Object")
    value, warnings = value_of(paint)
    assert value.vector.space == "object"
    assert len(warnings) == 1


def test_a_material_of_many_nodes_compiles():
    paint, node = shader("ShaderNodeBsdfPrincipled")
    texture = feed(node.inputs["Base Color"], "ShaderNodeTexImage", image=image())
    mapping = feed(texture.inputs["Vector"], "ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (2, 2, 2)
    feed(mapping.inputs["Vector"], "ShaderNodeTexCoord", "UV")
    feed(node.inputs["Roughness"], "ShaderNodeMath", operation="SQRT")
    bump = feed(node.inputs["Normal"], "ShaderNodeBump")
    feed(bump.inputs["Height"], "ShaderNodeTexChecker", 1)
    feed(bump.inputs["Normal"], "ShaderNodeNormalMap")
    result, warnings = exported(paint)
    programs = compile_programs([result.surface], [result.name], Mix(0.5, 0.0, 1.0))
    assert (warnings, programs.materials[0].has_lobes) == ([], True)
