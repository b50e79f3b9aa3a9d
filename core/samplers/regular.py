"""Regular sampling: the centres of a grid's cells.

Supersampling on a finer grid is as old as the treatment of aliasing itself (Crow 1977; Suffern 2007, ch. 5). The points
are as even in the plane and as far apart as a square lattice allows, but one behind the other when seen from a side:
n points have √n different x. Their equal spacing aliases, as moiré and as stair steps on near-vertical edges.

Meets: even in 2-D, minimum distance. Fails: even 1-D projections, irregular spacing.
Counts: rows × columns with columns = rows or rows + 1. There is no chance in it: all sets are the same.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import GRID_COUNTS, Criteria, Sampler, grid_shape, in_stratum


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of `count` cell centres, row by row; `rng` is not used."""
    rows, columns = grid_shape(count)
    points = np.empty((set_count, rows, columns, 2), np.float32)
    points[..., 0] = in_stratum(np.arange(columns), 0.5, columns)
    points[..., 1] = in_stratum(np.arange(rows), 0.5, rows)[:, np.newaxis]
    return points.reshape(set_count, count, 2)


SAMPLER = Sampler(
    name="regular",
    label="Regular",
    description="The centres of a regular grid, the same in every pixel and frame. Even and free of noise, but fine "
    "detail turns into moiré, near-vertical edges into steps, and soft shadows and blur into bands and copies. For all "
    "but comparison take Jittered",
    number=0,
    origin="Crow, 1977",
    criteria=Criteria(even_2d=True, even_1d=False, min_distance=True, irregular=False),
    counts=GRID_COUNTS,
    generate=generate,
)
