"""Correlation: domains, pixels and frames that share their points."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy import stats

from core import SAMPLERS, AreaLight, Instance, RenderSettings, Scene, render
from core.blocks import BlockGrid
from core.domains import Run, make_table, set_of_pixel
from core.film import develop, new_tile_sums
from core.integrator import Points, render_blocks
from core.lab.figure_decorrelation import FULL_BIAS, WIRINGS, errors
from core.lab.scenes import penumbra
from core.preparation import prepare
from tests.scenes import WHITE, camera_down, floor

from .case import Record, case
from .counts import ALIKE, CHANCE, SIGNIFICANCE, largest_by_chance, smooth


@case(
    "Domains that share a set",
    happens="A picture that is wrong for ever, however many samples it has: shadows at the wrong place, a wrong mean.",
    why="If sample i of the pixel always meets sample i of the lamp, only the diagonal of all combinations is seen. "
    "Two different sets in the same order are as bad: they share their strata.",
    rooks="Gives each domain, lamp and bounce a set of its own, in a random order of its own.",
)
def domains_share_a_set(record: Record) -> None:
    """x of the pixel × (1 + x of the light)/2 has the mean 3/8; where both are one set, 3/8 + 1/24."""
    for name, wiring in WIRINGS.items():
        found = errors(wiring, 64, 2000, np.random.default_rng(5))
        bias, error = float(found.mean()), float(found.std() / math.sqrt(len(found)))
        if name in ("one set for both", "two jittered sets in raster order"):
            record.claim(f"bias, {name}", bias, at_least=FULL_BIAS * 63 / 64 - 4 * error, at_most=FULL_BIAS + 4 * error)
    largest = 0.0
    for name in SAMPLERS:
        means = np.array([_coupled_mean(name, seed) for seed in range(40)])
        # The mean of Hammersley's first coordinates i/n is ½ - 1/2n.
        mean = 0.5 - (1 / 128 if name == "hammersley" else 0)
        bias, error = means.mean() - mean * (1 + mean) / 2, means.std(ddof=1) / math.sqrt(len(means))
        record.samplers[name] = f"bias {bias:+.5f} ± {error:.5f}, with sets of their own"
        largest = max(largest, float(abs(bias) / error))
    bound = float(stats.t.isf(1e-3 / 2 / len(SAMPLERS), 39))
    record.claim("largest |t| of Rooks' tables' bias", largest, at_most=bound)
    scene = penumbra((12, 12))
    truth = _picture(scene, "sobol_owen", 4096, seed=99)
    shared, own = (_mean_picture(scene, wiring, samples=256, seeds=8) for wiring in (_share, _keep))
    ratio = float(np.abs(shared - truth).mean() / np.abs(own - truth).mean())
    record.claim("error of a shadow, one set for both, over that of sets of their own", ratio, at_least=4)
    record.show("right", _enlarged(truth / truth.max()))
    record.show("error × 8, one set for both", _enlarged(0.3 + 8 * (shared - truth) / truth.max()))
    record.show("error × 8, sets of their own", _enlarged(0.3 + 8 * (own - truth) / truth.max()))


def _coupled_mean(name: str, seed: int) -> float:
    settings = RenderSettings(samples=64, sampler=name, seed=seed)
    pixel, light = make_table("pixel", settings, 1, 64), make_table("light", settings, 3, 64)
    chosen = [(set_of_pixel(pixel, x, y, 0), set_of_pixel(light, x, y, 2)) for x in range(8) for y in range(8)]
    p, q = np.array(chosen).T
    return float((pixel.points[0, p].astype(float) * (1 + light.points[0, q].astype(float)) / 2).mean())


def _share(points: Points) -> Points:
    """Points whose light is sampled with the pixel's own points."""
    return points._replace(light=points.pixel)


def _keep(points: Points) -> Points:
    return points


def _one_set(points: Points) -> Points:
    """Points of which each domain has one set for all pixels."""
    return Points(*(table._replace(points=table.points[:, :1].copy(), digits=0) for table in points))


def _textbook_sets(points: Points) -> Points:
    """Points of which each domain has TEXTBOOK_SETS sets, which pixels take at random, each as often."""
    # Pixels choose among a power of two; sets that follow each other in a sequence would cancel each other's errors.
    kept = np.resize(np.random.default_rng(0).permutation(1024)[:TEXTBOOK_SETS], 1024)
    return Points(*(table._replace(points=table.points[:, kept % table.points.shape[1]], digits=0) for table in points))


def _wired(
    scene: Scene, wiring: Callable[[Points], Points], seed: int, sampler: str = "multi_jittered", samples: int = 16
) -> np.ndarray:
    """A picture of `scene` with its points wired in another way than Rooks does: (height, width)."""
    prepared = prepare(scene, RenderSettings(samples=samples, sampler=sampler, seed=seed, threads=1))
    frame = prepared.frame._replace(points=wiring(prepared.frame.points))
    grid = BlockGrid((0, 0, *scene.camera.resolution))
    sums, run = new_tile_sums(grid.pixels), Run(0, prepared.settings.sample_count)
    render_blocks(*prepared.workspace(), frame, grid.blocks, run, sums, np.zeros(1, np.uint8))
    prepared.let_go()
    return grid.raster(develop(sums, run.count)["Combined"])[..., 0].astype(float)


