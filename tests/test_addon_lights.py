"""Lamps keep Cycles' units: watts, areas, angles, colours and what switches them off."""

from __future__ import annotations

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Euler  # noqa: E402

from core.errors import SceneError  # noqa: E402
from core.scene import (  # noqa: E402
    VISIBLE_TO_DIFFUSE,
    VISIBLE_TO_GLOSSY,
    VISIBLE_TO_SURFACES,
    VISIBLE_TO_TRANSMISSION,
    AreaLight,
    PointLight,
    SpotLight,
    SunLight,
)
from tests.addon_helpers import add, empty_scene, export, feed, lamp  # noqa: E402

has_normalize = pytest.mark.skipif(bpy.app.version < (4, 5), reason="lamps have this from Blender 4.5 on")


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def only_light():
    scene, warnings = export()
    assert warnings == []
    (light,) = scene.lights
    return light


def test_point_light():
    lamp("POINT", 40, location=(1, 2, 3), color=(1, 0.5, 0.25), shadow_soft_size=0.3, use_soft_falloff=False)
    light = only_light()
    assert type(light) is PointLight
    assert light.position == (1, 2, 3)
    assert light.power == (40, 20, 10)
    assert light.radius == pytest.approx(0.3)
    assert (light.soft_falloff, light.cast_shadow, light.name) == (False, True, "Lamp")


def test_the_radius_of_a_sphere_ignores_the_scale():
    lamp("POINT", shadow_soft_size=0.5).scale = (3, 3, 3)
    assert only_light().radius == 0.5


def test_spot_light_keeps_its_cone_and_matrix():
    spot = lamp("SPOT", 40, spot_size=1.0, spot_blend=0.4)
    spot.rotation_euler, spot.scale = Euler((0.3, 0.2, 0.1)), (1, 2, 1)
    light = only_light()
    assert type(light) is SpotLight
    assert (light.spot_size, light.blend) == (pytest.approx(1.0), pytest.approx(0.4))
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(light.matrix, np.array(spot.matrix_world))


@pytest.mark.parametrize(
    ("shape", "full_v", "kind"),
    [("SQUARE", 2, "rectangle"), ("RECTANGLE", 3, "rectangle"), ("DISK", 2, "ellipse"), ("ELLIPSE", 3, "ellipse")],
)
def test_area_light_has_full_scaled_axes(shape, full_v, kind):
    lamp("AREA", 10, shape=shape, size=2, size_y=3).scale = (2, 5, 1)
    light = only_light()
    assert type(light) is AreaLight
    assert light.shape == kind
    np.testing.assert_allclose(light.axis_u, (4, 0, 0))
    np.testing.assert_allclose(light.axis_v, (0, 5 * full_v, 0))
    assert light.power == (10, 10, 10)


def test_sun_points_back_to_itself_with_its_irradiance():
    sun = lamp("SUN", 3, color=(1, 1, 0.5), angle=math.radians(2))
    sun.rotation_euler, sun.scale = Euler((math.pi / 2, 0, 0)), (2, 2, 2)
    light = only_light()
    assert type(light) is SunLight
    np.testing.assert_allclose(light.direction, (0, -1, 0), atol=1e-7)
    assert light.irradiance == (3, 3, 1.5)
    assert light.angle == pytest.approx(math.radians(2))


@has_normalize
@pytest.mark.parametrize(
    ("kind", "properties", "gain"),
    [
        ("POINT", {"shadow_soft_size": 0.5}, 4 * math.pi * 0.25),
        ("POINT", {"shadow_soft_size": 0.0}, 4),
        ("AREA", {"shape": "RECTANGLE", "size": 2, "size_y": 3}, 6),
        ("AREA", {"shape": "ELLIPSE", "size": 2, "size_y": 3}, 6 * math.pi / 4),
        ("SUN", {"angle": 0.2}, math.pi * math.sin(0.1) ** 2),
        ("SUN", {"angle": 0.0}, 1),
    ],
)
def test_a_lamp_that_is_not_normalized_shines_per_area(kind, properties, gain):
    lamp(kind, 10, normalize=False, **properties)
    light = only_light()
    emitted = light.irradiance if kind == "SUN" else light.power
    assert emitted == pytest.approx((10 * gain,) * 3, rel=1e-6)


