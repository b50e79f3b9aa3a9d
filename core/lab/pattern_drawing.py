"""Drawing sets of points as the textbook does (Suffern 2007, ch. 5): the unit square with its projections beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from ..samplers import Sampler
from ..samplers.multi_jittered import coarse_rows
from ..samplers.sampler import grid_shape
from . import style
from .point_sets import independent_sets
from .spectrum import periodograms, reach

#: All lengths in cm.
SIDE = 6.0
STRIP = 0.5
GAP = 0.15
MARGIN = 0.4
HEAD = 0.7
FOOT = 0.3
CAPTION = 0.9
POINTS_PER_CM = 72 / style.CM_PER_INCH

SETS = 100
"""Sets that a periodogram is averaged over."""
STRONGEST = 16
"""Power that is drawn white; 1/16 is black, and the 1 of random points is in the middle of the scale."""
#: The samplers that put one point each into the rows and the columns of an n × n grid, into the cells of a √n × √n
#: one, and into those of any grid if n is a power of two.
FINE = ("n_rooks", "multi_jittered", "correlated_multi_jittered")
COARSE = ("regular", "jittered", "multi_jittered", "correlated_multi_jittered")
NETS = ("sobol_owen", "z_sobol")

MOST_LINES = 64
"""More of them along an axis would be a grey square."""


@style.drawing()
def pattern(sampler: Sampler, count: int, seed: int) -> Figure:
    """A set of `count` points that the sampler can make, its projections, and the mean periodogram of such sets."""
    sets = independent_sets(sampler, count, SETS, seed)
    panel = SIDE + GAP + STRIP
    bar = MARGIN + panel + 1.6 + SIDE + 0.3
    figure = _figure(bar + 1.9, HEAD + panel + FOOT)
    _square(figure, MARGIN, HEAD, SIDE, sets[0], sampler).set_title(f"{sampler.label}, n = {count}", loc="left")

    axes = _axes(figure, MARGIN + panel + 1.6, HEAD, SIDE, SIDE)
    image = _spectrum(axes, sets)
    kind = "Periodogram" if len(sets) == 1 else f"Mean periodogram of {len(sets)} sets"
    axes.set_title(kind, loc="left")
    scale = figure.colorbar(
        image, cax=_axes(figure, bar, HEAD, 0.25, SIDE), extend="both", ticks=[1 / 16, 1 / 4, 1, 4, 16]
    )
    scale.ax.set_yticklabels(["1/16", "1/4", "1", "4", "16"])
    scale.ax.minorticks_off()
    scale.set_label("power without f = 0 (1: random points)")
    return figure


@style.drawing()
def panels(sampler: Sampler, sets: Sequence[np.ndarray], captions: Sequence[str]) -> Figure:
    """Sets of points side by side, each (n, 2), with the captions (a), (b), … below."""
    side = SIDE if len(sets) < 3 else 4.4
    panel = side + GAP + STRIP
    step = panel + 0.9
    figure = _figure(MARGIN + len(sets) * step - 0.3, MARGIN + panel + CAPTION)
    for i, (points, caption) in enumerate(zip(sets, captions, strict=True)):
        left = MARGIN + i * step
        _square(figure, left, MARGIN, side, points, sampler)
        _text(
            figure, left + side / 2, MARGIN + panel + CAPTION / 2, f"({'abc'[i]}) {caption}", ha="center", va="center"
        )
    return figure


def _square(figure: Figure, left: float, top: float, side: float, points: np.ndarray, sampler: Sampler) -> Axes:
    """The unit square with the technique's grid and the points; x seen from below, y from the right."""
    count, color = len(points), style.color(sampler.name)
    square = _axes(figure, left, top, side, side)
    _frame(square)
    _grid(square, sampler.name, count)
    diameter = 0.065 * side * POINTS_PER_CM / count**0.25
    # Not clipped: a point on the edge is a whole point.
    square.scatter(*points.T, s=diameter**2, color=color, linewidths=0, clip_on=False, zorder=3)

    width = np.clip(0.55 * side * POINTS_PER_CM / count, 0.15, 0.8)
    for axis, strip in enumerate(
        (_axes(figure, left, top + side + GAP, side, STRIP), _axes(figure, left + side + GAP, top, STRIP, side))
    ):
        ends = np.stack(np.broadcast_arrays(points[:, axis, np.newaxis], (0.0, 1.0)), axis=-1)
        ticks = ends if axis == 0 else ends[..., ::-1]
        strip.add_collection(LineCollection(ticks, colors=color, linewidths=width, clip_on=False))
        _frame(strip)
        strip.set_axis_off()
    _text(figure, left + side + GAP + 0.05, top + side + GAP + STRIP / 2, "x", va="center")
    _text(figure, left + side + GAP + STRIP / 2, top - 0.05, "y", ha="center", va="bottom")
    return square


def _grid(square: Axes, name: str, count: int) -> None:
    """The strata that hold one point each by the technique's design."""
    rows, columns = grid_shape(count)
    if name == "multi_jittered":
        rows = coarse_rows(count)
        columns = -(-count // rows)
    if name in FINE and count <= MOST_LINES:
        _lines(square, count, count, "#E6E6E6", 0.4)
    is_net = name not in NETS or count & (count - 1) == 0
    if name in COARSE + NETS and is_net and rows * columns == count and columns <= MOST_LINES:
        _lines(square, rows, columns, style.FAINT, 0.6 if count <= MOST_LINES else 0.35)


def _lines(square: Axes, rows: int, columns: int, color: str, width: float) -> None:
    x, y = np.arange(1, columns) / columns, np.arange(1, rows) / rows
    upright = [[(at, 0), (at, 1)] for at in x]
    level = [[(0, at), (1, at)] for at in y]
    square.add_collection(LineCollection(upright + level, colors=color, linewidths=width, zorder=1))


def _spectrum(axes: Axes, sets: np.ndarray) -> AxesImage:
    highest = reach(sets.shape[1])
    power = periodograms(sets, highest).mean(axis=0)
    edge = highest + 0.5
    image = axes.imshow(
        np.maximum(power, 1e-9),  # a logarithmic scale has no 0
        norm=LogNorm(1 / STRONGEST, STRONGEST),
        cmap="gray",
        origin="lower",
        extent=(-edge, edge, -edge, edge),
        interpolation="nearest",
    )
    for spine in axes.spines.values():
        spine.set_visible(True)
    axes.set_xticks([-highest, 0, highest])
    axes.set_yticks([-highest, 0, highest])
    axes.set_xlabel("frequency in x (periods per square)", labelpad=1)
    axes.set_ylabel("frequency in y", labelpad=-4)
    return image


def _frame(axes: Axes) -> None:
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(True)


def _figure(width: float, height: float) -> Figure:
    figure = style.figure(width, height)
    figure.set_layout_engine("none")  # every place is given
    return figure


def _axes(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Axes at a place given in cm from the figure's left and top."""
    w, h = figure.get_size_inches() * style.CM_PER_INCH
    return figure.add_axes((left / w, 1 - (top + height) / h, width / w, height / h))


def _text(figure: Figure, left: float, top: float, text: str, **look) -> None:
    w, h = figure.get_size_inches() * style.CM_PER_INCH
    figure.text(left / w, 1 - top / h, text, **look)
