"""Blender's value nodes on single values: Math, Mix, Map Range, and the casts between colours, vectors and numbers.

As in Blender, what has no value (a division by 0, the root of a negative number) is 0.
"""

from __future__ import annotations

import math

import numpy as np

from .jit import device
from .values import BLENDS, INTERPOLATIONS, MATHS
from .warps import HALF, ONE, TWO, ZERO, clamp01

_THREE, _SIX = np.float32(3), np.float32(6)
_TINY = np.float32(2.0**-23)
_RADIANS, _DEGREES = np.float32(math.pi / 180), np.float32(180 / math.pi)
#: Rec.709's luminance of the primaries.
_RED, _GREEN, _BLUE = np.float32(0.2126729), np.float32(0.7151522), np.float32(0.0721750)

(
    _MIX, _DARKEN, _MULTIPLY, _BURN, _LIGHTEN, _SCREEN, _DODGE, _ADD, _OVERLAY, _SOFT_LIGHT, _LINEAR_LIGHT,
    _DIFFERENCE, _EXCLUSION, _SUBTRACT, _DIVIDE, _HUE, _SATURATION, _COLOR, _VALUE,
) = range(len(BLENDS))  # fmt: skip
(
    _M_ADD, _M_SUBTRACT, _M_MULTIPLY, _M_DIVIDE, _M_MULTIPLY_ADD, _M_POWER, _M_LOGARITHM, _M_SQRT, _M_INVERSE_SQRT,
    _M_ABSOLUTE, _M_EXPONENT, _M_MINIMUM, _M_MAXIMUM, _M_LESS_THAN, _M_GREATER_THAN, _M_SIGN, _M_COMPARE,
    _M_SMOOTH_MIN, _M_SMOOTH_MAX, _M_ROUND, _M_FLOOR, _M_CEIL, _M_TRUNC, _M_FRACT, _M_MODULO, _M_FLOORED_MODULO,
    _M_WRAP, _M_SNAP, _M_PINGPONG, _M_SINE, _M_COSINE, _M_TANGENT, _M_ARCSINE, _M_ARCCOSINE, _M_ARCTANGENT,
    _M_ARCTAN2, _M_SINH, _M_COSH, _M_TANH, _M_RADIANS, _M_DEGREES,
) = range(len(MATHS))  # fmt: skip
_LINEAR, _SMOOTHSTEP, _SMOOTHERSTEP = range(len(INTERPOLATIONS))


@device
def gray(red: float, green: float, blue: float) -> float:
    """The luminance of a linear Rec.709 colour."""
    return _RED * red + _GREEN * green + _BLUE * blue


@device
def math_op(operation: int, a: float, b: float, c: float) -> float:
    """One of `values.MATHS`."""
    if operation <= _M_MULTIPLY_ADD:
        return _arithmetic(operation, a, b, c)
    if operation <= _M_EXPONENT:
        return _power(operation, a, b)
    if operation <= _M_SMOOTH_MAX:
        return _comparison(operation, a, b, c)
    if operation <= _M_PINGPONG:
        return _rounding(operation, a, b, c)
    return _trigonometry(operation, a, b)


@device
def _arithmetic(operation: int, a: float, b: float, c: float) -> float:
    if operation == _M_ADD:
        return a + b
    if operation == _M_SUBTRACT:
        return a - b
    if operation == _M_MULTIPLY:
        return a * b
    if operation == _M_MULTIPLY_ADD:
        return a * b + c
    return divide(a, b)


@device
def divide(a: float, b: float) -> float:
    """a / b, or 0 where b is."""
    return a / b if b != ZERO else ZERO


@device
def _power(operation: int, a: float, b: float) -> float:
    if operation == _M_POWER:
        has_value = (a > ZERO) | ((a == ZERO) & (b >= ZERO)) | ((a < ZERO) & (b == np.floor(b)))
        return np.float32(a**b) if has_value else ZERO
    if operation == _M_LOGARITHM:
        below = np.float32(math.log(b)) if b > ZERO else ZERO
        return divide(np.float32(math.log(a)), below) if a > ZERO else ZERO
    if operation == _M_SQRT:
        return np.sqrt(max(a, ZERO))
    if operation == _M_INVERSE_SQRT:
        return ONE / np.sqrt(a) if a > ZERO else ZERO
    if operation == _M_ABSOLUTE:
        return abs(a)
    return np.float32(math.exp(min(a, np.float32(88))))