@has_normalize
def test_exposure_and_temperature():
    tinted = lamp("POINT", 10, exposure=2, use_temperature=True, temperature=3000)
    assert only_light().power == pytest.approx([40 * c for c in tinted.data.temperature_color], rel=1e-6)


def test_a_lamp_without_shadow():
    lamp("POINT", use_shadow=False)
    assert only_light().cast_shadow is False


KINDS = ["POINT", "SPOT", "AREA", "SUN"]
RAYS = {"diffuse": VISIBLE_TO_DIFFUSE, "glossy": VISIBLE_TO_GLOSSY, "transmission": VISIBLE_TO_TRANSMISSION}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ray", RAYS)
def test_a_lamp_lights_the_kinds_of_reflection_that_see_it(kind, ray):
    bulb = lamp(kind)
    assert only_light().visibility == VISIBLE_TO_SURFACES
    setattr(bulb, f"visible_{ray}", False)
    assert only_light().visibility == VISIBLE_TO_SURFACES & ~RAYS[ray]


@pytest.mark.parametrize("kind", KINDS)
def test_a_lamp_that_no_surface_sees_is_left_out(kind):
    bulb = lamp(kind)
    for ray in RAYS:
        setattr(bulb, f"visible_{ray}", False)
    assert export()[0].lights == ()


def test_a_lamp_that_the_camera_should_see_is_named():
    lamp("POINT", name="Bulb").visible_camera = True
    assert export()[1] == ['light "Bulb": Rooks does not show lamps to the camera']


def test_lamps_that_shed_no_light_are_left_out():
    lamp("POINT", 0)
    lamp("AREA", 10, size=1).scale = (0, 1, 1)
    lamp("POINT", 10).hide_set(True)
    lamp("POINT", 10, color=(0, 0, 0))
    assert export()[0].lights == ()


@pytest.mark.parametrize(
    ("kind", "properties", "scale"),
    [("AREA", {"size": 0}, 1), ("AREA", {}, 0), ("SUN", {}, 0), ("SPOT", {}, 0)],
    ids=["area of no size", "area", "sun", "spot"],
)
def test_a_lamp_of_no_size_sheds_no_light_and_is_named(kind, properties, scale):
    lamp(kind, 10, name="Key", **properties).scale = (scale,) * 3
    scene, warnings = export()
    assert (scene.lights, warnings) == ((), ['light "Key": it has a size or a scale of 0, and sheds no light'])


def test_the_scale_of_a_point_lamp_does_not_matter():
    lamp("POINT", 10, name="Key").scale = (0, 0, 0)
    assert only_light().power == (10, 10, 10)


def test_a_lamp_that_is_nowhere_is_named():
    lamp("POINT", 10, location=(float("nan"), 0, 0), name="Lost")
    with pytest.raises(SceneError, match='light "Lost" is nowhere'):
        export()


def test_instanced_lamps_are_placed_by_their_instances():
    inner = bpy.data.collections.new("Inner")
    data = bpy.data.lights.new("Bulb", "POINT")
    inner.objects.link(bpy.data.objects.new("Bulb", data))
    for x in (1, 2, 3):
        add(f"Place {x}", None, location=(x, 0, 0), instance_type="COLLECTION", instance_collection=inner)
    assert sorted(light.position for light in export()[0].lights) == [(1, 0, 0), (2, 0, 0), (3, 0, 0)]


def test_a_narrow_spread_is_named():
    lamp("AREA", spread=math.radians(90), name="Softbox")
    assert export()[1] == ['light "Softbox": Rooks lights every direction, as with a spread of 180°, not 90°']


