"""Node trees mean the same in Cycles: rendered there, and computed here from what was exported, they agree."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.addon_helpers import (  # noqa: E402
    add,
    empty_scene,
    export,
    feed,
    image,
    quad,
    render_with_cycles,
    shader,
)
from tests.naive_values import Hits, evaluate  # noqa: E402

#: Pixels along each side of a quad, which has sides of 2.
SIDE = 8
#: What may differ more than by float32's rounding. Cycles divides colours by their opacity after it has rounded their
#: product to 8 bits, and Rooks never multiplies them. Bytes are made linear there by Cycles, here by Blender.
ROUNDED = {
    "straight_colours_where_opacity_is_used": 0.03,
    "colour_attribute_of_bytes": 3e-4,
    "colour_attribute_without_a_name": 3e-4,
}

Build = Callable[[bpy.types.NodeSocket], None]
CASES: dict[str, Build] = {}


def case(build: Build) -> Build:
    """A tree of nodes that feeds a colour."""
    CASES[build.__name__] = build
    return build


def picture(socket, output=0, **options):
    """An image texture looked up by UV; its opacity varies."""
    tiles = bpy.data.images.get("Tiles") or _tiles()
    return feed(socket, "ShaderNodeTexImage", output, image=tiles, **options)


def _tiles():
    tiles = bpy.data.images.new("Tiles", 4, 3, alpha=True)
    tiles.pixels.foreach_set(np.random.default_rng(1).uniform(0, 1, 48).astype(np.float32))
    return tiles


def _udim_tile():
    tile = image("Tile")
    tile.filepath_raw, tile.file_format = f"{bpy.app.tempdir}/tile.1001.png", "PNG"
    tile.save()
    loaded = bpy.data.images.load(tile.filepath_raw)
    loaded.source, loaded.filepath = "TILED", f"{bpy.app.tempdir}/tile.<UDIM>.png"
    return loaded


def coordinates(socket, output="UV"):
    return feed(socket, "ShaderNodeTexCoord", output)


def mapped(socket, kind, output="UV"):
    """UV coordinates behind a mapping."""
    node = feed(socket, "ShaderNodeMapping", vector_type=kind)
    if kind in ("POINT", "TEXTURE"):
        node.inputs["Location"].default_value = (0.3, -0.2, 0.1)
    node.inputs["Rotation"].default_value = (0.2, 0.1, 0.7)
    node.inputs["Scale"].default_value = (1.5, 0.7, 2.0)
    coordinates(node.inputs["Vector"], output)
    return node


@case
def image_of_associated_colours(socket):
    picture(socket)


@case
def closest_image(socket):
    picture(socket, interpolation="Closest")


@case
def clipped_and_moved_image(socket):
    mapped(picture(socket, extension="CLIP").inputs["Vector"], "POINT")


@case
def mirrored_and_moved_image(socket):
    mapped(picture(socket, extension="MIRROR").inputs["Vector"], "TEXTURE")


@case
def opacity_of_an_image(socket):
    picture(socket, "Alpha", interpolation="Closest")


@case
def straight_colours_where_opacity_is_used(socket):
    mix = feed(socket, "ShaderNodeMixRGB")
    node = picture(mix.inputs["Color1"], interpolation="Closest")
    socket.id_data.links.new(node.outputs["Alpha"], mix.inputs["Fac"])


@case
def opacity_that_leads_nowhere(socket):
    node = picture(socket)
    loose = socket.id_data.nodes.new("ShaderNodeMath")
    socket.id_data.links.new(node.outputs["Alpha"], loose.inputs[0])


@case
def tile_of_an_image(socket):
    node = feed(socket, "ShaderNodeTexImage", image=_udim_tile())
    mapped(node.inputs["Vector"], "POINT")


def vector_to_color(vector, hide_value=False):
    """A group with these sockets, and the socket within it that makes its Color."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    made = tree.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector")
    made.default_value, made.hide_value = vector, hide_value
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    return tree, tree.nodes.new("NodeGroupOutput").inputs[0]


