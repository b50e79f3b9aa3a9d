"""What a sampler's errors mean: the slope with which they fall, and what it costs to be as good as another sampler.

Error is plotted, fitted and interpolated on log-log axes, where a power law is a straight line. Between measured counts
it is interpolated; beyond them nothing is claimed but a bound.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..samplers import SAMPLERS, TEXTBOOK
from .measure import Cell

#: Slopes are fitted from this count on: a power law is what the error tends to when there are many samples.
FIT_FROM = 16
#: The counts of the yardstick at which others are compared with it.
MILESTONES = (16, 64, 256)
YARDSTICK = "random"


@dataclass(frozen=True)
class Curve:
    """A sampler's error against samples and time, each array with one number per count, in order of counts.

    `errors` is the root of the mean over seeds of the mean squared error, `uncertainties` its standard error, `low` and
    `high` the 16th and 84th percentile of the seeds' RMSEs, `seconds` the median over seeds, tables included.
    """

    sampler: str
    counts: np.ndarray
    errors: np.ndarray
    uncertainties: np.ndarray
    low: np.ndarray
    high: np.ndarray
    seconds: np.ndarray


class Needed(NamedTuple):
    """An amount of samples or of seconds: exactly so much ("="), at most ("≤") or more (">")."""

    amount: float
    relation: str = "="

    def text(self, number: str = ".3g") -> str:
        return ("" if self.relation == "=" else self.relation) + format(self.amount, number)


class Slope(NamedTuple):
    """An exponent fitted by least squares on log-log axes, and its standard error (NaN from two points)."""

    value: float
    error: float


def curves(cells: Iterable[Cell]) -> dict[str, Curve]:
    """The curve of each sampler, by name, in the order of display."""
    by_sampler: dict[str, list[Cell]] = {}
    for cell in cells:
        by_sampler.setdefault(cell.sampler, []).append(cell)
    order = sorted(by_sampler, key=lambda name: SAMPLERS[name].number)
    return {name: _curve(name, sorted(by_sampler[name], key=lambda cell: cell.count)) for name in order}


def _curve(name: str, cells: Sequence[Cell]) -> Curve:
    errors = np.array([cell.rmse for cell in cells])
    squares = errors**2
    total = np.sqrt(squares.mean(axis=1))
    spread = squares.std(axis=1, ddof=1) / math.sqrt(errors.shape[1]) if errors.shape[1] > 1 else np.zeros(len(total))
    seconds = [np.median(np.add(cell.setup_seconds, cell.seconds)) for cell in cells]
    return Curve(
        name,
        np.array([cell.count for cell in cells]),
        total,
        np.divide(spread, 2 * total, out=np.zeros_like(total), where=total > 0),
        *np.percentile(errors, (16, 84), axis=1),
        np.array(seconds),
    )


def fit_slope(counts: np.ndarray, errors: np.ndarray) -> Slope | None:
    """The slope of the errors from FIT_FROM samples on; None where there are not two that are not 0."""
    use = (counts >= FIT_FROM) & (errors > 0)
    if use.sum() < 2:
        return None
    x, y = np.log(counts[use]), np.log(errors[use])
    x = x - x.mean()
    slope = (x @ y) / (x @ x)
    left = y - y.mean() - slope * x
    error = math.sqrt((left @ left) / (len(x) - 2) / (x @ x)) if len(x) > 2 else math.nan
    return Slope(float(slope), error)


def needed(amounts: np.ndarray, errors: np.ndarray, target: float) -> Needed:
    """The samples (or seconds) from which on the error stays at or below `target`.

    `amounts` are positive; where one sampler's error goes up and down again, the last descent counts.
    """
    order = np.argsort(amounts, kind="stable")
    amounts, errors = amounts[order], errors[order]
    above = np.flatnonzero(errors > target)
    if len(above) == 0:
        return Needed(float(amounts[0]), "≤")
    i = above[-1]
    if i == len(errors) - 1:
        return Needed(float(amounts[-1]), ">")
    if errors[i + 1] == 0:
        return Needed(float(amounts[i + 1]), "≤")
    share = math.log(errors[i] / target) / math.log(errors[i] / errors[i + 1])
    return Needed(float(amounts[i] * (amounts[i + 1] / amounts[i]) ** share))


def error_at(amounts: np.ndarray, errors: np.ndarray, amount: float) -> float | None:
    """The error after `amount` samples or seconds; None outside what was measured, or next to an error of 0."""
    order = np.argsort(amounts, kind="stable")
    amounts, errors = amounts[order], errors[order]
    if not amounts[0] <= amount <= amounts[-1]:
        return None
    with np.errstate(divide="ignore"):
        found = math.exp(np.interp(math.log(amount), np.log(amounts), np.log(errors)))
    return found if found > 0 else None


def front(amounts: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A sampler's counts that are worth their price, in order of amounts: none is as good for less."""
    order = np.lexsort((errors, amounts))
    amounts, errors = amounts[order], errors[order]
    better = np.r_[True, errors[1:] < np.minimum.accumulate(errors)[:-1]]
    return amounts[better], errors[better]


