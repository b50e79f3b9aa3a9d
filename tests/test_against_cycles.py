"""Rooks against Cycles: the same .blend, the same process, direct light only. Cycles is right by definition here.

Cycles is set to what Rooks models (sample_scenes sets it so: box filter, no bounces, nothing clamped), except that its
lamps are not to be hit by chance: a lamp that is stops the ray, and hides the world behind it (0.2 % of still_life).
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
import OpenEXR  # noqa: E402 - bpy first, or there is nothing to compare

import addon  # noqa: E402

SCENES = Path(__file__).parent.parent / "sample_scenes"
SAMPLES = 512
#: Side of the squares in which pictures are compared, in pixels.
REGION = 16

addon.register()


def open_scene(name: str, percentage: int) -> bpy.types.Scene:
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    scene = bpy.context.scene
    scene.render.resolution_percentage = percentage
    return scene


def picture(scene: bpy.types.Scene, engine: str, path: Path, samples: int, seed: int = 0) -> np.ndarray:
    """Render and read back: float32 (height, width, 3), linear."""
    scene.render.engine = engine
    scene.rooks.samples = scene.cycles.samples = samples
    scene.rooks.seed = scene.cycles.seed = seed
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        return (channels.get("RGBA") or channels["RGB"]).pixels[..., :3].astype(np.float64)


def region_means(image: np.ndarray) -> np.ndarray:
    rows, columns = image.shape[0] // REGION, image.shape[1] // REGION
    cut = image[: rows * REGION, : columns * REGION]
    return cut.reshape(rows, REGION, columns, REGION, 3).mean(axis=(1, 3))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "percentage"), [("checkerboard", 40), ("depth_of_field", 30), ("soft_shadows", 30), ("still_life", 25)]
)
def test_a_sample_scene_looks_as_in_cycles(name, percentage, tmp_path):
    scene = open_scene(name, percentage)
    for lamp in bpy.data.lights:
        lamp.cycles.use_multiple_importance_sampling = False
    # Two pictures of each, half the samples: their mean is compared, their difference says what noise can do.
    halves = {
        engine: [picture(scene, engine, tmp_path / f"{engine}{seed}.exr", SAMPLES // 2, seed) for seed in (1, 2)]
        for engine in ("ROOKS", "CYCLES")
    }
    ours, theirs = (np.mean(halves[engine], axis=0) for engine in ("ROOKS", "CYCLES"))

    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.01)

    # A pixel's mean of two halves has as variance a quarter of their squared difference, on average; a region averages
    # REGION² such pixels, and sums their squares.
    variance = sum(region_means((a - b) ** 2) for a, b in halves.values()) / 4 / REGION**2
    difference = region_means(ours - theirs)
    # Five standard errors (one false alarm in 1e6 regions), and float32's rounding where a region has no noise at all.
    allowed = 5 * np.sqrt(variance) + 1e-5 * region_means(theirs)
    assert (np.abs(difference) <= allowed).all(), np.argwhere(np.abs(difference) > allowed)


@pytest.mark.slow
def test_soft_shadows_takes_five_times_the_samples_per_second_of_cycles(tmp_path):
    scene = open_scene("soft_shadows", 100)
    for engine in ("ROOKS", "CYCLES"):
        picture(scene, engine, tmp_path / "warm.exr", 1)
    ratios = []
    for _ in range(3):
        seconds = {}
        for engine in ("ROOKS", "CYCLES"):
            start = time.perf_counter()
            picture(scene, engine, tmp_path / "timed.exr", 64)
            seconds[engine] = time.perf_counter() - start
        ratios.append(seconds["CYCLES"] / seconds["ROOKS"])
        print(f"{seconds} s: {ratios[-1]:.2f} times the samples per second")
    assert np.median(ratios) >= 5, ratios
