"""What the samplers promise: counts, strata, fairness. (`test_lab_score` has the figures of merit.)

Seeds are fixed. A statistical test rejects a right sampler with a probability of at most 1e-3, shared out among the
comparisons that it makes (Šidák); a failure is then a bug.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from core.lab.criteria import centred_discrepancy, smallest_distance
from core.samplers import SAMPLERS, TEXTBOOK
from core.samplers.fibonacci import generator
from core.samplers.hammersley import radical_inverse
from core.samplers.multi_jittered import coarse_rows
from core.samplers.sampler import grid_shape, stratum_bounds
from core.samplers.sobol import mirrored_pascal, reverse_bits
from tests import naive

COUNTS = range(1, 301)
SIGNIFICANCE = 1e-3
LARGEST = np.float32(1 - 2**-24)

GRIDS = ("regular", "jittered")
LATIN = ("n_rooks", "multi_jittered", "correlated_multi_jittered", "fibonacci")
NETS = ("sobol_owen", "z_sobol")
DETERMINISTIC = ("regular", "hammersley")
CHANCE = [name for name in SAMPLERS if name not in DETERMINISTIC]

every_sampler = pytest.mark.parametrize("sampler", SAMPLERS.values(), ids=SAMPLERS.keys())


class Extreme(np.random.Generator):
    """A generator whose every number is the largest, or the smallest, that the real one can return."""

    def __init__(self, largest: bool):
        super().__init__(np.random.PCG64(1))
        self.largest = largest

    def random(self, size=None, dtype=np.float64, out=None):
        bits = 24 if dtype == np.float32 else 53
        return np.full(size, 1 - 2.0**-bits if self.largest else 0, dtype)

    def integers(self, low, high=None, size=None, **_):
        low, high = (0, low) if high is None else (low, high)
        return np.full(size, high - 1 if self.largest else low)


def narrow_arange(*limits: int, dtype: type = np.int32, arange=np.arange) -> np.ndarray:
    return arange(*limits, dtype=dtype)


def sidak(comparisons: int) -> float:
    """The significance of each of so many comparisons that makes SIGNIFICANCE of all of them."""
    return 1 - (1 - SIGNIFICANCE) ** (1 / comparisons)


def strata(x: np.ndarray, count: int) -> np.ndarray:
    """The stratum of [0, 1) that each float32 lies in, exactly."""
    return np.floor(x.astype(np.float64) * count).astype(int)


def holds_each_once(indices: np.ndarray, count: int) -> bool:
    """Whether each row of `indices` is a permutation of 0 … count - 1."""
    return np.array_equal(np.sort(indices, axis=1), np.broadcast_to(np.arange(count), indices.shape))


# The registry


def test_the_six_textbook_samplers_are_found_in_their_order():
    six = ("regular", "random", "jittered", "n_rooks", "multi_jittered", "hammersley")
    assert six == TEXTBOOK == tuple(SAMPLERS)[:6]
    assert [SAMPLERS[name].number for name in six] == [0, 1, 2, 3, 4, 5]


@every_sampler
def test_a_sampler_describes_itself(sampler):
    assert SAMPLERS[sampler.name] is sampler
    assert sampler.name == sampler.name.lower()
    assert sampler.name.isidentifier()
    assert sampler.label
    assert sampler.origin[-4:].isdigit()
    assert len(sampler.criteria) == 4
    assert sampler.description
    assert not sampler.description.endswith(".")  # Blender adds the full stop


@every_sampler
def test_a_sampler_says_which_other_one_to_take_where_it_fails(sampler):
    others = [other.label.partition(",")[0] for other in SAMPLERS.values() if other is not sampler]
    assert any(label in sampler.description for label in others)


@every_sampler
def test_a_sampler_without_chance_says_that_all_pixels_share_its_points(sampler):
    first, second = sampler(2, 16, np.random.default_rng(1))
    has_chance = not np.array_equal(first, second)
    assert has_chance == ("the same in every pixel and frame" not in sampler.description)


def test_none_of_the_six_meets_all_four_criteria():
    assert not any(all(SAMPLERS[name].criteria) for name in TEXTBOOK)


# Shapes, ranges, counts


@every_sampler
def test_points_are_float32_in_the_unit_square(sampler):
    for requested in (1, 2, 16, 97):
        count = sampler.actual_count(requested)
        points = sampler(3, count, np.random.default_rng(1))
        assert points.dtype == np.float32
        assert points.shape == (3, count, 2)
        assert points.flags.c_contiguous
        assert (points >= 0).all()
        assert (points < 1).all()


@every_sampler
@pytest.mark.parametrize("largest", [False, True])
def test_extreme_random_numbers_keep_points_inside(sampler, largest):
    for requested in (*COUNTS, 4096, 99_991):
        points = sampler(1, sampler.actual_count(requested), Extreme(largest))
        assert points.min() >= 0
        assert points.max() <= LARGEST


@every_sampler
def test_the_count_made_is_the_nearest_not_below(sampler):
    actual = [sampler.actual_count(requested) for requested in COUNTS]
    makes = sorted({sampler.actual_count(n) for n in range(1, 700)})
    for requested, count in zip(COUNTS, actual, strict=True):
        assert count == min(n for n in makes if n >= requested)
        assert sampler.actual_count(count) == count
        assert sampler(2, count, np.random.default_rng(1)).shape == (2, count, 2)
    if sampler.name in GRIDS:
        assert all(count in {r * r for r in range(19)} | {r * (r + 1) for r in range(19)} for count in actual)
    elif sampler.name == "z_sobol":
        assert set(actual) == {1 << k for k in range(10)}
    else:
        assert actual == list(COUNTS)


@pytest.mark.parametrize("name", GRIDS)
def test_a_grid_refuses_a_count_that_is_no_grid(name):
    with pytest.raises(ValueError, match=r"cannot make 17 points, but 20: .*rows × columns"):
        SAMPLERS[name](1, 17, np.random.default_rng(1))


@every_sampler
def test_no_points_are_refused(sampler):
    with pytest.raises(ValueError, match="at least one point"):
        sampler(1, 0, np.random.default_rng(1))


@every_sampler
def test_many_points_are_the_same_where_numpys_integers_have_32_bits(sampler, monkeypatch):
    """Those of numpy 1 on Windows."""
    count = sampler.actual_count(60_001)
    expected = sampler(1, count, np.random.default_rng(5))
    monkeypatch.setattr(np, "arange", narrow_arange)
    assert np.array_equal(sampler(1, count, np.random.default_rng(5)), expected)


@every_sampler
def test_the_seed_decides(sampler):
    count = sampler.actual_count(29)
    first, again, other = (sampler(5, count, np.random.default_rng(seed)) for seed in (7, 7, 8))
    assert np.array_equal(first, again)
    assert np.array_equal(first, other) == (sampler.name in DETERMINISTIC)


@pytest.mark.parametrize("name", CHANCE)
def test_sets_differ(name):
    points = SAMPLERS[name](50, SAMPLERS[name].actual_count(13), np.random.default_rng(1))
    assert len(np.unique(points.reshape(50, -1), axis=0)) == 50


@pytest.mark.parametrize("name", DETERMINISTIC)
def test_all_sets_of_a_deterministic_sampler_are_one(name):
    points = SAMPLERS[name](4, 20, np.random.default_rng(1))
    assert (points == points[0]).all()


# Strata


def test_strata_of_float32_are_exact_and_hold_in_float32_arithmetic():
    for count in (*COUNTS, 4096, 99_991, 2**20, 2**20 + 7):
        index = np.arange(count)
        for bound in stratum_bounds(count):
            assert bound.dtype == np.float32
            assert np.array_equal(strata(bound, count), index)
            assert np.array_equal(np.floor(bound * np.float32(count)), index)


@pytest.mark.parametrize("name", LATIN)
def test_each_row_and_each_column_holds_one_point(name):
    rng = np.random.default_rng(2)
    for count in COUNTS:
        points = SAMPLERS[name](3, count, rng)
        assert holds_each_once(strata(points[..., 0], count), count)
        assert holds_each_once(strata(points[..., 1], count), count)


@pytest.mark.parametrize("name", LATIN)
@pytest.mark.parametrize("largest", [False, True])
def test_extreme_random_numbers_keep_rows_and_columns(name, largest):
    for count in (3, 7, 49, 97, 1000, 4096):
        points = SAMPLERS[name](2, count, Extreme(largest))
        assert holds_each_once(strata(points[..., 0], count), count)
        assert holds_each_once(strata(points[..., 1], count), count)


def test_hammersley_holds_one_point_per_column_and_at_powers_of_two_per_row():
    for count in COUNTS:
        points = SAMPLERS["hammersley"](1, count, np.random.default_rng(1))
        assert holds_each_once(strata(points[..., 0], count), count)
        # The digits of 0 … n - 1 fill the strata of 1/n only where n is a power of two: 0, ½, ¼ share two of three.
        assert holds_each_once(strata(points[..., 1], count), count) == (count & (count - 1) == 0)


def cell_indices(points: np.ndarray, rows: int, columns: int) -> np.ndarray:
    return strata(points[..., 1], rows) * columns + strata(points[..., 0], columns)


@pytest.mark.parametrize("name", GRIDS)
def test_each_cell_of_a_grid_holds_one_point_in_raster_order(name):
    for count in sorted({SAMPLERS[name].actual_count(n) for n in COUNTS}):
        points = SAMPLERS[name](3, count, np.random.default_rng(3))
        assert (cell_indices(points, *grid_shape(count)) == np.arange(count)).all()


def test_regular_points_are_the_centres():
    points = SAMPLERS["regular"](1, 6, np.random.default_rng(1))[0]
    x, y = np.meshgrid([1 / 6, 3 / 6, 5 / 6], [1 / 4, 3 / 4])
    np.testing.assert_allclose(points, np.stack((x.ravel(), y.ravel()), axis=-1), rtol=1e-6)


def test_each_coarse_cell_of_multi_jittered_holds_one_point_in_raster_order():
    rectangles = [n for n in COUNTS if n % coarse_rows(n) == 0]
    assert {r * r for r in range(1, 18)} <= set(rectangles)
    assert {8, 18, 128} <= set(rectangles)
    for count in rectangles:
        rows = coarse_rows(count)
        points = SAMPLERS["multi_jittered"](3, count, np.random.default_rng(4))
        assert (cell_indices(points, rows, count // rows) == np.arange(count)).all()


def test_multi_jittered_rows_share_the_points_evenly_for_any_count():
    for count in COUNTS:
        rows = coarse_rows(count)
        row = strata(SAMPLERS["multi_jittered"](3, count, np.random.default_rng(5))[..., 1], count) * rows // count
        assert all(set(np.bincount(r, minlength=rows)) <= {count // rows, count // rows + 1} for r in row)


def test_each_coarse_cell_of_correlated_multi_jittered_holds_one_point_in_raster_order():
    for root in range(1, 18):
        points = SAMPLERS["correlated_multi_jittered"](3, root**2, np.random.default_rng(4))
        cells = strata(points[..., 1], root) * root + strata(points[..., 0], root)
        assert holds_each_once(cells, root**2)


def test_correlated_multi_jittered_has_one_shuffle_for_all_rows_and_one_for_all_columns():
    """The place in the cell of x is the same all along a row of cells, that of y all along a column (Kensler, 2013)."""
    root = 7
    points = SAMPLERS["correlated_multi_jittered"](50, root**2, np.random.default_rng(4))
    x, y = strata(points[..., 0], root**2), strata(points[..., 1], root**2)
    for along, place in ((y // root, x % root), (x // root, y % root)):
        order = np.argsort(along, axis=1, kind="stable")
        by_line = np.take_along_axis(place, order, axis=1).reshape(50, root, root)
        assert (by_line == by_line[..., :1]).all()
        assert holds_each_once(by_line[..., 0], root)


@pytest.mark.parametrize("count", [16, 64, 256])
def test_correlated_multi_jittered_keeps_points_further_apart(count):
    """By the docs' figures 1.5, 1.8 and 2.3 times as far as multi-jittered."""
    rng = np.random.default_rng(6)
    correlated, independent = (
        smallest_distance(SAMPLERS[name](100, count, rng)) for name in ("correlated_multi_jittered", "multi_jittered")
    )
    assert stats.ttest_ind(correlated, independent, equal_var=False, alternative="greater").pvalue < SIGNIFICANCE


