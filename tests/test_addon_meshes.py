"""Everything that Blender would render as a mesh arrives, in its place, once, with the right materials."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix  # noqa: E402

from addon import versions  # noqa: E402
from core.errors import SceneError  # noqa: E402
from core.scene import (  # noqa: E402
    VISIBLE_TO_ALL,
    VISIBLE_TO_CAMERA,
    VISIBLE_TO_DIFFUSE,
    VISIBLE_TO_GLOSSY,
    VISIBLE_TO_SHADOWS,
    VISIBLE_TO_TRANSMISSION,
)
from tests.addon_helpers import add, empty_scene, export, feed, quad, shader  # noqa: E402


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def instances():
    scene, warnings = export()
    assert warnings == []
    return scene.instances


def areas(mesh) -> np.ndarray:
    corners = mesh.vertices[mesh.triangles]
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


def test_a_quad_is_two_triangles_in_its_place():
    quad(location=(1, 2, 3))
    (instance,) = instances()
    mesh = instance.mesh
    assert (mesh.vertices.dtype, mesh.triangles.dtype) == (np.float32, np.int32)
    assert mesh.triangles.shape == (2, 3)
    assert areas(mesh).sum() == pytest.approx(4)
    np.testing.assert_array_equal(instance.matrix[:3, 3], (1, 2, 3))
    assert instance.matrix.dtype == np.float64
    assert mesh.corner_normals is mesh.uvs is mesh.material_slots is None
    assert (instance.name, instance.visibility) == ("Quad", VISIBLE_TO_ALL)


def test_triangles_agree_with_blenders_own_table():
    bpy.ops.mesh.primitive_monkey_add()
    mesh = bpy.context.object.data
    mesh.calc_loop_triangles()
    expected = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", expected.reshape(-1))
    np.testing.assert_array_equal(instances()[0].mesh.triangles, expected)


def test_modifiers_are_applied():
    quad().modifiers.new("Rows", "ARRAY").count = 3
    assert areas(instances()[0].mesh).sum() == pytest.approx(12)


def test_subdivision_uses_the_evaluated_mesh():
    quad().modifiers.new("Fine", "SUBSURF").levels = 2
    assert len(instances()[0].mesh.triangles) == 32


def test_smooth_faces_have_vertex_normals():
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.ops.object.shade_smooth()
    mesh = instances()[0].mesh
    corners = mesh.vertices[mesh.triangles]
    assert mesh.corner_normals.shape == corners.shape
    outward = (mesh.corner_normals * corners).sum(axis=2) / np.linalg.norm(corners, axis=2)
    assert outward.min() > 0.99


def test_mixed_shading_keeps_flat_faces_flat():
    bpy.ops.mesh.primitive_cube_add()
    mesh = bpy.context.object.data
    mesh.shade_smooth()
    mesh.polygons[0].use_smooth = False
    exported = instances()[0].mesh
    corners = exported.vertices[exported.triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    is_flat = (np.abs(exported.corner_normals - face[:, None]) < 1e-5).all(axis=(1, 2))
    assert is_flat.sum() == 2


def test_texture_space_makes_generated_coordinates_from_0_to_1():
    quad(size=6).data.transform(Matrix.Translation((5, 0, 0)))
    mesh = instances()[0].mesh
    location, size = (np.array(part) for part in mesh.texture_space)
    generated = (mesh.vertices - location) / (2 * size) + 0.5
    np.testing.assert_allclose([generated.min(axis=0)[:2], generated.max(axis=0)[:2]], [[0, 0], [1, 1]], atol=1e-6)
    assert (size > 0).all()


def test_generated_coordinates_are_attributes_where_something_deforms_a_mesh():
    obj = quad(size=2)
    paint, node = shader("ShaderNodeEmission")
    feed(node.inputs["Color"], "ShaderNodeTexCoord", "Generated")
    obj.data.materials.append(paint)
    assert instances()[0].mesh.attributes == {}
    obj.modifiers.new("Wave", "WAVE")
    (instance,) = instances()
    assert instance.materials[0].surface.color.name == ".generated"
    generated = instance.mesh.attributes[".generated"]
    np.testing.assert_allclose([generated[..., :2].min(), generated[..., :2].max()], [0, 1], atol=1e-6)


def test_slots_and_their_materials():
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    paints = [shader("ShaderNodeBsdfDiffuse", name)[0] for name in "ABC"]
    for paint in paints:
        obj.data.materials.append(paint)
    obj.data.polygons[1].material_index = 1
    obj.data.polygons[4].material_index = 2
    (instance,) = instances()
    assert [m.name for m in instance.materials] == ["A", "B", "C"]
    np.testing.assert_array_equal(np.bincount(instance.mesh.material_slots), [8, 2, 2])


def test_faces_beyond_the_last_slot_use_the_last():
    obj = quad()
    obj.data.materials.append(shader("ShaderNodeBsdfDiffuse", "Only")[0])
    obj.data.polygons[0].material_index = 2
    (instance,) = instances()
    assert instance.mesh.material_slots.max() < len(instance.materials)
    assert {m.name for m in instance.materials} == {"Only"}


def test_two_objects_share_a_mesh_with_slots_of_their_own():
    first = quad("First")
    first.data.materials.append(shader("ShaderNodeBsdfDiffuse", "Mesh's")[0])
    second = add("Second", first.data)
    second.material_slots[0].link = "OBJECT"
    second.material_slots[0].material = shader("ShaderNodeBsdfDiffuse", "Object's")[0]
    one, two = sorted(instances(), key=lambda instance: instance.name)
    assert one.mesh is two.mesh
    assert (one.materials[0].name, two.materials[0].name) == ("Mesh's", "Object's")


def test_uvs_are_there_when_only_the_second_user_of_a_mesh_wants_them():
    first = quad("First")
    second = add("Second", first.data)
    first.data.materials.append(None)
    paint, node = shader("ShaderNodeBsdfDiffuse")
    image = bpy.data.images.new("Tiles", 2, 2)
    feed(node.inputs["Color"], "ShaderNodeTexImage", image=image)
    second.material_slots[0].link, second.material_slots[0].material = "OBJECT", paint
    one, two = instances()
    assert one.mesh is two.mesh
    assert one.mesh.uvs.shape == (2, 3, 2)


def test_a_texture_on_a_mesh_without_uvs_reads_zeros():
    obj = quad()
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    paint, node = shader("ShaderNodeBsdfDiffuse")
    feed(node.inputs["Color"], "ShaderNodeTexImage", image=bpy.data.images.new("Tiles", 2, 2))
    obj.data.materials.append(paint)
    np.testing.assert_array_equal(instances()[0].mesh.uvs, 0)


def make_text():
    bpy.ops.object.text_add()
    bpy.context.object.data.body = "R"


def make_curve():
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1


def make_surface():
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()


def make_metaballs():
    bpy.ops.object.metaball_add()
    bpy.ops.object.metaball_add(location=(1, 0, 0))


@pytest.mark.parametrize("make", [make_text, make_curve, make_surface, make_metaballs])
def test_other_kinds_of_object_arrive_once_as_meshes(make):
    make()
    paint = shader("ShaderNodeBsdfDiffuse", "Gold")[0]
    bpy.context.object.data.materials.append(paint)
    if make is make_metaballs:
        bpy.data.objects["Mball"].data.materials.append(paint)
    (instance,) = instances()
    assert areas(instance.mesh).sum() > 0.1
    assert [m.name for m in instance.materials] == ["Gold"]


def test_a_curve_without_surface_is_nothing_to_warn_about():
    bpy.ops.curve.primitive_bezier_circle_add()
    assert instances() == ()


def test_collection_instances_share_their_meshes():
    inner = bpy.data.collections.new("Inner")
    source = quad("Leaf")
    bpy.context.scene.collection.objects.unlink(source)
    inner.objects.link(source)
    for x in range(5):
        add(f"Place {x}", None, location=(x, 0, 0), instance_type="COLLECTION", instance_collection=inner)
    placed = instances()
    assert len({id(instance.mesh) for instance in placed}) == 1
    assert sorted(instance.matrix[0, 3] for instance in placed) == [0, 1, 2, 3, 4]


def test_hidden_objects_are_left_out():
    quad("Shown")
    quad("Hidden").hide_set(True)
    excluded = bpy.data.collections.new("Excluded")
    bpy.context.scene.collection.children.link(excluded)
    obj = quad("In excluded")
    bpy.context.scene.collection.objects.unlink(obj)
    excluded.objects.link(obj)
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    assert [instance.name for instance in instances()] == ["Shown"]


@pytest.mark.parametrize(
    ("ray", "bit"),
    [
        ("camera", VISIBLE_TO_CAMERA),
        ("diffuse", VISIBLE_TO_DIFFUSE),
        ("glossy", VISIBLE_TO_GLOSSY),
        ("transmission", VISIBLE_TO_TRANSMISSION),
        ("shadow", VISIBLE_TO_SHADOWS),
    ],
)
def test_each_kind_of_ray_has_its_bit(ray, bit):
    setattr(quad(), f"visible_{ray}", False)
    assert instances()[0].visibility == VISIBLE_TO_ALL & ~bit


def test_an_object_that_no_ray_sees_is_left_out():
    obj = quad()
    for ray in ("camera", "diffuse", "glossy", "transmission", "shadow"):
        setattr(obj, f"visible_{ray}", False)
    assert instances() == ()


def test_instances_are_as_visible_as_their_instancer_and_themselves():
    leaf, tree = quad("Leaf", size=0.4), quad("Tree", instance_type="VERTS")
    leaf.parent = tree
    leaf.visible_glossy, tree.visible_diffuse = False, False
    bits = {instance.visibility for instance in instances() if instance.name == "Leaf"}
    itself = VISIBLE_TO_ALL & ~VISIBLE_TO_GLOSSY
    assert bits == {itself, itself & ~VISIBLE_TO_DIFFUSE}


def test_an_indirect_only_collection_is_hidden_from_the_camera():
    quad()
    bpy.context.scene.collection.children.link(bpy.data.collections.new("Bounce"))
    obj = quad("Bouncer")
    bpy.context.scene.collection.objects.unlink(obj)
    bpy.data.collections["Bounce"].objects.link(obj)
    bpy.context.view_layer.layer_collection.children["Bounce"].indirect_only = True
    bits = {instance.name: instance.visibility for instance in instances()}
    assert bits == {"Quad": VISIBLE_TO_ALL, "Bouncer": VISIBLE_TO_ALL & ~VISIBLE_TO_CAMERA}


def test_a_material_override_counts_for_all():
    quad().data.materials.append(shader("ShaderNodeBsdfDiffuse", "Own")[0])
    bpy.context.view_layer.material_override = shader("ShaderNodeBsdfDiffuse", "Clay")[0]
    assert [m.name for m in instances()[0].materials] == ["Clay"]


def test_an_empty_mesh_is_named():
    add("Nothing", bpy.data.meshes.new("Nothing"))
    scene, warnings = export()
    assert scene.instances == ()
    assert warnings == ['object "Nothing" has no faces: there is nothing to render']


def test_vertices_that_are_not_numbers_are_an_error_that_counts_them():
    obj = quad("Broken")
    obj.data.vertices[1].co.x = float("nan")
    obj.data.vertices[2].co.y = float("inf")
    with pytest.raises(SceneError, match='object "Broken": 2 of its 4 vertices'):
        export()


def test_kinds_that_are_not_modelled_are_named():
    add("Fur", bpy.data.hair_curves.new("Fur"))
    assert export()[1] == ['object "Fur" is hair curves: Rooks leaves it out']


def test_a_mesh_in_edit_mode_is_rendered_as_edited():
    empty_scene()
    obj = quad()
    obj.modifiers.new("Array", "ARRAY")
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        exported, warnings = export()
        (instance,) = exported.instances
        assert (len(instance.mesh.vertices), len(instance.mesh.triangles), warnings) == (8, 4, [])
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_the_shadow_terminators_geometry_offset_arrives_and_its_shading_offset_is_named():
    obj = quad("Quad")
    assert instances()[0].lift_shadows_below == pytest.approx(0.1)
    owner = versions.shadow_terminator(obj)
    owner.shadow_terminator_geometry_offset = 0.3
    is_older = hasattr(owner, "shadow_terminator_offset")
    setattr(owner, "shadow_terminator_offset" if is_older else "shadow_terminator_shading_offset", 0.2)
    obj.update_tag()  # what an add-on's property, as in 4.2, does not do by itself
    scene, warnings = export()
    assert scene.instances[0].lift_shadows_below == pytest.approx(0.3)
    assert warnings == ['object "Quad": Rooks leaves out the Shading Offset of its shadow terminator']


def test_in_blender_4_3_cycles_has_the_shadow_terminators_offsets_and_without_it_they_are_the_defaults():
    cycles = SimpleNamespace(shadow_terminator_geometry_offset=0.3, shadow_terminator_offset=0.2)
    kind = SimpleNamespace(properties={"cycles"})
    changed = SimpleNamespace(cycles=cycles, bl_rna=kind, is_property_set=lambda name: True)
    unchanged = SimpleNamespace(bl_rna=kind, is_property_set=lambda name: False)
    without = SimpleNamespace(bl_rna=SimpleNamespace(properties=set()))
    offsets = [versions.shadow_terminator_offsets(obj) for obj in (changed, unchanged, without)]
    assert offsets == [(0.3, 0.2), (0.1, 0.0), (0.1, 0.0)]


def test_nothing_is_added_to_what_blender_has_evaluated():
    """Blender 4.3 does not free it: it ended with "Error: Not freed memory blocks"."""
    empty_scene()
    obj = quad()
    material, _ = shader("ShaderNodeEmission")
    obj.data.materials.append(material)
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    bpy.context.scene.collection.objects.link(lamp)
    export()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for block, name in ((obj, "cycles"), (material, "cycles"), (lamp.data, "cycles"), (world, "cycles_visibility")):
        evaluated = block.evaluated_get(depsgraph)
        assert name not in evaluated.bl_rna.properties or not evaluated.is_property_set(name)


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="normals are kept as they are given from Blender 4.5 on")
def test_custom_normals_without_a_direction_are_told_where_they_are_seen():
    obj = quad("Bent")
    obj.data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
    given = obj.data.attributes["custom_normal"].data
    for broken, count in (((0, 0, 0), 2), ((np.nan, 0, 0), 2), ((0, 0, 2), 0)):
        given.foreach_set("vector", np.array([broken, *[(0, 0, 1)] * 3], np.float32).ravel())
        obj.data.update()
        # One corner of the square, which two triangles share.
        advice = "recalculate them, or clear its custom normals"
        text = f"{count} of its normals are 0, NaN or infinite, and left out: {advice}"
        assert export()[1] == [f'mesh "Bent": {text}'] * (count > 0)
    given.foreach_set("vector", np.zeros(12, np.float32))
    obj.data.vertices.foreach_set("co", np.zeros(12, np.float32))  # no ray can hit what has no area
    obj.data.update()
    assert export()[1] == []


def test_attributes_that_are_no_numbers_are_told():
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    feed(diffuse.inputs["Color"], "ShaderNodeAttribute", attribute_name="Wear")
    obj = quad()
    obj.data.materials.append(paint)
    wear = obj.data.attributes.new("Wear", "FLOAT", "POINT")
    wear.data.foreach_set("value", [0.5, np.inf, 0.5, 0.5])
    text = '1 values of its attribute "Wear" are NaN or infinite, and taken for 0'
    assert export()[1] == [f'mesh "Quad": {text}']
    wear.data.foreach_set("value", [0.5] * 4)
    obj.data.update()
    assert export()[1] == []


def test_texture_coordinates_that_are_no_numbers_are_told():
    empty_scene()
    paint, color = shader("ShaderNodeBsdfDiffuse")
    feed(color.inputs["Color"], "ShaderNodeTexImage")
    obj = quad()
    obj.data.materials.append(paint)
    obj.data.uv_layers[0].uv[0].vector = np.nan, 0
    _scene, warnings = export()
    # One corner of the square, which two triangles share.
    assert any('mesh "Quad": 2 of its texture coordinates are NaN or infinite' in text for text in warnings)
