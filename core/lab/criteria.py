"""The four marks of a good point set (Suffern 2007, ch. 5) as numbers, with a verdict on each.

1. Even over the square: the centred L2 discrepancy (Hickernell 1998). It adds up how uneven x is, how uneven y is and
   what is uneven in the plane alone, so that the perfect axes of n-rooks sampling earn it a small sum. The verdict is
   therefore on the plane alone: the interaction of x and y in the wrap-around discrepancy (Hickernell 1998) over what
   random points have of it on average. (That is a mean of the periodogram off the axes, low frequencies weighing most.)
2. Even along each axis: the share of the n strata of an axis that hold a point. Beside it the star discrepancy of x
   times n: 1/2 for the centres of the strata, at most 1 for one point in each.
3. A minimum distance: the smallest distance between two points, on the torus, over that in the densest lattice.
4. No regular spacing: the largest peak of the mean periodogram over n, 1 for a lattice. Independent points have 1/n of
   it by chance; the verdict is on what goes beyond.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import qmc

from ..samplers import Criteria, Sampler
from .point_sets import independent_sets
from .spectrum import periodograms, reach

#: Of random points' unevenness in the plane. At n = 16 the best of the bad, random and n-rooks, have 1.0, the worst of
#: the good, multi-jittered, has 0.81; beyond that they are further apart.
MOST_UNEVEN = 0.9
#: One point per stratum is 1, random points have 0.64, and jittered ones hardly more.
LEAST_FILLED = 0.95
#: Between 0.50 of correlated multi-jittered at n = 16 and 0.66 of the Fibonacci lattice. Lagae and Dutré (2008) ask for
#: 0.65 to 0.85 of a Poisson-disk pattern; one to which no further point can be added has 0.78 (Feder 1980).
LEAST_DISTANCE = 0.6
#: Between 0.18 of correlated multi-jittered at n = 16 and 0.28 of Hammersley at 256, which larger counts approach too.
HIGHEST_PEAK = 0.25


class Mean(NamedTuple):
    """The mean over independent sets and its standard error, None where all sets are the same."""

    value: float
    error: float | None


@dataclass(frozen=True)
class Marks:
    """What was measured of a sampler's sets of `count` points."""

    count: int
    sets: int
    """The number of sets that differ: 1 where there is no chance in the sampler."""
    discrepancy: Mean
    """×1e-4."""
    unevenness: Mean
    """In the plane alone; 1 for random points."""
    star: Mean
    filled: Mean
    distance: Mean
    peak: Mean

    @property
    def regularity(self) -> float:
        """What of the peak goes beyond chance: 0 for independent points, 1 for a lattice."""
        return (self.count * self.peak.value - 1) / (self.count - 1)

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            even_2d=self.unevenness.value <= MOST_UNEVEN,
            even_1d=self.filled.value >= LEAST_FILLED,
            min_distance=self.distance.value >= LEAST_DISTANCE,
            irregular=self.regularity <= HIGHEST_PEAK,
        )


def measure(sampler: Sampler, count: int, sets: int, seed: int) -> Marks:
    """Measure the marks of `sets` independent sets of `count` points, a count ≥ 2 that the sampler can make."""
    points = independent_sets(sampler, count, sets, seed)
    return Marks(
        count=count,
        sets=len(points),
        discrepancy=_mean(centred_discrepancy(points)),
        unevenness=_mean(unevenness(points)),
        star=_mean(star_discrepancy(points)),
        filled=_mean(share_filled(points)),
        distance=_mean(smallest_distance(points)),
        peak=largest_peak(points),
    )


# Each takes sets of points, (sets, n, 2) in [0, 1), and but for the last returns a value for each set, (sets,).


def centred_discrepancy(points: np.ndarray) -> np.ndarray:
    """Criterion 1: the centred L2 discrepancy, squared as scipy has it, ×1e-4."""
    return np.array([qmc.discrepancy(s, method="CD") for s in points]) * 1e4


def unevenness(points: np.ndarray) -> np.ndarray:
    """Criterion 1: the discrepancy of the plane alone over its expectation for random points.

    It is 36/n Σ b(x_i - x_j) b(y_i - y_j) over all pairs, with b(d) = d² - |d| + 1/6, whose mean over the circle is 0.
    The kernel of the wrap-around discrepancy is the product of 4/3 + b over the axes: take the axes' parts away.
    """
    both, x, y = (
        np.array([qmc.discrepancy(s[:, axes], method="WD") for s in points])
        for axes in (slice(0, 2), slice(0, 1), slice(1, 2))
    )
    return 36 * points.shape[1] * (both - 4 / 3 * (x + y))


def star_discrepancy(points: np.ndarray) -> np.ndarray:
    """Criterion 2: n times the star discrepancy of the x."""
    count = points.shape[1]
    x = np.sort(points[..., 0].astype(float), axis=1) * count
    above, below = np.arange(1, count + 1) - x, x - np.arange(count)
    return np.maximum(above, below).max(axis=1)


def share_filled(points: np.ndarray) -> np.ndarray:
    """Criterion 2: the share of the n strata in x and the n strata in y that hold a point."""
    count = points.shape[1]
    strata = np.sort(np.floor(points.astype(float) * count), axis=1)
    return (1 + (np.diff(strata, axis=1) > 0).sum(axis=1)).mean(axis=1) / count


def smallest_distance(points: np.ndarray) -> np.ndarray:
    """Criterion 3: on the torus, as a share of the largest possible, √(2/(√3 n))."""
    nearest = [cKDTree(s, boxsize=1).query(s, k=2)[0][:, 1].min() for s in points.astype(float)]
    return np.array(nearest) / np.sqrt(2 / (np.sqrt(3) * points.shape[1]))


def largest_peak(points: np.ndarray) -> Mean:
    """Criterion 4: the largest peak of the mean periodogram over n; the error is that of the power at its frequency."""
    count = points.shape[1]
    power = periodograms(points, reach(count)).reshape(len(points), -1) / count
    return _mean(power[:, power.mean(axis=0).argmax()])


def _mean(values: np.ndarray) -> Mean:
    sets = len(values)
    return Mean(float(values.mean()), float(values.std(ddof=1) / np.sqrt(sets)) if sets > 1 else None)