@pytest.mark.parametrize(("count", "ratio"), [(17, 0.85), (53, 0.65), (97, 0.5)])
def test_multi_jittered_beats_n_rooks_in_the_plane_for_primes(count, ratio):
    """The docs' figures for squares make the ratio of their discrepancies 0.72 at 16 and 0.38 at 64."""
    rng = np.random.default_rng(6)
    multi_jittered, n_rooks = (
        centred_discrepancy(SAMPLERS[name](200, count, rng)).mean() for name in ("multi_jittered", "n_rooks")
    )
    assert multi_jittered < ratio * n_rooks


# Hammersley


def test_the_radical_inverse_is_van_der_corputs_sequence():
    sequence = qmc.Halton(d=1, scramble=False).random(5000)[:, 0]  # the first of Halton's sequences is van der Corput's
    assert np.array_equal(radical_inverse(np.arange(5000)), sequence.astype(np.float32))


def test_the_radical_inverse_agrees_with_table_5_1_corrected():
    table = [0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875, 0.0625]  # the book has .635 and .325 for 5 and 6
    assert radical_inverse(np.arange(1, 9)).tolist() == table


def test_the_radical_inverse_never_reaches_one():
    assert radical_inverse(np.array([2**24 - 1, 2**25 - 1, 2**32 - 1])).tolist() == [LARGEST] * 3


