"""The lab's demonstration of coupled domains shows what SAMPLING's theory says: fixed biases, and their cure."""

from __future__ import annotations

import numpy as np
import pytest

from core.lab import figure_decorrelation
from core.lab.figure_decorrelation import COUNTS, FULL_BIAS, WIRINGS, measure


@pytest.fixture(scope="module")
def results():
    return {name: {row["samples"]: row for row in rows} for name, rows in measure(seed=3).items()}


def within(row: dict[str, float], expected: float) -> bool:
    """Four standard errors: one false alarm in 16,000."""
    return abs(row["bias"] - expected) < 4 * row["bias_error"]


@pytest.mark.parametrize("samples", COUNTS)
def test_one_set_for_both_keeps_its_bias_for_ever(results, samples):
    assert within(results["one set for both"][samples], FULL_BIAS)


@pytest.mark.parametrize("samples", COUNTS)
def test_the_same_strata_in_the_same_order_are_as_bad(results, samples):
    """Points share their column of √n, not the place in it, which holds 1/n of the variance."""
    assert within(results["two jittered sets in raster order"][samples], FULL_BIAS * (1 - 1 / samples))


def test_one_order_of_sobols_sequence_is_stuck_though_unbiased(results):
    rows = results["two Sobol sets in the sequence's order"]
    assert all(within(row, 0) for row in rows.values())
    assert rows[1024]["rmse"] == pytest.approx(rows[64]["rmse"], rel=0.05)


def test_shuffled_sets_are_unbiased_and_converge(results):
    rows = results["two jittered sets, shuffled"]
    assert all(within(row, 0) for row in rows.values())
    assert rows[1024]["rmse"] < rows[16]["rmse"] / 8  # 64 times the samples: 1/8 is Monte Carlo's rate


def test_the_bias_is_that_of_equal_coordinates():
    x = (np.arange(100_000) + 0.5) / 100_000
    assert (x * (1 + x) / 2).mean() - figure_decorrelation.TRUE == pytest.approx(FULL_BIAS, rel=1e-6)


def test_the_figure_is_written(results, tmp_path):
    rows = {name: list(results[name].values()) for name in WIRINGS}
    assert [path.name for path in figure_decorrelation.draw(rows, tmp_path / "x")] == ["x.png", "x.svg"]
