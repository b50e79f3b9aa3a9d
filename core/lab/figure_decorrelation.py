"""Why domains must be decorrelated: what happens when sample i of the pixel always meets sample i of the light.

The integrand is the simplest product of two domains, a brightness that grows across the pixel times a light that is
seen better from one side: f(p, l) = x_p (1 + x_l) / 2, whose mean is 3/8. Each domain by itself has a good set of
points; what is wrong in all wirings but the last is which point of the one meets which of the other.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ..domains import shuffle_sets
from ..samplers import SAMPLERS
from . import style

TRUE = 3 / 8
#: The error of a wiring that makes x_p = x_l: ∫ x (1 + x) / 2 dx - 3/8.
FULL_BIAS = 1 / 24
COUNTS = (4, 16, 64, 256, 1024)
TRIALS = 2000
YTICKS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05)

#: Of each wiring at each of COUNTS: samples, bias with its standard error, and root mean square error.
Results = dict[str, list[dict[str, float]]]
Wiring = Callable[[int, int, np.random.Generator], tuple[np.ndarray, np.ndarray]]


def one_set(trials: int, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The same multi-jittered set for both: (trials, n, 2) points of the pixel, and of the light."""
    points = SAMPLERS["multi_jittered"](trials, count, rng)
    return points, points


def raster_order(trials: int, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two independent jittered sets, both cell by cell from the lower left."""
    return SAMPLERS["jittered"](trials, count, rng), SAMPLERS["jittered"](trials, count, rng)


def sequence_order(trials: int, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two independently scrambled Sobol sets, both in the sequence's order."""
    return SAMPLERS["sobol_owen"](trials, count, rng), SAMPLERS["sobol_owen"](trials, count, rng)


def shuffled(trials: int, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two independent jittered sets, each in a random order of its own: what Rooks does."""
    pixel, light = raster_order(trials, count, rng)
    return shuffle_sets(pixel, rng), shuffle_sets(light, rng)


WIRINGS: dict[str, Wiring] = {
    "one set for both": one_set,
    "two jittered sets in raster order": raster_order,
    "two Sobol sets in the sequence's order": sequence_order,
    "two jittered sets, shuffled": shuffled,
}
#: Whose colour and marker each wiring has, and its line: the same sampler's wirings differ by that.
LOOKS = {
    "one set for both": ("multi_jittered", "-"),
    "two jittered sets in raster order": ("jittered", "--"),
    "two Sobol sets in the sequence's order": ("sobol_owen", "-."),
    "two jittered sets, shuffled": ("jittered", "-"),
}


def errors(wiring: Wiring, count: int, trials: int, rng: np.random.Generator) -> np.ndarray:
    """The errors of `trials` estimates of `count` samples each."""
    pixel, light = (points[..., 0].astype(np.float64) for points in wiring(trials, count, rng))
    return (pixel * (1 + light) / 2).mean(axis=1) - TRUE


def measure(seed: int = 0, trials: int = TRIALS) -> Results:
    """Measure all wirings: the same seed, the same numbers."""
    rng = np.random.default_rng(seed)
    return {name: [_summary(wiring, count, trials, rng) for count in COUNTS] for name, wiring in WIRINGS.items()}


def _summary(wiring: Wiring, count: int, trials: int, rng: np.random.Generator) -> dict[str, float]:
    e = errors(wiring, count, trials, rng)
    return {
        "samples": count,
        "bias": float(e.mean()),
        "bias_error": float(e.std() / trials**0.5),
        "rmse": float((e**2).mean() ** 0.5),
    }


def draw(results: Results, path: Path, seed: int = 0) -> list[Path]:
    """Draw which points meet in each wiring, 64 of each, and the error of all; returns the files written."""
    with style.drawing():
        figure = style.figure(17, 9.6)
        panels = figure.subplot_mosaic([list("abcd"), list("eeee")], height_ratios=(1, 1.35))
        for axes, (name, wiring) in zip(panels.values(), WIRINGS.items(), strict=False):
            pixel, light = wiring(1, 64, np.random.default_rng(seed))
            axes.scatter(
                pixel[0, :, 0], light[0, :, 0], s=6, color=style.color(LOOKS[name][0]), linewidths=0, clip_on=False
            )
            axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=(0, 1), yticks=(0, 1), xlabel="pixel x")
            axes.set_title(name.replace(" in ", "\nin ").replace(", ", ",\n").replace(" for ", "\nfor "), fontsize=7.5)
        panels["a"].set_ylabel("light x")
        _draw_errors(panels["e"], results)
        return style.save(figure, path)


def _draw_errors(axes: Axes, results: Results) -> None:
    for name, rows in results.items():
        sampler, line = LOOKS[name]
        samples, rmse = ([row[key] for row in rows] for key in ("samples", "rmse"))
        axes.loglog(samples, rmse, line, color=style.color(sampler), marker=style.marker(sampler), label=name)
    axes.axhline(FULL_BIAS, color=style.FAINT, linewidth=0.8, zorder=0)
    axes.text(COUNTS[-1], FULL_BIAS * 1.1, "bias 1/24", ha="right", fontsize=7)
    axes.set(xlabel="samples", ylabel="root mean square error", xticks=COUNTS, xticklabels=COUNTS)
    axes.set_yticks(YTICKS, YTICKS)
    axes.minorticks_off()
    axes.legend(loc="lower left")
