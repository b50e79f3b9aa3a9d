"""Random sampling: every point anywhere, independent of all others.

Plain Monte Carlo integration (Metropolis and Ulam 1949; Suffern 2007, ch. 5). Points clump and leave gaps: the error
falls with 1/√n whatever is integrated. It replaces aliasing by noise.

Meets: irregular spacing. Fails: even in 2-D, even 1-D projections, minimum distance.
Counts: any.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of `count` independent points."""
    return rng.random((set_count, count, 2), dtype=np.float32)


SAMPLER = Sampler(
    name="random",
    label="Random",
    description="Independent random points. Never aliases, but clumps and gaps make it the noisiest of all. Take "
    "Multi-Jittered for less noise at any count",
    number=1,
    origin="Metropolis and Ulam, 1949",
    criteria=Criteria(even_2d=False, even_1d=False, min_distance=False, irregular=True),
    counts=ANY_COUNT,
    generate=generate,
)
