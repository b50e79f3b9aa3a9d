"""What the warps promise: each makes the density that its pdf states, inside its domain, in float32.

The χ² tests compare a histogram with the integrated pdf. Seeds are fixed; all of them together reject right warps with
a probability of at most 1e-3 (Šidák).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from core import warps
from tests.jit_helpers import compiled_return_type

F = np.float32
LARGEST = F(1 - 2**-24)
CORNERS = np.array([(u, v) for u in (0, 0.5, LARGEST) for v in (0, 0.5, LARGEST)], F)
SAMPLES = 20_000
#: Relative rounding error of float32.
EPS = 2.0**-24

unit = st.floats(0, float(LARGEST), width=32)


def warp(function: Callable, points: np.ndarray, *shape) -> np.ndarray:
    """The warped points as float64 (n, dimensions)."""
    return np.array([function(u, v, *shape) for u, v in points], np.float64)


def uniform(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((count, 2), dtype=F)


def p_value(places: np.ndarray, bounds: tuple, density: Callable, cells: tuple[int, int] = (12, 15)) -> float:
    """χ² test that `places`, (n, 2) in the box `bounds`, have the density `density(s, t)` there.

    The density is integrated over each cell by Gauss's rule; cells that expect fewer than 5 points are pooled.
    """
    edges = [np.linspace(low, high, count + 1) for (low, high), count in zip(bounds, cells, strict=True)]
    observed = np.histogram2d(*places.T, bins=edges)[0].ravel()
    assert observed.sum() == len(places), "points outside the domain"
    nodes, weights = np.polynomial.legendre.leggauss(6)
    s, t = (((e[1:] + e[:-1])[:, None] + np.diff(e)[:, None] * nodes) / 2 for e in edges)
    values = np.vectorize(density)(s[:, :, None, None], t[None, None])
    area = np.diff(edges[0])[0] * np.diff(edges[1])[0] / 4
    expected = len(places) * area * np.einsum("i,j,aibj->ab", weights, weights, values).ravel()
    assert expected.sum() == pytest.approx(len(places), rel=1e-5), "the pdf does not integrate to 1"
    rare = expected < 5
    if rare.any():
        observed = np.append(observed[~rare], observed[rare].sum())
        expected = np.append(expected[~rare], expected[rare].sum())
    return stats.chisquare(observed, expected * (observed.sum() / expected.sum())).pvalue


def polar(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.hypot(x, y), np.arctan2(y, x) % (2 * np.pi)


ROUND = (0, 2 * np.pi)


def chi_square_disk():
    x, y = warp(warps.square_to_disk, uniform(SAMPLES, 1)).T
    r, phi = polar(x, y)
    return p_value(np.stack((r, phi), 1), ((0, 1 + 4 * EPS), ROUND), lambda r, phi: warps.disk_pdf() * r)


def chi_square_ellipse():
    a, b = F(3), F(0.25)
    x, y = warp(warps.square_to_ellipse, uniform(SAMPLES, 2), a, b).T
    r, phi = polar(x / a, y / b)
    jacobian = float(a * b)
    density = lambda r, phi: warps.ellipse_pdf(a, b) * jacobian * r  # noqa: E731
    return p_value(np.stack((r, phi), 1), ((0, 1 + 4 * EPS), ROUND), density)


def chi_square_rectangle():
    a, b = F(3), F(0.25)
    points = warp(warps.square_to_rectangle, uniform(SAMPLES, 3), a, b)
    return p_value(points, ((-a, a), (-b, b)), lambda x, y: warps.rectangle_pdf(a, b))


def chi_square_triangle():
    corners = np.array([(0.0, 0.0), (2.0, 1.0), (0.5, 3.0)])
    area = 0.5 * abs(np.linalg.det(corners[1:] - corners[0]))
    weights = warp(warps.square_to_triangle, uniform(SAMPLES, 4))
    b, c = np.linalg.solve((corners[1:] - corners[0]).T, (weights @ corners - corners[0]).T)
    # b and the share t of what it leaves: the area element is 2 area (1 - b) db dt.
    places = np.stack((b, c / (1 - b)), 1).clip(0, 1)
    return p_value(places, ((0, 1), (0, 1)), lambda b, t: warps.triangle_pdf(F(area)) * 2 * area * (1 - b))


def rim_of_polygon(phi, blades: int, rotation: float):
    """Distance from the centre to the side in the direction phi; a side's middle is at `rotation`."""
    return np.cos(np.pi / blades) / np.cos((phi - rotation + np.pi / blades) % (2 * np.pi / blades) - np.pi / blades)