def _mean_picture(scene: Scene, wiring: Callable[[Points], Points], samples: int, seeds: int) -> np.ndarray:
    return np.mean([_wired(scene, wiring, seed, samples=samples) for seed in range(seeds)], axis=0)


def _picture(scene: Scene, sampler: str, samples: int, seed: int) -> np.ndarray:
    settings = RenderSettings(samples=samples, sampler=sampler, seed=seed)
    return render(scene, settings).passes["Combined"][..., 0].astype(float)


def _enlarged(picture: np.ndarray, factor: int = 10) -> np.ndarray:
    """A grey picture, (height, width), with larger pixels and three channels."""
    return np.repeat(np.kron(picture, np.ones((factor, factor)))[..., None], 3, axis=2)


#: How many sets Suffern's samplers make (2007, chapter 5).
TEXTBOOK_SETS = 83
SIDE = 48  # pixels of the soft shadow whose errors are looked at


@case(
    "Pixels that share a set",
    happens="Bands and steps in place of grain, which the eye finds at once.",
    why="With the same points neighbours make the same error, and it changes slowly over the picture: it is a pattern.",
    rooks="Takes a set for each pixel from thousands by a hash. Regular and Hammersley have but one set to take.",
    instead="Any sampler with chance in it; Multi-Jittered of the six",
)
def pixels_share_a_set(record: Record) -> None:
    """The largest peak of the error's periodogram over its mean, which for white noise is exponential."""
    scene, pictures = penumbra((SIDE, SIDE)), {}
    truth = _picture(scene, "sobol_owen", 4096, seed=99)
    for name in SAMPLERS:
        own, one = (_wired(scene, wiring, 7, name) - truth for wiring in (_keep, _one_set))
        pictures[name] = own, one
        record.samplers[name] = f"{_peak(own):.0f} times the mean, {_peak(one):.0f} with one set for all pixels"
    white = math.log(SIDE**2 / 2 * len(CHANCE) / 1e-3)  # exceeded by chance once in a thousand
    record.claim("highest peak with sets of their own", max(_peak(pictures[name][0]) for name in CHANCE), at_most=white)
    shared = min(_peak(pictures[name][1]) for name in SAMPLERS)
    record.claim("lowest peak with one set for all", shared, at_least=3 * white)
    alike = min(_peak(pictures[name][0]) for name in ALIKE)
    record.claim("lower peak of Regular and Hammersley", alike, at_least=3 * white)
    for label, error in (
        ("multi-jittered, sets of their own", pictures["multi_jittered"][0]),
        ("multi-jittered, one set", pictures["multi_jittered"][1]),
        ("Hammersley", pictures["hammersley"][0]),
    ):
        record.show(label, _enlarged(0.2 + error, 3))


def _peak(error: np.ndarray) -> float:
    """The largest of an error picture's periodogram, over the mean of it, but for the frequency 0."""
    power = np.abs(np.fft.fft2(error)).ravel()[1:] ** 2
    return float(power.max() / power.mean())


@case(
    "One set, 83 sets, and thousands",
    happens="The whole picture is too bright or too dark, by another amount with each seed; averages do not help.",
    why="What the pixels share does not average out: of P pixels with S sets the mean has the variance of a pixel × "
    "(1/S + (1 − 1/S)/P). The textbook has 83 sets.",
    rooks="Makes a set for each pixel, up to 2¹⁸ points per table, and never fewer than 16 sets.",
    samplers="Random, of whose sets the variance is known; the next row is about all of them.",
)
def few_sets(record: Record) -> None:
    """The variance of the mean over 1,024 pixels that all have the same integrand, over what it ought to be."""
    trials, pixels, count = 400, 1024, 16
    rng = np.random.default_rng(6)
    variance = float(smooth(SAMPLERS["random"](20_000, count, rng)).mean(axis=1).var())
    for sets in (1, TEXTBOOK_SETS, 1024):
        expected = variance * _noise_of_mean(sets, pixels)
        means = [_mean_of_pixels(sets, pixels, count, rng) for _ in range(trials)]
        # A variance of 400 normal numbers has a standard error of 7 %.
        ratio = float(np.var(means) / expected)
        bound = 5 * math.sqrt(2 / trials)
        what = f"sets: {sets}; noise of the mean {np.std(means):.2g}; its variance over the expected"
        record.claim(what, ratio, at_least=1 - bound, at_most=1 + bound)
    settings = RenderSettings(samples=count, sampler="random")
    sets = make_table("pixel", settings, 1, pixels).points.shape[1]
    record.claim("sets that Rooks makes for them", sets, at_least=pixels)