def test_hammersley_points_are_steps_in_x_and_mirrored_digits_in_y():
    points = SAMPLERS["hammersley"](1, 6, np.random.default_rng(1))[0]
    np.testing.assert_allclose(points[:, 0], np.arange(6) / 6, rtol=1e-6)
    assert points[:, 1].tolist() == [0, 0.5, 0.25, 0.75, 0.125, 0.625]


# Sobol's sequence


def elementary_intervals(points: np.ndarray) -> bool:
    """Whether each set of 2^k points has one point in each interval of area 2^-k with sides that are powers of two."""
    count = points.shape[1]
    shapes = [(1 << a, count >> a) for a in range(count.bit_length())]
    return all(holds_each_once(strata(points[..., 0], c) * r + strata(points[..., 1], r), count) for c, r in shapes)


@pytest.mark.parametrize("name", NETS)
def test_a_power_of_two_of_points_has_one_in_each_elementary_interval(name):
    for k in range(12):
        assert elementary_intervals(SAMPLERS[name](5, 1 << k, np.random.default_rng(k)))
    assert elementary_intervals(SAMPLERS[name](1, 1 << 16, np.random.default_rng(1)))


def test_that_test_can_fail():
    for name in ("random", "multi_jittered", "correlated_multi_jittered", "fibonacci"):
        assert not elementary_intervals(SAMPLERS[name](5, 16, np.random.default_rng(1)))


