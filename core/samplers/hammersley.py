"""Hammersley sampling: the i-th of n points is (i/n, Φ₂(i)).

Φ₂ is the radical inverse in base 2: the binary digits of i mirrored about the point, so that 6 = 110₂ becomes
.011₂ = 0.375 (van der Corput 1935; Hammersley 1960; Hammersley and Handscomb 1964; Suffern 2007, ch. 5, whose Table 5.1
has Φ₂(5) and Φ₂(6) wrong). The x are regularly spaced, the pattern has symmetries, and a set is a set: two pixels with
the same points show the same error, which aliases.

Meets: even in 2-D, even 1-D projections. Fails: irregular spacing, and, whatever the book says, minimum distance: the
smallest is hardly larger than among random points, and its share of the largest possible halves with each 4 times n.
Counts: any; in y one point per stratum of 1/n only where n is a power of two. There is no chance in it: all sets are
the same, and the first point is the square's corner.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import ANY_COUNT, Criteria, Sampler, in_stratum
from .sobol import reverse_bits, unit_interval


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sets of the `count` points from left to right; `rng` is not used."""
    index = np.arange(count)
    points = np.empty((set_count, count, 2), np.float32)
    points[..., 0] = in_stratum(index, 0, count)
    points[..., 1] = radical_inverse(index)
    return points


def radical_inverse(index: np.ndarray) -> np.ndarray:
    """Φ₂ of integers in [0, 2**32): float32 in [0, 1), exact below 2**24 and rounded down from there on."""
    return unit_interval(reverse_bits(index.astype(np.uint32)))


SAMPLER = Sampler(
    name="hammersley",
    label="Hammersley",
    description="Equal steps in x, mirrored binary digits in y. Even over the square and along each axis, but the same "
    "in every pixel and frame: moiré, bands and copies in place of noise, and a picture that is shifted, by half a "
    "pixel with one sample. Take Sobol instead",
    number=5,
    origin="Hammersley, 1960",
    criteria=Criteria(even_2d=True, even_1d=True, min_distance=False, irregular=False),
    counts=ANY_COUNT,
    generate=generate,
)
