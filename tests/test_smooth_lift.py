"""Where the smooth surface lies above a triangle: between a parabola and the tangent planes of the corners."""

from __future__ import annotations

import numpy as np
import pytest

from core.jit import kernel
from core.smooth_lift import lifts


@kernel
def _lift_all(corners: np.ndarray, normals: np.ndarray, points: np.ndarray, out: np.ndarray) -> None:
    for k in range(len(points)):
        a = (corners[0, 0], corners[0, 1], corners[0, 2])
        b = (corners[1, 0], corners[1, 1], corners[1, 2])
        c = (corners[2, 0], corners[2, 1], corners[2, 2])
        out[k, 0], out[k, 1] = lifts((a, b, c), normals, 0, points[k, 0], points[k, 1])


def lift(corners, normals, points) -> np.ndarray:
    out = np.zeros((len(points), 2), np.float32)
    _lift_all(np.float32(corners), np.float32(normals)[None], np.float32(points), out)
    return out


CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0.3, 0.8, 0)])
MIDDLES = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0, 0.5), (0.5, 0.5), (1 / 3, 1 / 3), (0.2, 0.7)])
UP = np.tile([0.0, 0, 1], (3, 1))


def leaning(slope: float) -> np.ndarray:
    """Unit normals that lean out from the middle: the triangle bulges where the slope is positive."""
    normals = np.column_stack([slope * (CORNERS - CORNERS.mean(axis=0))[:, :2], np.ones(3)])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_flat_triangle_is_not_lifted():
    assert np.abs(lift(CORNERS, UP, MIDDLES)).max() < 1e-7


@pytest.mark.parametrize("slope", [0.05, 0.5])
def test_a_bulge_lies_between_the_parabola_and_the_tangent_planes(slope):
    normals = leaning(slope)
    outside, inside = lift(CORNERS, normals, MIDDLES).T
    u = 1 - MIDDLES.sum(axis=1)
    weights = np.column_stack([u, MIDDLES])
    points = weights @ CORNERS
    planes = np.array([[(corner - p) @ n for corner, n in zip(CORNERS, normals, strict=True)] for p in points])
    # Between two corners a parabola with these slopes bulges by half of what they differ, along and across.
    pairs = [(i, j, (normals[j] - normals[i]) @ (CORNERS[j] - CORNERS[i])) for i, j in ((0, 1), (0, 2), (1, 2))]
    parabola = sum(weights[:, i] * weights[:, j] * bend / 2 for i, j, bend in pairs)
    assert outside == pytest.approx(np.maximum(planes.min(axis=1), parabola), abs=1e-6)
    assert outside[:3] == pytest.approx(0, abs=1e-6)
    assert (outside[3:] > 0).all()
    assert (inside <= 0).all()


def test_a_hollow_is_a_bulge_from_the_other_side():
    outside, inside = lift(CORNERS, leaning(0.4), MIDDLES).T
    hollow_outside, hollow_inside = lift(CORNERS, -leaning(0.4), MIDDLES).T
    assert hollow_inside == pytest.approx(-outside, abs=1e-6)
    assert hollow_outside == pytest.approx(-inside, abs=1e-6)
