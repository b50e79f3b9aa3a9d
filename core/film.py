"""The film: where samples become pixels.

Each pixel's samples are added up in their own order, in float64, so that the sums do not depend on how the samples were
cut into batches, tiles or threads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from .batch import ALPHA, DEPTH, LANES, NORMAL, PACKET, RADIANCE, Batch, Y, Z
from .jit import kernel

#: The passes of every film and their channels' names, in the order in which Blender's multilayer EXR has them.
PASSES = {
    "Combined": ("R", "G", "B", "A"),
    "Depth": ("Z",),
    "Normal": ("X", "Y", "Z"),
    "Sampling Error": ("R", "G", "B"),
}
#: A pass that is there only where `RenderSettings.denoising_albedo` asks for it.
DENOISING_ALBEDO = "Denoising Albedo"
CHANNELS = {**PASSES, DENOISING_ALBEDO: ("R", "G", "B")}


@dataclass
class Film:
    """A finished picture, or the part of it that was done when it was cancelled.

    `passes` maps names in `CHANNELS` to float32 (height, width, channels), bottom row first. Combined is scene-linear
    Rec.709 with premultiplied alpha; Depth is in metres along the view axis; Normal is the mean of the world-space
    shading normals; Sampling Error is the standard error that the pixel's mean would have if its samples were
    independent: right for random samples, mostly too large for stratified ones, without meaning for regular and
    Hammersley points (which can all agree and all be wrong), 0 where there is but one sample; Denoising Albedo is the
    colour of what the camera rays hit first, from 0 to 1 (see `denoising`).
    `x` and `y` are the lower left pixel of the film in the full frame, whose size `resolution` is. `dropped_samples`
    counts samples that were not finite numbers: they are left out of the mean. `negative_pixels` counts pixels that
    came out below 0, which light of negative power can do: there they are 0. `blocked_samples` counts samples that had
    used up their transparent bounces when they met one more surface, which they see black. `memory` is the
    bytes that the render took beside the film.
    """

    x: int
    y: int
    width: int
    height: int
    samples: int
    resolution: tuple[int, int]
    passes: dict[str, np.ndarray] = field(default_factory=dict)
    finished_pixels: int = 0
    setup_seconds: float = 0.0
    seconds: float = 0.0
    dropped_samples: int = 0
    negative_pixels: int = 0
    blocked_samples: int = 0
    memory: int = 0
    cancelled: bool = False

    def __post_init__(self) -> None:
        for name in PASSES:
            self.passes.setdefault(name, self.new_pass(name))

    def new_pass(self, name: str) -> np.ndarray:
        return np.zeros((self.height, self.width, len(CHANNELS[name])), np.float32)

    @property
    def samples_per_second(self) -> float:
        return self.finished_pixels * self.samples / self.seconds if self.seconds else 0.0


class TileSums(NamedTuple):
    """Running sums of a tile's pixels, in the order of its blocks."""

    count: np.ndarray  # (pixels,) samples that were finite
    combined: np.ndarray  # (pixels, 4)
    squares: np.ndarray  # (pixels, 3)
    normal: np.ndarray  # (pixels, 3)
    depth: np.ndarray  # (pixels,) of the pixel's first sample: a mean over an edge would be the depth of nothing
    albedo: np.ndarray  # (pixels, 3) of all samples, or (0, 3) where nobody asks for it
    blocked: np.ndarray  # (1,) samples of the tile: see `Film.blocked_samples`


def new_tile_sums(pixels: int, with_albedo: bool = False) -> TileSums:
    return TileSums(
        count=np.zeros(pixels),
        combined=np.zeros((pixels, 4)),
        squares=np.zeros((pixels, 3)),
        normal=np.zeros((pixels, 3)),
        depth=np.zeros(pixels),
        albedo=np.zeros((pixels if with_albedo else 0, 3)),
        blocked=np.zeros(1, np.int64),
    )


@kernel
def add_samples(sums: TileSums, batch: Batch, opaque: bool, first: int, samples: int, count: int) -> None:
    """Add a batch's samples, numbered from `first` through the tile with `samples` per pixel."""
    f = batch.floats
    done = 0
    while done < count:
        pixel, number = divmod(first + done, samples)
        run = min(samples - number, count - done)
        if number == 0:
            sums.depth[pixel] = f[done // LANES * PACKET + done % LANES + DEPTH]
        for j in range(done, done + run):
            i = j // LANES * PACKET + j % LANES
            r, g, b = np.float64(f[i + RADIANCE]), np.float64(f[i + RADIANCE + Y]), np.float64(f[i + RADIANCE + Z])
            # Not math.isfinite: the compiler's liberties with sums let it take that for granted.
            if abs(r) + abs(g) + abs(b) < math.inf:
                sums.count[pixel] += 1
                sums.combined[pixel, 0] += r
                sums.combined[pixel, 1] += g
                sums.combined[pixel, 2] += b
                sums.combined[pixel, 3] += 1 if opaque else f[i + ALPHA]
                sums.squares[pixel, 0] += r * r
                sums.squares[pixel, 1] += g * g
                sums.squares[pixel, 2] += b * b
                sums.normal[pixel, 0] += f[i + NORMAL]
                sums.normal[pixel, 1] += f[i + NORMAL + Y]
                sums.normal[pixel, 2] += f[i + NORMAL + Z]
        if opaque and number + run == samples and sums.count[pixel] == 0:
            sums.combined[pixel, 3] = 1  # black, not a hole in the picture
        done += run


def develop(sums: TileSums, samples: int) -> dict[str, np.ndarray]:
    """The passes of a tile's pixels, of `samples` each: float32 (pixels, channels), in the order of its blocks."""
    count = np.maximum(sums.count, 1)[:, None]
    combined = sums.combined / count
    variance = np.maximum(sums.squares / count - combined[:, :3] ** 2, 0) / np.maximum(count - 1, 1)
    passes = {
        "Combined": combined,
        "Depth": sums.depth[:, None],
        "Normal": sums.normal / count,
        "Sampling Error": np.sqrt(variance),
    }
    if len(sums.albedo):
        passes[DENOISING_ALBEDO] = sums.albedo / samples
    return {name: values.astype(np.float32) for name, values in passes.items()}
