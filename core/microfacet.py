"""Rough mirrors and rough glass: surfaces of tiny facets that are distributed as GGX (Walter et al. 2007).

Facets shade and mask each other as Smith has it, with heights correlated (Heitz 2014). Facets are sampled as the
viewer sees them (Heitz 2018), on a spherical cap (Dupuy and Benyoub 2023). Light that bounces from facet to facet is
lost here.

Cosines are to the surface's normal, those of the viewer and of facets above 0. `alpha` is the roughness parameter of
the distribution, above 0. Everything is written with

    reach(c) = √(c² + α² (1 - c²)), where Smith's Λ is (reach(c) / c - 1) / 2,

so that neither grazing angles nor a tiny alpha divide by zero or cancel.
"""

from __future__ import annotations

import numpy as np

from .jit import device
from .warps import INV_PI, ONE, TWO, ZERO, square_to_cap

#: Keeps a ratio of cosines that both underflow from being 0 / 0.
TINY = np.float32(1e-37)
#: At and below this alpha² a surface is smooth, and within this distance of 1 an index of refraction bends nothing:
#: the limits of Cycles 4.5.
SMOOTH_ALPHA_SQUARED = np.float32(2e-10)
SAME_INDEX = np.float32(1e-4)


@device
def is_smooth(alpha: float) -> bool:
    """Whether the surface is a perfect mirror or pane: its directions have no density."""
    return alpha * alpha <= SMOOTH_ALPHA_SQUARED


@device
def bends_nothing(eta: float) -> bool:
    """Whether light goes straight through, however rough the surface is: then that has no density either."""
    return abs(eta - ONE) < SAME_INDEX


@device
def ggx_density(alpha: float, nx: float, ny: float, nz: float, hx: float, hy: float, hz: float) -> float:
    """D of facets along h, of any length but 0, on a surface of normal n, per steradian.

    Integrated over them with their cosine it is 1. The sine comes from the cross product: 1 - cosine² would keep no
    digit of the small angles that matter for a small alpha.
    """
    cosine = nx * hx + ny * hy + nz * hz
    x, y, z = ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx
    squared = alpha * alpha
    stretched = (x * x + y * y + z * z + squared * cosine * cosine) / (hx * hx + hy * hy + hz * hz)
    return INV_PI * squared / (stretched * stretched)


@device
def reach(alpha: float, cosine: float) -> float:
    """See above."""
    return np.sqrt(cosine * cosine + alpha * alpha * max(ONE - cosine * cosine, ZERO))


@device
def visible_share(alpha: float, cosine_v: float) -> float:
    """G₁(v) / cos v: D × this × v·h is the density of facets h that the viewer sees, per steradian."""
    return TWO / (cosine_v + reach(alpha, cosine_v))


@device
def visible_and_lit_share(alpha: float, cosine_v: float, cosine_l: float) -> float:
    """G₂(v, l) / cos v, for light from either side; never more than `visible_share`."""
    both = reach(alpha, cosine_v) * cosine_l + reach(alpha, cosine_l) * cosine_v
    return TWO * cosine_l / max(both, TINY)


@device
def square_to_visible_facet(
    u: float, v: float, alpha: float, vx: float, vy: float, vz: float
) -> tuple[float, float, float]:
    """The unit normal of a facet, as likely as the viewer in the direction v sees it; all in tangent space, vz > 0.

    Stretched by 1 / alpha the surface is a hemisphere, and a uniform cap of mirrored rays hits it as the viewer does.
    """
    x, y, z = alpha * vx, alpha * vy, vz
    scale = ONE / np.sqrt(x * x + y * y + z * z)
    x, y, z = scale * x, scale * y, scale * z
    cx, cy, cz = square_to_cap(u, v, ONE + z)
    hx, hy, hz = alpha * (x + cx), alpha * (y + cy), max(z + cz, ZERO)
    squared = hx * hx + hy * hy + hz * hz
    # The viewer's own opposite, on the rim, mirrors into nothing.
    if squared == ZERO:
        return ZERO, ZERO, ONE
    scale = ONE / np.sqrt(squared)
    return scale * hx, scale * hy, scale * hz
