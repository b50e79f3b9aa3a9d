"""The light tree: its probabilities are those of its choices, no light is missed, and many lights cost little error.

What an emitter brings to a point is computed by hand: power × cosines / distance². For given probabilities p the
variance of the estimate is Σ c²/p - (Σ c)², so that error needs no sampling.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from core.jit import kernel
from core.light_choice import Emitters, LightTree, build_light_tree, choose_emitter, emitter_probability

#: Significance of the χ² tests: one false alarm in a thousand runs of the file.
SIGNIFICANCE = 1e-3 / 4


@kernel
def _choose(tree, point, normal, numbers, chosen, chances, rests):
    for i in range(len(numbers)):
        chosen[i], chances[i], rests[i] = choose_emitter(
            tree, point[0], point[1], point[2], normal[0], normal[1], normal[2], numbers[i]
        )


@kernel
def _probabilities(tree, point, normal, result):
    for k in range(len(result)):
        result[k] = emitter_probability(tree, k, point[0], point[1], point[2], normal[0], normal[1], normal[2])


def choose(tree: LightTree, point, normal, numbers) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    count = len(numbers)
    chosen, chances, rests = np.zeros(count, np.int64), np.zeros(count, np.float32), np.zeros(count, np.float32)
    _choose(tree, np.float32(point), np.float32(normal), np.float32(numbers), chosen, chances, rests)
    return chosen, chances, rests


def probabilities(tree: LightTree, point, normal=(0, 0, 0)) -> np.ndarray:
    result = np.zeros(len(tree.leaf), np.float32)
    _probabilities(tree, np.float32(point), np.float32(normal), result)
    return result.astype(np.float64)


def small_triangles(count: int, seed: int, two_sided: bool = True) -> Emitters:
    """Emitters in a room of 10 m, of very different powers."""
    rng = np.random.default_rng(seed)
    center, axis = rng.uniform(0, 10, (count, 3)), rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return Emitters(
        center - 1e-3,
        center + 1e-3,
        axis,
        np.zeros(count),
        np.full(count, np.pi / 2),
        np.full(count, two_sided),
        rng.random(count) ** 4 + 1e-4,
    )


def contributions(emitters: Emitters, point, normal=(0, 0, 0)) -> np.ndarray:
    """Power × cosine at the emitter × cosine at the point / distance², of each emitter's middle."""
    d = np.array(point, np.float64) - (emitters.low + emitters.high) / 2
    square = np.sum(d**2, axis=1)
    cosine = np.sum(d * emitters.axis, axis=1) / np.sqrt(square)
    cosine = np.where(emitters.two_sided, np.abs(cosine), np.maximum(cosine, 0))
    cosine = np.where(emitters.cone >= np.pi, 1, cosine)
    received = -d @ np.array(normal, np.float64) / np.sqrt(square) if np.any(normal) else 1
    return emitters.power * cosine * np.maximum(received, 0) / square


def relative_error(contribution: np.ndarray, chance: np.ndarray) -> float:
    """The standard deviation of one sample over the mean."""
    lit = contribution > 0
    variance = np.sum(contribution[lit] ** 2 / chance[lit]) / contribution.sum() ** 2 - 1
    return float(np.sqrt(max(variance, 0)))


@pytest.mark.parametrize("count", [1, 2, 3, 100])
def test_emitters_are_chosen_as_often_as_their_probability_says(count):
    tree = build_light_tree(small_triangles(count, seed=count))
    point, numbers = (4.0, 5.0, 6.0), np.random.default_rng(5).random(200_000)
    chosen, chances, rests = choose(tree, point, (0, 0, 0), numbers)
    expected = probabilities(tree, point)
    assert expected.sum() == pytest.approx(1, abs=1e-4)
    assert chances == pytest.approx(expected[chosen], rel=1e-5)
    hits = np.bincount(chosen, minlength=count)
    common = expected * len(numbers) > 5
    if common.sum() > 1:
        cells = np.append(hits[common], hits[~common].sum())
        wanted = np.append(expected[common], expected[~common].sum()) / expected.sum() * len(numbers)
        kept = wanted > 0
        assert stats.chisquare(cells[kept], wanted[kept] * cells.sum() / wanted.sum()).pvalue > SIGNIFICANCE
    # What is left of the number is even again.
    assert stats.kstest(rests.astype(np.float64), "uniform").pvalue > SIGNIFICANCE