def yardstick(measured: dict[str, Curve]) -> Curve:
    """The sampler that others are compared with: Random, or else the one whose error is the largest at the end."""
    return measured.get(YARDSTICK) or max(measured.values(), key=lambda curve: curve.errors[-1])


def milestones(curve: Curve) -> list[int]:
    """Indices into a yardstick's counts at which others are compared with it."""
    chosen = np.flatnonzero(np.isin(curve.counts, MILESTONES))
    return chosen.tolist() if len(chosen) else [len(curve.counts) - 1]


@dataclass(frozen=True)
class Standing:
    """A sampler against the yardstick, with one entry for each of `milestones`.

    `samples` and `seconds` reach the yardstick's error there; `error_ratios` are its errors, relative to the
    yardstick's, after the time that the yardstick took (None where it was not measured so briefly or so long).
    """

    samples: list[Needed]
    seconds: list[Needed]
    error_ratios: list[float | None]


def compare(curve: Curve, against: Curve) -> Standing:
    """How `curve` does at equal error and at equal time."""
    at = milestones(against)
    errors, seconds = against.errors[at], against.seconds[at]
    worthwhile = front(curve.seconds, curve.errors)
    reached = [error_at(*worthwhile, when) for when in seconds]
    return Standing(
        [needed(curve.counts.astype(float), curve.errors, target) for target in errors],
        [needed(*worthwhile, target) for target in errors],
        [error / target if error and target else None for error, target in zip(reached, errors, strict=True)],
    )


class TimesFewer(NamedTuple):
    """So many times the samples of `best` Random needs for the same error; `uncertainty` is the standard error."""

    best: str
    ratio: float
    uncertainty: float


def times_fewer(measured: dict[str, Curve]) -> dict[int, TimesFewer]:
    """For each of MILESTONES that was measured: the best of the textbook's six there, and how Random compares.

    Random's samples are independent, so that its error falls with exactly n^-1/2: with the errors at n, Random needs
    n × (its error / the best one's)², whether that count was measured or not.
    """
    six = {name: curve for name, curve in measured.items() if name in TEXTBOOK}
    answer = {}
    for count in MILESTONES:
        at = {name: np.flatnonzero(curve.counts == count) for name, curve in six.items()}
        errors = {name: float(six[name].errors[i[0]]) for name, i in at.items() if len(i)}
        if YARDSTICK not in errors or min(errors.values()) == 0:
            continue
        best = min(errors, key=errors.get)
        ratio = (errors[YARDSTICK] / errors[best]) ** 2
        relative = [six[name].uncertainties[at[name][0]] / errors[name] for name in (YARDSTICK, best)]
        answer[count] = TimesFewer(best, ratio, 2 * ratio * math.hypot(*relative) if best != YARDSTICK else 0.0)
    return answer
