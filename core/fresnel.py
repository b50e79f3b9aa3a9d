"""Fresnel's equations and what artists use in their place: how much of the light a smooth surface reflects.

Every function is of one channel. `cosine` is that between the ray on the viewer's side and the normal, 0 to 1; `eta` is
the index of refraction of the far side over that of the viewer's. A reflectance is a share of the light, 0 to 1.
"""

from __future__ import annotations

import numpy as np

from .jit import device
from .warps import HALF, ONE, TWO, ZERO

#: Below any cosine that matters: keeps the ratios of rays along the surface from being 0 / 0.
TINY = np.float32(1e-9)
#: The F82 model's second angle has the cosine 1/7: (1 - 1/7)⁵, and 7 / (1 - 1/7)⁶.
SCHLICK_AT_82 = np.float32((6 / 7) ** 5)
F82_SCALE = np.float32(7 / (6 / 7) ** 6)
#: `ior_from_f0` goes no further: an index of refraction of 399.
LARGEST_F0 = np.float32(0.99)


@device
def f0_from_ior(eta: float) -> float:
    """The reflectance head on of a dielectric."""
    ratio = (eta - ONE) / (eta + ONE)
    return ratio * ratio


@device
def ior_from_f0(f0: float) -> float:
    """The eta, 1 or more, of the dielectric with this reflectance head on, up to LARGEST_F0."""
    amplitude = np.sqrt(min(max(f0, ZERO), LARGEST_F0))
    return (ONE + amplitude) / (ONE - amplitude)


@device
def transmitted_cosine(cosine: float, eta: float) -> float:
    """The cosine of the refracted ray to the normal on the far side (Snell's law); 0 where all is reflected."""
    # η² - sin², grouped so that an eta close to 1 keeps its digits.
    squared = (eta - ONE) * (eta + ONE) + cosine * cosine
    return min(np.sqrt(max(squared, ZERO)) / eta, ONE)


@device
def dielectric_reflectance(cosine: float, eta: float) -> float:
    """Fresnel's equations for unpolarised light between two dielectrics; 1 where all is reflected."""
    near = max(cosine, TINY)
    far = transmitted_cosine(near, eta)
    # Of light that swings across the plane of incidence, and in it.
    across = (near - eta * far) / (near + eta * far)
    within = (eta * near - far) / (eta * near + far)
    return min(HALF * (across * across + within * within), ONE) if far > ZERO else ONE


@device
def schlick_share(cosine: float, eta: float, exponent: float) -> float:
    """How far the reflectance has gone from F0 head on to F90 at grazing angles: 0 to 1 (Schlick 1994).

    (1 - cosine) to the power of `exponent`, with the cosine on the side of the lower index of refraction. A negative
    exponent asks for the curve of the dielectric itself, remapped. 1 where all is reflected.
    """
    if exponent < ZERO:
        f0 = f0_from_ior(eta)
        return min(max((dielectric_reflectance(cosine, eta) - f0) / (ONE - f0), ZERO), ONE)
    outer = transmitted_cosine(cosine, eta) if eta < ONE else cosine
    return max(ONE - outer, ZERO) ** exponent


@device
def f82_coefficient(f0: float, tint: float) -> float:
    """The coefficient of `f82_reflectance` that multiplies Schlick's reflectance near 82 degrees with `tint`."""
    return F82_SCALE * (f0 + (ONE - f0) * SCHLICK_AT_82) * (ONE - tint)


@device
def f82_reflectance(cosine: float, f0: float, coefficient: float) -> float:
    """Schlick's reflectance less a dip of metals near 82 degrees (Hoffman 2019; Kutz, Hašan and Edmondson 2021)."""
    rest = min(max(ONE - cosine, ZERO), ONE)
    fifth = rest * rest * rest * rest * rest
    return min(max(f0 + (ONE - f0) * fifth - coefficient * cosine * fifth * rest, ZERO), ONE)


@device
def conductor_reflectance(cosine: float, n: float, k: float) -> float:
    """Fresnel's equations for unpolarised light from air onto a conductor of index n + ik (Born and Wolf, ch. 14).

    a + ib is the square root of (n + ik)² - sin², which stands for the index times the refracted ray's cosine.
    """
    near = max(cosine, TINY)
    sin_squared = max(ONE - cosine * cosine, ZERO)
    real, half_imaginary = (n - k) * (n + k) - sin_squared, n * k
    modulus = np.sqrt(real * real + (TWO * half_imaginary) * (TWO * half_imaginary))
    # The larger of a and b, and the other from their product: neither loses its digits.
    larger = np.sqrt(max(HALF * (modulus + abs(real)), TINY))
    smaller = half_imaginary / larger
    a, b = (larger, smaller) if real > ZERO else (smaller, larger)
    across = ((a - near) * (a - near) + b * b) / ((a + near) * (a + near) + b * b)
    below = (sin_squared + a * near) * (sin_squared + a * near) + (b * near) * (b * near)
    above = (sin_squared - a * near) * (sin_squared - a * near) + (b * near) * (b * near)
    return HALF * across * (ONE + above / max(below, TINY))
