"""What a sampler is, and the few steps that several of them share.

A sampler makes sets of points in the unit square [0, 1)². It knows nothing of pixels, lenses or lights: the renderer
chooses which set goes where, and shuffles the order of the points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isqrt
from typing import NamedTuple

from .late_numpy import np


class Criteria(NamedTuple):
    """Which of the four marks of a good point set a sampler has (Suffern 2007, ch. 5)."""

    even_2d: bool
    """The points spread evenly over the square: few clumps and gaps."""
    even_1d: bool
    """So do their projections on x and on y: seen from a side, no two points coincide."""
    min_distance: bool
    """No two points come close to each other."""
    irregular: bool
    """The points have no regular spacing, which would alias."""


@dataclass(frozen=True)
class Counts:
    """The numbers of points that a sampler can make: `nearest(n)` is the smallest of them not below n."""

    rule: str
    nearest: Callable[[int], int]


@dataclass(frozen=True)
class Sampler:
    """A technique of placing points in the unit square.

    `name` is what Python and the command line call it, `label` what a user reads, `description` its tooltip.
    `number` is what a .blend file stores and the order of display: it never changes. `origin` is author and year.
    `generate(set_count, count, rng)` makes the points; call the sampler itself, which checks the count first.
    `along_curve` says that the sets are runs of one sequence and complete each other: pixels that are neighbours on a
    space-filling curve are to take sets that are neighbours too. Else the sets have nothing to do with each other.
    """

    name: str
    label: str
    description: str
    number: int
    origin: str
    criteria: Criteria
    counts: Counts
    generate: Callable[[int, int, np.random.Generator], np.ndarray]
    along_curve: bool = False

    def actual_count(self, requested: int) -> int:
        """The number of points that a set really has when `requested` are asked for: the nearest not below.

        Raises:
            ValueError: less than one point is asked for.
        """
        if requested < 1:
            raise ValueError(f"a set has at least one point, not {requested}")
        return self.counts.nearest(requested)

    def __call__(self, set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
        """Make `set_count` sets of `count` points: float32 (set_count, count, 2) in [0, 1), in textbook order.

        Raises:
            ValueError: the technique cannot make `count` points.
        """
        nearest = self.actual_count(count)
        if nearest != count:
            raise ValueError(f"{self.label} cannot make {count} points, but {nearest}: {self.counts.rule}")
        return self.generate(set_count, count, rng)


def grid_shape(count: int) -> tuple[int, int]:
    """(rows, columns) of the grid nearest to a square with at least `count` cells: r × r or r × (r + 1).

    >>> grid_shape(16), grid_shape(17), grid_shape(21)
    ((4, 4), (4, 5), (5, 5))
    """
    root = isqrt(count)
    rows = root + (count > root * (root + 1))  # √count, rounded to the nearest integer
    return rows, -(-count // rows)


def cells(count: int) -> int:
    """The number of cells of the grid for `count` points."""
    rows, columns = grid_shape(count)
    return rows * columns


ANY_COUNT = Counts("any count from 1 on", nearest=int)
GRID_COUNTS = Counts("it fills a grid of rows × columns, with as many columns as rows or one more", nearest=cells)


def in_stratum(index: np.ndarray, offset: np.ndarray | float, strata: int) -> np.ndarray:
    """The numbers (index + offset) / strata as float32, each kept inside its stratum of [0, 1).

    `index` are integers in [0, strata), `offset` numbers in [0, 1) that broadcast against them. Without care rounding
    would move a point into the next stratum, or to 1: the largest number is 1 - 2**-24.
    """
    lowest, highest = stratum_bounds(strata)
    numbers = (index.astype(np.float32) + offset) / np.float32(strata)
    return np.clip(numbers, lowest[index], highest[index])


def stratum_bounds(strata: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and the highest float32 x of each of `strata` equal strata of [0, 1).

    They are inside both exactly and when a reader computes floor(x · strata) in float32 (up to 2**22 strata).
    """
    index = np.arange(strata + 1)
    edges = (index / strata).astype(np.float32)
    # x · strata is exact in float64: 24 bits times a number of few bits.
    edges = np.where(edges.astype(np.float64) * strata < index, np.nextafter(edges, np.float32(2)), edges)
    highest = np.nextafter(edges[1:], np.float32(0))
    rounds_up = np.floor(highest * np.float32(strata)) > index[:-1]
    return edges[:-1], np.where(rounds_up, np.nextafter(highest, np.float32(0)), highest)
