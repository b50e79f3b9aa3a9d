"""The sheet of a comparison: reference and chart, then for each sampler its crops and its error maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.gridspec import GridSpecBase
from matplotlib.patches import Rectangle
from matplotlib.ticker import EngFormatter

from ..samplers import SAMPLERS
from . import style
from .chart_drawing import draw_errors, draw_foot, foot_lines
from .chart_tables import cells
from .efficiency import Curve, curves

if TYPE_CHECKING:
    from .comparison import Comparison

WIDTH = 27.0
LABEL, CROP, MAP = 3.1, 2.5, 3.9  # the columns, in centimetres
#: Perceptually uniform, and readable without colour.
COLORMAP = "magma"
#: The error maps' scale spans so many decades.
DECADES = 2
LETTERS = "ABC"


@style.drawing()
def draw_sheet(comparison: Comparison) -> Figure:
    """The whole sheet."""
    foot = foot_lines(comparison.data, comparison.subject)
    row = _row_height(comparison)
    heights = [9.0, 1.0 + row * (len(comparison.samplers) + 1), 1.6, 0.5 + 0.45 * len(foot)]
    figure = style.figure(WIDTH, sum(heights) + 1)
    figure.suptitle(comparison.recommendation, fontsize=11, fontweight="bold", wrap=True)
    top, grid, bar, notes = figure.subfigures(4, 1, height_ratios=heights)
    whole, chart = top.subfigures(1, 2, width_ratios=(1, 2.2))
    _draw_whole(whole, comparison)
    draw_errors(chart, curves(cells(comparison.subject)), comparison.subject["references"])
    norm = _norm(comparison)
    _draw_grid(grid, comparison, norm)
    _draw_bar(bar, norm)
    draw_foot(notes, foot)
    return figure


def _row_height(comparison: Comparison) -> float:
    height, width = comparison.reference.shape[:2]
    return max(CROP, min(MAP * height / width, 2 * CROP)) + 0.15


def _draw_whole(figure: SubFigure, comparison: Comparison) -> None:
    ax = figure.subplots()
    _show(ax, comparison.reference)
    ax.set_title("Reference")
    for letter, crop in zip(LETTERS, comparison.crops, strict=False):
        corner = crop.left - 0.5, crop.top - 0.5
        for color, linewidth in (("white", 2.2), ("black", 0.9)):
            ax.add_patch(Rectangle(corner, crop.side, crop.side, fill=False, edgecolor=color, linewidth=linewidth))
        _badge(ax, letter, corner)


def _badge(ax: Axes, letter: str, corner: tuple[float, float]) -> None:
    """White on black below and right of a corner of the picture."""
    box = {"facecolor": "black", "alpha": 0.6, "pad": 1, "linewidth": 0}
    look = {"va": "top", "color": "white", "fontweight": "bold", "bbox": box}
    ax.annotate(letter, corner, (2, -2), textcoords="offset points", **look)


def _draw_grid(figure: SubFigure, comparison: Comparison, norm: LogNorm) -> None:
    """A row for the reference and one for each sampler; for each count shown the crops and then the error map."""
    crops, shown = len(comparison.crops), len(comparison.shown)
    widths = [LABEL, *([CROP] * crops + [MAP]) * shown]
    # What is not needed stays empty: crops have the same size on every sheet.
    spare = max(WIDTH - 1 - sum(widths), 0.01)
    grid = figure.add_gridspec(len(comparison.samplers) + 1, len(widths) + 1, width_ratios=[*widths, spare])
    _draw_reference_row(figure, grid, comparison)
    measured = curves(cells(comparison.subject))
    for i, name in enumerate(comparison.samplers, 1):
        _draw_label(figure.add_subplot(grid[i, 0]), measured[name], comparison.shown)
        for j, requested in enumerate(comparison.shown):
            count = SAMPLERS[name].actual_count(requested)
            shot = comparison.shots[name, count]
            first = 1 + j * (crops + 1)
            for k, crop in enumerate(comparison.crops):
                _show(figure.add_subplot(grid[i, first + k]), crop.of(shot.picture))
            error = np.maximum(shot.error, norm.vmin)
            ax = figure.add_subplot(grid[i, first + crops])
            ax.imshow(error, cmap=COLORMAP, norm=norm, interpolation="nearest")
            _bare(ax)
            if count != requested:
                ax.set_xlabel(f"{count} samples", fontsize=6, labelpad=1)


def _draw_reference_row(figure: SubFigure, grid: GridSpecBase, comparison: Comparison) -> None:
    crops = len(comparison.crops)
    ax = figure.add_subplot(grid[0, 0])
    ax.set_axis_off()
    ax.text(0, 0.54, "Reference", transform=ax.transAxes, va="bottom", fontweight="bold")
    ax.text(0, 0.46, "samples: RMSE, time", transform=ax.transAxes, va="top", fontsize=6.5)
    for j, requested in enumerate(comparison.shown):
        first = 1 + j * (crops + 1)
        for k, crop in enumerate(comparison.crops):
            ax = figure.add_subplot(grid[0, first + k])
            _show(ax, crop.of(comparison.reference))
            _badge(ax, LETTERS[k], (-0.5, -0.5))
            if k == 0:
                ax.set_title(f"{requested} sample{'s' if requested > 1 else ''} per pixel", loc="left")
        ax = figure.add_subplot(grid[0, first + crops])
        ax.set_axis_off()
        ax.text(0.5, 0, "error of each pixel", transform=ax.transAxes, ha="center", va="bottom")


def _draw_label(ax: Axes, curve: Curve, shown: Sequence[int]) -> None:
    """The sampler's name, and its error and time at the counts shown."""
    sampler = SAMPLERS[curve.sampler]
    ax.set_axis_off()
    label = sampler.label.replace(" ", "\n", 1)
    ax.text(0, 0.54, label, transform=ax.transAxes, va="bottom", color=style.color(curve.sampler), fontweight="bold")
    lines = []
    for requested in shown:
        (i,) = np.flatnonzero(curve.counts == sampler.actual_count(requested))
        seconds = EngFormatter("s", places=0)(curve.seconds[i])
        lines.append(f"{curve.counts[i]}: {curve.errors[i]:.2g}, {seconds}")
    ax.text(0, 0.46, "\n".join(lines), transform=ax.transAxes, va="top", fontsize=6.5)


def _draw_bar(figure: SubFigure, norm: LogNorm) -> None:
    ax = figure.add_axes((0.3, 0.62, 0.4, 0.16))
    figure.colorbar(
        ScalarMappable(norm, COLORMAP),
        cax=ax,
        orientation="horizontal",
        extend="both",
        label="RMSE of a pixel over seeds and channels, linear colour",
    )


def _norm(comparison: Comparison) -> LogNorm:
    """One scale for all maps: up to what all but a few pixels stay below."""
    errors = np.concatenate([shot.error.ravel() for shot in comparison.shots.values()])
    top = float(np.percentile(errors, 99.8)) or float(errors.max()) or 1.0
    return LogNorm(top / 10**DECADES, top)


def _show(ax: Axes, picture: np.ndarray) -> None:
    ax.imshow(picture, interpolation="nearest")
    _bare(ax)


def _bare(ax: Axes) -> None:
    ax.set(xticks=(), yticks=())
    for spine in ax.spines.values():
        spine.set(visible=True, linewidth=0.4)
