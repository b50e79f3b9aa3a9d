"""How many dimensions deep a good sampler still helps: its advantage over Random on paths of more and more bounces.

A path takes a point on the lamp at the first surface, and for each bounce a direction and a point on the lamp from
there: 2 + 4 × bounces dimensions. (From the fourth bounce on Russian roulette takes one more, not counted here.) Each
pair is well distributed in itself, and they meet in random order. What a sampler gains is gained in the parts of the
integrand that few dimensions decide; what many decide together it integrates no better than Random.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..samplers import SAMPLERS
from .efficiency import MILESTONES, YARDSTICK, Curve, curves
from .measure import Cell


class Advantage(NamedTuple):
    """RMSE of Random over that of a sampler with as many samples, and its standard error: 1 where it is no use."""

    ratio: float
    uncertainty: float


def dimensions(bounces: int) -> int:
    """How many numbers of the samplers decide what light a path of `scenes.box` finds."""
    return 2 + 4 * bounces


def bounces_text(bounces: int) -> str:
    return f"{bounces} bounce{'s' if bounces > 1 else ''}"


def paths(data: dict) -> dict[int, dict[str, Curve]]:
    """The curves of each sampler, by the number of bounces."""
    measured = [subject for subject in data["subjects"].values() if subject["bounces"] is not None and subject["cells"]]
    return {
        subject["bounces"]: curves(Cell(**cell) for cell in subject["cells"])
        for subject in sorted(measured, key=lambda subject: subject["bounces"])
    }


def advantage(measured: dict[str, Curve], sampler: str, count: int) -> Advantage | None:
    """That of `sampler` at `count` samples; None where it or Random was not measured there, or is exact."""
    relative, errors = [], []
    for name in (YARDSTICK, sampler):
        at = np.flatnonzero(measured[name].counts == count) if name in measured else ()
        if len(at) == 0 or measured[name].errors[at[0]] == 0:
            return None
        errors.append(float(measured[name].errors[at[0]]))
        relative.append(float(measured[name].uncertainties[at[0]]) / errors[-1])
    ratio = errors[0] / errors[1]
    return Advantage(ratio, ratio * math.hypot(*relative) if sampler != YARDSTICK else 0.0)


def shown(data: dict) -> tuple[list[str], list[int]]:
    """The samplers other than Random, in the order of display, and the MILESTONES at which any has an advantage."""
    known = {
        (name, count)
        for measured in paths(data).values()
        for name in measured.keys() - {YARDSTICK}
        for count in MILESTONES
        if advantage(measured, name, count)
    }
    names = sorted({name for name, _ in known}, key=lambda name: SAMPLERS[name].number)
    return names, sorted({count for _, count in known})


def table(data: dict) -> tuple[list[str], list[list[str]]]:
    """Heads and rows, a row for each sampler: its advantages at each number of bounces, joined by slashes."""
    found = paths(data)
    names, counts = shown(data)
    heads = [f"RMSE of Random ÷ RMSE at {'/'.join(map(str, counts or MILESTONES))}"]
    heads += [f"{bounces_text(bounces)}, {dimensions(bounces)} dimensions" for bounces in found]
    rows = []
    for name in names:
        gains = [[advantage(measured, name, count) for count in counts] for measured in found.values()]
        texts = ["/".join(f"{gain.ratio:.2f}" if gain else "–" for gain in its) for its in gains]
        rows.append([SAMPLERS[name].label, *texts])
    return heads, rows
