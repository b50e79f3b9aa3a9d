"""The charts of `chart`, drawn from the data of chart.json: one page a subject, and an overview."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, FixedLocator, LogLocator, NullFormatter, NullLocator, ScalarFormatter

from ..samplers import SAMPLERS
from . import depth, style
from .chart_tables import Row, bias_bound, cells, claim_text, conditions_text, reference_text, rows
from .efficiency import Curve, curves
from .measure import Cell

WIDTH = 27.0
#: Letters in a line of the foot.
FOOT = 175
#: Panels for bias² and variance in a row.
ABREAST = 5


@style.drawing()
def draw_subject(data: dict, name: str) -> Figure:
    """A page: error against samples and time, bias² and variance of each sampler, the tables."""
    subject = data["subjects"][name]
    measured = curves(cells(subject))
    foot = foot_lines(data, subject)
    parts = [(11.0, lambda area: draw_errors(area, measured, subject["references"]))]
    if _has_bias(subject):
        parts.append((0.9 + 3.6 * -(-len(measured) // ABREAST), lambda area: _draw_bias(area, subject)))
    parts.append((1.9 + 0.46 * len(measured), lambda area: _draw_table(area, subject)))
    parts.append((0.5 + 0.45 * len(foot), lambda area: draw_foot(area, foot)))
    heights = [height for height, _ in parts]
    figure = style.figure(WIDTH, sum(heights))
    areas = figure.subfigures(len(parts), 1, height_ratios=heights)
    areas[0].suptitle(subject["label"], fontsize=12, fontweight="bold")
    for area, (_, draw) in zip(areas, parts, strict=True):
        draw(area)
    return figure


def foot_lines(data: dict, subject: dict) -> list[str]:
    """How a subject was measured, in lines that fit the page."""
    return [part for line in [*reference_text(subject), *conditions_text(data, subject)] for part in wrap(line, FOOT)]


def draw_foot(figure: SubFigure, lines: Sequence[str]) -> None:
    figure.text(0.012, 0.95, "\n".join(lines), va="top", fontsize=7, linespacing=1.5)


@style.drawing()
def draw_overview(data: dict) -> Figure:
    """All subjects' errors against samples, and the answer to the lecture's claim."""
    subjects = [subject for subject in data["subjects"].values() if subject["cells"]]
    columns = min(3, len(subjects))
    lines = -(-len(subjects) // columns)
    figure = style.figure(9 * columns, 6.5 * lines + 2.5)
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for ax, subject in zip(axes, subjects, strict=False):
        measured = curves(cells(subject))
        _draw_curves(ax, measured, "counts")
        ax.set_title(subject["label"])
        ax.set(xlabel="Points" if subject["kind"] == "integrand" else "Samples per pixel", ylabel="RMSE")
        _round_counts(ax, measured)
    for ax in axes[len(subjects) :]:
        ax.set_axis_off()
    names = {name for subject in subjects for name in curves(cells(subject))}
    figure.legend(handles=legend_handles(names), loc="outside upper center", ncols=min(len(names), 5))
    claims = [claim_text(subject) for subject in subjects if subject["kind"] == "scene"]
    if claims:
        figure.supxlabel("\n".join(claims), x=0.01, ha="left", fontsize=7)
    return figure


@style.drawing()
def draw_depth(data: dict) -> Figure:
    """By how much each sampler errs less than Random on longer and longer paths, a panel for each count."""
    found = depth.paths(data)
    names, counts = depth.shown(data)
    figure = style.figure(9 * len(counts), 8.5)
    panels = figure.subplots(1, len(counts), sharey=True, squeeze=False)[0]
    for ax, count in zip(panels, counts, strict=True):
        ax.axhline(1, color=style.INK, linewidth=0.8)
        for name in names:
            gains = {b: depth.advantage(measured, name, count) for b, measured in found.items()}
            points = [(b, *gain) for b, gain in gains.items() if gain]
            look = {"color": style.color(name), "marker": style.marker(name), "capsize": 2, "elinewidth": 0.8}
            if points:
                ax.errorbar(*np.transpose(points)[:2], yerr=np.transpose(points)[2], **look)
        ax.set_xscale("log", base=2)
        ax.xaxis.set_major_locator(FixedLocator(list(found)))
        ax.xaxis.set_major_formatter(lambda b, _: f"{b:.0f}\n({depth.dimensions(round(b))})")
        ax.xaxis.set_minor_locator(NullLocator())
        ax.grid(True)
        ax.set(title=f"{count} samples", xlabel="Bounces (dimensions)")
    panels[0].set_ylabel("RMSE of Random ÷ RMSE")
    figure.suptitle("How many dimensions deep does a good sampler still help?", fontsize=12, fontweight="bold")
    figure.legend(handles=legend_handles(names), loc="outside lower center", ncols=ABREAST)
    return figure


# Error against samples and time


def draw_errors(figure: Figure | SubFigure, measured: dict[str, Curve], references: Sequence[dict]) -> None:
    """Two log-log panels side by side, with bands, a legend and the references' own errors."""
    by_count, by_time = figure.subplots(1, 2, sharey=True)
    _draw_curves(by_count, measured, "counts")
    _draw_curves(by_time, measured, "seconds")
    by_count.set(
        xlabel="Points" if not references else "Samples per pixel",
        ylabel="RMSE" if not references else "RMSE of linear colour",
    )
    by_time.set_xlabel("Time per estimate" if not references else "Time per picture")
    by_time.tick_params(labelleft=False)
    _round_counts(by_count, measured)
    _round_seconds(by_time, measured)
    seen = [reference for reference in references if reference["standard_error"] > 0]
    for ax in (by_count, by_time):
        for reference in seen:
            ax.axhline(reference["standard_error"], color=style.FAINT, linewidth=1, zorder=1)
    for reference in seen[:1]:
        text = "standard error of the reference" + ("s" if len(seen) > 1 else "")
        by_count.annotate(
            text,
            (0.01, reference["standard_error"]),
            (0, 3),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            fontsize=7,
            color="#666666",
        )
    figure.legend(handles=legend_handles(measured), loc="outside lower center", ncols=ABREAST)


