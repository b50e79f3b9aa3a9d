"""Parallelograms as seen from a point: closed forms, and a χ² test of the directions, however near the point is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from core.solid_angle import direction_in, see_parallelogram
from tests.test_warps import p_value, uniform

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


@pytest.mark.parametrize("height", [1e-9, 1e-4, 0.1, 1.0, 30.0, 1e4])
def test_the_solid_angle_of_a_square_is_that_of_the_closed_form(height):
    angle = see_parallelogram((-0.5, -0.5, height), X, Y).angle
    assert angle == pytest.approx(4 * math.asin(0.25 / (0.25 + height**2)), rel=1e-6)


@pytest.mark.parametrize("aside", [1e-3, 0.5])
@pytest.mark.parametrize("height", [1e-9, 1e-5])
def test_a_square_seen_edge_on_is_a_sliver_whose_angle_is_not_lost(aside, height):
    """Thin as it is, its solid angle is the integral of height / distance³ over it: here, with height² neglected."""
    angle = see_parallelogram((aside, -0.5, height), X, Y).angle
    far = 1 + aside
    expected = height * 2 * (math.hypot(aside, 0.5) / (0.5 * aside) - math.hypot(far, 0.5) / (0.5 * far))
    assert angle == pytest.approx(expected, rel=1e-3)


def test_of_what_lies_in_a_plane_with_the_point_nothing_is_seen():
    assert see_parallelogram((1.0, 0.0, 0.0), X, Y).angle == 0


def seen(corner: tuple, edge_v: tuple, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Where in the parallelogram, (n, 2) in the unit square, directions from even random points end; the directions;
    and the solid angle.
    """
    whole = see_parallelogram(corner, X, edge_v)
    directions = np.array([direction_in(whole, float(u), float(v)) for u, v in uniform(20_000, seed)], np.float64)
    offset = directions / directions[:, 2:] * corner[2] - corner
    t = offset[:, 1] / edge_v[1]
    return np.clip(np.column_stack([offset[:, 0] - edge_v[0] * t, t]), 0, 1), directions, whole.angle


def test_directions_are_even_over_a_slanted_parallelogram():
    corner, edge_v = (-0.5, -0.4, 1.0), (0.4, 1.0, 0.0)
    places, directions, angle = seen(corner, edge_v, seed=4)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-6)

    def density(s: float, t: float) -> float:
        x, y = corner[0] + s + 0.4 * t, corner[1] + t
        return corner[2] / (x * x + y * y + corner[2] ** 2) ** 1.5 / angle

    assert p_value(places, ((0, 1), (0, 1)), density) > 1e-3


@pytest.mark.parametrize("corner", [(-0.5, -0.5, 1e-2), (0.01, 0.02, 0.3), (-0.9, 0.001, 1e-3), (-0.5, -0.5, 1e-6)])
def test_directions_are_even_over_a_square_that_is_near(corner):
    """χ² over cells around the foot, whose solid angles are those of the closed form."""
    places, directions, _ = seen(corner, Y, seed=5)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-6)
    steps = np.array([-10, -1, -0.2, 0, 0.2, 1, 10]) * corner[2]
    edges = [np.unique(np.clip([0, *(steps - start), 1], 0, 1)) for start in corner[:2]]
    observed, _, _ = np.histogram2d(*places.T, bins=edges)
    x, y = edges[0] + corner[0], edges[1] + corner[1]
    up_to = np.arctan2(x[:, None] * y, corner[2] * np.sqrt(x[:, None] ** 2 + y**2 + corner[2] ** 2))
    expected = np.diff(np.diff(up_to, axis=0), axis=1)
    enough = expected / expected.sum() * len(places) > 5
    observed, expected = observed[enough], expected[enough]
    assert stats.chisquare(observed, expected * observed.sum() / expected.sum()).pvalue > 1e-3
