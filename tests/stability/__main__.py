"""`make stability`: run the cases, print a table with a verdict and the figures of each, and save them for the docs."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console
from rich.table import Table

from core import command_line
from core.files import replacing
from core.lab.style import make_folder
from core.lab.tone import display

from .case import GROUPS, LIMIT, RIGHT, WRONG, Case, Outcome, all_cases, by_sampler, compare_samplers, run

COLORS = {RIGHT: "green", LIMIT: "yellow", WRONG: "red"}


def main() -> int:
    return command_line.run_command(lambda: _run(_parser().parse_args()))


def _parser() -> argparse.ArgumentParser:
    parser = command_line.OneLineParser(
        prog="python -m tests.stability",
        description="Try Rooks where methods fail: a verdict and figures for each case.",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"cases or groups ({', '.join(GROUPS)}); default: all")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--quick", action="store_true", help="leave out the cases that take more than seconds")
    length.add_argument("--slow", action="store_true", help="leave out the others, which are part of make test")
    parser.add_argument(
        "--output",
        type=Path,
        metavar="FOLDER",
        help="save stability.json and the pictures there, and compare what each sampler does, which takes longer",
    )
    return parser


def _run(options: argparse.Namespace) -> int:
    cases = _choose(all_cases(), options)
    if options.output:
        make_folder(options.output)
    console = Console()
    outcomes = []
    for number, case in enumerate(cases, 1):
        with console.status(f"{number}/{len(cases)} {case.title}"):
            outcomes.append(run(case))
            if options.output:
                _save_pictures(outcomes[-1], options.output)
                if not (case.samplers or outcomes[-1].record.samplers):
                    outcomes[-1].record.samplers.update(compare_samplers(case))
    console.print(_table(outcomes))
    if options.output:
        with replacing(options.output / "stability.json") as path:
            path.write_text(json.dumps(_data(outcomes), indent=1, ensure_ascii=False), encoding="utf-8")
    wrong = [outcome.case.name for outcome in outcomes if outcome.verdict == WRONG]
    console.print(f"{len(outcomes)} cases, {len(wrong)} wrong{': ' * bool(wrong)}{', '.join(wrong)}")
    return 1 if wrong else 0


def _choose(cases: list[Case], options: argparse.Namespace) -> list[Case]:
    known = {name for case in cases for name in (case.name, case.group)}
    for name in options.names:
        if name not in known:
            print(
                f"rooks: no case or group is called {name!r}: choose from {', '.join(sorted(known))}", file=sys.stderr
            )
            raise SystemExit(2)
    named = [case for case in cases if not options.names or {case.name, case.group} & set(options.names)]
    return [case for case in named if not (options.quick if case.is_slow else options.slow)]


def _table(outcomes: list[Outcome]) -> Table:
    table = Table("case", "verdict", "figures", "s", title="Stability where methods fail", show_lines=True)
    for outcome in outcomes:
        figures = [f"[red]{text}[/red]" if text in outcome.record.broken else text for text in outcome.record.figures]
        figures += by_sampler(outcome.record.samplers)
        verdict = f"[{COLORS[outcome.verdict]}]{outcome.verdict}[/]"
        table.add_row(
            f"{outcome.case.title}\n{outcome.case.name}", verdict, "\n".join(figures), f"{outcome.seconds:.1f}"
        )
    return table


def _data(outcomes: list[Outcome]) -> list[dict]:
    """What docs/update.py needs beside the cases' words."""
    return [
        {
            "name": outcome.case.name,
            "verdict": outcome.verdict,
            "figures": outcome.record.figures,
            "samplers": outcome.record.samplers,
            "seconds": float(f"{outcome.seconds:.2g}"),
            "pictures": list(outcome.record.pictures),
        }
        for outcome in outcomes
    ]


def _save_pictures(outcome: Outcome, folder: Path) -> None:
    """Save a case's pictures side by side, in their order, as NAME.png."""
    if not outcome.record.pictures:
        return
    shown = [display(picture[..., :3]) for picture in outcome.record.pictures.values()]
    height = max(picture.shape[0] for picture in shown)
    gap = np.full((height, 4, 3), 255, np.uint8)
    padded = [np.pad(p, ((0, height - p.shape[0]), (0, 0), (0, 0)), constant_values=255) for p in shown]
    sheet = np.concatenate([part for picture in padded for part in (picture, gap)][:-1], axis=1)
    with replacing(folder / f"{outcome.case.name}.png") as path:
        Image.fromarray(sheet).save(path, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
