"""What a chart says in numbers: slopes, equal error, equal time, and the answer to "three times fewer samples".

It reads the data of chart.json alone (see `chart_data`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..samplers import SAMPLERS
from . import depth
from .efficiency import (
    FIT_FROM,
    MILESTONES,
    Curve,
    Needed,
    TimesFewer,
    compare,
    curves,
    fit_slope,
    milestones,
    times_fewer,
    yardstick,
)
from .measure import RATIO, Cell


@dataclass(frozen=True)
class Row:
    """A sampler's line in a table, as text; three of the lists have one entry per milestone of the yardstick.

    `samples` and `time` are what it needs to reach the yardstick's error there, the time relative to the yardstick's;
    `error` is its error after the yardstick's time, relative to the yardstick's.
    """

    sampler: str
    slope: str
    expected: str
    samples: list[str]
    time: list[str]
    error: list[str]


def cells(subject: dict) -> list[Cell]:
    return [Cell(**cell) for cell in subject["cells"]]


def rows(subject: dict) -> tuple[Curve, list[int], list[Row]]:
    """The yardstick, the counts at which others are compared with it, and the lines of all samplers."""
    measured = curves(cells(subject))
    against = yardstick(measured)
    at = milestones(against)
    return against, against.counts[at].tolist(), [_row(subject, c, against, at) for c in measured.values()]


def _row(subject: dict, curve: Curve, against: Curve, at: list[int]) -> Row:
    compared = compare(curve, against)
    expected = subject["expected"].get(curve.sampler)
    times = [
        Needed(needed.amount / seconds, needed.relation)
        for needed, seconds in zip(compared.seconds, against.seconds[at], strict=True)
    ]
    return Row(
        curve.sampler,
        slope_text(curve),
        "–" if expected is None else minus(f"{expected:.2f}"),
        [needed.text(".3g") for needed in compared.samples],
        [needed.text(".2g") for needed in times],
        ["–" if ratio is None else f"{ratio:.2f}" for ratio in compared.error_ratios],
    )


def slope_text(curve: Curve) -> str:
    slope = fit_slope(curve.counts, curve.errors)
    if slope is None:
        return "–"
    return minus(f"{slope.value:.2f}" + ("" if math.isnan(slope.error) else f" ± {slope.error:.2f}"))


def minus(number: str) -> str:
    """With a minus sign in place of the hyphen."""
    return number.replace("-", "−")


# Where the numbers come from


def reference_text(subject: dict) -> list[str]:
    """A line for each reference: how it was made, and how its own error compares with the smallest charted."""
    if subject["kind"] == "integrand":
        return ["Errors are against the closed form."]
    lines = []
    for reference in subject["references"]:
        judged = [c for c in cells(subject) if c.sampler in reference["judges"]]
        judges = " and ".join(SAMPLERS[name].label for name in reference["judges"])
        few = len(subject["references"]) > 1 and len(reference["judges"]) < 3
        lines.append(
            f"Reference{f' for {judges}' if few else ''}: {SAMPLERS[reference['sampler']].label}, "
            f"{len(reference['seeds'])} × {reference['samples']} samples, own seeds. "
            + _quality_text(reference["standard_error"], [error for c in judged for error in c.rmse if error > 0])
        )
    return lines


def _quality_text(standard_error: float, errors: Sequence[float]) -> str:
    if standard_error == 0:
        return "All its pictures agree."
    text = f"Its standard error is {standard_error:.2g}"
    if not errors:
        return f"{text}, and there is no error to compare it with."
    ratio = min(errors) / standard_error
    verdict = "." if ratio >= RATIO else f" (NOT 1/{RATIO}, as it should be)."
    return f"{text}, 1/{ratio:.3g} of the smallest error charted{verdict}"


def conditions_text(data: dict, subject: dict) -> list[str]:
    """Lines about seeds, bands, threads and compilation."""
    settings, machine = data["settings"], data["machine"]
    slopes = f"Slopes are fitted from {FIT_FROM} samples on, ± standard error; expected: {subject['expected_note']}."
    seeds = f"{settings['seeds']} seed{'s' if settings['seeds'] > 1 else ''}"
    bands = "bands: 16th to 84th percentile of the seeds; times: their median."
    if subject["kind"] == "integrand":
        trials = f"{seeds} of {settings['trials']} integrands placed at random, two point sets each"
        time = "Time is that of making a set and of evaluating the integrand, many at once, on one thread."
        return [f"{trials}; {bands} {slopes}", f"{time} {_steadiness_text(subject)}"]
    width, height = subject["resolution"]
    threads = f"{machine['threads']} thread{'s' if machine['threads'] > 1 else ''}"
    return [
        f"{seeds} of {width} × {height} pixels, linear colour; {bands} {slopes}",
        f"Time is that of a picture on {threads}, with its tables and the BVH; compiling the kernels or loading them, "
        f"{data['compile_seconds']:.2g} s once, is left out. {_steadiness_text(subject)}",
    ]


def _steadiness_text(subject: dict) -> str:
    """How much the times of seeds differ that have the same work to do: on a quiet machine by a few per cent."""
    totals = [np.add(cell.setup_seconds, cell.seconds) for cell in cells(subject)]
    spread = np.median([np.median(total) / total.min() for total in totals])
    return f"The median seed took {spread:.2f} times as long as the fastest."


def bias_bound(cell: Cell) -> tuple[float, bool]:
    """bias² and True where it is significant (three standard errors), or else its upper bound and False."""
    if cell.bias_squared > 3 * cell.bias_squared_error:
        return cell.bias_squared, True
    return max(cell.bias_squared, 0.0) + 3 * cell.bias_squared_error, False


def errs_by_a_pattern(cell: Cell) -> bool:
    """Whether most of the squared error is bias, which no other seed and no mean over pictures takes away."""
    return cell.bias_squared is not None and bias_bound(cell)[1] and cell.bias_squared > cell.variance


# The claim, and the tables as Markdown


def claim(data: dict) -> list[str]:
    """The measured answers to the lecture's "three times fewer samples" and to how deep that goes, as lines.

    The first has a line for each scene, or each integrand, the second one for each number of bounces.
    """
    subjects = [subject for subject in data["subjects"].values() if subject["bounces"] is None]
    scenes = [subject for subject in subjects if subject["kind"] == "scene"]
    lines = ['"The best technique can require three times fewer samples than the worst." Measured:']
    lines += [f"  {claim_text(subject)}" for subject in scenes or subjects]
    return (lines if subjects else []) + _depth_claim(data)


def _depth_claim(data: dict) -> list[str]:
    """How the advantage goes with the length of the path: nothing where no subject was measured at several bounces."""
    lines = []
    for bounces, measured in depth.paths(data).items():
        if answer := times_fewer(measured):
            where = f"{depth.bounces_text(bounces)}, {depth.dimensions(bounces)} dimensions"
            lines.append(f"  {where}: for the error of the best of the six Random needs {_times_text(answer)}")
    return ["How many dimensions deep does a good sampler still help? Measured:", *lines] if lines else []


def claim_text(subject: dict) -> str:
    answer = times_fewer(curves(cells(subject)))
    if not answer:
        return f"{subject['label']}: not to be told without Random at one of {', '.join(map(str, MILESTONES))} samples"
    return f"{subject['label']}: for the error of the best of the six Random needs {_times_text(answer)}"


def _times_text(answer: dict[int, TimesFewer]) -> str:
    return ", ".join(
        f"{found.ratio:.3g} ± {found.uncertainty:.1g} times the {count} of {SAMPLERS[found.best].label}"
        for count, found in answer.items()
    )


def markdown(data: dict) -> str:
    """All tables."""
    parts = [
        "# Error of the samplers",
        re.sub(r"^  ", "- ", "\n".join(claim(data)), flags=re.MULTILINE).replace("Measured:", "Measured:\n"),
        *_markdown_depth(data),
    ]
    for subject in data["subjects"].values():
        if subject["cells"]:
            parts += _markdown_subject(data, subject)
    return "\n\n".join(parts) + "\n"


def _markdown_depth(data: dict) -> list[str]:
    heads, lines = depth.table(data)
    table = [heads, ["---", *["---:"] * (len(heads) - 1)], *lines]
    return ["\n".join("| " + " | ".join(line) + " |" for line in table)] if lines else []


def _markdown_subject(data: dict, subject: dict) -> list[str]:
    against, counts, lines = rows(subject)
    label = SAMPLERS[against.sampler].label
    heads = ["sampler", "slope", "expected"]
    heads += [f"samples for the error of {label} at {count}" for count in counts]
    heads += [f"time for it, {label} at {count} = 1" for count in counts]
    heads += [f"error after the time of {label} at {count}, its own = 1" for count in counts]
    table = [heads, ["---", *["---:"] * (len(heads) - 1)]]
    table += [[SAMPLERS[r.sampler].label, r.slope, r.expected, *r.samples, *r.time, *r.error] for r in lines]
    return [
        f"## {subject['label']}",
        "\n".join("| " + " | ".join(line) + " |" for line in table),
        "  \n".join([*reference_text(subject), *conditions_text(data, subject)]),
    ]
