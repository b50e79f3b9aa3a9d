"""A picture that gets better pass after pass, for a window: what can be shown at once, and is exact in the end.

Each pass takes one point of each pixel's set. A part of a set is a worse set: a set's points stand in an order of their
own (see `domains`), and those of the lights run along a curve over the lamp, so that passes jump along it by the golden
section of its length: what the passes have taken at any time lies evenly on the curve (Sós 1958, the three-gap
theorem). After the last pass each pixel has had its whole set, and the picture is that of `render`.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import numpy as np

from .blocks import BLOCK, BlockGrid, Bounds
from .camera import check_camera
from .domains import Run
from .film import new_tile_sums
from .integrator import render_blocks
from .preparation import Prepared
from .scene import Camera

_GOLDEN_SECTION = (math.sqrt(5) - 1) / 2
#: Strips for each thread: the more, the less they wait for the last, and the more Python has to do.
_STRIPS = 4


class Progressive:
    """A picture of a prepared scene, seen by `camera`, inside of `bounds` (None: all of it).

    Raises:
        SceneError: nothing can be seen by this camera.
    """

    def __init__(self, prepared: Prepared, camera: Camera, bounds: Bounds | None = None) -> None:
        check_camera(camera)
        width, height = camera.resolution
        self.bounds = bounds or (0, 0, width, height)
        self.total = prepared.settings.sample_count
        self.done = self.blocked_samples = 0
        self._prepared = prepared
        self._frame = prepared.seen_by(camera)
        self._order = golden_order(self.total)
        left, bottom, right, top = self.bounds
        self._sums = np.zeros((top - bottom, right - left, 4))
        self._counts = np.zeros((top - bottom, right - left, 1))

    def add_pass(self, pool: ThreadPoolExecutor, stop: np.ndarray) -> bool:
        """Take one more sample of each pixel. False, and nothing is added, where `stop` (1,) uint8 became 1."""
        run = Run(int(self._order[self.done]), 1)
        strips = _strips(self.bounds, self._prepared.settings.thread_count * _STRIPS)
        rendered = list(pool.map(lambda bounds: self._strip(bounds, run, stop), strips))
        if stop[0]:
            return False
        bottom = self.bounds[1]
        for (_, low, _, high), (sums, counts, blocked) in zip(strips, rendered, strict=True):
            self.blocked_samples += blocked
            self._sums[low - bottom : high - bottom] += sums
            self._counts[low - bottom : high - bottom] += counts
        self.done += 1
        return True

    @property
    def dropped_samples(self) -> int:
        """How many samples were not finite, and are not in the picture."""
        return self.done * self._counts.size - int(self._counts.sum())

    @property
    def negative_pixels(self) -> int:
        """How many pixels are below 0, and black instead."""
        return int((self._sums < 0).any(axis=2).sum())

    def pixels(self) -> np.ndarray:
        """The picture so far: linear Rec.709, premultiplied alpha, float32 (height, width, 4), bottom row first."""
        return np.maximum(self._sums / np.maximum(self._counts, 1), 0).astype(np.float32)

    def _strip(self, bounds: Bounds, run: Run, stop: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        grid = BlockGrid(bounds)
        sums = new_tile_sums(grid.pixels)
        render_blocks(*self._prepared.workspace(), self._frame, grid.blocks, run, sums, stop)
        return grid.raster(sums.combined), grid.raster(sums.count[:, None]), int(sums.blocked[0])


def coarser(camera: Camera, size: int) -> Camera:
    """The camera with pixels of `size` × `size` of its own, so many that they cover its picture from the lower left."""
    width, height = (-(-pixels // size) for pixels in camera.resolution)
    left, right, bottom, top = camera.window
    step_x, step_y = (right - left) / camera.resolution[0] * size, (top - bottom) / camera.resolution[1] * size
    window = left, left + step_x * width, bottom, bottom + step_y * height
    return replace(camera, resolution=(width, height), window=window)


def golden_order(count: int) -> np.ndarray:
    """The numbers 0 … count - 1 in an order in which the first few of them lie evenly, however many they are."""
    coprime = [step for step in range(1, count + 1) if math.gcd(step, count) == 1]
    step = min(coprime, key=lambda step: abs(step - count * _GOLDEN_SECTION))
    return np.arange(count, dtype=np.int64) * step % count  # 32 bits, those of numpy 1 on Windows, are too few


def _strips(bounds: Bounds, count: int) -> list[Bounds]:
    """`bounds` in about `count` strips of whole blocks, from the bottom."""
    left, bottom, right, top = bounds
    first, last = bottom // BLOCK, -(-top // BLOCK)
    cuts = np.unique(np.linspace(first, last, count + 1).round().astype(int)) * BLOCK
    return [(left, max(low, bottom), right, min(high, top)) for low, high in pairwise(cuts.tolist())]