@case
def texture_in_a_group_whose_vector_is_not_linked(socket, hide_value=False):
    tree, color = vector_to_color((0.1, 0.9, 0), hide_value)
    feed(picture(color).inputs["Vector"], "NodeGroupInput")
    return feed(socket, "ShaderNodeGroup", node_tree=tree)


@case
def texture_in_a_group_whose_vector_has_no_value(socket):
    texture_in_a_group_whose_vector_is_not_linked(socket, hide_value=True)


@case
def texture_in_a_group_in_a_group_whose_vector_is_not_linked(socket):
    tree, color = vector_to_color((0.9, 0.2, 0))
    inner = texture_in_a_group_whose_vector_is_not_linked(color)
    feed(inner.inputs["Vector"], "NodeGroupInput")
    feed(socket, "ShaderNodeGroup", node_tree=tree)


@case
def texture_behind_a_loose_reroute(socket):
    feed(picture(socket).inputs["Vector"], "NodeReroute")


@case
def data_image(socket):
    feed(socket, "ShaderNodeTexImage", image=image("Data", is_data=True))


@case
def texture_mapping_of_the_sidebar(socket):
    mapping = picture(socket).texture_mapping
    mapping.vector_type, mapping.scale = "TEXTURE", (2, 3, 1)
    mapping.rotation, mapping.translation = (0, 0, 0.5), (0.1, 0.2, 0)
    mapping.mapping_x, mapping.mapping_y = "Y", "X"


@case
def generated_checks(socket):
    node = feed(socket, "ShaderNodeTexChecker")
    node.inputs["Scale"].default_value = 4.1


@case
def checks_by_another_object(socket):
    node = feed(socket, "ShaderNodeTexChecker")
    feed(node.inputs["Vector"], "ShaderNodeTexCoord", "Object", object=bpy.data.objects["Projector"])
    node.inputs["Scale"].default_value = 1.7


@case
def object_coordinates(socket):
    coordinates(socket, "Object")


@case
def position(socket):
    feed(socket, "ShaderNodeNewGeometry", "Position")


@case
def vectors_mapped(socket):
    mapped(socket, "VECTOR")


@case
def normals_mapped(socket):
    mapped(socket, "NORMAL", "Object")


@case
def named_uv_map(socket):
    feed(socket, "ShaderNodeUVMap", uv_map="Second")


@case
def attribute_of_points(socket):
    feed(socket, "ShaderNodeAttribute", "Color", attribute_name="Points")


@case
def factor_of_an_attribute(socket):
    feed(socket, "ShaderNodeAttribute", 2, attribute_name="Points")


@case
def factor_of_two_components(socket):
    feed(socket, "ShaderNodeAttribute", 2, attribute_name="UVMap")


@case
def opacity_of_an_attribute(socket):
    feed(socket, "ShaderNodeAttribute", "Alpha", attribute_name="Points")


@case
def normals_as_coordinates(socket):
    coordinates(socket, "Normal")


@case
def attribute_of_faces(socket):
    feed(socket, "ShaderNodeAttribute", "Vector", attribute_name="Faces")


@case
def colour_attribute_of_bytes(socket):
    feed(socket, "ShaderNodeVertexColor", layer_name="Bytes")


@case
def colour_attribute_without_a_name(socket):
    feed(socket, "ShaderNodeVertexColor")


@case
def attribute_that_is_not_there(socket):
    feed(socket, "ShaderNodeAttribute", "Color", attribute_name="Nowhere")


@case
def luminance_of_a_colour(socket):
    picture(feed(socket, "ShaderNodeMath", operation="SQRT").inputs[0])


@case
def mean_of_a_vector(socket):
    coordinates(feed(socket, "ShaderNodeMath", operation="SQRT").inputs[0])


