"""The textbook's glossy lobe: a power of the cosine to the mirror direction (Phong 1975; Suffern 2007, ch. 25).

The BRDF (exponent + 2) / 2π × cosᵉ, of the angle between the light and the viewer's mirror image, reflects all light
head on (Lewis 1994), and less from elsewhere: from the angle θ to the normal a sharp lobe of albedo 1 reflects cos θ.
That is the cosine of the light's direction, by which every BRDF is multiplied and which the textbook's form does not
divide by; nothing of a sharp lobe lies below the horizon. Of a wide lobe that part is lost, too.
"""

from __future__ import annotations

import numpy as np

from .jit import device
from .warps import BELOW_ONE, HALF, INV_TWO_PI, ONE, TWO, ZERO, square_to_disk


@device
def cosine_power(exponent: float, distance_squared: float) -> float:
    """cosᵉ of the angle between two unit vectors, from the squared distance of their tips; 0 beyond 90 degrees.

    The distance keeps the digits that the cosine of a small angle loses, which a large exponent would enlarge.
    """
    if distance_squared >= TWO:
        return ZERO
    return np.exp(exponent * np.log1p(-HALF * distance_squared))


@device
def cosine_power_brdf(exponent: float, power: float) -> float:
    """The BRDF where `cosine_power` is `power`."""
    return (exponent + TWO) * INV_TWO_PI * power


@device
def cosine_power_pdf(exponent: float, power: float) -> float:
    """The density of `square_to_cosine_power`, per steradian, where `cosine_power` is `power`."""
    return (exponent + ONE) * INV_TWO_PI * power


@device
def square_to_cosine_power(u: float, v: float, exponent: float) -> tuple[float, float, float]:
    """A direction on the side of +z, as likely as the power of its z: a disk bent so that it keeps area."""
    x, y = square_to_disk(u, v)
    radius_squared = x * x + y * y
    log_z = np.log1p(-min(radius_squared, BELOW_ONE)) / (exponent + ONE)
    sine = np.sqrt(-np.expm1(TWO * log_z))
    scale = sine / np.sqrt(radius_squared) if radius_squared > ZERO else ZERO
    return scale * x, scale * y, np.exp(log_z)
