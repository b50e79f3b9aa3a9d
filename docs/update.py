"""Fill in the parts of the pages that are made from code and measurements: `make docs`.

A page has blocks between `<!-- NAME:begin -->` and `<!-- NAME:end -->`; BLOCKS says what makes each. Measurements are
read from docs/data, where `make docs` puts them, and pictures are copied from out/docs. A test checks that the pages
are up to date with the code and the data.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from core.lab import chart_tables, depth  # noqa: E402 - the path comes first
from core.lab.efficiency import MILESTONES, TimesFewer, curves, times_fewer  # noqa: E402
from core.samplers import SAMPLERS, Sampler  # noqa: E402
from tests.stability.case import GROUPS, all_cases, by_sampler  # noqa: E402

DOCS = ROOT / "docs"
DATA, IMAGES, MADE = DOCS / "data", DOCS / "images", ROOT / "out" / "docs"
PAGES = (ROOT / "README.md", DOCS / "sampling.md", DOCS / "stability.md")
CHART_PAGE = DOCS / "chart.md"

MARKS = {True: "✓", False: "–"}


def data(name: str) -> dict:
    """The measurements in docs/data/NAME.json."""
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


def table(heads: list[str], rows: list[list[str]], align: str = "") -> str:
    """A Markdown table; `align` has an l, c or r for each column, l where it is shorter.

    Raises:
        SystemExit: there is nothing in it: a page would go on to argue from an empty table.
    """
    if not rows:
        sys.exit(f"nothing was measured for the table with the columns {', '.join(heads)}: run make docs")
    rules = [{"c": ":-:", "r": "--:"}.get(align[i : i + 1], "---") for i in range(len(heads))]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (heads, rules, *rows))


def samplers_table() -> str:
    """A row for each sampler of the registry, in its order."""
    heads = ["sampler", "from", "even in 2-D", "even in 1-D", "minimum distance", "irregular", "counts", ""]
    return table(heads, [_sampler_row(sampler) for sampler in SAMPLERS.values()], "llcccc")


def _sampler_row(sampler: Sampler) -> list[str]:
    made = {sampler.actual_count(n) for n in range(1, 100)}
    counts = {99: "any", 8: "powers of two"}.get(len(made), "rows × columns")
    marks = [MARKS[met] for met in sampler.criteria]
    return [f"{sampler.label} `{sampler.name}`", sampler.origin, *marks, counts, sampler.description]


def scores_table() -> str:
    """The marks of every sampler at each count, joined by slashes."""
    scores = data("score")["scores"]
    counts = "/".join(dict.fromkeys(str(score["count_asked"]) for score in scores))
    rows = []
    for name in dict.fromkeys(score["sampler"] for score in scores):
        own = [score for score in scores if score["sampler"] == name]
        figures = [
            "/".join(_short(score[key]["value"]) for score in own)
            for key in ("discrepancy", "unevenness", "star", "filled", "distance", "peak")
        ]
        verdicts = ["/".join(dict.fromkeys(MARKS[s["verdict"][mark]] for s in own)) for mark in own[0]["verdict"]]
        rows.append([SAMPLERS[name].label, *figures, *verdicts])
    heads = [f"n = {counts}", "CD", "plane", "n·D*", "filled", "distance", "peak", "1", "2", "3", "4"]
    return table(heads, rows, "lrrrrrrcccc")


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def claims() -> str:
    """The lecture's claims, each checked."""
    return "".join(f"- {finding}\n" for finding in data("score")["findings"])


def table_5_1() -> str:
    """The radical inverses, with what the textbook prints where it is wrong."""
    rows = []
    for row in data("score")["table_5_1"]:
        wrong = "" if row["value"] == row["printed"] else f"{row['printed']:g}"
        mirrored = "." + row["binary"][::-1]
        rows.append([str(row["i"]), row["binary"], mirrored, row["sum"], f"{row['value']:g}", wrong])
    return table(["i", "binary", "mirrored", "sum", "Φ₂(i)", "printed"], rows, "rrllll")


def horizon() -> str:
    """The errors of Figures 5.19 to 5.21."""
    figures = data("figures")["figures"]
    panels = [panel for name in ("figure_5_19", "figure_5_20", "figure_5_21") for panel in figures[name]["panels"]]
    rows = []
    for name in dict.fromkeys(panel["sampler"] for panel in panels):
        rows.append([SAMPLERS[name].label, *(f"{panel['rmse']:.4f}" for panel in panels if panel["sampler"] == name)])
    counts = dict.fromkeys(f"{panel['samples_per_pixel']}" for panel in panels)
    return table(["root mean square error at", *counts], rows, "lrr")