@case
def ramp(socket):
    node = feed(socket, "ShaderNodeValToRGB")
    node.color_ramp.interpolation = "EASE"
    node.color_ramp.elements[0].color = (1, 0.2, 0.1, 0.5)
    coordinates(node.inputs["Fac"])


@case
def opacity_of_a_stepped_ramp(socket):
    node = feed(socket, "ShaderNodeValToRGB", "Alpha")
    node.color_ramp.interpolation = "CONSTANT"
    node.color_ramp.elements[0].color = (1, 0.2, 0.1, 0.5)
    node.color_ramp.elements[1].position = 0.4
    coordinates(node.inputs["Fac"])


def mix_colors(socket, blend, **options):
    node = feed(socket, "ShaderNodeMix", "Result", data_type="RGBA", blend_type=blend, **options)
    a, b = (s for s in node.inputs if s.enabled and s.type == "RGBA")
    picture(a)
    coordinates(b)
    node.inputs["Factor"].default_value = 0.7
    return node


@case
def added_colours(socket):
    mix_colors(socket, "ADD", clamp_result=True)


@case
def differing_colours(socket):
    mix_colors(socket, "DIFFERENCE")


@case
def vectors_mixed_by_a_vector(socket):
    node = feed(socket, "ShaderNodeMix", "Result", data_type="VECTOR", factor_mode="NON_UNIFORM")
    factor, a, b = (s for s in node.inputs if s.enabled)
    coordinates(factor)
    picture(a)
    b.default_value = (0.1, 0.9, 0.4)


@case
def numbers_mixed(socket):
    node = feed(socket, "ShaderNodeMix", "Result", data_type="FLOAT", clamp_factor=False)
    factor, a, b = (s for s in node.inputs if s.enabled)
    coordinates(factor)
    a.default_value, b.default_value = 0.3, 0.9


@case
def range_mapped_smoothly(socket):
    node = feed(socket, "ShaderNodeMapRange", interpolation_type="SMOOTHERSTEP")
    coordinates(node.inputs["Value"])
    node.inputs["From Min"].default_value, node.inputs["From Max"].default_value = 0.2, 0.5
    node.inputs["To Min"].default_value, node.inputs["To Max"].default_value = 0.9, 0.1


@case
def vector_mapped_to_a_range(socket):
    node = feed(socket, "ShaderNodeMapRange", 1, data_type="FLOAT_VECTOR", interpolation_type="SMOOTHSTEP")
    coordinates(node.inputs["Vector"])


@case
def clamped_between_bounds_the_wrong_way_round(socket):
    node = feed(socket, "ShaderNodeClamp", clamp_type="RANGE")
    coordinates(node.inputs["Value"])
    node.inputs["Min"].default_value, node.inputs["Max"].default_value = 0.5, 0.2


@case
def separated_and_combined(socket):
    node = feed(socket, "ShaderNodeCombineColor")
    for index, name in ((2, "Red"), (0, "Green")):
        picture(feed(node.inputs[name], "ShaderNodeSeparateColor", index).inputs[0])


@case
def saturation_and_value(socket):
    node = feed(socket, "ShaderNodeCombineColor")
    for index, name in ((1, "Red"), (2, "Green")):
        picture(feed(node.inputs[name], "ShaderNodeSeparateColor", index, mode="HSV").inputs[0])


@case
def gray(socket):
    picture(feed(socket, "ShaderNodeRGBToBW").inputs[0])


@case
def inverted(socket):
    node = feed(socket, "ShaderNodeInvert")
    node.inputs[0].default_value = 0.8
    picture(node.inputs["Color"])


@case
def gamma(socket):
    node = feed(socket, "ShaderNodeGamma")
    node.inputs["Gamma"].default_value = 1.7
    picture(node.inputs["Color"])


@case
def brightness_and_contrast(socket):
    node = feed(socket, "ShaderNodeBrightContrast")
    node.inputs[1].default_value, node.inputs["Contrast"].default_value = -0.2, 0.6
    picture(node.inputs["Color"])