def chi_square_polygon(blades: int, rotation: float):
    x, y = warp(warps.square_to_polygon, uniform(SAMPLES, 5 + blades), blades, F(rotation)).T
    r, phi = polar(x, y)
    phi = (phi - rotation + np.pi / blades) % (2 * np.pi)
    rim = lambda phi: rim_of_polygon(phi, blades, np.pi / blades)  # noqa: E731
    density = lambda q, phi: warps.polygon_pdf(blades) * rim(phi) ** 2 * q  # noqa: E731
    # Rounding may put a point beyond its rim; how far is tested below.
    return p_value(np.stack(((r / rim(phi)).clip(0, 1), phi), 1), ((0, 1), ROUND), density, (8, 3 * blades))


def chi_square_sphere():
    x, y, z = warp(warps.square_to_sphere, uniform(SAMPLES, 20)).T
    return p_value(np.stack((z, polar(x, y)[1]), 1), ((-1, 1), ROUND), lambda z, phi: warps.sphere_pdf())


def chi_square_cap(depth: float):
    x, y, _ = warp(warps.square_to_cap, uniform(SAMPLES, 21), F(depth)).T
    r, phi = polar(x, y)
    # 1 - cos from the sine, in float64: valid up to 90°.
    places = np.stack((r**2 / (1 + np.sqrt(1 - r**2)), phi), 1)
    return p_value(places, ((0, depth * (1 + 1e-5)), ROUND), lambda d, phi: warps.cap_pdf(F(depth)))


def chi_square_whole_cap():
    x, y, z = warp(warps.square_to_cap, uniform(SAMPLES, 22), F(2)).T
    places = np.stack((z.clip(-1, 1), polar(x, y)[1]), 1)
    return p_value(places, ((-1, 1), ROUND), lambda z, phi: warps.cap_pdf(F(2)))


def chi_square_cosine_hemisphere():
    x, y, z = warp(warps.square_to_cosine_hemisphere, uniform(SAMPLES, 23)).T
    density = lambda z, phi: warps.cosine_hemisphere_pdf(F(z))  # noqa: E731
    return p_value(np.stack((z, polar(x, y)[1]), 1), ((0, 1), ROUND), density)


CHI_SQUARES = {
    "disk": chi_square_disk,
    "ellipse": chi_square_ellipse,
    "rectangle": chi_square_rectangle,
    "triangle": chi_square_triangle,
    "polygon of 3": lambda: chi_square_polygon(3, 0.0),
    "polygon of 5": lambda: chi_square_polygon(5, 0.7),
    "polygon of 8": lambda: chi_square_polygon(8, -3.0),
    "sphere": chi_square_sphere,
    "cap of 1e-4 radians": lambda: chi_square_cap(0.5e-8),
    "cap of 60 degrees": lambda: chi_square_cap(0.5),
    "cap of 180 degrees": chi_square_whole_cap,
    "cosine hemisphere": chi_square_cosine_hemisphere,
}


@pytest.mark.parametrize("domain", CHI_SQUARES)
def test_points_have_the_density_that_the_pdf_states(domain):
    assert CHI_SQUARES[domain]() > 1 - (1 - 1e-3) ** (1 / len(CHI_SQUARES))


