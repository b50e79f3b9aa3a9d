"""Jittered sampling: one random point in each cell of a grid.

Stratified sampling (Cook, Porter and Carpenter 1984; Cook 1986; Suffern 2007, ch. 5 and fig. 5.9). The strata are
independent and cover the square without gap or overlap. Points of neighbouring cells can touch, and the projections
clump: in x, all points of a column share 1/√n of the axis.

Meets: even in 2-D, irregular spacing. Fails: even 1-D projections, minimum distance.
Counts: rows × columns with columns = rows or rows + 1.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import GRID_COUNTS, Criteria, Sampler, grid_shape, in_stratum


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of `count` points, one in each cell, row by row."""
    rows, columns = grid_shape(count)
    jitter = rng.random((2, set_count, rows, columns), dtype=np.float32)
    points = np.empty((set_count, rows, columns, 2), np.float32)
    points[..., 0] = in_stratum(np.arange(columns), jitter[0], columns)
    points[..., 1] = in_stratum(np.arange(rows)[:, np.newaxis], jitter[1], rows)
    return points.reshape(set_count, count, 2)


SAMPLER = Sampler(
    name="jittered",
    label="Jittered",
    description="One random point in each cell of a grid. Even over the square and a good choice for any picture, but "
    "uneven along each axis, which shows on edges close to horizontal or vertical. There take Multi-Jittered",
    number=2,
    origin="Cook, Porter and Carpenter, 1984",
    criteria=Criteria(even_2d=True, even_1d=False, min_distance=False, irregular=True),
    counts=GRID_COUNTS,
    generate=generate,
)
