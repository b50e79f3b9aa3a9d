"""Shader nodes become the core's shaders field by field; what is not modelled is named."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from core.scene import DEFAULT_GREY  # noqa: E402
from core.shaders import (  # noqa: E402
    AddShader,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Metallic,
    MixShader,
    Principled,
    Refraction,
    Translucent,
    Transparent,
)
from core.values import Bump, Checker, Normalized, NormalMap  # noqa: E402
from tests.addon_helpers import empty_scene, exported, feed, material, plain, shader  # noqa: E402

#: The Glossy BSDF's name before it was renamed still creates it.
GLOSSY = "ShaderNodeBsdfAnisotropic"
COLOR, TINT = (0.1, 0.2, 0.3), (0.4, 0.5, 0.6)

has_metallic = pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender has this node from 4.3 on")


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def becomes(kind: str, expected, options: dict | None = None, **inputs) -> None:
    """Check what a shader node with these options and inputs becomes, without a warning."""
    paint, node = shader(kind, **{name: _socket(value) for name, value in inputs.items()})
    for name, value in (options or {}).items():
        setattr(node, name, value)
    result, warnings = exported(paint)
    assert (plain(result.surface), warnings) == (plain(expected), [])


def _socket(value):
    return (*value, 1) if isinstance(value, tuple) and value in (COLOR, TINT) else value


def test_diffuse():
    becomes("ShaderNodeBsdfDiffuse", Diffuse(COLOR, 0.3), Color=COLOR, Roughness=0.3)


@pytest.mark.parametrize(("chosen", "distribution"), [("GGX", "ggx"), ("MULTI_GGX", "multiscatter_ggx")])
def test_glossy(chosen, distribution):
    becomes(GLOSSY, Glossy(COLOR, 0.3, distribution), {"distribution": chosen}, Color=COLOR, Roughness=0.3)


@has_metallic
def test_metallic_by_its_colours():
    inputs = {"Base_Color": COLOR, "Edge_Tint": TINT, "Roughness": 0.3}
    expected = Metallic(COLOR, TINT, False, 0.3, "ggx")
    becomes("ShaderNodeBsdfMetallic", expected, {"distribution": "GGX", "fresnel_type": "F82"}, **inputs)


@has_metallic
def test_metallic_by_its_index_of_refraction():
    n, k = (0.2, 0.9, 1.1), (3.9, 2.4, 2.2)
    paint, node = shader("ShaderNodeBsdfMetallic", Roughness=0.3)
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = n, k
    result, warnings = exported(paint)
    assert (plain(result.surface), warnings) == (plain(Metallic(n, k, True, 0.3)), [])


def test_glass():
    becomes("ShaderNodeBsdfGlass", Glass(COLOR, 0.3, 1.6), Color=COLOR, Roughness=0.3, IOR=1.6)


def test_refraction():
    becomes(
        "ShaderNodeBsdfRefraction",
        Refraction(COLOR, 0.3, 1.6),
        {"distribution": "GGX"},
        Color=COLOR,
        Roughness=0.3,
        IOR=1.6,
    )


def test_transparent_and_translucent():
    becomes("ShaderNodeBsdfTransparent", Transparent(COLOR), Color=COLOR)
    becomes("ShaderNodeBsdfTranslucent", Translucent(COLOR), Color=COLOR)


def test_emission():
    becomes("ShaderNodeEmission", Emission(COLOR, 7.0), Color=COLOR, Strength=7)


def test_principled():
    diffuse_roughness = {"Diffuse_Roughness": 0.11} if bpy.app.version >= (4, 3) else {}
    becomes(
        "ShaderNodeBsdfPrincipled",
        Principled(
            base_color=COLOR,
            metallic=0.1,
            roughness=0.2,
            ior=1.6,
            alpha=0.7,
            diffuse_roughness=0.11 if diffuse_roughness else 0.0,
            specular_level=0.3,
            specular_tint=TINT,
            transmission=0.4,
            coat=0.5,
            coat_roughness=0.6,
            coat_ior=1.7,
            coat_tint=TINT,
            emission_color=COLOR,
            emission_strength=0.8,
            distribution="ggx",
        ),
        {"distribution": "GGX"},
        Base_Color=COLOR,
        Metallic=0.1,
        Roughness=0.2,
        IOR=1.6,
        Alpha=0.7,
        Specular_IOR_Level=0.3,
        Specular_Tint=TINT,
        Transmission_Weight=0.4,
        Coat_Weight=0.5,
        Coat_Roughness=0.6,
        Coat_IOR=1.7,
        Coat_Tint=TINT,
        Emission_Color=COLOR,
        Emission_Strength=0.8,
        **diffuse_roughness,
    )


def test_a_new_principled_node_is_the_cores_default():
    becomes("ShaderNodeBsdfPrincipled", Principled())


def test_mixed_and_added_shaders_and_those_that_are_not_there():
    paint, _tree, output = material()
    mix = feed(output.inputs["Surface"], "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    add = feed(mix.inputs[2], "ShaderNodeAddShader")
    feed(add.inputs[1], "ShaderNodeBsdfDiffuse")
    result, warnings = exported(paint)
    assert (plain(result.surface), warnings) == (plain(MixShader(0.25, None, AddShader(None, Diffuse()))), [])


def test_values_feed_shaders():
    paint, node = shader("ShaderNodeBsdfPrincipled")
    feed(node.inputs["Base Color"], "ShaderNodeTexChecker")
    feed(node.inputs["Roughness"], "ShaderNodeValue").outputs[0].default_value = 0.25
    surface, warnings = exported(paint)[0].surface, exported(paint)[1]
    assert (type(surface.base_color), surface.roughness, warnings) == (Checker, 0.25, [])


def test_normals_feed_shaders():
    paint, node = shader("ShaderNodeBsdfPrincipled")
    feed(node.inputs["Normal"], "ShaderNodeNormalMap")
    feed(node.inputs["Coat Normal"], "ShaderNodeBump")
    surface = exported(paint)[0].surface
    assert (type(surface.normal), type(surface.coat_normal)) == (NormalMap, Bump)


def test_a_vector_that_feeds_a_normal_is_made_one_long():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    feed(node.inputs["Normal"], "ShaderNodeCombineXYZ")
    assert isinstance(exported(paint)[0].surface.normal, Normalized)


def test_a_normal_from_an_unknown_node_is_the_surfaces_own():
    paint, node = shader("ShaderNodeBsdfDiffuse")
    feed(node.inputs["Normal"], "ShaderNodeNormal", name="Ball")
    result, warnings = exported(paint)
    assert result.surface.normal is None
    assert "Ball" in warnings[0]


# The textbook's lobe


def test_a_material_can_have_the_cosine_power_lobe():
    paint, node = shader(GLOSSY, Color=(*COLOR, 1), Roughness=0.3)
    node.distribution = "BECKMANN"
    paint.rooks.glossy_lobe = "COSINE_POWER"
    result, warnings = exported(paint)
    assert (plain(result.surface), warnings) == (plain(Glossy(COLOR, 0.3, "cosine_power")), [])


def test_only_glossy_nodes_have_the_cosine_power_lobe():
    paint, _node = shader("ShaderNodeBsdfGlass")
    paint.rooks.glossy_lobe = "COSINE_POWER"
    assert exported(paint)[0].surface.distribution == "multiscatter_ggx"


# What is not modelled


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("ShaderNodeBsdfPrincipled", {"Subsurface_Weight": 0.5}),
        ("ShaderNodeBsdfPrincipled", {"Sheen_Weight": 0.5}),
        ("ShaderNodeBsdfPrincipled", {"Thin_Film_Thickness": 200.0}),
        ("ShaderNodeBsdfPrincipled", {"Anisotropic": 0.5}),
        (GLOSSY, {"Anisotropy": 0.5}),
    ],
)
def test_inputs_that_are_not_modelled_are_named_unless_they_are_0(kind, values):
    paint, node = shader(kind, **values)
    name = next(iter(values)).replace("_", " ")
    assert exported(paint)[1] == [f'material "Paint": Rooks does not use the {name} of the node "{node.name}"']


def test_a_linked_input_that_is_not_modelled_is_named():
    paint, node = shader("ShaderNodeBsdfPrincipled")
    feed(node.inputs["Sheen Weight"], "ShaderNodeTexChecker", 1)
    assert "the Sheen Weight of the node" in exported(paint)[1][0]


@pytest.mark.parametrize(
    ("kind", "name", "given", "taken"),
    [
        ("Glass", "IOR", 0, "1e-05"),
        ("Glass", "IOR", 1e8, "100000"),
        ("Refraction", "IOR", -1, "1e-05"),
        ("Principled", "IOR", 1e8, "100000"),
        ("Principled", "Coat IOR", 0.5, "1"),
        ("Principled", "Metallic", 1.5, "1"),
        ("Glossy", "Roughness", -0.5, "0"),
        ("Diffuse", "Roughness", 2, "1"),
    ],
)
def test_constants_that_are_kept_to_their_limits_are_told(kind, name, given, taken):
    paint, node = shader(f"ShaderNodeBsdf{kind}")
    feed(node.inputs[name], "ShaderNodeValue").outputs[0].default_value = given
    text = f"its {name} of {given:g} is taken for {taken}"
    assert exported(paint)[1] == [f'material "Paint": node "{node.name}": {text}']


def test_a_factor_beyond_1_is_told():
    paint, mix = shader("ShaderNodeMixShader")
    feed(mix.inputs[0], "ShaderNodeValue").outputs[0].default_value = 1.5
    text = f"its {mix.inputs[0].name} of 1.5 is taken for 1"
    assert exported(paint)[1] == [f'material "Paint": node "Mix Shader": {text}']


@pytest.mark.parametrize("index", [1e-4, 1.0, 9e4])
def test_constants_within_their_limits_are_not_told(index):
    paint, node = shader("ShaderNodeBsdfGlass")
    feed(node.inputs["IOR"], "ShaderNodeValue").outputs[0].default_value = index
    assert exported(paint)[1] == []


def test_a_tangent_without_anisotropy_changes_nothing():
    paint, node = shader("ShaderNodeBsdfPrincipled")
    feed(node.inputs["Tangent"], "ShaderNodeTangent")
    assert exported(paint)[1] == []


@pytest.mark.parametrize(
    ("kind", "chosen", "name"),
    [
        (GLOSSY, "BECKMANN", "Beckmann"),
        (GLOSSY, "ASHIKHMIN_SHIRLEY", "Ashikhmin-Shirley"),
        ("ShaderNodeBsdfGlass", "BECKMANN", "Beckmann"),
        ("ShaderNodeBsdfRefraction", "BECKMANN", "Beckmann"),
    ],
)
def test_other_distributions_become_ggx_and_are_named_unless_the_surface_is_smooth(kind, chosen, name):
    paint, node = shader(kind, Roughness=0.3)
    node.distribution = chosen
    result, warnings = exported(paint)
    assert getattr(result.surface, "distribution", "ggx") == "ggx"
    text = f'node "{node.name}": its {name} distribution is rendered as GGX'
    assert warnings == [f'material "Paint": {text}']
    node.inputs["Roughness"].default_value = 0
    assert exported(paint)[1] == []


def test_an_unknown_shader_keeps_its_colour():
    result, warnings = exported(shader("ShaderNodeBsdfSheen", Color=(*COLOR, 1))[0])
    assert plain(result.surface) == plain(Diffuse(COLOR))
    assert len(warnings) == 1


def test_an_unknown_shader_without_a_colour_is_grey():
    result, warnings = exported(shader("ShaderNodeHoldout")[0])
    assert plain(result.surface) == plain(Diffuse(DEFAULT_GREY))
    assert len(warnings) == 1
