"""Correlated multi-jittered sampling: multi-jittered with one shuffle for all rows and one for all columns.

In the textbook's multi-jittered sets each row of the coarse grid is shuffled by itself, so that points of neighbouring
cells can come close. Here all rows share one permutation and all columns share another: the points keep the spacing of
the canonical arrangement, and clump less (Kensler 2013, "Correlated Multi-Jittered Sampling", Pixar TM 13-01).

Any n is made as Kensler does, from a grid of `columns` ≈ √n whose last row is not full. He leaves places of the fine
grid empty then; here the points close up, and the places are counted from a random start, round the end. So each of
the n strata of each axis holds one point for every n, and each place is equally likely.

Meets: even in 2-D, even 1-D projections, irregular spacing. Fails: minimum distance, though it comes nearest of those.
Counts: any.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler, grid_shape, in_stratum


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of `count` points, coarse row by coarse row from the bottom."""
    columns = grid_shape(count)[1]
    rows = -(-count // columns)
    index = np.arange(count)
    column = _permutations(set_count, columns, rng)[:, index % columns]
    place = _permutations(set_count, rows, rng)[:, index // columns]
    # What was the place in the column becomes the rank among all points.
    fine_column = np.argsort(np.argsort(column * rows + place, axis=1), axis=1)
    if count < rows * columns:
        fine_column = (fine_column + rng.integers(count, size=(set_count, 1))) % count
    jitter = rng.random((2, set_count, count), dtype=np.float32)
    points = np.empty((set_count, count, 2), np.float32)
    points[..., 0] = in_stratum(fine_column, jitter[0], count)
    points[..., 1] = in_stratum(index, jitter[1], count)
    return points


def _permutations(set_count: int, length: int, rng: np.random.Generator) -> np.ndarray:
    """A permutation of 0 … length - 1 for each set: (set_count, length)."""
    return rng.permuted(np.broadcast_to(np.arange(length), (set_count, length)), axis=1)


SAMPLER = Sampler(
    name="correlated_multi_jittered",
    label="Correlated Multi-Jittered",
    description="Multi-jittered with one shuffle shared by all rows and one by all columns, which keeps the points "
    "further apart. As good on edges as Sobol, at any count. Detail as fine as its points makes more noise: there take "
    "Multi-Jittered",
    number=7,
    origin="Kensler, 2013",
    criteria=Criteria(even_2d=True, even_1d=True, min_distance=False, irregular=True),
    counts=ANY_COUNT,
    generate=generate,
)
