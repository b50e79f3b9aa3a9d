"""Measuring the error of samplers on a scene: honest references, bias and variance apart, and the time it took.

A picture is judged by its linear, unclamped colour, and against a reference that shares nothing with it: another
sampler, and seeds from a range that no judged picture uses. The reference is the mean of several independent pictures
of many samples, so that their spread tells its own standard error; pictures are added until that is below a tenth of
the smallest error that it is to judge, or until the reference has cost as much as all that is judged.

With errors e_i of the pictures of S seeds, ⟨·,·⟩ the mean over pixels and channels, the mean of ⟨e_i, e_i⟩ is bias² +
variance, and the mean of ⟨e_i, e_j⟩ over i ≠ j is bias² alone; both also hold the reference's variance, which is taken
off the bias. The estimate of bias² is itself free of bias, and so comes out below zero at times when there is none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..film import Film
from ..rendering import render
from ..samplers import SAMPLERS
from ..scene import Scene
from ..settings import RenderSettings

#: How much smaller than the smallest error charted the reference's own must be, and what is aimed at: the pilot
#: pictures that the aim rests on are few.
RATIO, AIM = 10, 11
#: A reference's pictures have so many times the largest count charted. Where the error falls with n^-3/4, as across
#: edges, the least number of pictures makes it 16 times smaller then.
REFERENCE_FACTOR, MIN_PICTURES = 16, 4
#: A reference may always have so many pictures, and more where all that is judged costs more.
ENOUGH_PICTURES = 12
MAX_REFERENCE_SAMPLES = 1 << 16
#: Seeds below are for judged pictures, those from here on for references.
REFERENCE_SEEDS = 1 << 30
#: What rendering a picture costs beside its samples, in samples: tables, the BVH, threads.
OVERHEAD = 400_000

SOBOL, OTHER = "sobol_owen", "correlated_multi_jittered"
#: The samplers whose points are made in the same way as those of SOBOL.
LIKE_SOBOL = {SOBOL, "z_sobol"}

#: A picture: float32 (height, width, 3), bottom row first.
Picture = np.ndarray


class Cancelled(Exception):  # noqa: N818 - nothing went wrong
    """The caller's `should_cancel` said so."""


@dataclass(frozen=True)
class Cell:
    """What was measured of one sampler at one count. The lists have one number per seed.

    `rmse` is over pixels and channels of linear colour. `setup_seconds` is making the tables and the BVH, `seconds`
    rendering. `bias_squared` (with its standard error), `variance` are per pixel and channel; None with a single seed.
    """

    sampler: str
    requested: int
    count: int
    seeds: list[int]
    rmse: list[float]
    setup_seconds: list[float]
    seconds: list[float]
    bias_squared: float | None
    bias_squared_error: float | None
    variance: float | None
    dropped_samples: int = 0


@dataclass(frozen=True)
class Reference:
    """The picture that others are judged by: the mean of one picture of `samples` samples for each of `seeds`.

    `standard_error` is its own root-mean-square error over pixels and channels, from the spread of the pictures.
    """

    sampler: str
    samples: int
    seeds: list[int]
    standard_error: float
    picture: np.ndarray = field(repr=False)  # float64 (height, width, 3)