@device
def _comparison(operation: int, a: float, b: float, c: float) -> float:
    if operation == _M_MINIMUM:
        return min(a, b)
    if operation == _M_MAXIMUM:
        return max(a, b)
    if operation == _M_LESS_THAN:
        return ONE if a < b else ZERO
    if operation == _M_GREATER_THAN:
        return ONE if a > b else ZERO
    if operation == _M_SIGN:
        return ONE if a > ZERO else (-ONE if a < ZERO else ZERO)
    if operation == _M_COMPARE:
        return ONE if abs(a - b) <= max(c, _TINY) else ZERO
    return _smooth_min(a, b, c) if operation == _M_SMOOTH_MIN else -_smooth_min(-a, -b, c)


@device
def _smooth_min(a: float, b: float, distance: float) -> float:
    h = max(distance - abs(a - b), ZERO) / distance if distance != ZERO else ZERO
    return min(a, b) - h * h * h * distance / _SIX


@device
def _rounding(operation: int, a: float, b: float, c: float) -> float:
    if operation == _M_ROUND:
        return np.floor(a + HALF)
    if operation == _M_FLOOR:
        return np.floor(a)
    if operation == _M_CEIL:
        return np.ceil(a)
    if operation == _M_TRUNC:
        return np.trunc(a)
    if operation == _M_FRACT:
        return a - np.floor(a)
    if operation == _M_MODULO:
        return a - np.trunc(divide(a, b)) * b if b != ZERO else ZERO
    if operation == _M_FLOORED_MODULO:
        return a - np.floor(divide(a, b)) * b if b != ZERO else ZERO
    if operation == _M_WRAP:
        span = b - c
        return a - span * np.floor(divide(a - c, span)) if span != ZERO else c
    if operation == _M_SNAP:
        return np.floor(divide(a, b)) * b
    turn = divide(a - b, TWO * b)
    return abs((turn - np.floor(turn)) * TWO * b - b)


@device
def _trigonometry(operation: int, a: float, b: float) -> float:
    if operation == _M_SINE:
        return np.float32(math.sin(a))
    if operation == _M_COSINE:
        return np.float32(math.cos(a))
    if operation == _M_TANGENT:
        return np.float32(math.tan(a))
    if operation == _M_ARCSINE:
        return np.float32(math.asin(min(max(a, -ONE), ONE)))
    if operation == _M_ARCCOSINE:
        return np.float32(math.acos(min(max(a, -ONE), ONE)))
    if operation == _M_ARCTANGENT:
        return np.float32(math.atan(a))
    if operation == _M_ARCTAN2:
        return np.float32(math.atan2(a, b))
    if operation == _M_RADIANS:
        return a * _RADIANS
    if operation == _M_DEGREES:
        return a * _DEGREES
    return _hyperbolic(operation, min(max(a, np.float32(-88)), np.float32(88)))


@device
def _hyperbolic(operation: int, a: float) -> float:
    if operation == _M_SINH:
        return np.float32(math.sinh(a))
    if operation == _M_COSH:
        return np.float32(math.cosh(a))
    return np.float32(math.tanh(a))


@device
def map_range(
    interpolation: int, clamp: int, value: float, from_min: float, from_max: float, to_min: float, to_max: float
) -> float:
    """Blender's Map Range of a number; 0 where the range to map from is empty."""
    if from_min == from_max:
        return ZERO
    share = (value - from_min) / (from_max - from_min)
    if interpolation != _LINEAR:
        share = clamp01(share)
    if interpolation == _SMOOTHSTEP:
        share = share * share * (_THREE - TWO * share)
    elif interpolation == _SMOOTHERSTEP:
        share = share * share * share * (share * (share * _SIX - np.float32(15)) + np.float32(10))
    result = to_min + share * (to_max - to_min)
    if clamp != 0:
        result = min(max(result, min(to_min, to_max)), max(to_min, to_max))
    return result


