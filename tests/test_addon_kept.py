"""What is kept of one export for the next: meshes that have not changed, and nothing that has."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy

import core
from addon.camera import export_camera
from addon.export import export_scene
from addon.kept import Kept
from tests.addon_helpers import add, empty_scene, quad


@pytest.fixture
def scene():
    scene = empty_scene()
    quad("A")
    quad("B").location.z = 1.0
    return scene


def export(kept: Kept) -> dict[str, core.scene.Mesh]:
    """The meshes by their objects, after Blender has said what has changed, which it does in handlers alone."""

    def forget(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        kept.forget_changed(depsgraph)

    bpy.app.handlers.depsgraph_update_post.append(forget)
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.remove(forget)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    exported, _ = export_scene(depsgraph, export_camera(depsgraph, (32, 24)), kept)
    return {instance.name: instance.mesh for instance in exported.instances}


def test_what_only_moves_is_not_read_again(scene):
    kept = Kept(1)
    before = export(kept)
    bpy.data.objects["A"].location.x = 5.0
    after = export(kept)
    assert all(after[name] is before[name] for name in ("A", "B"))


def test_a_changed_material_does_not_read_meshes_again(scene):
    material = bpy.data.materials.new("paint")
    material.use_nodes = True
    bpy.data.objects["A"].data.materials.append(material)
    kept = Kept(1)
    before = export(kept)
    material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.1
    after = export(kept)
    assert all(after[name] is before[name] for name in ("A", "B"))


def test_a_changed_mesh_is_read_again_and_no_other(scene):
    kept = Kept(1)
    before = export(kept)
    mesh = bpy.data.objects["A"].data
    mesh.vertices[0].co.z = 7.0
    mesh.update()
    after = export(kept)
    assert after["A"].vertices[:, 2].max() == 7
    assert after["B"] is before["B"]


def test_a_changed_modifier_is_a_changed_mesh(scene):
    modifier = bpy.data.objects["A"].modifiers.new("more", "ARRAY")
    kept = Kept(1)
    before = export(kept)
    modifier.count = 5
    after = export(kept)
    assert len(after["A"].triangles) > len(before["A"].triangles)
    assert after["B"] is before["B"]


def test_new_objects_appear_and_removed_ones_are_forgotten(scene):
    kept = Kept(1)
    export(kept)
    add("C", bpy.data.objects["B"].data.copy())
    bpy.data.objects.remove(bpy.data.objects["A"])
    assert set(export(kept)) == {"B", "C"}
    assert len(kept.meshes) == 2


def test_what_a_new_material_looks_up_is_added(scene):
    kept = Kept(1)
    assert export(kept)["A"].uvs is None
    material = bpy.data.materials.new("picture")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    image = nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.new("grey", 2, 2)
    material.node_tree.links.new(image.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    bpy.data.objects["A"].data.materials.append(material)
    assert export(kept)["A"].uvs is not None


def test_a_changed_image_is_read_again(scene):
    kept = Kept(1)
    image = bpy.data.images.new("grey", 2, 2, float_buffer=True)
    export(kept)
    before = kept.images.colors(image).copy()
    image.pixels.foreach_set(np.full(16, 0.5, np.float32))
    image.update()
    image.update_tag()
    export(kept)
    assert not np.array_equal(kept.images.colors(image), before)