def test_each_prefix_of_sobol_owen_is_a_net_too():
    points = SAMPLERS["sobol_owen"](5, 300, np.random.default_rng(1))
    for k in range(9):
        assert elementary_intervals(points[:, : 1 << k])


def test_all_the_sets_of_z_sobol_are_a_net_together():
    points = SAMPLERS["z_sobol"](64, 16, np.random.default_rng(1))
    for sets in (1, 2, 4, 16, 64):
        assert elementary_intervals(points.reshape(-1, sets * 16, 2))


def test_unscrambled_it_is_sobols_sequence():
    index = np.arange(1024, dtype=np.uint32)
    ours = np.stack([reverse_bits(index), reverse_bits(mirrored_pascal(index))], axis=-1) * 2.0**-32
    theirs = qmc.Sobol(d=2, scramble=False).random(1024)  # in the order of a Gray code
    assert {tuple(point) for point in ours} == {tuple(point) for point in theirs}


@pytest.mark.parametrize("count", [16, 64, 256])
def test_hashed_scrambling_is_as_good_as_owens_own(count):
    """The variance of a smooth integrand's estimate, against a twin that flips a coin for every node of the tree."""
    sets, rng = 2000, np.random.default_rng(12)
    hashed = smooth(SAMPLERS["sobol_owen"](sets, count, rng)).mean(axis=1)
    owen = smooth(naive.owen_scrambled_sobol(sets, count, rng)).mean(axis=1)
    ratio = hashed.var() / owen.var()
    # Tails are a little heavier than normal: Levene's test does not care, the F test would.
    assert stats.levene(hashed, owen).pvalue > sidak(3), ratio


