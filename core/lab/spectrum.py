"""The periodogram: how strongly a set of points repeats itself, by direction and spacing.

The power at a frequency f is P(f) = |Σ exp(-2πi f·p)|²/n over the n points p (Bartlett 1964; Ulichney 1988 brought it
to graphics). At whole frequencies the unit square repeats without a seam. Independent points have P = 1 on average at
every f but 0, where it is always n; a lattice has P = n at its own frequencies and 0 at the others. A dark middle means
that little of a picture's coarse detail is lost as noise; a bright dot is a pattern in the picture that will alias.

Only numpy is needed.
"""

from __future__ import annotations

from math import isqrt

import numpy as np


def reach(count: int) -> int:
    """The largest frequency looked at along each axis: 2√n rounded up, twice that of a square grid of n points."""
    return isqrt(4 * count - 1) + 1


def periodograms(points: np.ndarray, highest: int) -> np.ndarray:
    """The power of each set, without that at frequency 0, which is set to 0.

    `points` are (sets, n, 2) in [0, 1). Returns float64 (sets, 2 highest + 1, 2 highest + 1): [s, j, i] is the power at
    the frequency (i - highest, j - highest), x first.
    """
    frequencies = np.arange(-highest, highest + 1)
    power = np.empty((len(points), len(frequencies), len(frequencies)))
    for s, p in enumerate(points.astype(np.float64)):
        # exp(-2πi(fx x + fy y)) is a product of one factor for each axis: the sum over points is a matrix product.
        waves_x, waves_y = np.exp(-2j * np.pi * p.T[:, :, np.newaxis] * frequencies)
        power[s] = np.abs(waves_y.T @ waves_x) ** 2 / len(p)
    power[:, highest, highest] = 0
    return power
