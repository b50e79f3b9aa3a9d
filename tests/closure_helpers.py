"""What the tests of closures share: views, the light of a white world that lobes reflect, and Cycles' answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from core.closures import View
from core.lobe_record import LOBE_SIZE
from tests.lobe_helpers import UP, F, direction, sample

#: Any list of lobes that these tests make has room here.
MAX_LOBES = 8
_POINTS = np.minimum(qmc.Sobol(3, seed=1).random(1 << 15), 1 - 2**-24)
#: Pixels across a square in Cycles' picture.
_PIXELS = 8


def vector(values) -> np.ndarray:
    return np.array(values, F)


def view_at(degrees: float, front: bool = True, g=UP) -> View:
    """From so many degrees off +z, towards +x."""
    return View(*vector(direction(np.cos(np.radians(degrees)))), *vector(g), front)


def lobes_of(append: Callable[..., int], *inputs) -> list[np.ndarray]:
    """The records that `append(lobes, *inputs)` makes; it returns where the next would begin."""
    lobes = np.zeros(MAX_LOBES * LOBE_SIZE, F)
    end = append(lobes, *inputs)
    return list(lobes[: int(end)].reshape(-1, LOBE_SIZE))


def albedo(lobes: list[np.ndarray], view: View) -> np.ndarray:
    """What lobes reflect and transmit of a white world's light to the viewer, (3,)."""
    if not lobes:
        return np.zeros(3)
    return sample(lobes, view[:3], _POINTS, view[3:6])[1].mean(0)


def cycles_albedos(materials: Sequence[tuple[Callable, float, bool]], folder: Path, samples: int = 512) -> np.ndarray:
    """What Cycles finds for squares of these materials, each seen alone in a white world, (n, 3).

    A material is a function from a node tree to the socket of its shader; then come the degrees from which the square
    is seen, and whether from the front.
    """
    import bpy
    import OpenEXR

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    side = math.ceil(math.sqrt(len(materials)))
    for i, material in enumerate(materials):
        _add_square(bpy, *material, i % side, i // side)
    _look_at_squares(bpy, scene, side)
    scene.render.engine = "CYCLES"
    settings = scene.cycles
    settings.samples, settings.use_adaptive_sampling, settings.use_denoising = samples, False, False
    settings.blur_glossy = settings.sample_clamp_indirect = 0
    settings.pixel_filter_type, settings.max_bounces = "BOX", 4
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(folder / "albedos.exr")
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(scene.render.filepath) as file:
        channels = file.channels()
        pixels = (channels.get("RGBA") or channels["RGB"]).pixels[::-1, :, :3].astype(np.float64)
    cells = pixels.reshape(side, _PIXELS, side, _PIXELS, 3)[:, 1:-1, :, 1:-1]
    return cells.mean((1, 3)).reshape(-1, 3)[: len(materials)]


def cycles_node(kind: str, properties: dict | None = None, **inputs) -> Callable:
    """A material of one shader node; inputs' names have _ for spaces, colours are tuples."""

    def build(tree):
        node = tree.nodes.new(kind)
        for name, value in (properties or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            socket = node.inputs[name.replace("_", " ")]
            socket.default_value = (*value, 1) if socket.type == "RGBA" else value
        return node.outputs[0]

    return build


def _add_square(bpy, build: Callable, degrees: float, front: bool, x: int, y: int) -> None:
    """A square in the picture, turned away from the camera. Only the camera sees it, so it is alone in the world."""
    half, long = 0.5, 0.5 / math.cos(math.radians(degrees))
    mesh = bpy.data.meshes.new("Square")
    corners = [(-half, -long, 0), (half, -long, 0), (half, long, 0), (-half, long, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3) if front else (3, 2, 1, 0)])
    square = bpy.data.objects.new("Square", mesh)
    square.location, square.rotation_euler = (x + half, y + half, 0), (math.radians(degrees), 0, 0)
    square.visible_diffuse = square.visible_glossy = square.visible_transmission = square.visible_shadow = False
    paint = bpy.data.materials.new("Paint")
    paint.use_nodes = True
    tree = paint.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree), output.inputs["Surface"])
    mesh.materials.append(paint)
    bpy.context.scene.collection.objects.link(square)


def _look_at_squares(bpy, scene, side: int) -> None:
    scene.world = bpy.data.worlds.new("White")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (1, 1, 1, 1), 1
    # Only what is sampled from the material finds the light.
    scene.world.cycles.sampling_method = "NONE"
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale, data.clip_end = "ORTHO", side, 1e4
    scene.camera = bpy.data.objects.new("Camera", data)
    scene.camera.location = (side / 2, side / 2, 1000)
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x = scene.render.resolution_y = side * _PIXELS
    scene.render.resolution_percentage = 100
