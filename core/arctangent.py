"""The angle of a vector, without calling a library: for loops that become SIMD, and in float32 throughout."""

from __future__ import annotations

import math

import numpy as np

from .jit import device

_ZERO, _ONE = np.float32(0), np.float32(1)
_PI, _HALF_PI, _QUARTER_PI = (np.float32(math.pi / k) for k in (1, 2, 4))
_TAN_EIGHTH_PI = np.float32(math.tan(math.pi / 8))

#: Minimax polynomial on |t| <= tan π/8: (atan t - t) / t³ in powers of t², fitted with Lawson's algorithm to atan's
#: relative error, which is below 2.1e-8.
_ATAN_3, _ATAN_5 = np.float32(-0.33332949137), np.float32(0.19977709971)
_ATAN_7, _ATAN_9 = np.float32(-0.13877678107), np.float32(0.08053720554)


@device
def arctan2(y: float, x: float) -> float:
    """The angle of (x, y) from the x axis, in [-π, π], to a relative 3e-7; 0 for the vector (0, 0).

    Its octant is found first, and half an octant is turned back where that makes the tangent small (Cody and Waite
    1980).
    """
    low, high = min(abs(x), abs(y)), max(abs(x), abs(y))
    steep = low > _TAN_EIGHTH_PI * high
    numerator, denominator = (low - high if steep else low), (low + high if steep else high)
    t = numerator / (denominator if denominator > _ZERO else _ONE)
    z = t * t
    angle = t + t * z * (_ATAN_3 + z * (_ATAN_5 + z * (_ATAN_7 + z * _ATAN_9)))
    angle = _QUARTER_PI + angle if steep else angle
    angle = _HALF_PI - angle if abs(y) > abs(x) else angle
    angle = _PI - angle if x < _ZERO else angle
    return -angle if y < _ZERO else angle