def slopes() -> str:
    """Fitted slopes beside the expected ones, of the integrands with closed forms."""
    subjects = [subject for subject in data("chart")["subjects"].values() if subject["kind"] == "integrand"]
    rows: dict[str, list[str]] = {}
    for subject in subjects:
        for name, curve in curves(chart_tables.cells(subject)).items():
            expected = chart_tables.minus(f"{subject['expected'][name]:.2f}")
            rows.setdefault(name, [SAMPLERS[name].label]).append(f"{chart_tables.slope_text(curve)} ({expected})")
    return table(
        ["fitted (expected) power of n", *(subject["label"] for subject in subjects)], list(rows.values()), "lrrrrr"
    )


def three_times() -> str:
    """How many times the samples of the best of the six Random needs on each scene."""
    every = data("chart")["subjects"].values()
    subjects = [subject for subject in every if subject["kind"] == "scene" and subject["bounces"] is None]
    found = {subject["label"]: times_fewer(curves(chart_tables.cells(subject))) for subject in subjects}
    rows = [[label, *map(_times, answer.values())] for label, answer in found.items()]
    counts = next(iter(found.values()))
    heads = [f"best of the six at {count}" for count in counts]
    return table(["so many times its samples Random needs for the error of the", *heads], rows, "lrrr")


def _times(found: TimesFewer) -> str:
    return f"{found.ratio:.3g} ± {found.uncertainty:.1g} ({SAMPLERS[found.best].label})"


def depths() -> str:
    """By how much each sampler errs less than Random, by the length of the path."""
    heads, rows = depth.table(data("chart"))
    return table(heads, rows, "l" + "r" * (len(heads) - 1))


def path_times() -> str:
    """How many times the samples of the best of the six Random needs, by the length of the path."""
    rows = []
    for bounces, measured in depth.paths(data("chart")).items():
        path = f"{depth.bounces_text(bounces)}, {depth.dimensions(bounces)} dimensions"
        rows.append([path, *map(_times, times_fewer(measured).values())])
    heads = [f"best of the six at {count}" for count in MILESTONES]
    return table(["so many times its samples Random needs for the error of the", *heads], rows, "lrrr")


def stability(group: str) -> str:
    """A row for each case of a group, and below them the pictures."""
    measured = {outcome["name"]: outcome for outcome in data("stability")}
    rows, sheets = [], []
    for case in (case for case in all_cases() if case.group == group):
        outcome = measured[case.name]
        samplers = [case.samplers] if case.samplers else by_sampler(outcome["samplers"])
        remedy = [f"*Instead:* {case.instead}"] if case.instead else []
        words = [f"**{case.title}**", case.happens, case.why, "<br>".join(samplers), "<br>".join([case.rooks, *remedy])]
        cells = [*words, "<br>".join(outcome["figures"]), outcome["verdict"]]
        rows.append([cell.replace("|", r"\|") for cell in cells])
        if outcome["pictures"]:
            caption = f"{case.title}: {', '.join(outcome['pictures'])}"
            sheets.append(f"\n![{caption}](images/stability/{case.name}.png)\n\n*{caption}*\n")
    heads = ["case", "what happens", "why", "the samplers", "what Rooks does", "figures (bounds)", "verdict"]
    return table(heads, rows) + "".join(sheets)


BLOCKS: dict[str, Callable[[], str]] = {
    "samplers": samplers_table,
    "scores": scores_table,
    "claims": claims,
    "table_5_1": table_5_1,
    "horizon": horizon,
    "slopes": slopes,
    "three_times": three_times,
    "depths": depths,
    "path_times": path_times,
    **{f"stability_{group}": partial(stability, group) for group in GROUPS},
}


def updated(text: str) -> str:
    """A page's text with its blocks made anew."""
    return re.sub(
        r"(<!-- (\w+):begin -->\n).*?(<!-- \2:end -->)",
        lambda match: f"{match[1]}\n{BLOCKS[match[2]]()}\n{match[3]}",
        text,
        flags=re.DOTALL,
    )


def chart_page() -> str:
    """The page with all tables of the chart."""
    return chart_tables.markdown(data("chart"))


def pictures(text: str) -> list[str]:
    """The paths below docs/images of the pictures that a page of docs/ shows or links to."""
    return re.findall(r"\]\(images/(.*?)\)", text)


def main() -> None:
    for page in PAGES:
        page.write_text(updated(page.read_text(encoding="utf-8")), encoding="utf-8")
    CHART_PAGE.write_text(chart_page(), encoding="utf-8")
    for picture in (shown for page in PAGES[1:] for shown in pictures(page.read_text(encoding="utf-8"))):
        if (MADE / picture).exists():
            (IMAGES / picture).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(MADE / picture, IMAGES / picture)


if __name__ == "__main__":
    main()
