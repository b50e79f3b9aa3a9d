"""What is read at the hit: attributes, UV maps, normals, Fresnel; and that meshes have what is read."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from core.values import (  # noqa: E402
    UV,
    WORLD,
    Attribute,
    Bump,
    Checker,
    Combine,
    Component,
    Fresnel,
    LayerWeight,
    Math,
    NormalMap,
)
from tests.addon_helpers import (  # noqa: E402
    empty_scene,
    export,
    exported,
    fed,
    feed,
    image,
    plain,
    quad,
    shader,
    value_of,
)


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def normal_of(kind: str, **properties):
    """The node that feeds the Normal of a diffuse material, and the material."""
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    return feed(diffuse.inputs["Normal"], kind, **properties), paint


# Normals


@pytest.mark.parametrize("space", ["TANGENT", "OBJECT", "WORLD"])
def test_normal_map(space):
    node, paint = normal_of("ShaderNodeNormalMap", space=space)
    node.inputs["Strength"].default_value = 0.5
    result, warnings = exported(paint)
    assert plain(result.surface.normal) == plain(NormalMap((0.5, 0.5, 1.0), 0.5, space.lower()))
    assert warnings == []


@pytest.mark.parametrize("space", ["object", "world"])
def test_normal_maps_of_the_old_game_engine_have_y_and_z_turned_round(space):
    node, paint = normal_of("ShaderNodeNormalMap", space=f"BLENDER_{space.upper()}")
    feed(node.inputs["Color"], "ShaderNodeTexChecker")
    checks = Checker((0.8,) * 3, (0.2,) * 3, 5.0)
    red, green, blue = (Component(checks, i) for i in range(3))
    color = Combine(red, Math("subtract", 1.0, green), Math("subtract", 1.0, blue))
    assert plain(exported(paint)[0].surface.normal) == plain(NormalMap(color, 1.0, space))


@pytest.mark.skipif("convention" not in bpy.types.ShaderNodeNormalMap.bl_rna.properties, reason="not in this Blender")
def test_normal_maps_of_directx_have_y_turned_round():
    node, paint = normal_of("ShaderNodeNormalMap", convention="DIRECTX")
    node.inputs["Color"].default_value = (0.5, 0.25, 1, 1)
    color = exported(paint)[0].surface.normal.color
    assert plain(color.y) == plain(Math("subtract", 1.0, Component((0.5, 0.25, 1.0), 1)))


def test_bump_on_a_normal_map():
    node, paint = normal_of("ShaderNodeBump", invert=True)
    node.inputs["Strength"].default_value, node.inputs["Distance"].default_value = 0.5, 0.25
    feed(node.inputs["Height"], "ShaderNodeTexChecker", 1)
    feed(node.inputs["Normal"], "ShaderNodeNormalMap")
    result, warnings = exported(paint)
    expected = Bump(Checker(1.0, 0.0, 5.0), 0.5, 0.25, True, NormalMap((0.5, 0.5, 1.0)))
    assert (plain(result.surface.normal), warnings) == (plain(expected), [])


@pytest.mark.parametrize("options", [{"output": "Fresnel"}, {"output": "Facing"}])
def test_layer_weight(options):
    node, paint = fed("ShaderNodeLayerWeight", **options)
    node.inputs["Blend"].default_value = 0.25
    assert plain(value_of(paint)) == plain((LayerWeight(0.25, options["output"].lower()), []))


def test_fresnel_of_a_normal():
    node, paint = fed("ShaderNodeFresnel")
    node.inputs["IOR"].default_value = 1.75
    feed(node.inputs["Normal"], "ShaderNodeNormalMap", space="WORLD")
    assert plain(value_of(paint)) == plain((Fresnel(1.75, NormalMap((0.5, 0.5, 1.0), 1.0, "world")), []))


def test_an_index_of_refraction_that_is_kept_to_its_limits_is_told():
    node, paint = fed("ShaderNodeFresnel")
    feed(node.inputs["IOR"], "ShaderNodeValue").outputs[0].default_value = 0
    assert value_of(paint)[1] == ['material "Paint": node "Fresnel": its IOR of 0 is taken for 1e-05']


def test_the_position_is_in_the_world():
    _node, paint = fed("ShaderNodeNewGeometry", "Position")
    assert value_of(paint) == (WORLD, [])


def test_the_normal_is_the_surfaces_own():
    _node, paint = fed("ShaderNodeNewGeometry", "Normal")
    assert plain(value_of(paint)) == plain((NormalMap((0.5, 0.5, 1.0), 0.0, "world"), []))


def test_the_normal_as_a_coordinate_is_in_the_meshs_space():
    mesh, warnings = mesh_with(fed("ShaderNodeTexCoord", "Normal")[1])
    assert warnings == []
    np.testing.assert_array_equal(mesh.attributes[".normal"], np.tile((0, 0, 1), (2, 3, 1)))


@pytest.mark.parametrize(("output", "value"), [("Pointiness", 0.5), ("Backfacing", 0.0)])
def test_what_is_not_known_of_the_geometry_is_a_number_and_named(output, value):
    _node, paint = fed("ShaderNodeNewGeometry", output, name="Edges")
    text = f'the output {output} of the node "Edges" is not known, and {value:g} taken instead'
    assert value_of(paint) == (value, [f'material "Paint": {text}'])


def test_a_light_path_chooses_what_most_rays_see():
    _node, paint = fed("ShaderNodeLightPath", "Is Camera Ray", name="Trick")
    text = 'the output Is Camera Ray of the node "Trick" is not known, and 0 taken instead'
    assert value_of(paint) == (0.0, [f'material "Paint": {text}'])


# UV maps


def test_a_uv_map_without_a_name_is_the_active_one():
    texture, paint = fed("ShaderNodeTexImage", image=image())
    feed(texture.inputs["Vector"], "ShaderNodeUVMap")
    assert value_of(paint)[0].vector is UV


def test_a_uv_map_with_a_name_is_an_attribute():
    texture, paint = fed("ShaderNodeTexImage", image=image())
    feed(texture.inputs["Vector"], "ShaderNodeUVMap", uv_map="Second")
    value, warnings = value_of(paint)
    assert (plain(value.vector), warnings) == (plain(Attribute("Second")), [])


# Attributes on meshes


def mesh_with(paint, prepare=lambda mesh: None):
    """The exported mesh of a quad with a material, `prepare`d before, and the warnings."""
    obj = quad()
    prepare(obj.data)
    obj.data.materials.append(paint)
    scene, warnings = export()
    return scene.instances[-1].mesh, warnings


def attribute_material(name: str, output: str = "Color"):
    return fed("ShaderNodeAttribute", output, attribute_name=name)[1]


def test_attribute():
    assert plain(value_of(attribute_material("Wear"))) == plain((Attribute("Wear"), []))
    assert plain(value_of(attribute_material("Wear", "Vector"))) == plain((Attribute("Wear"), []))


def test_color_attribute():
    node, paint = fed("ShaderNodeVertexColor", layer_name="Paint")
    assert plain(value_of(paint)) == plain((Attribute("Paint"), []))
    node.layer_name = ""
    assert plain(value_of(paint)) == plain((Attribute(""), []))


def test_attributes_of_objects_are_named():
    _node, paint = fed("ShaderNodeAttribute", attribute_type="OBJECT", name="Custom")
    text = 'material "Paint": node "Custom": attributes of the object are not read, and taken for 0'
    assert value_of(paint) == (0.0, [text])


# A quad's corners are 0 1 2, 0 2 3 (or another diagonal): its vertices and corners have the same numbers.
NUMBERS = np.array([0.0, 1.0, 2.0, 3.0])
COUNTS = {"POINT": 4, "CORNER": 4, "FACE": 1}
FIELDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
}


@pytest.mark.parametrize("domain", COUNTS)
@pytest.mark.parametrize("kind", FIELDS)
def test_attributes_are_read_for_each_corner(kind, domain):
    field, width, dtype = FIELDS[kind]
    stored = np.outer(NUMBERS[: COUNTS[domain]], np.arange(1, width + 1)).astype(dtype)

    def prepare(mesh):
        mesh.attributes.new("Wear", kind, domain).data.foreach_set(field, stored.ravel())

    mesh, warnings = mesh_with(attribute_material("Wear"), prepare)
    numbers = np.zeros((2, 3)) if domain == "FACE" else NUMBERS[mesh.triangles]
    components = [1, 1, 1] if width == 1 else [1, 2, 0 if width == 2 else 3]
    expected = numbers[..., None] * components
    assert (mesh.attributes["Wear"].dtype, warnings) == (np.float32, [])
    np.testing.assert_allclose(mesh.attributes["Wear"], expected > 0 if dtype == np.bool_ else expected)


#: A Fac and an Alpha of a value of 1, 2, 3 … in as many components as the kind has.
NUMBERS_OF_KINDS = {"FLOAT": (1, 1), "FLOAT2": (1, 1), "FLOAT_VECTOR": (2, 1), "FLOAT_COLOR": (2, 4)}


@pytest.mark.parametrize("kind", NUMBERS_OF_KINDS)
def test_factor_and_opacity_of_an_attribute(kind):
    field, width, dtype = FIELDS[kind]

    def prepare(mesh):
        mesh.attributes.new("Wear", kind, "FACE").data.foreach_set(field, np.arange(1, width + 1, dtype=dtype))

    factor, opacity = NUMBERS_OF_KINDS[kind]
    for output, name, expected in (("Fac", ".factor of Wear", factor), ("Alpha", ".opacity of Wear", opacity)):
        paint, diffuse = shader("ShaderNodeBsdfDiffuse")
        node = feed(diffuse.inputs["Color"], "ShaderNodeAttribute", attribute_name="Wear")
        socket = next(socket for socket in node.outputs if socket.identifier == output)
        paint.node_tree.links.new(socket, diffuse.inputs["Color"])
        mesh, warnings = mesh_with(paint, prepare)
        assert warnings == []
        np.testing.assert_array_equal(mesh.attributes[name], np.full((2, 3, 3), expected))


def test_colours_kept_as_bytes_are_made_linear():
    def prepare(mesh):
        colors = mesh.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
        colors.data.foreach_set("color_srgb", np.tile(np.array([128 / 255, 0, 1, 1], np.float32), 4))

    mesh, _warnings = mesh_with(fed("ShaderNodeVertexColor", layer_name="Paint")[1], prepare)
    encoded = 128 / 255
    np.testing.assert_allclose(mesh.attributes["Paint"][0, 0], (((encoded + 0.055) / 1.055) ** 2.4, 0, 1), rtol=1e-3)


def test_the_colour_without_a_name_is_the_one_for_renders():
    def prepare(mesh):
        for name, value in (("First", 0.25), ("Second", 0.75)):
            mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT").data.foreach_set("color", np.full(16, value))
        mesh.color_attributes.render_color_index = 1

    mesh, _warnings = mesh_with(fed("ShaderNodeVertexColor")[1], prepare)
    np.testing.assert_allclose(mesh.attributes[""], 0.75)


def test_an_attribute_that_a_mesh_does_not_have_is_not_there():
    mesh, warnings = mesh_with(attribute_material("Wear"))
    assert (mesh.attributes, warnings) == ({}, [])


def test_attributes_of_edges_are_named():
    mesh, warnings = mesh_with(attribute_material("Wear"), lambda mesh: mesh.attributes.new("Wear", "FLOAT", "EDGE"))
    assert mesh.attributes == {}
    assert warnings == ['mesh "Quad": Rooks does not read its attribute "Wear" (float on edge)']


def test_uv_maps_are_attributes():
    texture, paint = fed("ShaderNodeTexImage", image=image())
    feed(texture.inputs["Vector"], "ShaderNodeUVMap", uv_map="UVMap")
    mesh, _warnings = mesh_with(paint)
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    np.testing.assert_array_equal(mesh.attributes["UVMap"], corners[mesh.triangles])
    assert mesh.uvs is None


def test_attributes_of_modifiers_are_read():
    def prepare(mesh):
        mesh.attributes.new("Wear", "FLOAT", "POINT").data.foreach_set("value", NUMBERS.astype(np.float32))

    obj = quad()
    prepare(obj.data)
    obj.modifiers.new("Rows", "ARRAY").count = 2
    obj.data.materials.append(attribute_material("Wear"))
    mesh = export()[0].instances[0].mesh
    np.testing.assert_allclose(mesh.attributes["Wear"][..., 0], NUMBERS[mesh.triangles % 4])


# Tangents on meshes


def test_only_normal_maps_in_tangent_space_ask_for_tangents():
    mesh, _warnings = mesh_with(normal_of("ShaderNodeNormalMap", space="OBJECT")[1])
    assert mesh.tangents is None
    mesh, _warnings = mesh_with(normal_of("ShaderNodeNormalMap")[1])
    np.testing.assert_allclose(mesh.tangents, np.tile((1, 0, 0, 1), (2, 3, 1)), atol=1e-6)


def test_a_normal_map_has_a_uv_map_of_its_own():
    def prepare(mesh):
        turned = np.array([0, 0, 0, 1, -1, 1, -1, 0], np.float32)  # u grows along -y, v along x
        mesh.uv_layers.new(name="Second").uv.foreach_set("vector", turned)

    mesh, _warnings = mesh_with(normal_of("ShaderNodeNormalMap", uv_map="Second")[1], prepare)
    np.testing.assert_allclose(mesh.tangents, np.tile((0, -1, 0, 1), (2, 3, 1)), atol=1e-6)


def test_without_a_uv_map_there_are_no_tangents():
    mesh, warnings = mesh_with(
        normal_of("ShaderNodeNormalMap")[1], lambda mesh: mesh.uv_layers.remove(mesh.uv_layers[0])
    )
    text = "it has no UV map for its normal map, which is turned as if u grew along the world's X"
    assert (mesh.tangents, warnings) == (None, [f'mesh "Quad": {text}'])


def test_a_normal_map_with_a_uv_map_that_is_not_there_is_left_out():
    mesh, warnings = mesh_with(normal_of("ShaderNodeNormalMap", uv_map="Lost")[1])
    np.testing.assert_array_equal(mesh.tangents, np.tile((0, 0, 1, 0), (2, 3, 1)))
    assert warnings == ['mesh "Quad": it has no UV map "Lost" for its normal map, which is left out']


@pytest.mark.parametrize("number", [0, np.nan, np.inf])
def test_a_normal_map_on_texture_coordinates_without_a_direction_is_turned_as_in_blender(number):
    """As if u grew along the mesh's X; what is no number is told."""

    def prepare(mesh):
        mesh.uv_layers[0].uv.foreach_set("vector", np.full(8, number, np.float32))

    mesh, warnings = mesh_with(normal_of("ShaderNodeNormalMap")[1], prepare)
    np.testing.assert_array_equal(mesh.tangents, np.tile((1, 0, 0, -1), (2, 3, 1)))
    text = "6 of its texture coordinates are NaN or infinite, and taken for 0: unwrap it again"
    assert warnings == [f'mesh "Quad": {text}'] * (number != 0)


def test_several_uv_maps_for_normals_are_named():
    first, second = (normal_of("ShaderNodeNormalMap", uv_map=name)[1] for name in ("", "Second"))

    def prepare(mesh):
        mesh.uv_layers.new(name="Second")
        mesh.materials.append(first)

    _mesh, warnings = mesh_with(second, prepare)
    assert warnings == ['mesh "Quad": its normal maps use several UV maps, and get one']