# The polynomials


def test_the_polynomials_are_cosine_and_sine_to_float32():
    angles = np.linspace(-np.pi / 4, np.pi / 4, 2001).astype(F)
    angles = angles[abs(angles) <= np.pi / 4]
    cosine, sine = np.array([warps.cos_sin_octant(angle) for angle in angles], float).T
    exact = angles.astype(float)
    np.testing.assert_allclose(cosine, np.cos(exact), rtol=2 * EPS)
    np.testing.assert_allclose(sine, np.sin(exact), rtol=2 * EPS)


def test_cosine_and_sine_of_some_turns():
    angles = np.linspace(-20, 20, 4001).astype(F)
    cosine, sine = np.array([warps.cos_sin(angle) for angle in angles], float).T
    np.testing.assert_allclose(cosine, np.cos(angles.astype(float)), atol=1e-6)
    np.testing.assert_allclose(sine, np.sin(angles.astype(float)), atol=1e-6)


# Domains


@given(unit, unit)
def test_the_disk_is_shirley_and_chius(u, v):
    a, b = 2 * u - 1, 2 * v - 1
    if abs(a) > abs(b):
        r, phi = a, math.pi / 4 * b / a
    else:
        r, phi = b, math.pi / 2 - math.pi / 4 * (a / b if b else 0)
    assert warps.square_to_disk(F(u), F(v)) == pytest.approx((r * math.cos(phi), r * math.sin(phi)), abs=3e-7)


def test_points_of_the_disk_are_taken_back_to_the_square():
    points = np.concatenate([CORNERS, uniform(1000, 20)])
    back = warp(warps.disk_to_square, warp(warps.square_to_disk, points).astype(F))
    np.testing.assert_allclose(back, points, atol=1e-6)


@given(unit, unit)
def test_barycentric_coordinates_are_positive_and_add_up_to_one(u, v):
    weights = warps.square_to_triangle(F(u), F(v))
    assert min(weights) >= 0
    assert sum(weights) == pytest.approx(1, abs=4 * EPS)


@given(unit, unit)
def test_directions_are_unit_vectors(u, v):
    u, v = F(u), F(v)
    for direction in (
        warps.square_to_sphere(u, v),
        warps.square_to_cap(u, v, F(2)),
        warps.square_to_cap(u, v, F(1e-3)),
        warps.square_to_cosine_hemisphere(u, v),
    ):
        assert math.hypot(*direction) == pytest.approx(1, abs=1e-6)


WARPS = {
    "disk": (warps.square_to_disk,),
    "ellipse": (warps.square_to_ellipse, F(2), F(3)),
    "rectangle": (warps.square_to_rectangle, F(2), F(3)),
    "triangle": (warps.square_to_triangle,),
    "polygon": (warps.square_to_polygon, 5, F(1)),
    "sphere": (warps.square_to_sphere,),
    "tiny cap": (warps.square_to_cap, F(1e-12)),
    "whole cap": (warps.square_to_cap, F(2)),
    "cosine hemisphere": (warps.square_to_cosine_hemisphere,),
}


@pytest.mark.parametrize("domain", WARPS)
def test_the_edges_of_the_square_stay_finite_and_in_the_domain(domain):
    function, *shape = WARPS[domain]
    points = warp(function, CORNERS, *shape)
    assert np.isfinite(points).all()
    if domain in ("disk", "polygon"):
        assert np.hypot(*points.T).max() <= 1 + 4 * EPS
    if domain == "cosine hemisphere":
        assert points[:, 2].min() >= 0


@pytest.mark.parametrize("domain", WARPS)
def test_kernels_stay_in_float32(domain):
    function, *shape = WARPS[domain]
    assert "float64" not in compiled_return_type(function, F(0.25), F(0.75), *shape)


# Polygons, as in Cycles: a side's middle at the angle `rotation`


