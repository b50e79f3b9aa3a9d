"""Previews of materials, lamps and worlds: the pictures that Cycles makes of the same scenes of Blender's."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon import engine  # noqa: E402
from addon.watch import Watch, watching  # noqa: E402
from tests.addon_helpers import empty_scene, lamp, quad, shader  # noqa: E402

#: Values of the display, 0 to 1: the largest mean difference, from noise and the edges of another pixel filter.
DIFFERENCE = 0.02


def previews(name: str) -> tuple[dict[str, np.ndarray], Watch]:
    """The previews, (height, width, 4), of three data-blocks by what they are, rendered by an engine."""
    scene = empty_scene()
    scene.render.engine = name
    paint, _node = shader("ShaderNodeEmission", Color=(0.8, 0.2, 0.1, 1))
    quad().data.materials.append(paint)
    world = scene.world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = 0.2, 0.3, 0.9, 1
    blocks = {"material": paint, "light": lamp("SPOT").data, "world": world}
    with watching(Watch()) as watch:
        bpy.ops.wm.previews_ensure()
    pictures = {}
    for kind, block in blocks.items():
        width, height = block.preview.image_size
        pictures[kind] = np.array(block.preview.image_pixels_float).reshape(height, width, 4)
    return pictures, watch


def test_previews_are_those_of_cycles():
    before = list(engine.last_render)
    ours, watch = previews("ROOKS")
    assert watch.error is None
    assert engine.last_render == before, "a preview is not the last render"
    expected, _watch = previews("CYCLES")
    for kind, picture in expected.items():
        assert picture[..., :3].max() > 0.2, kind
        assert np.abs(ours[kind] - picture).mean() < DIFFERENCE, kind
