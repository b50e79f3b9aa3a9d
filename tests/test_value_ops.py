"""Math, Mix and Map Range against their definitions in float64, as Blender's manual and its users know them."""

from __future__ import annotations

import colorsys
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.value_ops import from_hsv, gray, map_range, math_op, mix, to_hsv
from core.values import BLENDS, INTERPOLATIONS, MATHS, MapRange
from tests import naive_values

F = np.float32
#: Exact in float32, and far enough apart that no quotient of two falls on the wrong side of a whole number.
eighths = st.integers(-64, 64).map(lambda i: i / 8)
#: Nothing so small that a quotient of two leaves float32.
numbers = st.floats(-1000, 1000, width=32).filter(lambda x: x == 0 or abs(x) > 1e-6)
shares = st.integers(0, 16).map(lambda i: i / 16)
components = st.tuples(*[st.integers(0, 32).map(lambda i: i / 16)] * 3)


def over(a: float, b: float) -> float:
    return a / b if b else 0.0


def power(a: float, b: float) -> float:
    if a == 0:
        return float(b == 0)
    return a**b if a > 0 or b == int(b) else 0.0


def smooth_min(a: float, b: float, distance: float) -> float:
    """The cubic smooth minimum (Quilez 2013)."""
    if distance == 0:
        return min(a, b)
    return min(a, b) - max(distance - abs(a - b), 0.0) ** 3 / (6 * distance**2)


def pingpong(a: float, b: float) -> float:
    """Up to b and back to 0 again."""
    if b == 0:
        return 0.0
    place = a % (2 * abs(b))
    return min(place, 2 * abs(b) - place)


