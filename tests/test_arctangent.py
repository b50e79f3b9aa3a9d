"""The angle of a vector, against the library's in float64."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.arctangent import arctan2
from core.jit import kernel
from tests.jit_helpers import compiled_return_type

F = np.float32
number = st.floats(-(2.0**50), 2.0**50, width=32)


@kernel
def angles(y, x, result):
    for k in range(len(result)):
        result[k] = arctan2(y[k], x[k])


def test_angles_keep_their_relative_precision():
    rng = np.random.default_rng(1)
    y, x = (rng.normal(size=(2, 100_000)) * 10.0 ** rng.uniform(-6, 2, (2, 100_000))).astype(F)
    result = np.empty_like(x)
    angles(y, x, result)
    np.testing.assert_allclose(result, np.arctan2(y.astype(float), x.astype(float)), rtol=3e-7)


@given(number, number)
def test_the_angle_lies_in_its_quadrant(y, x):
    angle = arctan2(F(y), F(x))
    assert abs(angle) <= F(math.pi)
    assert angle * y >= 0
    assert (abs(angle) <= F(math.pi / 2)) or x <= 0
    assert arctan2(F(-y), F(x)) == (-angle if y else angle)


@pytest.mark.parametrize(
    ("y", "x", "angle"),
    [(0, 0, 0), (0, 1, 0), (1, 0, math.pi / 2), (0, -1, math.pi), (-1, 0, -math.pi / 2), (-1, -1, -3 * math.pi / 4)],
)
def test_angles_of_the_axes(y, x, angle):
    assert arctan2(F(y), F(x)) == F(angle)


def test_kernels_stay_in_float32():
    assert compiled_return_type(arctan2, F(1), F(2)) == "float32"
