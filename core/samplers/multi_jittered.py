"""Multi-jittered sampling: jittered and n-rooks at once.

A coarse grid of rows × columns cells with one point in each, placed such that the n × n fine grid also has one point
in each row and column (Chiu, Shirley and Wang 1994; Suffern 2007, ch. 5 and fig. 5.11, for squares n).

Where n is rows × columns with cells at most twice as high as wide, that is exactly what is made. Any other n (primes,
say) is rows × columns + d with rows ≈ √n and d < rows: d of the rows, spread evenly, take one point more. The fine
columns are dealt out to the rows: d of them, spread evenly from a random start, to the longer rows, and of the others
each successive run of `rows` columns once to every row. So each row stays stratified in x, each point has a row of its
own and a column of its own, and each place of the fine grid is equally likely: the estimate is free of bias. (Dropping
points from a larger set would lose one of the three.)

Meets: even in 2-D, even 1-D projections, irregular spacing. Fails: minimum distance.
Counts: any.
"""

from __future__ import annotations

from math import isqrt

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler, grid_shape, in_stratum


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of `count` points, coarse row by coarse row, in each from left to right."""
    rows = coarse_rows(count)
    sizes = np.diff(np.arange(rows + 1) * count // rows)  # how many points are in each row
    row_of_point = np.repeat(np.arange(rows), sizes)
    row_of_column = deal_columns(set_count, sizes, rng)
    column = np.argsort(row_of_column, axis=1, kind="stable")
    # The fine rows of a coarse row go to its points in random order.
    fine_row = np.argsort(row_of_point + rng.random((set_count, count)), axis=1)
    jitter = rng.random((2, set_count, count), dtype=np.float32)
    points = np.empty((set_count, count, 2), np.float32)
    points[..., 0] = in_stratum(column, jitter[0], count)
    points[..., 1] = in_stratum(fine_row, jitter[1], count)
    return points


def coarse_rows(count: int) -> int:
    """The rows of the coarse grid: the divisor next to √count if cells are then 2 : 1 or squarer, or else √count."""
    divisor = next(rows for rows in range(isqrt(count), 0, -1) if count % rows == 0)
    return divisor if count <= 2 * divisor**2 else grid_shape(count)[0]


def deal_columns(set_count: int, sizes: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Which coarse row each fine column belongs to, (set_count, n): row j gets `sizes[j]` of the n columns."""
    count, rows, columns = sizes.sum(), len(sizes), sizes.min()
    longer = np.flatnonzero(sizes > columns).astype(np.uint16)
    extra = np.zeros((set_count, count), bool)
    if len(longer):
        start = rng.integers(count, size=(set_count, 1))
        np.put_along_axis(extra, (np.arange(len(longer)) * count + start) // len(longer), True, axis=1)
    dealt = np.empty((set_count, count), np.uint16)
    every_row = np.broadcast_to(np.arange(rows, dtype=np.uint16), (set_count * columns, rows))
    dealt[extra] = rng.permuted(np.broadcast_to(longer, (set_count, len(longer))), axis=1).ravel()
    dealt[~extra] = rng.permuted(every_row, axis=1).ravel()
    return dealt


SAMPLER = Sampler(
    name="multi_jittered",
    label="Multi-Jittered",
    description="One point in each cell of a coarse grid and in each row and column of a fine one. Even over the "
    "square and along each axis: the best all-rounder, though points can still come close to each other. At "
    "powers of two Sobol has less noise in smooth light",
    number=4,
    origin="Chiu, Shirley and Wang, 1994",
    criteria=Criteria(even_2d=True, even_1d=True, min_distance=False, irregular=True),
    counts=ANY_COUNT,
    generate=generate,
)
