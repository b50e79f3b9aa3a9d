"""A case of the stability suite: a way in which rendering goes wrong, and measurements that show whether it does.

A case is a function of a `Record` that measures, and makes claims: a figure with the bounds that it has to keep. Its
words (what happens, why, what Rooks does) stand beside it, and become its row of docs/stability.md.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module

import numpy as np

#: The modules of this package that hold cases, in the order of the page, with their headings there.
GROUPS = {
    "counts": "Counts of samples",
    "correlation": "Correlation",
    "aliasing": "Aliasing",
    "lens": "Lenses",
    "lights": "Lights",
    "numbers": "Scales and distances",
    "leaks": "Leaks of light",
    "geometry": "Meshes at their limits",
    "materials": "Materials",
    "materials_images": "Images on surfaces",
    "materials_glass": "Layers of glass and transparency",
    "fireflies": "Fireflies",
    "process": "Processes",
    "random_scenes": "Random scenes",
    "broken_files": "Broken files",
}

RIGHT, LIMIT, WRONG = "right", "limit", "wrong"


@dataclass
class Record:
    """What a case has measured. `samplers` says for each sampler by its name what it does, where they differ."""

    figures: list[str] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)
    samplers: dict[str, str] = field(default_factory=dict)
    pictures: dict[str, np.ndarray] = field(default_factory=dict)

    def claim(self, what: str, value: float, *, at_least: float = -np.inf, at_most: float = np.inf) -> None:
        """Claim that a figure keeps its bounds, which are part of what is shown. NaN keeps none."""
        bounds = [f"at least {at_least:g}"] * (at_least > -np.inf) + [f"at most {at_most:g}"] * (at_most < np.inf)
        text = f"{what}: {value:.3g}" + f" ({', '.join(bounds)})" * bool(bounds)
        self.figures.append(text)
        if not at_least <= value <= at_most:
            self.broken.append(text)

    def show(self, label: str, linear: np.ndarray) -> None:
        """Put a linear picture, (height, width, 3) with the bottom row first, on the case's sheet."""
        self.pictures[label] = linear


@dataclass(frozen=True)
class Case:
    """A case: its words, and what measures it.

    `instead` is what to use where a method fails by its nature: such a case claims that it does, and that what stands
    in `instead` does not. `is_slow` keeps a case that takes more than seconds out of `make test`.
    """

    name: str
    group: str
    title: str
    happens: str
    why: str
    rooks: str
    measure: Callable[[Record], None]
    instead: str = ""
    is_slow: bool = False


@dataclass(frozen=True)
class Outcome:
    """What became of a case: `verdict` is "right", "limit" (right, where the method can be) or "wrong"."""

    case: Case
    record: Record
    seconds: float

    @property
    def verdict(self) -> str:
        if self.record.broken:
            return WRONG
        return LIMIT if self.case.instead else RIGHT


_cases: dict[str, Case] = {}


def case(
    title: str, *, happens: str, why: str, rooks: str, instead: str = "", is_slow: bool = False
) -> Callable[[Callable[[Record], None]], Callable[[Record], None]]:
    """Make a function a case; it is called after the function, and stands in the group of its module."""

    def register(measure: Callable[[Record], None]) -> Callable[[Record], None]:
        name, group = measure.__name__, measure.__module__.rpartition(".")[2]
        assert name not in _cases, f"two cases are called {name}"
        _cases[name] = Case(name, group, title, happens, why, rooks, measure, instead, is_slow)
        return measure

    return register


def all_cases() -> list[Case]:
    """Every case, in the order of `GROUPS` and of the lines in their files."""
    for group in GROUPS:
        import_module(f"{__package__}.{group}")
    return [case for group in GROUPS for case in _cases.values() if case.group == group]


def run(case: Case) -> Outcome:
    """Measure a case. What it raises is a fault of Rooks or of the case: it is printed, and makes the case wrong."""
    record, start = Record(), time.perf_counter()
    try:
        case.measure(record)
    except Exception:
        traceback.print_exc()
        record.claim("exceptions", 1, at_most=0)
    assert record.figures, f"{case.name} claims nothing"
    return Outcome(case, record, time.perf_counter() - start)
