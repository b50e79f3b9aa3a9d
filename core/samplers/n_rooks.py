"""N-rooks sampling: n points on an n × n grid, like rooks none of which can take another.

Each row and each column of the grid holds exactly one point (Shirley 1991; Suffern 2007, ch. 5; Latin hypercube
sampling in statistics, McKay, Beckman and Conover 1979). Jittered points on the main diagonal are made first; then one
coordinate is shuffled. One fair shuffle is enough: shuffling both coordinates gives the same distribution. The
projections are perfect, the plane is hardly better covered than by random points.

Meets: even 1-D projections, irregular spacing. Fails: even in 2-D, minimum distance.
Counts: any.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler, in_stratum


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of `count` points, one in each column (in this order) and one in each row of the count × count grid."""
    jitter = rng.random((2, set_count, count), dtype=np.float32)
    diagonal = in_stratum(np.arange(count), jitter, count)
    return np.stack((diagonal[0], rng.permuted(diagonal[1], axis=1)), axis=-1)


SAMPLER = Sampler(
    name="n_rooks",
    label="N-Rooks",
    description="One point in each row and each column of a fine grid. Perfectly even along each axis, good for "
    "horizontal and vertical edges, but little better than random over the square. For all else take Multi-Jittered",
    number=3,
    origin="Shirley, 1991",
    criteria=Criteria(even_2d=False, even_1d=True, min_distance=False, irregular=True),
    counts=ANY_COUNT,
    generate=generate,
)
