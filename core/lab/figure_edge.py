"""Figure 4.1: a sharp edge, what one ray through the centre of each of 7 × 5 pixels makes of it, and what more make."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from . import scenes, style
from .figure_plates import PANEL, Panel, Plate, picture_panel
from .figure_shots import Studio, letters, rmse
from .scenes import DARK, LIGHT
from .tone import display

RESOLUTION = (7, 5)
#: Samplers and counts of the parts (b), (d), (e), (f); (c) is the closed form.
SHOTS = (("regular", 1), ("regular", 16), ("jittered", 16), ("multi_jittered", 16))
RENDERS = len(SHOTS)


def make(studio: Studio) -> Plate:
    scene, exact = scenes.sharp_edge(RESOLUTION), scenes.edge_coverage(RESOLUTION)
    shots = [studio.shoot(scene, sampler, count) for sampler, count in SHOTS]
    coverages = [coverage(shot.picture) for shot in shots]
    errors = [rmse(measured, exact) for measured in coverages]
    marks = letters(6)
    parts = (marks[1], *marks[3:])
    panels = [
        picture_panel(
            shot.picture,
            f"{mark} {shot.label}, {shot.samples} per pixel",
            f"RMSE of coverage {error:.4f}",
            decorate=_draw_centers if shot.samples == 1 else partial(_write_shares, covered=measured),
        )
        for shot, mark, measured, error in zip(shots, parts, coverages, errors, strict=True)
    ]
    edge = _edge_panel(f"{marks[0]} The edge", "with the centres of 7 × 5 pixels")
    truth = picture_panel(
        _picture(exact),
        f"{marks[2]} The exact coverage",
        "RMSE 0: the closed form",
        decorate=partial(_write_shares, covered=exact),
    )
    numbers = [
        {"part": mark} | shot.numbers() | {"rmse_of_coverage": error}
        for mark, shot, error in zip(parts, shots, errors, strict=True)
    ]
    caption = (
        "Figure 4.1. A sharp edge (a), ray traced at 7 × 5 pixels with rays through the dots (b): steps, for a ray "
        "either hits or misses. The right grey of a pixel is the share of it that the dark side covers, written on the "
        "pixels that the edge passes (c). Sixteen rays in each pixel come close to it (d–f)."
    )
    return Plate("figure_4_1", [[edge, panels[0], truth], panels[1:]], caption, {"panels": numbers})


def coverage(picture: np.ndarray) -> np.ndarray:
    """The share of each pixel, (h, w), that a picture of `scenes.sharp_edge` says is dark."""
    return (LIGHT - picture[..., 0]) / (LIGHT - DARK)


def _picture(covered: np.ndarray) -> np.ndarray:
    return np.repeat((LIGHT + (DARK - LIGHT) * covered)[..., None], 3, axis=2)


def _edge_panel(*lines: str) -> Panel:
    """The scene itself, as lines and areas, with the pixels' borders and centres."""
    columns, rows = RESOLUTION
    scale = PANEL // columns
    light, dark = display(_picture(np.array([[0.0, 1.0]])))[0] / 255

    def draw(axes: Axes) -> None:
        lean = rows / 2 * math.tan(scenes.EDGE_ANGLE)
        axes.fill_between((0, columns), 0, rows, color=light, linewidth=0)
        axes.fill(
            (columns / 2 - lean, columns, columns, columns / 2 + lean), (0, 0, rows, rows), color=dark, linewidth=0
        )
        axes.vlines(np.arange(1, columns), 0, rows, color=style.FAINT, linewidth=0.4)
        axes.hlines(np.arange(1, rows), 0, columns, color=style.FAINT, linewidth=0.4)
        _draw_centers(axes)

    return Panel(columns * scale, rows * scale, lines, draw)


def _draw_centers(axes: Axes) -> None:
    columns, rows = RESOLUTION
    x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    axes.plot(x.ravel(), y.ravel(), "o", color="black", markersize=3.6, markeredgecolor="white", markeredgewidth=0.6)
    axes.set(xlim=(0, columns), ylim=(0, rows))


def _write_shares(axes: Axes, covered: np.ndarray) -> None:
    """Write the coverage on the pixels that the edge passes."""
    exact = scenes.edge_coverage(RESOLUTION)
    for j, i in np.argwhere((exact > 0) & (exact < 1)):
        # The one whose contrast is the higher: they are even at a luminance of 0.18.
        ink = "white" if LIGHT + (DARK - LIGHT) * covered[j, i] < 0.18 else "black"
        axes.text(i + 0.5, j + 0.5, f"{covered[j, i]:.2f}", size=5.5, color=ink, ha="center", va="center")