def _mean_of_pixels(sets: int, pixels: int, count: int, rng: np.random.Generator) -> float:
    """The mean of pixels that each take one of the sets at random."""
    of_sets = smooth(SAMPLERS["random"](sets, count, rng)).mean(axis=1)
    return float(of_sets[rng.integers(sets, size=pixels)].mean())


@case(
    "Pictures from one set, from 83 sets, and from thousands",
    happens="The whole picture is too bright or too dark, by another amount with each seed; averages do not help.",
    why="As above: 83 sets leave a picture of 1,024 pixels with 3.6 times the noise of its mean that it would have if "
    "its pixels shared nothing; one set leaves it with 32 times of it.",
    rooks="Makes a set for each pixel. ZSobol's pixels share a sequence so that their errors cancel.",
    is_slow=True,
)
def few_sets_in_pictures(record: Record) -> None:
    """The noise of the mean of an evenly lit floor, of 1,024 pixels, over 200 seeds.

    ZSobol's sets are pieces of one sequence: their errors are not independent of each other.
    """
    seeds, pixels = 200, 1024
    lamp = AreaLight((0.0, 0.0, 1.5), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    scene = Scene(camera_down(1e-6, (32, 32)), (Instance(floor(0.01), materials=(WHITE,)),), (lamp,))
    ratios = {"1 set and with 83": [], "83 sets and with Rooks' own": []}
    for name in SAMPLERS:
        one, some, own = (
            np.array([_wired(scene, wiring, seed, name).mean() for seed in range(seeds)])
            for wiring in (_one_set, _textbook_sets, _keep)
        )
        noise = [100 * float(means.std(ddof=1) / means.mean()) for means in (one, some, own)]
        record.samplers[name] = "noise of the mean {:.2g} %, {:.2g} %, and {:.2g} % as Rooks does it".format(*noise)
        if name in CHANCE and not SAMPLERS[name].along_curve:
            sets = make_table("light", RenderSettings(samples=16, sampler=name), 1, pixels).points.shape[1]
            ratios["1 set and with 83"].append((noise[0] / noise[1]) ** 2 * _noise_of_mean(TEXTBOOK_SETS, pixels))
            own = _noise_of_mean(sets, pixels) / _noise_of_mean(TEXTBOOK_SETS, pixels)
            ratios["83 sets and with Rooks' own"].append((noise[1] / noise[2]) ** 2 * own)
    for which, found in ratios.items():
        # A ratio of the variances of normal numbers is F-distributed.
        bound = float(stats.f.isf(SIGNIFICANCE / 4 / len(found), seeds - 1, seeds - 1))
        for what, ratio in (("smallest", min(found)), ("largest", max(found))):
            text = f"{what} ratio of the variances with {which}, over the expected"
            record.claim(text, ratio, at_least=1 / bound, at_most=bound)


def _noise_of_mean(sets: int, pixels: int) -> float:
    """The variance of the mean of pixels that each take one of the sets at random, over that of a pixel."""
    return 1 / sets + (1 - 1 / sets) / pixels


@case(
    "Seeds of consecutive frames",
    happens="The noise of an animation stands still, like dirt on the lens, or drifts through the picture.",
    why="Frames with one seed have one error. Seeds that follow each other make related points if they are used as "
    "they are, or added to a state.",
    rooks="Mixes the seed by numpy's SeedSequence: with Animate Seed the errors of two frames have nothing in common. "
    "Those of Regular and Hammersley have no chance in them, and stand still whatever the seed.",
    instead="Animate Seed, and any other sampler than Regular and Hammersley",
)
def frames_that_follow(record: Record) -> None:
    """The correlation of the errors of frames with the seeds k and k + 1."""
    scene = penumbra((SIDE, SIDE))
    truth = _picture(scene, "sobol_owen", 4096, seed=99)
    largest, still = 0.0, 1.0
    for name in SAMPLERS:
        frames = [_wired(scene, _keep, seed, name) - truth for seed in (10, 11, 12, 13)]
        pairs = list(pairwise(frames))
        mean = float(np.mean([_correlation(a, b) for a, b in pairs]))
        record.samplers[name] = f"{mean:+.2f}"
        if name in ALIKE:
            still = min(still, mean)
        else:
            # Of independent errors the sum of products is as large as chance has it for these very errors.
            largest = max(largest, *(abs((a * b).sum()) / math.sqrt((a * a * b * b).sum()) for a, b in pairs))
    record.claim("largest |z| of a correlation", largest, at_most=largest_by_chance(3 * len(CHANCE)))
    record.claim("lower correlation of Regular and Hammersley", still, at_least=0.3)
    again = _wired(scene, _keep, 10) - _wired(scene, _keep, 10)
    record.claim("difference of two frames with one seed", float(np.abs(again).max()), at_most=0)


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float((a * b).sum() / math.sqrt((a * a).sum() * (b * b).sum()))