@case
def value_of_a_colour(socket):
    node = feed(socket, "ShaderNodeHueSaturation")
    node.inputs["Value"].default_value = 1.6
    picture(node.inputs["Color"])


def build_scene() -> None:
    """A row of quads, one for each case, that fills the picture; each shines with the case's colour."""
    scene = empty_scene(SIDE * len(CASES), SIDE)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2 * len(CASES)
    scene.camera.location = (len(CASES) - 1, 0, 10)
    add("Projector", None, location=(3, 2, 1), rotation_euler=(0.3, 0.2, 0.9), scale=(1.3, 0.8, 2.0))
    rng = np.random.default_rng(2)
    for place, (name, build) in enumerate(CASES.items()):
        paint, node = shader("ShaderNodeEmission", name)
        build(node.inputs["Color"])
        mesh = quad(name, location=(2 * place, 0, 0)).data
        mesh.uv_layers.new(name="Second").uv.foreach_set("vector", rng.uniform(0, 1, 8).astype(np.float32))
        points = mesh.attributes.new("Points", "FLOAT_COLOR", "POINT")
        points.data.foreach_set("color", rng.uniform(0, 1, 16).astype(np.float32))
        mesh.attributes.new("Faces", "FLOAT_VECTOR", "FACE").data[0].vector = (0.25, 0.5, 1)
        mesh.color_attributes.new("Bytes", "BYTE_COLOR", "CORNER").data.foreach_set(
            "color_srgb", rng.uniform(0, 1, 16).astype(np.float32)
        )
        mesh.color_attributes.render_color_index = mesh.color_attributes.find("Bytes")
        mesh.materials.append(paint)


def hits_on(instance) -> Hits:
    """The middles of the pixels that a quad fills, lowest row first."""
    mesh = instance.mesh
    middles = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    points = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    place = np.hstack([points, np.zeros((len(points), 1))])
    weights = np.zeros((len(points), len(mesh.triangles), 3))
    for index, triangle in enumerate(mesh.triangles):
        corners = np.vstack([mesh.vertices[triangle].T[:2], np.ones(3)])
        shares = np.linalg.solve(corners, np.vstack([points.T, np.ones(len(points))])).T
        inside = (shares > -1e-9).all(axis=1) & ~weights.any(axis=(1, 2))
        weights[inside, index] = shares[inside]

    def interpolated(values):
        return np.einsum("ntc,tcd->nd", weights, values)

    location, size = (np.array(part) for part in mesh.texture_space)
    uvs = np.zeros((len(mesh.triangles), 3, 2)) if mesh.uvs is None else mesh.uvs
    return Hits(
        {
            "uv": np.pad(interpolated(uvs), ((0, 0), (0, 1))),
            "generated": (place - location) / (2 * size) + 0.5,
            "object": place,
            "world": place + instance.matrix[:3, 3],
        },
        {"Nowhere": np.zeros((len(points), 3))}
        | {name: interpolated(values) for name, values in mesh.attributes.items()},
    )


@pytest.fixture(scope="module")
def pictures(tmp_path_factory) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """For each case what Cycles shows, and what the exported value is there."""
    build_scene()
    exported, warnings = export()
    assert warnings == []
    whole = render_with_cycles(tmp_path_factory.mktemp("cycles") / "values.exr")
    theirs = whole.reshape(SIDE, len(CASES), SIDE, 3).swapaxes(0, 1).reshape(len(CASES), SIDE**2, 3)
    ours = {
        instance.name: evaluate(instance.materials[0].surface.color, hits_on(instance))
        for instance in exported.instances
    }
    return {name: (theirs[place], ours[name]) for place, name in enumerate(CASES)}


@pytest.mark.parametrize("name", CASES)
def test_a_tree_means_what_it_means_in_cycles(pictures, name):
    theirs, ours = pictures[name]
    assert np.ptp(theirs) > 0.1 or name == "attribute_that_is_not_there"
    np.testing.assert_allclose(ours, theirs, atol=ROUNDED.get(name, 1e-5))
