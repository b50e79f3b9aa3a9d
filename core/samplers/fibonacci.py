"""Fibonacci sampling: a lattice turned by the golden ratio, shifted at random for each set.

The i-th of n points is (i/n, frac(i g/n)) with g/n next to 1/φ: a rank-1 lattice (Korobov 1959; Sloan and Joe 1994),
which for Fibonacci numbers n is the lattice of Zaremba (1966). The points are as far apart as those of a good lattice,
and their rows are at angles that few edges in a picture have. For any n, g is the number next to n/φ that has no
divisor in common with n, so that both axes hold one point per stratum of 1/n. The shift, by whole strata and part of
one, goes round the ends of the square (Cranley and Patterson 1976) and makes the sets random and the mean unbiased.

Meets: even in 2-D, even 1-D projections, minimum distance. Fails: irregular spacing: it is a grid, only a turned one.
Counts: any. The generator is the one nearest to the golden ratio, not the best there is: at some counts (15, 24, 54,
88 …) its points come closer than the third mark allows.
"""

from __future__ import annotations

from math import gcd, sqrt

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler, in_stratum

GOLDEN_RATIO = (1 + sqrt(5)) / 2


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of the lattice's `count` points, in the order of its first axis before the shift."""
    index = np.arange(count, dtype=np.int64)  # on Windows numpy 1 would take 32 bits, too few for the product
    lattice = np.stack([index, index * generator(count) % count])
    start = rng.integers(count, size=(2, set_count, 1))
    offset = rng.random((2, set_count, 1), dtype=np.float32)
    return np.stack(in_stratum((lattice[:, None] + start) % count, offset, count), axis=-1)


def generator(count: int) -> int:
    """The whole number nearest to count/φ that has no divisor in common with `count`.

    >>> generator(21), generator(16)
    (13, 9)
    """
    return min((g for g in range(1, count + 1) if gcd(g, count) == 1), key=lambda g: abs(g - count / GOLDEN_RATIO))


SAMPLER = Sampler(
    name="fibonacci",
    label="Fibonacci",
    description="A lattice turned by the golden ratio and shifted at random. Even over the square and along each axis, "
    "and at most counts its points keep apart, but it is regular: where fine detail meets its spacing, all points "
    "agree, and the noise is that of one. There take Multi-Jittered",
    number=9,
    origin="Zaremba, 1966",
    criteria=Criteria(even_2d=True, even_1d=True, min_distance=True, irregular=False),
    counts=ANY_COUNT,
    generate=generate,
)