@dataclass(frozen=True)
class Study:
    """What is to be measured: `samplers` × `counts` on a scene, with `seeds` pictures each.

    The compared sampler takes the place of those of all domains in `settings`, the count that of `samples`;
    `settings.seed` is the first seed.
    """

    scene: Scene
    settings: RenderSettings
    samplers: Sequence[str]
    counts: Sequence[int]
    seeds: int

    def cells(self) -> list[tuple[str, int, int]]:
        """(sampler, requested, count) in the order of measuring; counts that a sampler makes into one appear once.

        Samplers alternate, so that a machine that is busy for a while is unfair to none.
        """
        made = {}
        for requested in sorted(set(self.counts)):
            for name in self.samplers:
                made.setdefault((name, SAMPLERS[name].actual_count(requested)), requested)
        return [(name, requested, count) for (name, count), requested in made.items()]

    def judged_seeds(self) -> list[int]:
        return [(self.settings.seed + i) % REFERENCE_SEEDS for i in range(self.seeds)]

    def reference_seed(self, i: int) -> int:
        return REFERENCE_SEEDS + (self.settings.seed + i) % REFERENCE_SEEDS

    def reference_samples(self) -> int:
        """The samples of one picture of a reference: a power of two, which suits every sampler."""
        wanted = REFERENCE_FACTOR * max(count for _, _, count in self.cells())
        return min(1 << (wanted - 1).bit_length(), MAX_REFERENCE_SAMPLES)

    def most_pictures(self) -> int:
        """A reference may have so many pictures: as many as cost what all that is judged does, or ENOUGH_PICTURES."""
        judged = sum(count for _, _, count in self.cells()) * self.seeds
        return max(ENOUGH_PICTURES, judged // self.reference_samples())

    def settings_for(self, sampler: str, samples: int, seed: int) -> RenderSettings:
        own = dict.fromkeys(("pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler"))
        return replace(self.settings, sampler=sampler, samples=samples, seed=seed, **own)


def assign_references(samplers: Sequence[str]) -> dict[str, str]:
    """Which sampler makes the reference that each is judged by: never itself, nor one with points of the same make.

    One reference for all where that is possible, else two.
    """
    chosen = set(samplers)
    if not chosen & LIKE_SOBOL:
        return dict.fromkeys(samplers, SOBOL)
    if OTHER not in chosen:
        return dict.fromkeys(samplers, OTHER)
    return {name: OTHER if name in LIKE_SOBOL else SOBOL for name in samplers}


class Laboratory:
    """Renders a study's pictures, and tells how far it is.

    `on_progress(share, what)` gets the share of the work done, 0 to 1 and never falling, and a few words.

    Raises:
        Cancelled: from any method, once `should_cancel` has answered True.
    """

    def __init__(
        self,
        study: Study,
        on_progress: Callable[[float, str], None] | None = None,
        should_cancel: Callable[[], bool] | None = None,
    ):
        self.study = study
        self.on_progress = on_progress
        self.should_cancel = should_cancel
        self.share = 0.0
        self.done = 0
        # A guess where references are concerned: it is mended as they grow.
        references = set(assign_references(study.samplers).values())
        self.to_do = {("cell", name, count): study.seeds * self._cost(count) for name, _, count in study.cells()}
        for name in references:
            self.to_do["reference", name] = MIN_PICTURES * self._cost(study.reference_samples())

    def warm_up(self) -> float:
        """Compile the kernels or load them from the cache, which belongs to no measurement: the seconds it took."""
        first, second = (self._render(self.study.samplers[0], 1, 0, "compiling") for _ in range(2))
        return max(_total_seconds(first) - _total_seconds(second), 0.0)

    def make_reference(self, sampler: str, judged: Sequence[str]) -> Reference:
        """The reference made with `sampler` for judging the samplers `judged`."""
        study = self.study
        what = f"reference ({SAMPLERS[sampler].label})"
        samples = study.reference_samples()
        largest = {name: count for name, _, count in study.cells() if name in judged}
        first_seed = study.judged_seeds()[0]
        pilots = [_colors(self._render(name, count, first_seed, what)) for name, count in largest.items()]
        seeds, mean, squares = [], 0.0, 0.0
        while True:
            seeds.append(study.reference_seed(len(seeds)))
            picture = _colors(self._render(sampler, samples, seeds[-1], what)).astype(np.float64)
            before, mean = mean, mean + (picture - mean) / len(seeds)
            squares = squares + (picture - before) * (picture - mean)
            if len(seeds) < MIN_PICTURES:
                continue
            variance = float(np.mean(squares)) / (len(seeds) - 1) / len(seeds)
            goal = _smallest_error(pilots, mean, variance) / AIM
            wanted = min(len(seeds) * variance / goal**2 if goal else 0, study.most_pictures())
            if len(seeds) >= wanted:
                break
            self.to_do["reference", sampler] = (int(wanted) + 1 - len(seeds)) * self._cost(samples)
        self.to_do.pop(("reference", sampler), None)
        return Reference(sampler, samples, seeds, variance**0.5, mean)

    def measure_cell(self, sampler: str, requested: int, count: int, reference: Reference) -> tuple[Cell, np.ndarray]:
        """The cell, and its pictures: float32 (seeds, height, width, 3)."""
        seeds = self.study.judged_seeds()
        what = f"{SAMPLERS[sampler].label}, {count} sample{'s' if count > 1 else ''}"
        pictures, setup_seconds, seconds, dropped = [], [], [], 0
        for seed in seeds:
            film = self._render(sampler, count, seed, what)
            pictures.append(_colors(film).copy())  # without the film's other passes, which would be kept as well
            setup_seconds.append(film.setup_seconds)
            seconds.append(film.seconds)
            dropped += film.dropped_samples
        self.to_do.pop(("cell", sampler, count), None)
        pictures = np.stack(pictures)
        products = error_products(pictures, reference.picture)
        cell = Cell(
            sampler,
            requested,
            count,
            seeds,
            np.sqrt(np.diag(products)).tolist(),
            setup_seconds,
            seconds,
            *bias_and_variance(products, reference.standard_error**2),
            dropped,
        )
        return cell, pictures

    def skip_cell(self, sampler: str, count: int) -> None:
        """The cell has been measured before: its work is done."""
        self.done += self.to_do.pop(("cell", sampler, count))

    def _render(self, sampler: str, samples: int, seed: int, what: str) -> Film:
        if self.on_progress is not None:
            left = sum(self.to_do.values())
            self.share = max(self.share, self.done / max(self.done + left, 1))
            self.on_progress(self.share, what)
        film = render(self.study.scene, self.study.settings_for(sampler, samples, seed), None, self.should_cancel)
        if film.cancelled:
            raise Cancelled
        cost = self._cost(samples)
        self.done += cost
        for key in (("cell", sampler, samples), ("reference", sampler)):
            if key in self.to_do:
                self.to_do[key] = max(self.to_do[key] - cost, 0)
                break
        return film

    def _cost(self, samples: int) -> int:
        width, height = self.study.scene.camera.resolution
        left, bottom, right, top = self.study.settings.border or (0, 0, width, height)
        return (right - left) * (top - bottom) * samples + OVERHEAD


def error_products(pictures: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """⟨e_i, e_j⟩ for all pairs of pictures (S, height, width, 3): float64 (S, S), the mean over pixels and channels."""
    flat, right = pictures.reshape(len(pictures), -1), reference.ravel()
    products = np.zeros((len(flat), len(flat)))
    for first in range(0, flat.shape[1], 1 << 16):  # in pieces, since in float64 all of it would double the memory
        piece = np.s_[first : first + (1 << 16)]
        errors = flat[:, piece] - right[piece]
        products += errors @ errors.T
    return products / flat.shape[1]


def bias_and_variance(
    products: np.ndarray, reference_variance: float
) -> tuple[float, float, float] | tuple[None, None, None]:
    """bias², its standard error, and variance, from `error_products` (S, S); three None where S is 1.

    The standard error is the jackknife's over seeds, and at least the reference's variance: what is smaller than that
    cannot be told from the reference's own error. Two seeds have one product and no spread: there the whole squared
    error stands for it, which bias² can never exceed.
    """
    seeds = len(products)
    if seeds == 1:
        return None, None, None
    own = np.trace(products) / seeds
    between = (products.sum() - np.trace(products)) / (seeds * (seeds - 1))
    error = reference_variance if seeds > 2 else own
    if seeds > 2:
        others = products.sum(axis=1) - np.diag(products)  # of one seed with each other one
        without = (between * seeds * (seeds - 1) - 2 * others) / ((seeds - 1) * (seeds - 2))
        error = np.hypot(error, np.sqrt((seeds - 1) / seeds * ((without - without.mean()) ** 2).sum()))
    return float(between - reference_variance), float(error), float(max(own - between, 0.0))


def _smallest_error(pilots: Sequence[Picture], mean: np.ndarray, variance: float) -> float:
    """The smallest RMSE among pilot pictures against a reference of that variance; 0 where all are exact."""
    squares = [float(np.mean((pilot - mean) ** 2)) - variance for pilot in pilots]
    return min((square for square in squares if square > 0), default=0.0) ** 0.5


def _colors(film: Film) -> Picture:
    return film.passes["Combined"][..., :3]


def _total_seconds(film: Film) -> float:
    return film.setup_seconds + film.seconds