@device
def mix(
    blend: int, t: float, ar: float, ag: float, ab: float, br: float, bg: float, bb: float
) -> tuple[float, float, float]:
    """One of `values.BLENDS` of the colours a and b by the share t."""
    if blend >= _HUE:
        return _mix_hsv(blend, t, ar, ag, ab, br, bg, bb)
    return _blend(blend, t, ar, br), _blend(blend, t, ag, bg), _blend(blend, t, ab, bb)


@device
def _blend(blend: int, t: float, a: float, b: float) -> float:
    rest = ONE - t
    if blend == _BURN:
        below = rest + t * b
        return clamp01(ONE - (ONE - a) / below) if below > ZERO else ZERO
    if blend == _DODGE:
        above = ONE - t * b
        dodged = min(a / above, ONE) if above > ZERO else ONE
        return dodged if a != ZERO else a
    if blend == _SCREEN:
        return ONE - (rest + t * (ONE - b)) * (ONE - a)
    if blend == _OVERLAY:
        dark = a * (rest + TWO * t * b)
        return dark if a < HALF else ONE - (rest + TWO * t * (ONE - b)) * (ONE - a)
    if blend == _EXCLUSION:
        return max(rest * a + t * (a + b - TWO * a * b), ZERO)
    return rest * a + t * _full_blend(blend, a, b)


@device
def _full_blend(blend: int, a: float, b: float) -> float:
    """The blends that fade in evenly, at their full strength."""
    if blend == _DARKEN:
        return min(a, b)
    if blend == _MULTIPLY:
        return a * b
    if blend == _LIGHTEN:
        return max(a, b)
    if blend == _ADD:
        return a + b
    if blend == _SOFT_LIGHT:
        return (ONE - a) * b * a + a * (ONE - (ONE - b) * (ONE - a))
    if blend == _LINEAR_LIGHT:
        return a + TWO * b - ONE
    if blend == _DIFFERENCE:
        return abs(a - b)
    if blend == _SUBTRACT:
        return a - b
    if blend == _DIVIDE:
        return a / b if b != ZERO else a
    return b


@device
def _mix_hsv(
    blend: int, t: float, ar: float, ag: float, ab: float, br: float, bg: float, bb: float
) -> tuple[float, float, float]:
    hue, saturation, value = to_hsv(ar, ag, ab)
    other_hue, other_saturation, other_value = to_hsv(br, bg, bb)
    if blend == _VALUE:
        return from_hsv(hue, saturation, (ONE - t) * value + t * other_value)
    if blend == _SATURATION:
        gray_stays = saturation == ZERO
        return from_hsv(hue, ZERO if gray_stays else (ONE - t) * saturation + t * other_saturation, value)
    if other_saturation == ZERO:
        return ar, ag, ab
    red, green, blue = from_hsv(other_hue, other_saturation if blend == _COLOR else saturation, value)
    rest = ONE - t
    return rest * ar + t * red, rest * ag + t * green, rest * ab + t * blue


@device
def to_hsv(red: float, green: float, blue: float) -> tuple[float, float, float]:
    """Hue, 0 to 1, saturation and value (Smith 1978)."""
    value = max(red, green, blue)
    chroma = value - min(red, green, blue)
    saturation = chroma / value if value != ZERO else ZERO
    if saturation == ZERO:
        return ZERO, ZERO, value
    if red == value:
        hue = (green - blue) / chroma
    elif green == value:
        hue = TWO + (blue - red) / chroma
    else:
        hue = np.float32(4) + (red - green) / chroma
    hue = hue / _SIX
    return (hue + ONE if hue < ZERO else hue), saturation, value


@device
def from_hsv(hue: float, saturation: float, value: float) -> tuple[float, float, float]:
    """The colour of a hue, saturation and value."""
    return (
        value * (ONE - saturation * (ONE - _ramp(hue, ZERO))),
        value * (ONE - saturation * (ONE - _ramp(hue, np.float32(2 / 3)))),
        value * (ONE - saturation * (ONE - _ramp(hue, np.float32(1 / 3)))),
    )


@device
def _ramp(hue: float, turn: float) -> float:
    """How much of a primary a full hue has; the primary's own hue is 0 after adding `turn`."""
    place = hue + turn
    place = (place - np.floor(place)) * _SIX
    return clamp01(abs(place - _THREE) - ONE)
