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
from unittest.mock import patch

import numpy as np

from core import SAMPLERS, RenderSettings

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

#: What `compare_samplers` says of a sampler with which a case keeps all of its claims.
KEPT = "within the bounds"


@dataclass
class Record:
    """What a case has measured. `samplers` says for each sampler by its name what it does, where a case tells that."""

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
    in `instead` does not. `samplers` says why samplers need not be compared, where they have no part in a case; of all
    others that do not tell of each sampler themselves `compare_samplers` does. `is_slow` keeps a case that takes more
    than seconds out of `make test`.
    """

    name: str
    group: str
    title: str
    happens: str
    why: str
    rooks: str
    measure: Callable[[Record], None]
    instead: str = ""
    samplers: str = ""
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
    title: str, *, happens: str, why: str, rooks: str, instead: str = "", samplers: str = "", is_slow: bool = False
) -> Callable[[Callable[[Record], None]], Callable[[Record], None]]:
    """Make a function a case; it is called after the function, and stands in the group of its module."""

    def register(measure: Callable[[Record], None]) -> Callable[[Record], None]:
        name, group = measure.__name__, measure.__module__.rpartition(".")[2]
        assert name not in _cases, f"two cases are called {name}"
        _cases[name] = Case(name, group, title, happens, why, rooks, measure, instead, samplers, is_slow)
        return measure

    return register


def all_cases() -> list[Case]:
    """Every case, in the order of `GROUPS` and of the lines in their files."""
    for group in GROUPS:
        import_module(f"{__package__}.{group}")
    return [case for group in GROUPS for case in _cases.values() if case.group == group]


def run(case: Case) -> Outcome:
    """Measure a case. What it raises is a fault of Rooks or of the case: it is printed, and makes the case wrong."""
    start = time.perf_counter()
    record = _measured(case)
    assert record.figures, f"{case.name} claims nothing"
    return Outcome(case, record, time.perf_counter() - start)


def compare_samplers(case: Case) -> dict[str, str]:
    """What becomes of a case's claims with each sampler, by its name, in place of those that the case renders with.

    What a case asks of Random or of Hammersley is about these, and stays.
    """
    own, found = RenderSettings.samplers.fget, {}
    for name in SAMPLERS:

        def chosen(settings: RenderSettings, name: str = name) -> dict[str, str]:
            of_domains = own(settings)
            return of_domains if settings.sampler in ("random", "hammersley") else dict.fromkeys(of_domains, name)

        with patch.object(RenderSettings, "samplers", property(chosen)):
            found[name] = _shortly(_measured(case).broken)
    return found


def _shortly(broken: list[str]) -> str:
    more = [f"and {len(broken) - 2} more"] if len(broken) > 2 else []
    return "; ".join(broken[:2] + more) or KEPT


def by_sampler(found: dict[str, str]) -> list[str]:
    """What samplers do, a line each; what most of them do stands last, in one line."""
    names: dict[str, list[str]] = {}
    for name, text in found.items():
        names.setdefault(text, []).append(SAMPLERS[name].label.partition(",")[0])
    whose = {text: ", ".join(labels) for text, labels in names.items()}
    for text, labels in names.items():
        if len(labels) > len(found) / 2:
            del whose[text]
            whose[text] = "The others" if whose else "All"
    return [f"{labels}: {text}" for text, labels in whose.items()]


def _measured(case: Case) -> Record:
    record = Record()
    try:
        case.measure(record)
    except Exception:
        traceback.print_exc()
        record.claim("exceptions", 1, at_most=0)
    return record
