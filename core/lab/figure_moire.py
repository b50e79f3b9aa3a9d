"""Moiré and its cure: the far checks with regular points, which make patterns of them, and irregular ones: noise."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from ..scene import Scene
from . import scenes
from .figure_plates import GAP, HIGHLIGHT, PANEL, Panel, Plate, picture_panel
from .figure_shots import Reference, Studio, letters, regularity, regularity_of_noise
from .tone import display

SAMPLERS = ("regular", "jittered", "multi_jittered")
COUNTS = (1, 4, 16, 64)
RENDERS = len(SAMPLERS) * len(COUNTS)


def make(studio: Studio, scene: Scene, reference: Reference) -> Plate:
    """The figure, of the checkerboard `scene` whose converged picture is `reference`."""
    window = band(scene.camera.resolution)
    truth = reference.cut(window)
    rows, numbers = [], []
    marks = iter(letters(RENDERS))
    for count in COUNTS:
        row = []
        for name in SAMPLERS:
            shot, mark = studio.shoot(scene, name, count), next(marks)
            picture = shot.picture[window]
            judged = truth.judge(picture) | {"pattern": regularity(picture - truth.picture)}
            stated = f"RMSE {judged['rmse']:.4f}, pattern {judged['pattern']:.3f}"
            row.append(picture_panel(picture, f"{mark} {shot.label}, {shot.samples} per pixel", stated))
            numbers.append({"part": mark} | shot.numbers() | judged)
        rows.append(row)
    noise = regularity_of_noise(truth.picture.shape[1])
    first, last = numbers[: len(SAMPLERS)], numbers[-len(SAMPLERS) :]
    caption = (
        "Moiré, its cure, and what the cure costs. Regular points make waves of the far checks; more of them make the "
        "waves fainter and push them towards the horizon. Irregular points make noise instead: multi-jittered "
        f"ones err with one sample per pixel by {first[2]['rmse']:.3f} (regular {first[0]['rmse']:.3f}), with "
        f"{COUNTS[-1]} by {last[2]['rmse']:.3f} (regular {last[0]['rmse']:.3f}). Pattern: the share of the error's "
        f"energy that lies in the strongest frequency of its row (Fisher's g); white noise has {noise:.3f}. "
        f"{truth.sentence()} The bars show the cause: a pair of checks nearly as long as a pixel, met at equal steps, "
        "is seen as a slow wave."
    )
    numbers = {"panels": numbers, "pattern_of_white_noise": noise, "reference": truth.numbers()}
    sketch = Panel(len(SAMPLERS) * (PANEL + GAP) - GAP, 260, (), partial(_draw_beat, seed=studio.seed), framed=False)
    return Plate("moire", [*rows, [sketch]], caption, numbers)


def band(resolution: tuple[int, int]) -> tuple[slice, slice]:
    """Rows and columns of the far checks: a sixth of the picture's height below the horizon, the middle half across."""
    width, height = resolution
    top = min(math.ceil(scenes.horizon(resolution)), height)
    return np.s_[max(0, top - height // 6) : top, width // 4 : width // 4 + width // 2]


#: The sketch: pixels in a row, and the width of a check, so that two checks are nearly a pixel.
PIXELS, CHECK = 48, 12 / 25


def _draw_beat(axes: Axes, seed: int) -> None:
    """A row of checks, and what one ray per pixel makes of it, through the pixels' centres and at random places."""
    checks = np.arange(0, PIXELS + CHECK, CHECK).clip(max=PIXELS)
    pixels = np.arange(PIXELS + 1)
    centers = pixels[:-1] + 0.5
    anywhere = pixels[:-1] + np.random.default_rng(seed).random(PIXELS)
    for row, rays, name in ((4, centers, "rays through the centres"), (2, anywhere, "rays at random places")):
        _draw_strip(axes, row, checks, _check(checks[:-1] + CHECK / 2), name)
        axes.plot(rays, np.full(PIXELS, row), "o", color=HIGHLIGHT, markersize=2.4, markeredgewidth=0)
        _draw_strip(axes, row - 1, pixels, _check(rays), "what they see")
    _draw_strip(axes, 0, pixels, _mean_of_checks(pixels), "what is right")
    axes.set(xlim=(-12, PIXELS), ylim=(-0.5, 4.5))


def _draw_strip(axes: Axes, row: int, edges: np.ndarray, light: np.ndarray, name: str) -> None:
    """Bars between `edges` whose radiance lies at the share `light` of the way from DARK to LIGHT."""
    radiance = scenes.DARK + (scenes.LIGHT - scenes.DARK) * light
    colors = display(np.repeat(radiance[None, :, None], 3, axis=2))[0] / 255
    axes.bar(edges[:-1], 0.72, np.diff(edges), row - 0.36, align="edge", color=colors, linewidth=0, antialiased=False)
    axes.text(-0.4, row, name, size=6.5, ha="right", va="center")


def _check(x: np.ndarray) -> np.ndarray:
    return (np.floor(x / CHECK) % 2 == 0).astype(float)


def _mean_of_checks(borders: np.ndarray) -> np.ndarray:
    """The mean of `_check` between neighbouring borders, from its integral."""
    pairs, rest = np.divmod(borders, 2 * CHECK)
    return np.diff(pairs * CHECK + np.minimum(rest, CHECK)) / np.diff(borders)