def _draw_curves(ax: Axes, measured: dict[str, Curve], along: str) -> None:
    exact = not any((curve.errors > 0).any() for curve in measured.values())
    ax.set(xscale="log", yscale="linear" if exact else "log")
    ax.grid(True)
    for name, curve in measured.items():
        x = getattr(curve, along)
        order = np.argsort(x, kind="stable")
        seen = order if exact else order[curve.errors[order] > 0]
        ax.fill_between(x[seen], curve.low[seen], curve.high[seen], color=style.color(name), alpha=0.25, linewidth=0)
        ax.plot(x[seen], curve.errors[seen], color=style.color(name), marker=style.marker(name))
    if exact:
        ax.set_ylim(-0.05, 1)


def _round_counts(ax: Axes, measured: dict[str, Curve]) -> None:
    """Ticks at the powers of four in range, written out."""
    counts = np.concatenate([curve.counts for curve in measured.values()])
    ticks = [4**k for k in range(16) if counts.min() <= 4**k <= counts.max()]
    if len(ticks) < 2:
        ticks = sorted({int(counts.min()), int(counts.max())})
    ax.xaxis.set_major_locator(FixedLocator(ticks))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_minor_formatter(NullFormatter())


def _round_seconds(ax: Axes, measured: dict[str, Curve]) -> None:
    seconds = np.concatenate([curve.seconds for curve in measured.values()])
    if seconds.max() < 100 * seconds.min():  # two powers of ten are too few, and 1, 2 and 5 times them may be too many
        ticks = {float(f"{tick:.2g}") for tick in np.geomspace(seconds.min(), seconds.max(), 3)}
        ax.xaxis.set_major_locator(FixedLocator(sorted(ticks)))
    else:
        ax.xaxis.set_major_locator(LogLocator())
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(EngFormatter("s"))
    ax.xaxis.set_minor_formatter(NullFormatter())


def legend_handles(names) -> list[Line2D]:
    ordered = sorted(names, key=lambda name: SAMPLERS[name].number)
    return [
        Line2D([], [], color=style.color(name), marker=style.marker(name), label=SAMPLERS[name].label)
        for name in ordered
    ]


# Bias² and variance


def _has_bias(subject: dict) -> bool:
    """Whether there are several seeds to tell bias from variance by, and any error at all."""
    every = subject["cells"]
    return all(cell["variance"] is not None for cell in every) and any(max(cell["rmse"]) > 0 for cell in every)


