"""What the tests of the add-on share: an empty scene, and short ways to put things into it."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import bpy
import numpy as np

import addon
from addon import versions
from addon.camera import export_camera, frame_resolution
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
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return export_scene(depsgraph, export_camera(depsgraph, frame_resolution(depsgraph.scene_eval.render)))


def exported(paint: bpy.types.Material) -> tuple:
    """The core's material of a quad that has this one, and the warnings."""
    quad().data.materials.append(paint)
    scene, warnings = export()
    return scene.instances[-1].materials[0], warnings


def fed(kind: str, output: int | str = 0, **properties) -> tuple[bpy.types.Node, bpy.types.Material]:
    """A new node whose output is the colour of a diffuse material; and that material."""
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    return feed(diffuse.inputs["Color"], kind, output, **properties), paint


def value_of(paint: bpy.types.Material) -> tuple:
    """The core's value of the colour of a material made by `fed`, and the warnings."""
    material, warnings = exported(paint)
    return material.surface.color, warnings


def image(name: str = "Tiles", opacity: float = 1.0, **options) -> bpy.types.Image:
    """2 × 2 pixels: red and green below, blue and white above."""
    tiles = bpy.data.images.new(name, 2, 2, alpha=opacity < 1.0, **options)
    colors = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], np.float32)
    tiles.pixels.foreach_set(np.hstack([colors, np.full((4, 1), opacity, np.float32)]).ravel())
    return tiles


def render_with_cycles(path) -> np.ndarray:
    """What Cycles shows at the middle of each pixel, (height, width, 3) float32, lowest row first."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    settings = scene.render.image_settings
    versions.choose_file_format(settings, "OPEN_EXR")
    settings.color_depth = "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(str(path), check_existing=False)
    pixels = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(pixels)
    return pixels.reshape(picture.size[1], picture.size[0], -1)[..., :3]


def plain(tree):
    """A tree of values or shaders as nested tuples, which can be compared; numbers have six digits."""
    if is_dataclass(tree):
        return (type(tree).__name__, *(plain(getattr(tree, field.name)) for field in fields(tree)))
    if isinstance(tree, np.ndarray):
        return (tree.shape, plain(tuple(tree.ravel().tolist())))
    if isinstance(tree, tuple):
        return tuple(plain(part) for part in tree)
    if isinstance(tree, int | float) and not isinstance(tree, bool):
        return float(f"{tree:.6g}") + 0.0
    return tree
