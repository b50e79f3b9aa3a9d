"""What the tests of the add-on share: an empty scene, and short ways to put things into it."""

from __future__ import annotations

import bpy
import numpy as np

import addon
from addon.export import export_scene

addon.register()


def empty_scene(width: int = 32, height: int = 24) -> bpy.types.Scene:
    """A new file with a camera at the origin's +Z that looks down, and nothing else."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "ROOKS"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.camera = add("Camera", bpy.data.cameras.new("Camera"), location=(0, 0, 10))
    return scene


def add(name: str, data: bpy.types.ID | None, location=(0, 0, 0), **properties) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    for key, value in properties.items():
        setattr(obj, key, value)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def quad(name: str = "Quad", size: float = 2.0, **properties) -> bpy.types.Object:
    """A square in the XY plane with UVs from 0 to 1."""
    h = size / 2
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    return add(name, mesh, **properties)


def lamp(kind: str, energy: float = 10.0, location=(0, 0, 5), name: str = "Lamp", **properties) -> bpy.types.Object:
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    for key, value in properties.items():
        setattr(data, key, value)
    return add(name, data, location=location)


def material(name: str = "Paint") -> tuple[bpy.types.Material, bpy.types.NodeTree, bpy.types.Node]:
    """A material with nothing but an output node."""
    paint = bpy.data.materials.new(name)
    if not paint.node_tree:
        paint.use_nodes = True
    paint.node_tree.nodes.clear()
    output = paint.node_tree.nodes.new("ShaderNodeOutputMaterial")
    return paint, paint.node_tree, output


def shader(kind: str, name: str = "Paint", **inputs) -> tuple[bpy.types.Material, bpy.types.Node]:
    """A material with one shader node, its inputs set."""
    paint, tree, output = material(name)
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return paint, node


def feed(socket: bpy.types.NodeSocket, kind: str, output: int | str = 0, **properties) -> bpy.types.Node:
    """A new node linked into a socket."""
    tree = socket.id_data
    node = tree.nodes.new(kind)
    for key, value in properties.items():
        setattr(node, key, value)
    tree.links.new(node.outputs[output], socket)
    return node


def export() -> tuple:
    """The core's scene of the current file, and the warnings."""
    return export_scene(bpy.context.evaluated_depsgraph_get())