def emission_of(light) -> bpy.types.Node:
    light.use_nodes = True
    return next(node for node in light.node_tree.nodes if node.type == "EMISSION")


def test_constant_emission_node_multiplies():
    emission = emission_of(lamp("POINT", 10).data)
    emission.inputs["Color"].default_value = (1, 0.5, 0.25, 1)
    emission.inputs["Strength"].default_value = 3
    assert only_light().power == (30, 15, 7.5)


def test_other_nodes_of_a_lamp_are_named():
    emission = emission_of(lamp("POINT", 10, name="Gobo").data)
    feed(emission.inputs["Color"], "ShaderNodeTexNoise", "Color", name="Clouds")
    scene, warnings = export()
    assert scene.lights[0].power == (5, 5, 5)
    assert len(warnings) == 1
    assert all(name in warnings[0] for name in ("Gobo", "Clouds"))


def test_what_varies_over_a_lamp_is_taken_for_one_half_and_named():
    emission = emission_of(lamp("POINT", 10, name="Gobo").data)
    feed(emission.inputs["Color"], "ShaderNodeTexChecker")
    emission.inputs["Strength"].default_value = 3
    scene, warnings = export()
    assert scene.lights[0].power == (15, 15, 15)
    text = "its nodes give it light that is not the same everywhere, and what varies is taken for 0.5"
    assert warnings == [f'light "Gobo": {text}']


def test_nodes_of_a_lamp_that_are_constant_are_worked_out():
    emission = emission_of(lamp("POINT", 10).data)
    strength = feed(emission.inputs["Strength"], "ShaderNodeMath", operation="MULTIPLY")
    feed(strength.inputs[0], "ShaderNodeRGB").outputs[0].default_value = (1, 0, 0, 1)
    strength.inputs[1].default_value = 2
    assert only_light().power == pytest.approx((10 * 2 * 0.2126729,) * 3, rel=1e-6)


def test_shaders_of_a_lamp_are_mixed_and_added():
    emission = emission_of(lamp("POINT", 10).data)
    tree, output = emission.id_data, emission.outputs[0].links[0].to_socket
    mix = feed(output, "ShaderNodeMixShader")
    mix.inputs["Fac"].default_value = 0.25
    emission.inputs["Strength"].default_value = 2
    tree.links.new(emission.outputs[0], mix.inputs[1])
    add_shader = feed(mix.inputs[2], "ShaderNodeAddShader")
    for socket in add_shader.inputs:
        feed(socket, "ShaderNodeEmission").inputs["Color"].default_value = (1, 0, 0, 1)
    assert only_light().power == (10 * (1.5 + 0.25 * 2), 15, 15)


def test_a_mirrored_area_lamp_shines_along_its_own_negative_z():
    lamp("AREA", 10, size=2).scale = (-1, 3, 1)
    light = only_light()
    np.testing.assert_allclose(np.cross(light.axis_v, light.axis_u), (0, 0, -12))


def test_a_sun_of_half_the_sky():
    lamp("SUN", 3, angle=math.pi)  # which Blender keeps as a little more
    assert only_light().angle == math.pi


def test_a_portal_does_not_shine():
    lamp("AREA", 10).data.cycles.is_portal = True
    scene, warnings = export()
    assert (scene.lights, warnings) == ((), [])


def test_what_rooks_does_not_do_with_a_lamp_is_named():
    bulb = lamp("POINT", name="Bulb")
    bulb.light_linking.receiver_collection = bpy.data.collections.new("Lit")
    bulb.light_linking.blocker_collection = bpy.data.collections.new("Blocking")
    bulb.data.cycles.max_bounces = 2
    assert export()[1] == [
        'light "Bulb": Rooks has no light linking, and it lights everything',
        'light "Bulb": Rooks has no shadow linking, and everything casts a shadow in its light',
        'light "Bulb": Rooks does not leave it out after its 2 bounces',
    ]
