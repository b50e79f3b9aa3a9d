"""Counts of samples: odd ones, huge ones, and sets that are cut short."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy import stats

from core import SAMPLERS, Instance, RenderSettings, Scene, SettingsError, render
from core.domains import make_table, shuffle_sets
from core.lab.integrands import INTEGRANDS
from core.lab.scenes import DARK, EDGE_ANGLE, LIGHT, edge_coverage, penumbra, sharp_edge
from core.preparation import prepare
from core.progressive import Progressive
from tests.scenes import emitter, picture, quad, rotation

from .case import Record, case

#: One, two, primes, and other counts that are no squares.
ODD = (1, 2, 3, 5, 7, 13, 31, 97, 10, 48, 200)
HUGE = (65_536, 65_537, 1 << 20)
#: Those whose sets are all alike: there is no chance in them, and no mean over sets.
ALIKE = ("regular", "hammersley")
CHANCE = tuple(name for name in SAMPLERS if name not in ALIKE)
#: What a test of many z-scores may call chance, all together.
SIGNIFICANCE = 1e-3


def largest_by_chance(tests: int) -> float:
    """The |z| that the largest of `tests` independent normal numbers exceeds with a chance of SIGNIFICANCE (Šidák)."""
    return float(stats.norm.isf((1 - (1 - SIGNIFICANCE) ** (1 / tests)) / 2))


def smooth(points: np.ndarray) -> np.ndarray:
    """An integrand of mean (e - 1)(1 - cos 3)/3, without symmetries of the square."""
    x, y = points[..., 0].astype(float), points[..., 1].astype(float)
    return np.exp(x) * np.sin(3 * y)


SMOOTH_MEAN = (math.e - 1) * (1 - math.cos(3)) / 3


@case(
    "1, 2, primes, and counts that are no squares",
    happens="Points are missing, pile up in a corner, or lie outside of the square; some counts give another mean.",
    why="Textbook code fills a ⌊√n⌋ × ⌊√n⌋ grid and leaves the rest of the n points at (0, 0), or reads past its set.",
    rooks="Makes exactly n points, or says which count above n it makes; every place is equally likely in each sampler "
    "but Regular and Hammersley, which have no chance in them.",
)
def odd_counts(record: Record) -> None:
    """The mean over 2,000 sets is the integral, where sets differ; where they do not, all n points are there."""
    outside = miscounted = 0
    largest = 0.0
    for name, sampler in SAMPLERS.items():
        made = [sampler.actual_count(count) for count in ODD]
        rounded = [f"{count} for {asked}" for asked, count in zip(ODD, made, strict=True) if count != asked]
        record.samplers[name] = f"makes {', '.join(rounded)}" if rounded else "makes each of them"
        for asked, count in zip(ODD, made, strict=True):
            points = sampler(2000 if name in CHANCE else 2, count, np.random.default_rng(asked))
            outside += int((~((points >= 0) & (points < 1))).sum())
            miscounted += count < asked or points.shape[1] != count or len(np.unique(points[0], axis=0)) != count
            if name in CHANCE:
                means = smooth(points).mean(axis=1)
                largest = max(largest, abs(means.mean() - SMOOTH_MEAN) / (means.std() / math.sqrt(len(means))))
    record.claim("coordinates outside of [0, 1)", outside, at_most=0)
    record.claim("sets with a point too few or twice", miscounted, at_most=0)
    record.claim("largest |z| of a mean", largest, at_most=largest_by_chance(len(CHANCE) * len(ODD)))


@case(
    "65,536 points and more",
    happens="Points reach 1.0 or fall into a neighbour's stratum; counters overflow; tables outgrow the memory.",
    why="float32 has 24 digits: (j + u)/n rounds up. 2²⁰ points are 8 MB, for each set of each dimension.",
    rooks="Keeps each point inside of its stratum; counts in 64 bits; makes large tables a part at a time, and refuses "
    "those above 2 GB in one line.",
)
def huge_counts(record: Record) -> None:
    """In each axis one point per stratum of 1/n, where a sampler promises that, and all inside of the square."""
    outside = shared = missing = 0
    for name, sampler in SAMPLERS.items():
        record.samplers[name] = "makes " + ", ".join(f"{sampler.actual_count(asked):,}" for asked in HUGE)
        for asked in HUGE:
            count = sampler.actual_count(asked)
            points = sampler(1, count, np.random.default_rng(1))[0]
            missing += abs(count - len(points))
            outside += int((~((points >= 0) & (points < 1))).sum())
            is_net = count & (count - 1) == 0
            axes = {"hammersley": range(1 + is_net), "sobol_owen": range(2 * is_net)}.get(name, range(2))
            if sampler.criteria.even_1d:
                for axis in axes:
                    strata = np.floor(points[:, axis].astype(float) * count).astype(int)
                    shared += count - len(np.unique(strata))
    record.claim("points more or less than the reported count", missing, at_most=0)
    record.claim("coordinates outside of [0, 1)", outside, at_most=0)
    record.claim("strata of 1/n without a point", shared, at_most=0)
    refusal = ""
    try:
        make_table("light", RenderSettings(samples=1 << 20), 640, 1)
    except SettingsError as error:
        refusal = str(error)
    record.claim("lines that refuse 2²⁰ samples of 640 lights", len(refusal.splitlines()), at_least=1, at_most=1)


@case(
    "The mean of pictures with 65,536 samples per pixel",
    happens="A picture of enough samples for anything is off by a little, always to the same side.",
    why="Points that are rounded into the next stratum or to 1.0, sums in float32, and sets that are not even on "
    "average leave an error that no seed averages away.",
    rooks="Adds up in float64; every place is equally likely in each sampler but Regular and Hammersley, which are the "
    "same with every seed. With so many samples their own error is as small as the others' noise.",
    is_slow=True,
)
def huge_means(record: Record) -> None:
    """The edge of a glowing square over seeds: each pixel's error, over the standard error of its mean.

    The square is small, 2 m: half-way between its corners an edge is off by what float32 rounds there.
    """
    seeds, largest, alike = 16, 0.0, 0.0
    square = Instance(quad((1, 0, -1), (2, 0, 0), (0, 2, 0)), rotation(2, -EDGE_ANGLE), (emitter(),))
    scene = Scene(sharp_edge((7, 5)).camera, (square,))
    truth = edge_coverage((7, 5))
    crossed = (truth > 1e-3) & (truth < 1 - 1e-3)
    for name in SAMPLERS:
        of_seeds = [picture(scene, samples=1 << 16, sampler=name, seed=seed, threads=0) for seed in range(seeds)]
        found = np.array(of_seeds)[:, crossed]
        bias, error = found.mean(axis=0) - truth[crossed], found.std(axis=0, ddof=1) / math.sqrt(seeds)
        record.samplers[name] = f"largest error of the mean over {seeds} seeds {np.abs(bias).max():.1g}"
        if name in CHANCE:
            largest = max(largest, float(np.abs(bias / error).max()))
        else:
            alike = max(alike, float(np.abs(bias).max()))
    tests = len(CHANCE) * int(crossed.sum())
    bound = float(stats.t.isf((1 - (1 - SIGNIFICANCE) ** (1 / tests)) / 2, seeds - 1))
    record.claim("largest |t| of a pixel's mean", largest, at_most=bound)
    # Of n points in rows of √n an edge crosses one in each row, and errs by less than that one.
    record.claim("error of Regular and Hammersley", alike, at_most=1 / math.sqrt(1 << 16))


@case(
    "Pictures with 65,536 and with 2²⁰ samples per pixel",
    happens="Sums stop growing; counters overflow; points of one pixel repeat.",
    why="1 added to 2²⁴ in float32 is lost; 2²⁰ samples in a tile of 64 × 64 pixels are 2³², more than 32 bits count.",
    rooks="Adds up in float64 and counts in 64 bits. Pixels share the 16 sets of so large a table.",
    is_slow=True,
)
def huge_pictures(record: Record) -> None:
    """A sharp edge: no pixel errs by more than 4.5 standard deviations of random points, whatever the sampler."""
    truth = LIGHT + (DARK - LIGHT) * edge_coverage((7, 5))
    for name in SAMPLERS:
        error = _edge(name, 1 << 16) - truth
        record.samplers[name] = f"largest error {np.abs(error).max():.1g}"
        record.claim(f"largest error of {name} at 65,536", np.abs(error).max(), at_most=4.5 * _deviation(1 << 16))
    error = _edge("random", 1 << 20) - truth
    record.claim("largest error of random at 2²⁰", np.abs(error).max(), at_most=4.5 * _deviation(1 << 20))


def _edge(sampler: str, samples: int) -> np.ndarray:
    settings = RenderSettings(samples=samples, sampler=sampler, seed=3)
    return render(sharp_edge((7, 5)), settings).passes["Combined"][..., 0].astype(float)


def _deviation(samples: int) -> float:
    """The standard deviation of a pixel half dark and half light, of independent samples."""
    return (LIGHT - DARK) / 2 / math.sqrt(samples)


@case(
    "Sets that are cut short",
    happens="Half of a set in the textbook's order lies in half of the pixel: the picture is wrong until it is done.",
    why="Most sets are good as a whole only. In raster order the first half of jittered points is the lower half.",
    rooks="Puts each set into a random order: at any time the picture is unbiased, and no noisier than with Random. "
    "With k of n samples the mean square error is (n − k)/(n − 1) of Random's, and what the whole set leaves. That is "
    "so of Sobol's sequence, too, though its own order is progressive. Wait for the last pass, or take fewer samples.",
)
def half_sets(record: Record) -> None:
    """The covered share of a pixel that a disk's edge crosses, by the first 128 of 256 points."""
    trials, count, half = 1500, 256, 128
    rng = np.random.default_rng(4)
    disk = INTEGRANDS["disk"]
    places = disk.place(trials, rng)
    integral = disk.integral(places)[:, None]
    raster = SAMPLERS["jittered"](trials, count, rng)[:, :half]
    random = _root_mean_square(disk.value(SAMPLERS["random"](trials, half, rng), places) - integral)
    in_raster_order = _root_mean_square(disk.value(raster, places) - integral) / random
    record.claim("error of jittered in raster order over random's", in_raster_order, at_least=2)
    off = []
    for name, sampler in SAMPLERS.items():
        points = shuffle_sets(sampler(trials, count, rng), rng)
        errors = disk.value(points, places) - integral
        found = _root_mean_square(errors[:, :half])
        # Of points in random order any two have the same covariance: that of the whole set tells that of its parts.
        square, whole = (errors**2).mean(), _root_mean_square(errors) ** 2
        covariance = (count * whole - square) / (count - 1)
        expected = math.sqrt(square / half + (half - 1) / half * covariance)
        off.append(abs(found / expected - 1))
        record.samplers[name] = f"{found / random:.2f} of Random's error at half time"
    # A root mean square of 1500 normal numbers has a standard error of 1.8 %.
    record.claim("largest relative distance from the expected error", max(off), at_most=5 / math.sqrt(2 * trials))


