"""What the tests against Cycles share: pictures by both engines of Blender's current file, and how to compare them."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import OpenEXR
import pytest

import addon

ENGINES = ("ROOKS", "CYCLES")
#: Side of the squares in which pictures are compared, in pixels.
REGION = 16

addon.register()


def picture(scene: bpy.types.Scene, engine: str, path: Path, samples: int, seed: int = 0) -> np.ndarray:
    """Render and read back: float64 (height, width, 3), linear, or 4 where the file is to have an alpha channel."""
    scene.render.engine = engine
    scene.rooks.samples = scene.cycles.samples = samples
    scene.rooks.seed = scene.cycles.seed = seed
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        pixels = channels["RGBA"].pixels if "RGBA" in channels else channels["RGB"].pixels
    with_alpha = scene.render.image_settings.color_mode == "RGBA"
    return pixels[..., : 4 if with_alpha else 3].astype(np.float64)


def region_means(image: np.ndarray, size: int = REGION) -> np.ndarray:
    """(height, width, channels) to (height // size, width // size, channels)."""
    rows, columns = image.shape[0] // size, image.shape[1] // size
    cut = image[: rows * size, : columns * size]
    return cut.reshape(rows, size, columns, size, -1).mean(axis=(1, 3))


def pictures(scene: bpy.types.Scene, folder: Path, samples: int, seeds: int) -> dict[str, np.ndarray]:
    """Of each engine `seeds` independent pictures, (seeds, height, width, channels)."""
    return {
        engine: np.array([picture(scene, engine, folder / f"{engine}.exr", samples, seed + 1) for seed in range(seeds)])
        for engine in ENGINES
    }


def assert_alike(of: dict[str, np.ndarray], size: int = REGION, sigmas: float = 5.0, rel: float = 0.01) -> None:
    """The engines' means agree within `rel` in each channel, and every region within `sigmas` standard errors.

    The variance of a region's mean is estimated from its pixels, which are independent of each other: from the
    spread of each pixel over the seeds. One of a region of 256 pixels and two seeds has 256 degrees of freedom, unless
    a few pixels hold most of it. Five standard errors make one false alarm in 1e6 regions.
    """
    ours, theirs = (of[engine].mean(axis=0) for engine in ENGINES)
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=rel)
    variance = sum(region_means(each.var(axis=0, ddof=1), size) / len(each) for each in of.values()) / size**2
    difference = region_means(ours - theirs, size)
    # And float32's rounding, where a region has no noise at all.
    allowed = sigmas * np.sqrt(variance) + 1e-5 * region_means(theirs, size)
    beyond = np.abs(difference) > allowed
    assert not beyond.any(), [(*place, difference[*place], allowed[*place]) for place in np.argwhere(beyond)]
