"""The cosine-power lobe: its density, its energy and its precision."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from core import cosine_power
from core.jit import kernel

F = np.float32
EXPONENTS = (0.0, 1.0, 20.0, 1000.0, 1e6)


@kernel
def _sample(points, exponent, out):
    for i in range(len(points)):
        out[i, 0], out[i, 1], out[i, 2] = cosine_power.square_to_cosine_power(points[i, 0], points[i, 1], exponent)


def sample(points: np.ndarray, exponent: float) -> np.ndarray:
    out = np.empty((len(points), 3), F)
    _sample(points.astype(F), F(exponent), out)
    return out.astype(float)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_directions_are_as_likely_as_the_power_of_their_cosine(exponent):
    """cosᵉ⁺¹ is then uniform, and so is the azimuth: a χ² of 10 × 12 cells at the level 1e-4."""
    x, y, z = sample(np.random.default_rng(1).random((50_000, 2)), exponent).T
    # The cosine from the sine where that is small, as in the code under test.
    log_z = np.where(z > 0.5, 0.5 * np.log1p(-np.minimum(x * x + y * y, 1 - 1e-9)), np.log(np.maximum(z, 1e-30)))
    share, turn = np.exp((exponent + 1) * log_z), np.arctan2(y, x) / (2 * np.pi) % 1
    cells = np.histogram2d(share, turn, (10, 12), ((0, 1), (0, 1)))[0]
    assert cells.sum() == 50_000
    assert stats.chisquare(cells.ravel()).pvalue > 1e-4


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_directions_are_unit_vectors_for_all_of_the_square(exponent):
    edge = F(1 - 2**-24)
    corners = np.array([(u, v) for u in (0, 0.25, 0.5, edge) for v in (0, 0.25, 0.5, edge)])
    directions = sample(corners, exponent)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    assert (directions[:, 2] >= 0).all()


@pytest.mark.parametrize("exponent", EXPONENTS[:4])
def test_the_densities_integrate_to_one(exponent):
    """Of the sampled density over the hemisphere, and of BRDF × cosine about the normal: the albedo head on."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    # Over the share t of the sampled density: cosine = t^(1 / (exponent + 1)).
    t = (nodes + 1) / 2
    cosines = t ** (1 / (exponent + 1))
    powers = np.array([cosine_power.cosine_power(F(exponent), F(2 - 2 * c)) for c in cosines], float)
    solid_angles = 2 * np.pi * weights / 2 * cosines / (t * (exponent + 1))
    pdf = [float(cosine_power.cosine_power_pdf(F(exponent), F(p))) for p in powers]
    brdf = [float(cosine_power.cosine_power_brdf(F(exponent), F(p))) for p in powers]
    assert np.dot(pdf, solid_angles) == pytest.approx(1, rel=1e-3)
    assert np.dot(brdf * cosines, solid_angles) == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("angle", [0.0, 1e-3, 0.05, 1.0, 1.5])
def test_the_power_keeps_its_digits(exponent, angle):
    distance_squared = F(4 * np.sin(angle / 2) ** 2)
    exact = np.exp(exponent * np.log1p(-float(distance_squared) / 2))
    assert cosine_power.cosine_power(F(exponent), distance_squared) == pytest.approx(exact, rel=2e-5, abs=1e-30)


def test_behind_the_mirror_there_is_nothing():
    assert cosine_power.cosine_power(F(1), F(2)) == cosine_power.cosine_power(F(0), F(4)) == 0
