"""What the figures' numbers are made from: renders, converged references with their own errors, and how errors look."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..rendering import render
from ..samplers import SAMPLERS
from ..scene import Scene
from ..settings import RenderSettings

#: No figure judges it, and it converges fastest of all that we have: the sampler of references.
REFERENCE_SAMPLER = "sobol_owen"

NBSP = "\N{NO-BREAK SPACE}"


@dataclass(frozen=True)
class Shot:
    """A render: `picture` is linear (h, w, 3) float64, bottom row first; `samples` per pixel were really taken."""

    picture: np.ndarray
    sampler: str
    samples: int
    seed: int

    @property
    def label(self) -> str:
        return SAMPLERS[self.sampler].label

    @property
    def total(self) -> int:
        """The samples of the whole picture: what it cost."""
        return self.samples * self.picture.shape[0] * self.picture.shape[1]

    def numbers(self) -> dict[str, str | int]:
        height, width = self.picture.shape[:2]
        return {
            "sampler": self.sampler,
            "samples_per_pixel": self.samples,
            "resolution": f"{width}x{height}",
            "total_samples": self.total,
            "seed": self.seed,
        }


@dataclass(frozen=True)
class Reference:
    """A converged picture: the mean of two renders with different seeds, whose difference tells its error."""

    first: np.ndarray
    second: np.ndarray
    samples: int
    seeds: tuple[int, int]

    @property
    def picture(self) -> np.ndarray:
        return (self.first + self.second) / 2

    @property
    def error(self) -> float:
        """The RMSE of `picture`: each render errs by rms(difference)/√2, and their mean by 1/√2 of that."""
        return rmse(self.first, self.second) / 2

    def cut(self, window: tuple[slice, slice]) -> Reference:
        return Reference(self.first[window], self.second[window], self.samples, self.seeds)

    def shrunk(self, factor: int) -> Reference:
        """The reference of the same picture with `factor` times fewer pixels each way."""
        samples = self.samples * factor**2
        return Reference(shrink(self.first, factor), shrink(self.second, factor), samples, self.seeds)

    def judge(self, picture: np.ndarray) -> dict[str, float]:
        """The error of `picture`, and that of the reference itself."""
        return {"rmse": rmse(picture, self.picture), "rmse_of_the_reference": self.error}

    def sentence(self) -> str:
        return (
            f"RMSE: of linear radiance, against {SAMPLERS[REFERENCE_SAMPLER].label} at 2{NBSP}×{NBSP}{self.samples} "
            f"samples, other seeds, which itself errs by {self.error:.2g}."
        )

    def numbers(self) -> dict[str, object]:
        return {
            "sampler": REFERENCE_SAMPLER,
            "samples_per_pixel": 2 * self.samples,
            "seeds": list(self.seeds),
        }


@dataclass(frozen=True)
class Studio:
    """Renders with one seed, threads and a progress bar; `on_progress` gets the share of a render since the last."""

    seed: int
    threads: int
    on_progress: Callable[[float], None] = lambda _: None

    def shoot(self, scene: Scene, sampler: str, samples: int, seed: int | None = None) -> Shot:
        seed = self.seed if seed is None else seed
        settings = RenderSettings(samples=samples, sampler=sampler, seed=seed, threads=self.threads)
        film = render(scene, settings, on_tile=lambda tile: self.on_progress(1 / tile.total))
        return Shot(film.passes["Combined"][..., :3].astype(np.float64), sampler, film.samples, seed)

    def reference(self, scene: Scene, samples: int) -> Reference:
        """Two renders at `samples` per pixel each, with seeds that no figure uses."""
        seeds = tuple((self.seed + step) % 2**31 for step in (1, 2))
        first, second = (self.shoot(scene, REFERENCE_SAMPLER, samples, seed) for seed in seeds)
        return Reference(first.picture, second.picture, first.samples, seeds)


def rmse(picture: np.ndarray, truth: np.ndarray) -> float:
    """The root of the mean squared difference over pixels and channels."""
    return float(np.sqrt(np.mean((picture - truth) ** 2)))


def shrink(picture: np.ndarray, factor: int) -> np.ndarray:
    """The means of blocks of `factor` × `factor` pixels, which both sides must be multiples of."""
    height, width, channels = picture.shape
    return picture.reshape(height // factor, factor, width // factor, factor, channels).mean(axis=(1, 3))


def regularity(error: np.ndarray) -> float:
    """How much of an error picture, (h, w, 3), is pattern: the share of its energy in each row's strongest frequency.

    Along a row the distant checks have one spacing, so what regular points make of them is a wave. This is Fisher's
    test of harmonic analysis (1929), g, row by row and weighted by energy; of a row's mean only the deviation counts.
    White noise has about `regularity_of_noise`.
    """
    rows = error.mean(axis=2)
    power = np.abs(np.fft.rfft(rows - rows.mean(axis=1, keepdims=True), axis=1)[:, 1:]) ** 2
    energy = power.sum()
    return float(power.max(axis=1).sum() / energy) if energy > 0 else 0.0


def regularity_of_noise(width: int) -> float:
    """The expected `regularity` of white noise in rows of `width` pixels: (1 + 1/2 + … + 1/m)/m for m frequencies."""
    frequencies = width // 2
    return float(np.sum(1 / np.arange(1, frequencies + 1)) / frequencies)


def letters(count: int) -> Sequence[str]:
    """(a), (b), (c), … for the parts of a figure."""
    return [f"({chr(ord('a') + i)})" for i in range(count)]