@pytest.mark.parametrize(("blades", "rotation"), [(3, 0.0), (4, 0.4), (5, -1.0), (6, 6.0), (7, 3.2), (16, 0.1)])
def test_points_fill_the_polygon_to_its_corners_and_not_beyond(blades, rotation):
    # A fine grid with the square's own edges, where the corners of the polygon come from.
    axis = np.linspace(0, LARGEST, 7 * blades + 1).astype(F)
    grid = np.stack(np.meshgrid(axis, np.linspace(0, LARGEST, 41).astype(F)), -1).reshape(-1, 2)
    x, y = warp(warps.square_to_polygon, grid, blades, F(rotation)).T
    r, phi = polar(x, y)
    assert (r <= rim_of_polygon(phi, blades, rotation) + 1e-6).all()
    corners = rotation + (2 * np.arange(blades) + 1) * np.pi / blades
    for corner in corners:
        assert np.hypot(x - np.cos(corner), y - np.sin(corner)).min() < 0.15
    assert 1 / warps.polygon_pdf(blades) == pytest.approx(blades / 2 * np.sin(2 * np.pi / blades), rel=1e-6)


# Moments, which χ² sees only coarsely


def test_moments_are_those_of_the_domain():
    # Midpoints of a fine grid integrate the moments almost exactly.
    axis = ((np.arange(100) + 0.5) / 100).astype(F)
    grid = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    disk, sphere = warp(warps.square_to_disk, grid), warp(warps.square_to_sphere, grid)
    hemisphere, cap = warp(warps.square_to_cosine_hemisphere, grid), warp(warps.square_to_cap, grid, F(0.5))
    triangle, pentagon = warp(warps.square_to_triangle, grid), warp(warps.square_to_polygon, grid, 5, F(0.3))
    np.testing.assert_allclose(disk.T @ disk / len(disk), np.eye(2) / 4, atol=1e-4)
    np.testing.assert_allclose(sphere.mean(0), 0, atol=1e-6)
    np.testing.assert_allclose(sphere.T @ sphere / len(sphere), np.eye(3) / 3, atol=1e-4)
    np.testing.assert_allclose(hemisphere.mean(0), (0, 0, 2 / 3), atol=1e-3)  # z is steep at the rim
    np.testing.assert_allclose(cap.mean(0), (0, 0, 0.75), atol=1e-4)
    np.testing.assert_allclose(triangle.mean(0), 1 / 3, atol=1e-4)
    second = (2 + np.cos(2 * np.pi / 5)) / 12  # of a regular pentagon of circumradius 1, per axis
    np.testing.assert_allclose(pentagon.mean(0), 0, atol=1e-4)
    np.testing.assert_allclose(pentagon.T @ pentagon / len(pentagon), np.eye(2) * second, atol=1e-3)


# Tiny cones


@pytest.mark.parametrize("angle", [1e-6, 1e-4, 1e-2, 1.0])
def test_directions_in_a_cap_keep_their_relative_precision(angle):
    """In exact arithmetic the point at radius r of the disk has sin(θ/2) = r sin(angle/2)."""
    depth = warps.one_minus_cos(F(math.sin(angle) ** 2))
    assert depth == pytest.approx(2 * math.sin(angle / 2) ** 2, rel=1e-6)
    points = uniform(2000, 30)
    x, y, _ = warp(warps.square_to_cap, points, F(depth)).T
    radius = abs(2 * points.astype(float) - 1).max(axis=1)
    half_sine = radius * math.sin(angle / 2)
    np.testing.assert_allclose(np.hypot(x, y), 2 * half_sine * np.sqrt(1 - half_sine**2), rtol=2e-6)


def test_one_minus_cosine_of_a_right_angle_is_one():
    assert warps.one_minus_cos(F(1)) == 1
    assert warps.one_minus_cos(F(1) + F(2 * EPS)) == pytest.approx(1)
    assert warps.one_minus_cos(F(0)) == 0
