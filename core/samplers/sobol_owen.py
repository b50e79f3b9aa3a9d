"""Sobol sampling with Owen's scrambling: the first n points of Sobol's sequence, each set scrambled anew.

Sobol 1967, Owen 1995, made by hashing as Burley 2020 does; *padded*, that is: in every domain the same first two
dimensions, put together at random. Where n is a power of two a set is a (0, k, 2)-net: jittered on grids of every shape
at once, 16 × 1, 8 × 2, 4 × 4 and so on. Owen (1997) proved that the error of smooth integrands falls with n^-3/2. The
sequence is progressive: each prefix is a good set as well.

Meets: even in 2-D, even 1-D projections, irregular spacing. Fails: minimum distance.
Counts: any; in each axis one point per stratum of 1/n only where n is a power of two.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler
from .sobol import scrambled_sobol


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of the sequence's first `count` points, in its order."""
    seeds = rng.integers(1 << 32, size=(set_count, 1, 2), dtype=np.uint32)
    return scrambled_sobol(np.arange(count), seeds)


SAMPLER = Sampler(
    name="sobol_owen",
    label="Sobol, Owen-Scrambled",
    description="Stratified on grids of every shape at once, at random within. The least error where the picture is "
    "smooth, and good everywhere; best at powers of two. At other counts take Multi-Jittered",
    number=6,
    origin="Burley, 2020",
    criteria=Criteria(even_2d=True, even_1d=True, min_distance=False, irregular=True),
    counts=ANY_COUNT,
    generate=generate,
)
