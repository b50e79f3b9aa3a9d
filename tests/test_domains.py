"""Which point meets which: decorrelated domains, sets that never meet themselves, tables looked up as numbered.

The coupled integrand: SAMPLING.md describes one of pixel × light with the true value .375 that is biased by +.042 where
sample i of the pixel always meets sample i of the light. It is f(p, l) = x_p (1 + x_l) / 2 (a brightness that grows
across the pixel, times a light seen better from one side): its mean is ½ · ¾ = .375, and if x_l = x_p it is
(½ + ⅓) / 2 = .4167. Two independent sets of k × k strata in the same order share their strata, not the place in
them: they have (1 - 1/k²) of that bias, which is 1/24.
"""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage, stats

from core import SettingsError, domains
from core.batch import LANES, PACKET, POINT, Y, new_batch
from core.domains import DOMAINS, PointTable, Run, hash32, look_up_points, make_table, place_on_curve, set_of_pixel
from core.samplers import SAMPLERS
from core.settings import RenderSettings
from tests import naive
from tests.scenes import Estimate, estimate

TRUE, BIAS = 0.375, 1 / 24
#: Of the six, those whose sets are all alike know no chance but the shuffling.
CHANCE = [name for name in SAMPLERS if name not in ("regular", "hammersley")]
PIXELS, BLOCKS = 64, np.array([(0, 0), (4, 0), (8, 4), (100, 200)], np.int64)


