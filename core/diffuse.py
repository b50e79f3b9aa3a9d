"""Rough matt surfaces: Oren and Nayar's model, as Fujii improved it, with all the light that bounces between facets.

Lambert's model needs no code: cosine / π. Directions are sampled with that density for both; where viewer and light
both graze the surface Oren and Nayar's is larger, by up to roughness / cosine.

Oren and Nayar 1994; Fujii 2012, "A tiny improvement of Oren-Nayar reflectance model"; the multiple scattering is that
of the OpenPBR surface (Andersson et al. 2024), after Kulla and Conty 2017. An albedo of 1 loses nothing.
"""

from __future__ import annotations

import math

import numpy as np

from .jit import device
from .warps import INV_PI, ONE, PI, TWO, ZERO

TWO_THIRDS = np.float32(2 / 3)
#: What a roughness of 1 takes from a surface that is seen or lit along itself.
GRAZING = np.float32(math.pi / 2 - 2 / 3)
#: The mean over the cosine-weighted hemisphere of `_shaded_share`: 2π/3 - 28/15.
MEAN_SHARE = np.float32(2 * math.pi / 3 - 28 / 15)
#: Keeps a ratio of cosines from being 0 / 0.
TINY = np.float32(1e-20)


@device
def oren_nayar(roughness: float, cosine_v: float, cosine_l: float, v_dot_l: float) -> tuple[float, float]:
    """What is reflected per steradian and cosine of the light, without its colour: after one bounce, and after more.

    The cosines are those of viewer and light to the normal, 0 to 1. Lambert's would be (1 / π, 0). The second part is
    still to be tinted by `oren_nayar_tint`.
    """
    a = ONE / (PI + roughness * GRAZING)
    b = roughness * a
    t = v_dot_l - cosine_v * cosine_l
    once = a + b * (t / max(cosine_v, cosine_l, TINY) if t > ZERO else t)
    # 1 - π a is b × GRAZING: what a direction loses to further bounces, and what all lose on average.
    loss_v = b * (GRAZING - _shaded_share(cosine_v))
    loss_l = b * (GRAZING - _shaded_share(cosine_l))
    loss = b * (GRAZING - MEAN_SHARE)
    return max(once, ZERO), INV_PI * max(loss_v, ZERO) * max(loss_l, ZERO) / max(loss, TINY)


@device
def oren_nayar_tint(roughness: float, albedo: float) -> float:
    """What the second part of `oren_nayar` is multiplied with: the series of the bounces after the first."""
    loss = roughness * (GRAZING - MEAN_SHARE) / (PI + roughness * GRAZING)
    return albedo * albedo * (ONE - loss) / (ONE - albedo * loss)


@device
def bump_alpha_squared(cosine: float) -> float:
    """How rough facets would have to be to tilt a normal as far as a bump does, by the cosine between both normals.

    Light that comes from before a bump's normal, but along the surface, would not reach it: the bump's own terminator
    would be a hard edge (Estevez, Lecocq and Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump
    Terminator Problem").
    """
    square = max(cosine * cosine, TINY)
    return min((ONE - square) / (np.float32(8) * square), ONE) if square < ONE else ZERO


@device
def bump_share(alpha_squared: float, cosine: float) -> float:
    """The share of light that such facets let pass, by the cosine of the light to the normal that was tilted (GGX)."""
    square = max(cosine * cosine, TINY)
    return TWO / (ONE + np.sqrt(ONE + alpha_squared * (ONE - square) / square))


@device
def _shaded_share(cosine: float) -> float:
    """Fujii's albedo in one direction is π a + b × this. Written without his 1 - sin³, so that it keeps its digits."""
    sine = np.sqrt(max(ONE - cosine * cosine, ZERO))
    angle = np.arccos(min(cosine, ONE))
    return sine * (angle - TWO_THIRDS - sine * cosine) + TWO_THIRDS * sine * cosine * (ONE + sine + sine * sine) / (
        ONE + sine
    )