def test_without_emitters_there_is_nothing_to_choose():
    tree = build_light_tree(small_triangles(0, seed=0))
    assert len(tree.leaf) == 0


@settings(max_examples=60)
@given(st.integers(1, 70), st.integers(0, 10_000), st.booleans(), st.booleans())
def test_what_brings_light_can_be_chosen(count, seed, two_sided, from_one_side):
    emitters = small_triangles(count, seed, two_sided)
    tree = build_light_tree(emitters)
    rng = np.random.default_rng(seed + 1)
    for _ in range(4):
        point, normal = rng.uniform(-2, 12, 3), rng.normal(size=3)
        normal = normal / np.linalg.norm(normal) if from_one_side else np.zeros(3)
        brings = contributions(emitters, point, normal)
        chance = probabilities(tree, point, normal)
        assert (chance[brings > 1e-9 * emitters.power] > 0).all()
        assert chance.sum() <= 1 + 1e-4


def test_a_spot_that_looks_away_is_not_chosen_and_one_that_looks_here_is():
    axis = np.array([[0, 0, -1.0], [0, 0, 1.0]])
    low = np.array([[0, 0, 5.0], [1, 0, 5.0]])
    falloff = np.full(2, np.radians(20))
    tree = build_light_tree(Emitters(low, low, axis, np.zeros(2), falloff, np.zeros(2, bool), np.ones(2)))
    assert probabilities(tree, (0.1, 0, 0)) == pytest.approx([1, 0])


def test_of_a_thousand_lights_the_one_that_matters_is_found():
    emitters = small_triangles(1000, seed=3)
    at = (emitters.low + emitters.high)[17] / 2
    point = at + 0.01 * emitters.axis[17]
    brings = contributions(emitters, point)
    assert brings[17] > 0.9 * brings.sum()
    assert relative_error(brings, probabilities(build_light_tree(emitters), point)) < 1


def lamps_of_a_hall(count: int) -> Emitters:
    """Lamps that look down from the ceiling of a hall of 100 m × 100 m, 4 m high, of very different powers."""
    rng = np.random.default_rng(9)
    center = np.column_stack([rng.uniform(0, 100, (count, 2)), np.full(count, 4.0)])
    lamps = small_triangles(count, seed=9, two_sided=False)
    return lamps._replace(low=center - 1e-3, high=center + 1e-3, axis=np.tile((0, 0, -1.0), (count, 1)))


@pytest.mark.parametrize(
    ("count", "gain"), [(10, 1.1), (100, 3), (1000, 6), pytest.param(100_000, 6, marks=pytest.mark.slow)]
)
def test_the_tree_errs_less_than_a_choice_by_power_or_by_chance(count, gain):
    """By how much: `pytest -s` prints it. Medians over points on the floor."""
    emitters = lamps_of_a_hall(count)
    tree = build_light_tree(emitters)
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(25):
        point, normal = (*rng.uniform(10, 90, 2), 0.0), (0, 0, 1.0)
        brings = contributions(emitters, point, normal)
        ways = (
            probabilities(tree, point, normal),
            emitters.power / emitters.power.sum(),
            np.full(count, 1 / count),
        )
        errors.append([relative_error(brings, chance) for chance in ways])
    by_tree, by_power, by_chance = np.median(errors, axis=0)
    print(f"{count} lamps: relative error {by_tree:.2f} by tree, {by_power:.2f} by power, {by_chance:.2f} by chance")
    assert by_tree * gain < min(by_power, by_chance)
