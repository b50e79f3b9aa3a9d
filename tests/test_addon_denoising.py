"""Blender's Denoise node takes the noise out of Rooks' pictures, and keeps textures by the passes that Rooks writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.versions import choose_multilayer_format  # noqa: E402
from tests.addon_helpers import empty_scene, feed, lamp, quad, shader  # noqa: E402
from tests.cycles_helpers import region_means  # noqa: E402
from tests.test_addon_engine import render, saved_pixels  # noqa: E402

SCENES = Path(__file__).parent.parent / "sample_scenes"
#: From the Render Layers node to the Denoise node.
GUIDES = (("Denoising Normal", "Normal"), ("Denoising Albedo", "Albedo"))


def empty_compositor(scene: bpy.types.Scene) -> tuple[bpy.types.NodeTree, bpy.types.NodeSocket]:
    """The scene's compositor tree, emptied, and the socket that takes its picture."""
    scene.render.use_compositing = True
    if bpy.app.version >= (5, 0):
        tree = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
        return tree, tree.nodes.new("NodeGroupOutput").inputs["Image"]
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree, scene.node_tree.nodes.new("CompositorNodeComposite").inputs["Image"]


def open_scene(name: str, width: int, height: int) -> bpy.types.Scene:
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    return scene


def converged(scene: bpy.types.Scene, samples: int) -> np.ndarray:
    """The picture with many samples, (height, width, 3)."""
    rooks = scene.rooks
    kept = rooks.samples, rooks.sampler
    rooks.samples, rooks.sampler = samples, "SOBOL_OWEN"
    picture = render().films[0].passes["Combined"][..., :3]
    rooks.samples, rooks.sampler = kept
    return picture


def denoised(scene: bpy.types.Scene, path: Path, guides=GUIDES) -> tuple[np.ndarray, np.ndarray]:
    """The picture as rendered, and what the compositor makes of it, (height, width, 3) both."""
    bpy.context.view_layer.rooks.use_pass_denoising_data = True
    tree, result = empty_compositor(scene)
    layers, node = (tree.nodes.new(f"CompositorNode{kind}") for kind in ("RLayers", "Denoise"))
    for output, entry in (("Image", "Image"), *guides):
        tree.links.new(layers.outputs[output], node.inputs[entry])
    tree.links.new(node.outputs["Image"], result)
    film = render().films[0]
    return film.passes["Combined"][..., :3], saved_pixels(path)[..., :3]


def rmse(picture: np.ndarray, truth: np.ndarray) -> float:
    """The error of what a screen shows: the edges of a lamp would outweigh all else."""
    return float(np.sqrt(np.square(np.minimum(picture, 1) - np.minimum(truth, 1)).mean()))


def kept_steps(picture: np.ndarray, truth: np.ndarray) -> float:
    """How much is left of the steps from pixel to pixel in a row: 1 is all of it."""
    steps = np.diff(truth, axis=1)
    return float((np.diff(picture, axis=1) * steps).sum() / np.square(steps).sum())


def test_a_noisy_sample_scene_comes_out_with_less_than_half_the_error(tmp_path):
    scene = open_scene("cornell_box", 64, 64)
    scene.rooks.samples = 4
    truth = converged(scene, 128)
    noisy, clean = denoised(scene, tmp_path / "x.exr")
    assert rmse(clean, truth) <= 0.5 * rmse(noisy, truth)


def test_by_the_albedo_a_faint_texture_outlives_the_noise(tmp_path):
    """Checks of 0.5 and 0.6 under a lamp whose light is a coin's toss: without the albedo they are taken for noise."""
    scene = empty_scene(64, 64)
    scene.rooks.samples, scene.rooks.sampler = 4, "RANDOM"
    paint, diffuse = shader("ShaderNodeBsdfDiffuse")
    checks = feed(diffuse.inputs["Color"], "ShaderNodeTexChecker")
    checks.inputs["Color1"].default_value, checks.inputs["Color2"].default_value = (0.5,) * 3 + (1,), (0.6,) * 3 + (1,)
    checks.inputs["Scale"].default_value = 10
    quad(size=8).data.materials.append(paint)
    quad("Blind", size=1, location=(0, 0, 2)).visible_camera = False
    lamp("AREA", 500, location=(0, 0, 4), size=3)
    truth = converged(scene, 256)
    noisy, guided = denoised(scene, tmp_path / "x.exr")
    _, alone = denoised(scene, tmp_path / "x.exr", guides=())
    assert rmse(guided, truth) <= min(0.5 * rmse(noisy, truth), rmse(alone, truth))
    assert kept_steps(guided, truth) > 0.8
    assert kept_steps(alone, truth) < 0.4


def test_ticking_the_box_makes_the_sockets_that_cycles_has():
    tree, _ = empty_compositor(empty_scene())
    node = tree.nodes.new("CompositorNodeRLayers")
    assert not {"Denoising Normal", "Denoising Albedo"} & {s.name for s in node.outputs if s.enabled}
    bpy.context.view_layer.rooks.use_pass_denoising_data = True
    ours = {socket.name for socket in node.outputs if socket.enabled}
    assert {"Denoising Normal", "Denoising Albedo"} <= ours
    bpy.context.view_layer.rooks.use_pass_denoising_data = False
    assert not {"Denoising Normal", "Denoising Albedo"} & {s.name for s in node.outputs if s.enabled}


@pytest.mark.parametrize("name", ["cornell_box", pytest.param("still_life", marks=pytest.mark.slow)])
def test_the_albedo_is_that_of_cycles_where_nothing_is_a_mirror(name, tmp_path):
    """Cycles' too is noisy in each pixel: the two agree in the means of regions."""
    openexr = pytest.importorskip("OpenEXR")
    scene = open_scene(name, 96, 64)
    layer = bpy.context.view_layer
    layer.rooks.use_pass_denoising_data = layer.cycles.denoising_store_passes = True
    scene.rooks.samples = scene.cycles.samples = 64
    scene.rooks.max_bounces = scene.cycles.max_bounces = 0
    choose_multilayer_format(scene.render.image_settings)
    albedos = []
    for engine in ("ROOKS", "CYCLES"):
        scene.render.engine, scene.render.filepath = engine, str(tmp_path / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        with openexr.File(scene.render.filepath, separate_channels=True) as file:
            channels = {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}
        albedos.append(np.stack([channels[f"{layer.name}.Denoising Albedo.{c}"] for c in "RGB"], axis=-1))
    assert albedos[0].min() >= 0
    assert albedos[0].max() <= 1
    np.testing.assert_allclose(*(region_means(albedo, 8) for albedo in albedos), atol=0.01)
