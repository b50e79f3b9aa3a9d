"""Score samplers by the four marks of a good point set, check the lecture's claims, and print Table 5.1, corrected."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from .. import command_line
from ..files import check_writable, replacing
from ..samplers import SAMPLERS
from . import table_5_1
from .claims import YES_NO, findings
from .criteria import HIGHEST_PEAK, LEAST_DISTANCE, LEAST_FILLED, MOST_UNEVEN, Marks, Mean, measure

#: One point has no distance from another; the discrepancy takes n² steps.
COUNTS = (2, 4096)
#: A standard error of fewer sets says nothing, and their mean spectrum has peaks by chance.
SETS = (10, 10_000)
#: Of a table with the longest figures, where stdout is no terminal.
WIDTH = 140

MARKS = {
    "even_2d": "Even over the square. CD: the centred L2 discrepancy, not square-rooted, × 10⁻⁴. Plane: what is uneven "
    f"in the plane and not along an axis, over the same of random points. ✓ if at most {MOST_UNEVEN:g}.",
    "even_1d": "Even along each axis. n·D*: n times the star discrepancy of x, at most 1 for one point per stratum. "
    f"Filled: the share of the n strata of each axis that hold a point. ✓ if at least {LEAST_FILLED:g}.",
    "min_distance": "A minimum distance. Distance: the smallest between two points, on the torus, over that of the "
    f"densest lattice, √(2/(√3 n)). ✓ if at least {LEAST_DISTANCE:g}.",
    "irregular": "No regular spacing. Peak: the largest of the sets' mean periodogram, up to the frequency 2√n, over "
    f"n; 1 is a lattice. ✓ if what goes beyond chance, (n·peak - 1)/(n - 1), is at most {HIGHEST_PEAK:g}.",
}


@dataclass(frozen=True)
class Score:
    """The marks of a sampler, by name, of which sets of `asked` points were wanted."""

    sampler: str
    asked: int
    marks: Marks


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's options to its parser."""
    names = list(SAMPLERS)
    integer = command_line.integer
    parser.add_argument(
        "--samplers", nargs="+", type=command_line.sampler, default=names, metavar="NAME", help=", ".join(names)
    )
    parser.add_argument(
        "--counts", nargs="+", type=integer(*COUNTS), default=[16, 64, 256], metavar="N", help="points per set"
    )
    parser.add_argument("--sets", type=integer(*SETS), default=100, metavar="N", help="sets to average over (100)")
    parser.add_argument("--seed", type=integer(0, 2**31 - 1), default=1, metavar="N", help="chooses the sets")
    parser.add_argument("--json", type=Path, metavar="PATH", help="write everything to this file too")


def run(options: argparse.Namespace) -> int:
    """Measure, print, and write the JSON file if one is wanted."""
    if options.json:
        check_writable(options.json)
    scores = [
        Score(name, count, measure(SAMPLERS[name], SAMPLERS[name].actual_count(count), options.sets, options.seed))
        for count in dict.fromkeys(options.counts)
        for name in dict.fromkeys(options.samplers)
    ]
    report(scores)
    if options.json:
        text = json.dumps(as_json(scores, options.seed), indent=1, ensure_ascii=False)
        with replacing(options.json) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")
    return 0


def report(scores: list[Score]) -> None:
    """Print the tables, the claims and Table 5.1."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH)
    for asked in dict.fromkeys(score.asked for score in scores):
        console.print(f"[bold]n = {asked}[/]")
        console.print(score_table([score for score in scores if score.asked == asked]))
    for score in scores:
        if score.marks.count != score.asked:
            rule = SAMPLERS[score.sampler].counts.rule
            console.print(
                f"{score.sampler} makes {score.marks.count} points where {score.asked} are asked for: {rule}."
            )
    for number, text in enumerate(MARKS.values(), start=1):
        console.print(f"{number}  {text}")
    sets = max(score.marks.sets for score in scores)
    console.print(f"±  The standard error of the mean over {sets} sets; none where chance has no part in the figure.")
    if claims := findings(by_sampler(scores)):
        console.print("\n[bold]The lecture's claims[/]\n")
        for claim in claims:
            console.print(f"•  {claim}")
    console.print("\n[bold]Table 5.1: radical inverses in base 2[/]")
    console.print(table_5_1.drawn())
    console.print(f"*  {table_5_1.errata()}")


def score_table(scores: list[Score]) -> Table:
    """A row for each sampler; each verdict stands behind the figure that decides it."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("sampler", overflow="fold")
    for heading in ("n", "1 CD", "1 plane", "2 n·D*", "2 filled", "3 distance", "4 peak"):
        table.add_column(heading, justify="right", overflow="fold")
    for score in scores:
        marks = score.marks
        even_2d, even_1d, min_distance, irregular = (YES_NO[met] for met in marks.criteria)
        table.add_row(
            score.sampler,
            str(marks.count),
            figure(marks.discrepancy),
            f"{figure(marks.unevenness)} {even_2d}",
            figure(marks.star),
            f"{figure(marks.filled)} {even_1d}",
            f"{figure(marks.distance)} {min_distance}",
            f"{figure(marks.peak)} {irregular}",
        )
    return table


def figure(mean: Mean) -> str:
    """A mean with its standard error, both to the error's first digit and at most four behind the point.

    >>> figure(Mean(231.4, 14.6)), figure(Mean(0.1098, 0.0003)), figure(Mean(43.129, None))
    ('231±15', '0.1098±0.0003', '43.1')
    """
    if mean.error is None or mean.error < 5e-5:
        return f"{mean.value:.3g}"
    decimals = int(np.clip(-np.floor(np.log10(mean.error)), 0, 4))
    return f"{mean.value:.{decimals}f}±{mean.error:.{decimals}f}"


def by_sampler(scores: list[Score]) -> dict[str, list[Marks]]:
    """The marks at each count, by sampler."""
    names = dict.fromkeys(score.sampler for score in scores)
    return {name: [score.marks for score in scores if score.sampler == name] for name in names}


def as_json(scores: list[Score], seed: int) -> dict:
    """Everything that was measured, with what it takes to understand and to repeat it."""
    limits = {
        "unevenness": MOST_UNEVEN,
        "filled": LEAST_FILLED,
        "distance": LEAST_DISTANCE,
        "regularity": HIGHEST_PEAK,
    }
    return {
        "seed": seed,
        "marks": MARKS,
        "limits": limits,
        "scores": [_score_as_json(score) for score in scores],
        "findings": findings(by_sampler(scores)),
        "table_5_1": table_5_1.rows(),
    }


def _score_as_json(score: Score) -> dict:
    fields = {name: f._asdict() if isinstance(f, Mean) else f for name, f in vars(score.marks).items()}
    return {
        "sampler": score.sampler,
        "count_asked": score.asked,
        **fields,
        "regularity": score.marks.regularity,
        "verdict": score.marks.criteria._asdict(),
    }
