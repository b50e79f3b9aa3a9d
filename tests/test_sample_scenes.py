"""The sample scenes give numbers: no pixel of any is NaN, infinite or negative, whatever the seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import addon  # noqa: E402
import core  # noqa: E402
from addon.camera import export_camera  # noqa: E402
from addon.export import export_scene  # noqa: E402
from addon.settings import render_settings  # noqa: E402

SCENES = sorted((Path(__file__).parent.parent / "sample_scenes").glob("*.blend"))
SEEDS = 50

addon.register()


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_pixel_is_a_number_that_is_not_negative(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    render = bpy.context.scene.render
    resolution = (48, max(48 * render.resolution_y // render.resolution_x, 1))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    scene, _ = export_scene(depsgraph, export_camera(depsgraph, resolution))
    settings = replace(render_settings(bpy.context.scene, resolution), samples=4)
    for seed in range(SEEDS):
        film = core.render(scene, replace(settings, seed=seed))
        # A sample that is no number would be left out of its pixel, and counted.
        assert (film.dropped_samples, film.negative_pixels) == (0, 0), seed
        for name, pixels in film.passes.items():
            assert np.isfinite(pixels).all(), (name, seed)
        assert (film.passes["Combined"] >= 0).all(), seed
