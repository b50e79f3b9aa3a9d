"""ZSobol sampling: one scrambled Sobol sequence for the whole picture, cut into sets along a Z-curve of its pixels.

After Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering
of Pixels". Each set of 2^k points is a (0, k, 2)-net, as good in its pixel as one of `sobol_owen`. Besides, the sets of
4, 16, 64 … pixels that form a square are a net together: where one pixel comes out too bright its neighbours make up
for it. The error is as large, but it is *blue* noise, without low frequencies, which the eye and a filter average away.

Meets: even in 2-D, even 1-D projections, irregular spacing. Fails: minimum distance.
Counts: powers of two.
"""

from __future__ import annotations

from .late_numpy import np
from .sampler import Counts, Criteria, Sampler
from .sobol import scrambled_sobol


def generate(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """The sequence's first `set_count` runs of `count` points, in its order."""
    index = np.arange(set_count * count).reshape(set_count, count)
    return scrambled_sobol(index, rng.integers(1 << 32, size=2, dtype=np.uint32))


SAMPLER = Sampler(
    name="z_sobol",
    label="ZSobol",
    description="One Sobol sequence for the whole picture, shared out along a Z-curve. The same error as Sobol, but "
    "spread as fine, even grain that the eye averages away. Powers of two only: for other counts take Multi-Jittered",
    number=8,
    origin="Ahmed and Wonka, 2020",
    criteria=Criteria(even_2d=True, even_1d=True, min_distance=False, irregular=True),
    counts=Counts("it takes powers of two", nearest=lambda count: 1 << (count - 1).bit_length()),
    generate=generate,
    along_curve=True,
)