def _draw_bias(figure: SubFigure, subject: dict) -> None:
    """A small panel for each sampler, all with the same axes."""
    by_sampler: dict[str, list[Cell]] = {}
    for cell in cells(subject):
        by_sampler.setdefault(cell.sampler, []).append(cell)
    names = sorted(by_sampler, key=lambda name: SAMPLERS[name].number)
    columns = min(ABREAST, len(names))
    lines = -(-len(names) // columns)
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for ax, name in zip(axes.ravel(), names, strict=False):
        _draw_bias_panel(ax, name, sorted(by_sampler[name], key=lambda cell: cell.count))
    for ax in axes.ravel()[len(names) :]:
        ax.set_visible(False)
    axes[0, 0].set_ylim(*_limits(by_sampler))
    _round_counts(axes[0, 0], curves(cells(subject)))
    figure.legend(handles=_bias_legend(), loc="outside upper center", ncols=3)


def _draw_bias_panel(ax: Axes, name: str, its: Sequence[Cell]) -> None:
    color = style.color(name)
    counts = np.array([cell.count for cell in its])
    variance = np.array([cell.variance for cell in its])
    bounds = np.array([bias_bound(cell) for cell in its])
    ax.set(xscale="log", yscale="log")
    ax.grid(True)
    ax.set_title(SAMPLERS[name].label, color=color, fontsize=8)
    ax.plot(counts[variance > 0], variance[variance > 0], color=color)
    bias, sure = bounds[:, 0], bounds[:, 1] > 0
    ax.plot(counts[sure], bias[sure], color=color, linestyle=(0, (3, 1.5)), marker="s", markersize=3)
    ax.plot(counts[~sure], bias[~sure], color=color, linestyle="", marker="v", markersize=3.5, markerfacecolor="white")


def _limits(by_sampler: dict[str, list[Cell]]) -> tuple[float, float]:
    """What is far below everything else is rounding, and would only press the rest together."""
    every = [cell for its in by_sampler.values() for cell in its]
    total = np.array([np.mean(np.square(cell.rmse)) for cell in every])
    return total[total > 0].min() * 1e-2, total.max() * 3


def _bias_legend() -> list[Line2D]:
    dark = {"color": style.INK}
    return [
        Line2D([], [], **dark, label="variance"),
        Line2D([], [], **dark, linestyle=(0, (3, 1.5)), marker="s", markersize=3, label="bias²"),
        Line2D(
            [],
            [],
            **dark,
            linestyle="",
            marker="v",
            markerfacecolor="white",
            label="bias² not significant: upper bound",
        ),
    ]


# The table


def _draw_table(figure: SubFigure, subject: dict) -> None:
    against, counts, lines = rows(subject)
    label = SAMPLERS[against.sampler].label
    ax = figure.add_axes((0.012, 0, 0.976, 1))
    ax.set_axis_off()
    ax.set(xlim=(0, 1), ylim=(len(lines) + 2.6, 0))
    groups = (
        f"Samples for the error of {label} at",
        f"Time for it, {label} = 1",
        f"Error in {label}'s time, its own = 1",
    )
    left = 0.36
    width = (1 - left) / (3 * len(counts))
    ax.text(0.21, 1.6, "Slope", ha="center", fontsize=7, fontweight="bold")
    ax.text(0.305, 1.6, "Expected", ha="center", fontsize=7, fontweight="bold")
    for i, group in enumerate(groups):
        start = left + i * len(counts) * width
        ax.text(start + len(counts) * width / 2, 0.7, group, ha="center", fontsize=7, fontweight="bold")
        ax.plot((start + 0.1 * width, start + (len(counts) - 0.1) * width), (0.9, 0.9), color=style.INK, linewidth=0.5)
        for j, count in enumerate(counts):
            ax.text(start + (j + 0.5) * width, 1.6, str(count), ha="center", fontsize=7, fontweight="bold")
    ax.plot((0, 1), (1.85, 1.85), color=style.INK, linewidth=0.8)
    for i, row in enumerate(lines):
        _draw_row(ax, 2.6 + i, row, left, width)


def _draw_row(ax: Axes, y: float, row: Row, left: float, width: float) -> None:
    color = style.color(row.sampler)
    ax.plot(0.008, y - 0.22, color=color, marker=style.marker(row.sampler))
    ax.text(0.02, y, SAMPLERS[row.sampler].label, fontsize=7)
    ax.text(0.21, y, row.slope, ha="center", fontsize=7)
    ax.text(0.305, y, row.expected, ha="center", fontsize=7)
    for j, text in enumerate([*row.samples, *row.time, *row.error]):
        ax.text(left + (j + 0.5) * width, y, text, ha="center", fontsize=7)
