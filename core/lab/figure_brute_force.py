"""Brute force against sampling at equal cost: sixteen times the pixels with one sample, or sixteen samples per pixel.

A picture of more pixels, seen from so far that the eye no longer tells them apart, is its own average: and the average
of 4 × 4 pixels with a ray through the centre of each is nothing but regular sampling with 16 points.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from . import scenes
from .figure_plates import HIGHLIGHT, Plate, picture_panel
from .figure_shots import NBSP, Reference, Shot, Studio, letters, shrink

SAMPLER = "multi_jittered"
#: Pixels of the finer picture per pixel of the coarser one, each way.
FACTOR = 4
#: The coarse picture's share of the figures' resolution, and how many times its most telling part is magnified.
SHARE, MAGNIFIED = 3 / 8, 4
REFERENCE_SAMPLES = 128
RENDERS = 4


def make(studio: Studio, resolution: tuple[int, int]) -> Plate:
    coarse = tuple(max(MAGNIFIED, round(side * SHARE / MAGNIFIED) * MAGNIFIED) for side in resolution)
    fine = tuple(side * FACTOR for side in coarse)
    brute = studio.shoot(scenes.checkerboard(fine), "regular", 1)
    sampled = studio.shoot(scenes.checkerboard(coarse), SAMPLER, FACTOR**2)
    assert sampled.total == brute.total, "the cost is not the same"
    return _plate(brute, sampled, studio.reference(scenes.checkerboard(fine), REFERENCE_SAMPLES))


def _plate(brute: Shot, sampled: Shot, fine: Reference) -> Plate:
    coarse = fine.shrunk(FACTOR)
    parts = (
        (brute, brute.picture, "Brute force, 1 per pixel", fine, FACTOR),
        (brute, shrink(brute.picture, FACTOR), "Brute force, from afar", coarse, 1),
        (sampled, sampled.picture, f"{sampled.label}, {sampled.samples} per pixel", coarse, 1),
    )
    whole, magnified, numbers = [], [], []
    for mark, (shot, picture, title, truth, factor) in zip(letters(3), parts, strict=True):
        size = f"{picture.shape[1]} × {picture.shape[0]}"
        judged = truth.judge(picture)
        window = _magnified_window(sampled.picture.shape[:2], factor)
        lines = (f"{mark} {title}", f"{size} pixels, RMSE {judged['rmse']:.4f}")
        whole.append(picture_panel(picture, *lines, decorate=partial(_outline, window=window)))
        magnified.append(picture_panel(picture[window], f"{mark} {MAGNIFIED} times magnified"))
        numbers.append({"part": mark} | shot.numbers() | {"shown": size.replace(" × ", "x")} | judged)
    rays = f"{brute.total:,}".replace(",", NBSP)
    caption = (
        f"Brute force against sampling: {rays} rays each. More pixels (a) show the same steps and patterns, only "
        f"finer. Seen from so far that the eye averages {FACTOR}{NBSP}×{NBSP}{FACTOR} of them (b), they are regular "
        f"sampling with {FACTOR**2} points. As many rays, spread over fewer pixels by a better sampler (c), make "
        f"{numbers[2]['rmse'] / numbers[1]['rmse']:.2f} times the error. {coarse.sentence()} (a) is judged by the "
        f"same reference before its pixels are averaged, which errs by {fine.error:.2g}."
    )
    references = {"(a)": fine.numbers(), "(b) and (c)": coarse.numbers()}
    return Plate("brute_force", [whole, magnified], caption, {"panels": numbers, "references": references})


def _magnified_window(shape: tuple[int, int], factor: int) -> tuple[slice, slice]:
    """Rows and columns of the part below the horizon that is shown magnified.

    `shape` is the coarse picture's; the result is for one with `factor` times more pixels each way.
    """
    height, width = (side // MAGNIFIED for side in shape)
    bottom = max(0, math.ceil(scenes.horizon(shape[::-1])) - height)
    bottom = min(bottom, shape[0] - height)
    left = (shape[1] - width) // 2
    return np.s_[bottom * factor : (bottom + height) * factor, left * factor : (left + width) * factor]


def _outline(axes: Axes, window: tuple[slice, slice]) -> None:
    rows, columns = window
    size = (columns.stop - columns.start, rows.stop - rows.start)
    axes.add_patch(Rectangle((columns.start, rows.start), *size, fill=False, edgecolor=HIGHLIGHT, linewidth=0.9))