# The Fibonacci lattice


def test_fibonacci_numbers_of_points_make_fibonacci_lattices():
    numbers = [2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233, 377]
    assert [generator(n) for n in numbers[1:]] == numbers[:-1]


def test_fibonacci_points_are_a_shifted_lattice():
    for count in (*COUNTS, 4096):
        points = SAMPLERS["fibonacci"](3, count, np.random.default_rng(1)).astype(float)
        steps = (points - points[:, :1]) * count
        index = np.rint(steps).astype(int)
        assert np.abs(steps - index).max() < 1e-4 * max(1, count / 1000)
        assert ((index[..., 1] - generator(count) * index[..., 0]) % count == 0).all()


# Fairness


def book_n_rooks(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """N-rooks with the book's shuffle, whose swap partner is any element and whose pivot is never the first."""
    points = np.empty((set_count, count, 2), np.float32)
    for axis in (0, 1):
        coordinates = (np.arange(count) + rng.random((set_count, count))) / count
        every = np.arange(set_count)
        for pivot in range(1, count):
            target = rng.integers(count, size=set_count)
            coordinates[every, pivot], coordinates[every, target] = (
                coordinates[every, target],
                coordinates[every, pivot].copy(),
            )
        points[..., axis] = coordinates
    return points


def smallest_p_value(points: np.ndarray) -> float:
    """The smallest p-value of χ² tests, one per column, that the point in it is equally often in each row."""
    count = points.shape[1]
    columns, rows = strata(points[..., 0], count), strata(points[..., 1], count)
    table = np.zeros((count, count), int)
    np.add.at(table, (columns, rows), 1)
    return stats.chisquare(table, axis=1).pvalue.min()


@pytest.mark.parametrize(("name", "count"), list(product(LATIN, (2, 7, 16, 18, 19, 23))))
def test_every_place_of_the_fine_grid_is_equally_likely(name, count):
    assert smallest_p_value(SAMPLERS[name](20_000, count, np.random.default_rng(8))) > sidak(count * 6 * len(LATIN))


def test_the_books_shuffle_fails_that_test():
    assert smallest_p_value(book_n_rooks(20_000, 16, np.random.default_rng(8))) < 1e-30


def corner_frequency(points: np.ndarray) -> float:
    """How often the stratum of the first row and first column holds a point."""
    return (points < 1 / points.shape[1]).all(axis=2).any(axis=1).mean()


@pytest.mark.parametrize(("count", "book"), [(16, 0.169), (64, 0.143), (256, 0.141)])
def test_the_corner_stratum_holds_a_point_once_in_n_sets(count, book):
    sets = 20_000
    rng = np.random.default_rng(9)
    for name in LATIN:
        hits = round(corner_frequency(SAMPLERS[name](sets, count, rng)) * sets)
        assert stats.binomtest(hits, sets, 1 / count).pvalue > sidak(3 * len(LATIN))
    biased = corner_frequency(book_n_rooks(5000, count, rng))
    assert biased == pytest.approx(book, abs=0.0005 + 4 * np.sqrt(book / 5000))


def smooth(points: np.ndarray) -> np.ndarray:
    """An integrand of mean (e - 1)(1 - cos 3)/3, without symmetries of the square."""
    x, y = points[..., 0].astype(float), points[..., 1].astype(float)
    return np.exp(x) * np.sin(3 * y)


@pytest.mark.parametrize(("name", "count"), list(product(CHANCE, (1, 2, 3, 5, 13, 31, 97))))
def test_the_mean_over_sets_is_the_integral(name, count):
    sampler = SAMPLERS[name]
    estimates = smooth(sampler(10_000, sampler.actual_count(count), np.random.default_rng(10))).mean(axis=1)
    z = (estimates.mean() - (np.e - 1) * (1 - np.cos(3)) / 3) / (estimates.std() / np.sqrt(len(estimates)))
    assert 2 * stats.norm.sf(abs(z)) > sidak(7 * len(CHANCE))
