"""The point sets that the lab measures and draws."""

from __future__ import annotations

import numpy as np

from ..samplers import Sampler


def independent_sets(sampler: Sampler, count: int, sets: int, seed: int) -> np.ndarray:
    """Sets of `count` points, float32 (sets, count, 2); one set only where chance has no part in the sampler.

    Each sampler and count has random numbers of its own: no set depends on what else is made.

    Raises:
        ValueError: the sampler cannot make `count` points.
    """
    rng = np.random.default_rng((seed, sampler.number, count))
    # One by one: the sets of one call may be parts of one sequence, and a standard error wants independent ones.
    points = np.concatenate([sampler(1, count, rng) for _ in range(sets)])
    return points[:1] if (points == points[0]).all() else points