def _root_mean_square(errors: np.ndarray) -> float:
    """The root mean square, over trials, of the means of (trials, n) errors."""
    return float(np.sqrt((errors.mean(axis=1) ** 2).mean()))


@case(
    "Stopping early",
    happens="A picture stopped with Escape mixes pixels of few and of many samples, or is biased by half-used sets.",
    why="See above: parts of sets.",
    rooks="A render stopped keeps its finished tiles, which are final, and leaves the others empty. The viewport's "
    "passes jump through each set: what is seen after any pass is right on average.",
    is_slow=True,
)
def stopped_pictures(record: Record) -> None:
    """Over seeds, the picture after each pass differs from the one after the last by nothing but chance."""
    seeds = 100
    with ThreadPoolExecutor(1) as pool:
        for name in SAMPLERS:
            pictures = np.array([_all_passes(name, seed, pool) for seed in range(seeds)])
            differences = (pictures[:, :-1] - pictures[:, -1:]).reshape(seeds, -1)
            error = differences.std(axis=0, ddof=1) / math.sqrt(seeds)
            noisy = error > error.max() / 10  # where a lamp is hidden once in a hundred times t is not Student's
            t = np.abs(differences.mean(axis=0)[noisy] / error[noisy])
            bound = float(stats.t.isf((1 - (1 - SIGNIFICANCE / len(SAMPLERS)) ** (1 / len(t))) / 2, seeds - 1))
            record.samplers[name] = f"largest |t| {t.max():.2f}"
            record.claim(f"largest |t| of a pixel after any pass, {name}", float(t.max()), at_most=bound)
    kept, final = _stopped_and_final()
    done = kept[..., 3] > 0
    record.claim("pixels finished when stopped", int(done.sum()), at_least=1, at_most=done.size - 1)
    record.claim("finished pixels that are not final", int((kept != final)[done].any(axis=-1).sum()), at_most=0)
    record.claim("unfinished pixels that are not empty", int((kept[~done] != 0).any(axis=-1).sum()), at_most=0)
    record.show("stopped", kept[..., :3])
    record.show("final", final[..., :3])


def _all_passes(sampler: str, seed: int, pool: ThreadPoolExecutor) -> np.ndarray:
    """A soft shadow after each of its passes: (passes, height, width)."""
    scene = penumbra((8, 8))
    prepared = prepare(scene, RenderSettings(samples=4, sampler=sampler, seed=seed, threads=1))
    picture, shown = Progressive(prepared, scene.camera), []
    while picture.done < picture.total:
        picture.add_pass(pool, np.zeros(1, np.uint8))
        shown.append(picture.pixels()[..., 0].astype(float))
    prepared.let_go()
    return np.array(shown)


def _stopped_and_final() -> tuple[np.ndarray, np.ndarray]:
    """A soft shadow whose render is stopped after its first tiles, and the finished one: Combined, (h, w, 4)."""
    scene, settings = penumbra((128, 128)), RenderSettings(samples=16, tile_size=32, threads=1)
    tiles = []
    stopped = render(scene, settings, tiles.append, lambda: len(tiles) >= 4)
    return stopped.passes["Combined"], render(scene, settings).passes["Combined"]
