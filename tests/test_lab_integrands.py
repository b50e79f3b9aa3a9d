"""The integrands of the charts: their closed forms, and how fast each sampler's error falls, as the docs say.

Seeds are fixed. Slopes must be within 0.1 of the expected ones; other comparisons within four standard errors.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest

from core.lab.efficiency import fit_slope
from core.lab.integrands import EXPECTED_SLOPES, INTEGRANDS, Trials, measure
from core.samplers import SAMPLERS

SLOPE_COUNTS = (16, 64, 256, 1024, 4096)
RATIO_COUNTS = (16, 64, 256)
#: Two sets each.
TRIALS = 300
RATIO_TRIALS = 1000

#: RMSE(random) / RMSE at 16, 64 and 256 points, from 1000 trials.
RATIOS = {
    "gauss": {
        "regular": (10, 20, 41),
        "jittered": (3.4, 6.4, 13),
        "n_rooks": (3.1, 3.2, 3.2),
        "multi_jittered": (6.5, 14, 30),
        "hammersley": (2.8, 4.5, 7.6),
        "sobol_owen": (7.6, 26, 89),
        "correlated_multi_jittered": (6.0, 9.0, 14),
    },
    "disk": {
        "regular": (2.4, 3.4, 4.8),
        "jittered": (1.6, 2.4, 3.1),
        "n_rooks": (1.6, 1.7, 1.6),
        "multi_jittered": (1.9, 2.5, 3.2),
        "hammersley": (2.2, 3.3, 4.5),
        "sobol_owen": (1.8, 2.8, 3.6),
        "correlated_multi_jittered": (2.1, 3.4, 4.7),
    },
    "half_plane": {
        "regular": (3.5, 5.0, 6.6),
        "jittered": (2.2, 3.2, 4.5),
        "n_rooks": (2.0, 2.0, 2.1),
        "multi_jittered": (2.4, 3.5, 4.8),
        "hammersley": (2.3, 3.4, 5.5),
        "sobol_owen": (2.6, 3.7, 5.4),
        "correlated_multi_jittered": (2.8, 4.1, 5.8),
    },
    "step": {
        "regular": (1.5, 1.6, 1.6),
        "jittered": (2.3, 3.2, 4.3),
        "n_rooks": (4.5, 8.6, 17),
        "multi_jittered": (4.5, 8.3, 18),
        "hammersley": (3.1, 6.3, 12),
        "sobol_owen": (4.3, 8.5, 17),
        "correlated_multi_jittered": (4.3, 8.6, 17),
    },
}


@cache
def trials(sampler: str, count: int, number: int = TRIALS) -> dict[str, Trials]:
    return measure(SAMPLERS[sampler], count, number, 12)


def rmse(errors: np.ndarray) -> tuple[float, float]:
    """The RMSE of signed errors (2, trials), and its standard error: two sets in one place are not independent."""
    squares = (errors**2).mean(axis=0)
    root = np.sqrt(squares.mean())
    return root, squares.std(ddof=1) / np.sqrt(squares.size) / (2 * root)


@pytest.mark.parametrize("integrand", INTEGRANDS.values(), ids=INTEGRANDS)
def test_the_integral_is_the_mean_over_a_fine_grid(integrand):
    """A midpoint rule of 2000² points errs by less than 2e-6 inside, and by a thousandth of a cell's width at edges."""
    side = 2000
    axis = (np.arange(side) + 0.5) / side
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(1, -1, 2)
    places = integrand.place(6, np.random.default_rng(1))
    means = [integrand.value(grid, place[None]).mean() for place in places]
    # An edge parallel to an axis is off by up to half a row of points.
    tolerance = 0.5 / side if integrand.name == "step" else 2e-5
    np.testing.assert_allclose(means, integrand.integral(places), rtol=0, atol=tolerance)


@pytest.mark.parametrize(("integrand", "sampler"), list(product(INTEGRANDS, SAMPLERS)))
def test_the_error_falls_with_the_expected_slope(integrand, sampler):
    errors = np.array([rmse(trials(sampler, count)[integrand].errors)[0] for count in SLOPE_COUNTS])
    slope = fit_slope(np.array(SLOPE_COUNTS), errors)
    assert slope.value == pytest.approx(EXPECTED_SLOPES[integrand][sampler], abs=0.1)


@pytest.mark.parametrize(("integrand", "sampler"), [(i, s) for i in RATIOS for s in RATIOS[i]])
def test_the_error_is_smaller_than_that_of_random_points_by_the_factor_in_the_docs(integrand, sampler):
    """Within four standard errors of this measurement and of the docs', and a unit of the last digit quoted."""
    for count, expected in zip(RATIO_COUNTS, RATIOS[integrand][sampler], strict=True):
        random, error = (rmse(trials(name, count, RATIO_TRIALS)[integrand].errors) for name in ("random", sampler))
        ratio = random[0] / error[0]
        relative = np.hypot(random[1] / random[0], error[1] / error[0])
        digit = 1 if expected >= 10 else 0.1
        assert ratio == pytest.approx(expected, abs=digit + 4 * np.sqrt(2) * relative * expected)


@pytest.mark.parametrize("integrand", INTEGRANDS)
def test_points_without_chance_have_bias_alone_and_fair_ones_none(integrand):
    for name in SAMPLERS:
        first, second = trials(name, 16)[integrand].errors
        product_ = first * second
        if name in ("regular", "hammersley"):
            assert np.array_equal(first, second)
        elif name != "z_sobol":  # whose sets are parts of one sequence: their errors are not independent
            assert abs(product_.mean()) < 4 * product_.std() / np.sqrt(product_.size)


def test_the_seed_decides_where_integrands_are():
    """Regular points have no chance of their own: only other places can change their errors."""
    first, again, other = (measure(SAMPLERS["regular"], 4, 40, seed)["disk"].errors for seed in (5, 5, 6))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_every_registered_sampler_has_an_expected_slope():
    for slopes in EXPECTED_SLOPES.values():
        assert set(slopes) == set(SAMPLERS)
