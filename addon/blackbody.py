"""The colour of what glows with heat.

Planck's spectrum, seen by the CIE 1931 observer, whose colour matching functions are sums of Gaussian lobes after
Wyman, Sloan and Shirley (2013, Simple analytic approximations to the CIE XYZ color matching functions). Cycles has a
fit of its own: from 2000 K on the two differ by less than 2 %, at 1500 K by 3 %, and in what is left of green by more.
"""

from __future__ import annotations

import numpy as np

from .nodes import Color

#: Cycles' range, in kelvin.
COLDEST, HOTTEST = 800.0, 12000.0

#: hc/k in nm K.
SECOND_RADIATION_CONSTANT = 1.438776877e7
WAVELENGTHS = np.arange(380.0, 781.0)  # nm

#: For X, Y and Z: the lobes' heights, centres in nm, and widths below and above these.
LOBES = (
    ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
)
XYZ_TO_REC709 = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)


def blackbody(temperature: float) -> Color:
    """Linear Rec.709 of luminance 1; what lies outside of its gamut is 0."""
    kelvin = min(max(temperature, COLDEST), HOTTEST)
    spectrum = WAVELENGTHS**-5 / np.expm1(SECOND_RADIATION_CONSTANT / (WAVELENGTHS * kelvin))
    xyz = np.array([sum(_lobe(*lobe) for lobe in lobes) @ spectrum for lobes in LOBES])
    red, green, blue = np.maximum(XYZ_TO_REC709 @ (xyz / xyz[1]), 0.0)
    return float(red), float(green), float(blue)


def _lobe(height: float, centre: float, below: float, above: float) -> np.ndarray:
    distance = WAVELENGTHS - centre
    return height * np.exp(-0.5 * (distance / np.where(distance < 0.0, below, above)) ** 2)
