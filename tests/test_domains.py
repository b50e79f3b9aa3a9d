"""Which point meets which: decorrelated domains, sets that never meet themselves, tables looked up as numbered.

The coupled integrand: SAMPLING.md describes one of pixel × light with the true value .375 that is biased by +.042 where
sample i of the pixel always meets sample i of the light. It is f(p, l) = x_p (1 + x_l) / 2 (a brightness that grows
across the pixel, times a light seen better from one side): its mean is ½ · ¾ = .375, and if x_l = x_p it is
(½ + ⅓) / 2 = .4167. Two independent sets of k × k strata in the same order share their strata, not the place in
them: they have (1 - 1/k²) of that bias, which is 1/24.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from core import SettingsError, domains
from core.batch import LANES, PACKET, POINT, Y, new_batch
from core.domains import DOMAINS, PointTable, hash32, look_up_points, make_table, set_of_pixel
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
    look_up_points(batch, table, dimension, blocks, first, count)
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