def looked_up(table: PointTable, dimension: int, blocks: np.ndarray, first: int, count: int) -> np.ndarray:
    """The points of `count` samples, (count, 2), by the kernel."""
    batch = new_batch(-(-count // LANES))
    look_up_points(batch, POINT, table, dimension, blocks, Run(0, table.points.shape[2]), first, count)
    lanes = batch.floats.reshape(-1, PACKET)
    return np.stack([lanes[:, row : row + LANES].ravel()[:count] for row in (POINT, POINT + Y)], -1)


def coupled_means(name: str, samples: int, light: str, seed: int, shared: bool = False) -> np.ndarray:
    """The pixels' estimates of the coupled integrand, the light's points taken from the domain `light`."""
    settings = RenderSettings(samples=samples, sampler=name, seed=seed)
    count = settings.sample_count
    pixel_table = make_table("pixel", settings, 1, PIXELS)
    light_table = pixel_table if shared else make_table(light, settings, 3, PIXELS)
    p = looked_up(pixel_table, 0, BLOCKS, 0, PIXELS * count)
    q = looked_up(light_table, 0 if shared else 2, BLOCKS, 0, PIXELS * count)
    return (p[:, 0] * (1 + q[:, 0]) / 2).reshape(PIXELS, count).mean(axis=1)


def coupled(name: str, samples: int = 64, light: str = "light", shared: bool = False) -> Estimate:
    return estimate(lambda seed: coupled_means(name, samples, light, seed, shared).mean())


@pytest.mark.parametrize("name", CHANCE)
@pytest.mark.parametrize("domain", ["lens", "light", "bsdf"])
def test_pixel_and_other_domains_are_not_coupled(name, domain):
    assert coupled(name, light=domain).agrees(TRUE)


@pytest.mark.parametrize("samples", [1, 5, 16, 256])
def test_pixel_and_light_are_not_coupled_at_any_count(samples):
    assert coupled("multi_jittered", samples).agrees(TRUE)
    assert coupled("jittered", samples).agrees(TRUE)


def test_the_order_is_shuffled_where_all_sets_are_alike():
    """Regular points measure ∫ x (1 + x') / 2 exactly in each domain, so that only the coupling is left."""
    assert coupled("regular").agrees(TRUE)
    # The mean of Hammersley's first coordinates i / n is not ½, but ½ - 1/2n.
    mean = 0.5 - 1 / 128
    assert coupled("hammersley").agrees(mean * (1 + mean) / 2)


@pytest.mark.parametrize("name", CHANCE)
def test_wired_to_the_same_set_they_are_coupled(name):
    result = coupled(name, shared=True)
    assert result.agrees(TRUE + BIAS)
    assert not result.agrees(TRUE)


@pytest.mark.parametrize("samples", [16, 64, 256])
def test_without_the_shuffle_jittered_sets_are_coupled(samples, monkeypatch):
    for order in ("shuffle_sets", "follow_curve"):
        monkeypatch.setattr(domains, order, lambda points, rng: points)
    result = coupled("jittered", samples)
    assert result.agrees(TRUE + BIAS * (1 - 1 / samples))
    assert not result.agrees(TRUE)


def test_two_dimensions_of_one_domain_are_not_coupled():
    settings = RenderSettings(samples=64, sampler="jittered")

    def mean(seed: int) -> float:
        table = make_table("light", RenderSettings(samples=64, sampler="jittered", seed=seed), 4, PIXELS)
        p, q = (looked_up(table, dimension, BLOCKS, 0, PIXELS * settings.sample_count) for dimension in (1, 3))
        return (p[:, 0] * (1 + q[:, 0]) / 2).mean()

    assert estimate(mean).agrees(TRUE)


def test_shuffling_is_fair_and_its_own_for_each_set():
    """Each point is as likely at each place: χ² over the 5 × 5 counts, and over the 24 orders of 4 points."""
    points = np.broadcast_to(np.arange(5, dtype=np.float32)[None, :, None], (20_000, 5, 2))
    shuffled = domains.shuffle_sets(points, np.random.default_rng(1))[:, :, 0].astype(int)
    assert (np.sort(shuffled, axis=1) == np.arange(5)).all()
    counts = np.array([np.bincount(shuffled[:, place], minlength=5) for place in range(5)])
    assert stats.chi2.sf(((counts - 4000) ** 2 / 4000).sum(), 16) > 1e-3
    orders = np.unique(shuffled, axis=0, return_counts=True)[1]
    assert len(orders) == 120
    assert stats.chisquare(orders).pvalue > 1e-3


def test_a_random_start_is_fair_and_its_own_for_each_set():
    points = np.broadcast_to(np.arange(5, dtype=np.float32)[None, :, None] / 5, (20_000, 5, 2))
    followed = np.rint(domains.follow_curve(points, np.random.default_rng(1))[:, :, 0] * 5).astype(int)
    assert (np.diff(followed, axis=1) % 5 == 1).all()
    assert stats.chisquare(np.bincount(followed[:, 0])).pvalue > 1e-3


def test_along_the_curve_four_neighbours_fill_a_square():
    (points,) = domains.follow_curve(SAMPLERS["regular"](1, 16, np.random.default_rng(1)), np.random.default_rng(3))
    start = next(i for i, point in enumerate(points) if tuple(point) == (0.125, 0.125))
    quarters = np.roll(points, -start, axis=0).reshape(4, 4, 2)
    assert np.array_equal(np.ptp(quarters, axis=1), np.full((4, 2), 0.25))


@pytest.mark.parametrize("order", [domains.shuffle_sets, domains.follow_curve])
def test_points_stay_with_their_coordinates(order):
    points = np.random.default_rng(1).random((7, 12, 2), dtype=np.float32)
    shuffled = order(points, np.random.default_rng(2))
    for before, after in zip(points, shuffled, strict=True):
        assert {tuple(point) for point in before} == {tuple(point) for point in after}
        assert not np.array_equal(before, after)


# Tables


@pytest.mark.parametrize("domain", DOMAINS)
@pytest.mark.parametrize("name", SAMPLERS)
def test_a_table_holds_whole_sets_of_the_domains_sampler(domain, name):
    settings = RenderSettings(samples=20, sampler="random", **{f"{domain}_sampler": name})
    table = make_table(domain, settings, 3, 1000)
    assert table.points.dtype == np.float32
    _, set_count, count = table.points.shape
    assert count == settings.sample_count
    if SAMPLERS[name].along_curve:
        assert set_count == 3 * 4**table.digits
    else:
        assert set_count & (set_count - 1) == 0
        assert set_count >= 3000
    assert table.points.min() >= 0
    assert table.points.max() < 1
    if name == "regular":
        grid = SAMPLERS[name](1, count, np.random.default_rng(1))[0]
        for chosen in (0, set_count - 1):
            assert {tuple(p) for p in table.points[:, chosen].T} == {tuple(p) for p in grid}


def test_domains_and_seeds_have_tables_of_their_own():
    tables = [
        make_table(domain, RenderSettings(samples=4, sampler="random", seed=seed), 1, 64)
        for domain in DOMAINS
        for seed in (0, 1, 2**31 - 1)
    ]
    assert len({table.points.tobytes() for table in tables}) == len(tables)
    assert len({table.salt for table in tables}) == len(tables)
    again = make_table("pixel", RenderSettings(samples=4, sampler="random", seed=0), 1, 64)
    assert np.array_equal(again.points, tables[0].points)
    assert again.salt == tables[0].salt


@pytest.mark.parametrize("dimensions", [1, 3, 64, 1000])
def test_no_two_dimensions_of_a_pixel_share_a_set(dimensions):
    table = make_table("light", RenderSettings(samples=4, sampler="random"), dimensions, 16)
    assert table.points.shape[1] >= dimensions
    for x, y in ((0, 0), (1, 0), (0, 1), (7, 7), (3839, 2159), (12345, 1)):
        chosen = [set_of_pixel(table, x, y, dimension) for dimension in range(dimensions)]
        assert len(set(chosen)) == dimensions
        assert chosen == [
            naive.set_of_pixel(table.salt, table.points.shape[1], x, y, dimension) for dimension in range(dimensions)
        ]


def test_pixels_spread_evenly_over_the_sets():
    """χ² over 64 sets, of the first dimension and of a later one, and of the pairs that neighbours have."""
    table = PointTable(np.zeros((2, 64, 1), np.float32), 12345)
    for dimension in (0, 5):
        chosen = np.array([[set_of_pixel(table, x, y, dimension) for x in range(160)] for y in range(90)])
        assert stats.chisquare(np.bincount(chosen.ravel(), minlength=64)).pvalue > 1e-3
        pairs = (chosen[:, :-1] % 8) * 8 + chosen[:, 1:] % 8
        assert stats.chisquare(np.bincount(pairs.ravel(), minlength=64)).pvalue > 1e-3


# Sets along a curve


def along_curve(dimensions: int, samples: int = 4, seed: int = 0) -> PointTable:
    return make_table("light", RenderSettings(samples=samples, sampler="z_sobol", seed=seed), dimensions, 64 * 64)


def test_each_square_of_pixels_is_a_run_of_the_curve():
    """Squares of 1, 4, 16, 64 … pixels, in each dimension: 4^k sets in a row, from a multiple of 4^k on."""
    table = along_curve(3)
    assert table.digits == 6
    for dimension in range(3):
        chosen = np.array([[set_of_pixel(table, x, y, dimension) for x in range(128)] for y in range(128)])
        assert np.array_equal(np.unique(chosen), np.arange(4096) + dimension * 4096)
        for level in range(7):
            side = 2**level
            squares = chosen.reshape(128 // side, side, 128 // side, side).swapaxes(1, 2).reshape(-1, 4**level)
            squares = np.sort(squares, axis=1)
            assert (squares[:, 0] % 4**level == 0).all()
            assert (squares - squares[:, :1] == np.arange(4**level)).all()


def test_the_curve_is_its_definition_with_and_without_the_jit():
    table = along_curve(3)
    for x, y, dimension in ((0, 0, 0), (5, 9, 1), (63, 64, 2), (3839, 2159, 0)):
        salt = naive.hash32(dimension, 0, table.salt)
        place = naive.place_on_curve(x, y, table.digits, salt)
        assert place_on_curve(x, y, table.digits, salt) == place
        assert place_on_curve.py_func(x, y, table.digits, salt) == place
        assert set_of_pixel(table, x, y, dimension) == dimension * 4**table.digits + place


def test_the_curve_turns_anew_in_each_square_and_dimension_and_for_each_seed():
    """All 24 orders of four quarters occur equally often (χ²)."""
    chosen = np.array(
        [
            [place_on_curve(2 * x + i % 2, 2 * y + i // 2, 6, salt) % 4 for i in range(4)]
            for x in range(32)
            for y in range(32)
            for salt in (1, 2, 77)
        ]
    )
    orders = np.unique(chosen, axis=0, return_counts=True)[1]
    assert len(orders) == 24
    assert stats.chisquare(orders).pvalue > 1e-3


def test_the_points_of_a_square_of_pixels_are_a_net():
    """What makes the noise blue: 4 points in each of 4 × 4 pixels are 64 points, one per elementary interval."""
    table = along_curve(3)
    for block in BLOCKS:
        points = looked_up(table, 1, block[None], 0, 64).astype(np.float64)
        for a in range(7):
            columns, rows = 2**a, 64 >> a
            cells = np.floor(points[:, 0] * columns) * rows + np.floor(points[:, 1] * rows)
            assert np.array_equal(np.sort(cells), np.arange(64))


@pytest.mark.parametrize("samples", [1, 4, 16])
@pytest.mark.parametrize(("integrand", "gain"), [("edge", 1.5), ("smooth", 2)])
def test_blurred_errors_along_the_curve_are_smaller(samples, integrand, gain):
    """Ahmed and Wonka's point: before a blur of 2 pixels the error is the same, after it much smaller."""
    blocks = np.array([(4 * i, 4 * j) for j in range(16) for i in range(16)], np.int64)
    error_of = {"edge": lambda x, y: (x + y < 1) - 0.5, "smooth": lambda x, y: x * y - 0.25}[integrand]

    def errors(name: str, seed: int) -> np.ndarray:
        table = make_table("light", RenderSettings(samples=samples, sampler=name, seed=seed), 3, 64 * 64)
        x, y = looked_up(table, 2, blocks, 0, 64 * 64 * samples).T.astype(np.float64)
        means = error_of(x, y).reshape(-1, samples).mean(axis=1)
        return means.reshape(16, 16, 4, 4).swapaxes(1, 2).reshape(64, 64)

    fields = {name: [errors(name, seed) for seed in range(8)] for name in ("sobol_owen", "z_sobol")}
    sharp, blurred = (
        {name: np.mean([(blur(e) ** 2).mean() for e in images]) ** 0.5 for name, images in fields.items()}
        for blur in (lambda e: e, lambda e: ndimage.gaussian_filter(e, 2, mode="wrap"))
    )
    assert sharp["z_sobol"] == pytest.approx(sharp["sobol_owen"], rel=0.15)
    assert blurred["sobol_owen"] > gain * blurred["z_sobol"]


# The hash


@given(st.integers(-(2**40), 2**40), st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_the_hash_is_its_definition_with_and_without_the_jit(a, b, c):
    expected = naive.hash32(a, b, c)
    assert hash32(a, b, c) == expected
    assert hash32.py_func(a, b, c) == expected


def test_the_hash_is_well_spread():
    """Each bit is set half of the time, and flipping one bit of the input flips each with probability ½ (4.5 σ)."""
    rng = np.random.default_rng(3)
    values = rng.integers(0, 2**14, (4000, 3))
    hashes = np.array([hash32(*map(int, row)) for row in values])
    flipped = np.array([hash32(int(a) ^ (1 << int(bit)), int(b), int(c)) for (a, b, c), bit in
                        zip(values, rng.integers(0, 14, 4000), strict=True)])  # fmt: skip
    for numbers in (hashes, hashes ^ flipped):
        ones = ((numbers[:, None] >> np.arange(32)) & 1).mean(axis=0)
        assert np.abs(ones - 0.5).max() < 4.5 * 0.5 / np.sqrt(4000)
    small = np.array([hash32(x, y, 0) >> 24 for y in range(64) for x in range(64)])
    assert stats.chisquare(np.bincount(small, minlength=256)).pvalue > 1e-3


# Looking up


@pytest.mark.parametrize("samples", [1, 5, 16, 20, 64])
def test_points_are_looked_up_as_the_samples_are_numbered(samples):
    settings = RenderSettings(samples=samples, sampler="random", seed=3)
    table = make_table("light", settings, 4, PIXELS)
    total = PIXELS * samples
    expected = {
        dimension: np.array(
            [naive.point_of_sample(table.points, table.salt, dimension, BLOCKS, i) for i in range(total)]
        )
        for dimension in (0, 3)
    }
    for dimension, points in expected.items():
        for first, count in ((0, total), (0, 16), (16, total - 16), (min(48, total - 16), 16), (total - 16, 16)):
            part = looked_up(table, dimension, BLOCKS, first, count)
            assert np.array_equal(part, points[first : first + count])


def test_batches_may_begin_anywhere():
    table = make_table("pixel", RenderSettings(samples=5, sampler="random"), 1, PIXELS)
    whole = looked_up(table, 0, BLOCKS, 0, PIXELS * 5)
    for first, after in pairwise((0, 3, 4, 17, 100, 243, 320)):
        assert np.array_equal(looked_up(table, 0, BLOCKS, first, after - first), whole[first:after])


# Limits


@pytest.mark.parametrize("samples", [0, -1, 10**9])
def test_counts_beyond_reason_are_refused(samples):
    with pytest.raises(SettingsError, match=f"samples.*{samples}"):
        RenderSettings(samples=samples)


def test_tables_beyond_memory_are_refused_before_they_are_made():
    settings = RenderSettings(samples=2**20, sampler="random")
    with pytest.raises(SettingsError, match=r"1048576 samples in 640 light dimensions need \d+ GB"):
        make_table("light", settings, 640, 100)


@pytest.mark.parametrize("name", ["multi_jittered", "z_sobol"])
def test_a_large_table_takes_little_more_memory_while_it_is_made(name, monkeypatch):
    monkeypatch.setattr(domains, "PART_POINTS", 1 << 15)
    settings = RenderSettings(samples=1 << 10, sampler=name)
    tracemalloc.start()
    table = make_table("light", settings, 512, 1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < table.points.nbytes + 10 * 8 * (1 << 15)
    corners = table.points[:, :, 0].T
    assert len(np.unique(corners, axis=0)) == len(corners)


def test_a_table_that_memory_has_no_room_for_is_refused(monkeypatch):
    def no_room(points, rng):
        raise MemoryError

    monkeypatch.setattr(domains, "shuffle_sets", no_room)
    with pytest.raises(SettingsError, match=r"9 samples in 2 pixel dimensions need .* GB of tables, more memory"):
        make_table("pixel", RenderSettings(samples=9), 2, 100)