DEFINITIONS = {
    "add": lambda a, b, c: a + b,
    "subtract": lambda a, b, c: a - b,
    "multiply": lambda a, b, c: a * b,
    "divide": lambda a, b, c: over(a, b),
    "multiply_add": lambda a, b, c: a * b + c,
    "power": lambda a, b, c: power(a, b),
    "logarithm": lambda a, b, c: over(math.log(a), math.log(b)) if a > 0 and b > 0 else 0.0,
    "sqrt": lambda a, b, c: math.sqrt(a) if a > 0 else 0.0,
    "inverse_sqrt": lambda a, b, c: 1 / math.sqrt(a) if a > 0 else 0.0,
    "absolute": lambda a, b, c: abs(a),
    "exponent": lambda a, b, c: math.exp(a),
    "minimum": lambda a, b, c: min(a, b),
    "maximum": lambda a, b, c: max(a, b),
    "less_than": lambda a, b, c: float(a < b),
    "greater_than": lambda a, b, c: float(a > b),
    "sign": lambda a, b, c: float((a > 0) - (a < 0)),
    "compare": lambda a, b, c: float(abs(a - b) <= max(c, 0.0)),
    "smooth_min": lambda a, b, c: smooth_min(a, b, c),
    "smooth_max": lambda a, b, c: -smooth_min(-a, -b, c),
    "round": lambda a, b, c: math.floor(a + 0.5),
    "floor": lambda a, b, c: math.floor(a),
    "ceil": lambda a, b, c: math.ceil(a),
    "trunc": lambda a, b, c: math.trunc(a),
    "fract": lambda a, b, c: a % 1,
    "modulo": lambda a, b, c: math.fmod(a, b) if b else 0.0,
    "floored_modulo": lambda a, b, c: a % b if b else 0.0,
    "wrap": lambda a, b, c: c + (a - c) % (b - c) if b != c else c,
    "snap": lambda a, b, c: b * (a // b) if b else 0.0,
    "pingpong": lambda a, b, c: pingpong(a, b),
    "sine": lambda a, b, c: math.sin(a),
    "cosine": lambda a, b, c: math.cos(a),
    "tangent": lambda a, b, c: math.tan(a),
    "arcsine": lambda a, b, c: math.asin(min(max(a, -1), 1)),
    "arccosine": lambda a, b, c: math.acos(min(max(a, -1), 1)),
    "arctangent": lambda a, b, c: math.atan(a),
    "arctan2": lambda a, b, c: math.atan2(a, b),
    "sinh": lambda a, b, c: math.sinh(a),
    "cosh": lambda a, b, c: math.cosh(a),
    "tanh": lambda a, b, c: math.tanh(a),
    "radians": lambda a, b, c: math.radians(a),
    "degrees": lambda a, b, c: math.degrees(a),
}


def test_every_operation_and_blend_has_a_definition_here():
    assert set(DEFINITIONS) == set(MATHS)
    assert set(FULL) | {"burn", "dodge", "hue", "saturation", "color", "value"} == set(BLENDS)


@pytest.mark.parametrize("operation", MATHS)
@given(a=eighths, b=eighths, c=st.integers(0, 64).map(lambda i: i / 8))
def test_math_is_its_definition(operation, a, b, c):
    expected = DEFINITIONS[operation](a, b, c)
    assert math_op(MATHS.index(operation), F(a), F(b), F(c)) == pytest.approx(expected, rel=1e-5, abs=2e-6)


@pytest.mark.parametrize("operation", MATHS)
@given(a=numbers, b=numbers, c=numbers)
def test_no_operation_makes_a_nan_of_numbers(operation, a, b, c):
    assert not np.isnan(math_op(MATHS.index(operation), F(a), F(b), F(c)))


# Mix

#: The blends at their full strength; less of it is an even fade from a.
FULL = {
    "mix": lambda a, b: b,
    "darken": min,
    "multiply": lambda a, b: a * b,
    "lighten": max,
    "screen": lambda a, b: 1 - (1 - a) * (1 - b),
    "add": lambda a, b: a + b,
    "overlay": lambda a, b: 2 * a * b if a < 0.5 else 1 - 2 * (1 - a) * (1 - b),
    "soft_light": lambda a, b: (1 - a) * a * b + a * (1 - (1 - a) * (1 - b)),
    "linear_light": lambda a, b: a + 2 * b - 1,
    "difference": lambda a, b: abs(a - b),
    "exclusion": lambda a, b: a + b - 2 * a * b,
    "subtract": lambda a, b: a - b,
    "divide": lambda a, b: a / b if b else a,
}


def fade(t: float, a: float, b: float) -> float:
    return (1 - t) * a + t * b


def dodge(t: float, a: float, b: float) -> float:
    if a == 0:
        return 0.0
    return min(a / (1 - t * b), 1.0) if t * b < 1 else 1.0


def burn(t: float, a: float, b: float) -> float:
    below = 1 - t + t * b
    return min(max(1 - (1 - a) / below, 0.0), 1.0) if below > 0 else 0.0


def blended(blend: str, t: float, a, b) -> np.ndarray:
    if blend in FULL:
        result = np.array([fade(t, x, FULL[blend](x, y)) for x, y in zip(a, b, strict=True)])
        return result.clip(0, None) if blend == "exclusion" else result
    if blend in ("burn", "dodge"):
        return np.array([(burn if blend == "burn" else dodge)(t, x, y) for x, y in zip(a, b, strict=True)])
    (h, s, v), (other_h, other_s, other_v) = colorsys.rgb_to_hsv(*a), colorsys.rgb_to_hsv(*b)
    if blend == "value":
        return np.array(colorsys.hsv_to_rgb(h, s, fade(t, v, other_v)))
    if blend == "saturation":
        return np.array(colorsys.hsv_to_rgb(h, fade(t, s, other_s) if s else 0.0, v))
    if other_s == 0:
        return np.array(a)
    turned = colorsys.hsv_to_rgb(other_h, other_s if blend == "color" else s, v)
    return np.array([fade(t, x, y) for x, y in zip(a, turned, strict=True)])


@pytest.mark.parametrize("blend", BLENDS)
@given(t=shares, a=components, b=components)
def test_a_blend_is_its_definition(blend, t, a, b):
    seen = mix(BLENDS.index(blend), F(t), *map(F, a), *map(F, b))
    assert seen == pytest.approx(tuple(blended(blend, t, a, b)), rel=1e-5, abs=2e-6)


@pytest.mark.parametrize("blend", BLENDS)
@given(a=components, b=components)
def test_nothing_of_a_blend_is_the_first_color(blend, a, b):
    if blend in ("burn", "dodge"):  # which clamp to 1
        a = tuple(min(x, 1.0) for x in a)
    assert mix(BLENDS.index(blend), F(0), *map(F, a), *map(F, b)) == pytest.approx(a, rel=1e-5, abs=2e-6)


@given(components)
def test_a_color_is_that_of_its_hue_saturation_and_value(color):
    assert from_hsv(*to_hsv(*map(F, color))) == pytest.approx(color, rel=1e-5, abs=2e-6)
    assert to_hsv(*map(F, color))[1:] == pytest.approx(colorsys.rgb_to_hsv(*color)[1:], rel=1e-5, abs=2e-6)


def test_white_is_as_bright_as_it_is():
    assert gray(F(1), F(1), F(1)) == pytest.approx(1, abs=2e-5)
    assert gray(F(0), F(1), F(0)) == pytest.approx(0.7152, abs=1e-4)


# Map Range


@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
@given(numbers=st.tuples(*[eighths] * 5).filter(lambda n: n[1] != n[2]))
def test_map_range_is_its_definition(interpolation, clamp, numbers):
    hits = naive_values.Hits({"uv": np.zeros((1, 3))}, {})
    expected = naive_values.evaluate(MapRange(*numbers, interpolation, clamp), hits)[0, 0]
    seen = map_range(INTERPOLATIONS.index(interpolation), int(clamp), *map(F, numbers))
    # Extrapolated far beyond a narrow range, the result is a difference of large numbers.
    scale = max(abs(number) for number in numbers) / abs(numbers[2] - numbers[1])
    assert seen == pytest.approx(expected, rel=1e-5, abs=2e-6 * (1 + 8 * scale))


def test_an_empty_range_maps_to_0():
    assert map_range(0, 0, F(1), F(2), F(2), F(3), F(4)) == 0
