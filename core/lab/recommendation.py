"""One sentence: which of the compared samplers to take for a scene, and what it saves.

The yardstick is Random, or where that was not compared the sampler with the largest error. The best sampler is the one
that reaches the yardstick's error, at its largest count, in the least time. Where only one count was measured there is
no such time, and errors at that count are compared instead. What lies within the uncertainty is said to be undecided.

The root mean square does not tell a pattern from noise, and the eye does: where the best one's error is mostly bias,
the same with every seed, the sentence says so.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from ..samplers import SAMPLERS
from .efficiency import Curve, front, needed, yardstick

#: However steady the timings look: the next render on the same machine is not more like them than this.
TIME_UNCERTAINTY = 0.05
#: A difference counts from so many standard errors on.
SIGNIFICANT = 2
PATTERN = ", but as a pattern and not as noise"


def recommend(measured: dict[str, Curve], patterned: Collection[str]) -> str:
    """The sentence for curves by sampler name, of one count or several; `patterned` are those that err by a pattern."""
    if len(measured) == 1:
        (curve,) = measured.values()
        return f"Only {_label(curve)} was measured on this scene: add another sampler to compare it with."
    against = yardstick(measured)
    if against.errors[-1] == 0:
        exact = [curve for curve in measured.values() if curve.errors[-1] == 0]
        if len(exact) == len(measured):
            return "Every sampler renders this scene exactly: take any, with the fewest samples."
        return f"{_label(against)} renders this scene exactly: nothing can be better."
    if len(against.counts) == 1:
        return _by_error(measured, against, patterned)
    return _by_time(measured, against, patterned)


def _by_time(measured: dict[str, Curve], against: Curve, patterned: Collection[str]) -> str:
    target, own_time = against.errors[-1], against.seconds[-1]
    others = {name: curve for name, curve in measured.items() if curve is not against}
    reach = {name: needed(*front(curve.seconds, curve.errors), target) for name, curve in others.items()}
    ratios = {name: reached.amount / own_time for name, reached in reach.items() if reached.relation != ">"}
    uncertainties = {name: _time_uncertainty(measured[name], target) for name in ratios}
    own = _time_uncertainty(against, target)
    best = min(ratios, key=ratios.get, default=None)
    if best is None or math.log(1 / ratios[best]) < SIGNIFICANT * math.hypot(own, uncertainties[best]):
        return f"No sampler is clearly better than {_label(against)} for this scene."
    equals = [
        name
        for name, ratio in ratios.items()
        if name != best
        and math.log(ratio / ratios[best]) < SIGNIFICANT * math.hypot(uncertainties[name], uncertainties[best])
    ]
    bound = "at most " if reach[best].relation == "≤" else ""
    pattern = PATTERN if best in patterned else ""
    saved = f"the error of {_label(against)} in {bound}{ratios[best]:.2f} of its time"
    return f"{_label(measured[best])} for this scene: {saved}{pattern}{_aside(measured, equals)}."


def _by_error(measured: dict[str, Curve], against: Curve, patterned: Collection[str]) -> str:
    best = min(measured.values(), key=lambda curve: curve.errors[-1])
    count = best.counts[-1]
    if _same(against, best):
        return f"No sampler is clearly better than {_label(against)} for this scene at {count} samples."
    equals = [
        name for name, curve in measured.items() if curve is not best and curve is not against and _same(curve, best)
    ]
    error, time = best.errors[-1] / against.errors[-1], best.seconds[-1] / against.seconds[-1]
    pattern = PATTERN if best.sampler in patterned else ""
    saved = f"at {count} samples {error:.2f} of the error of {_label(against)}, in {time:.2f} of its time"
    return f"{_label(best)} for this scene: {saved}{pattern}{_aside(measured, equals)}."


def _same(worse: Curve, better: Curve) -> bool:
    """Whether their errors at the last count differ by no more than chance."""
    chance = math.hypot(worse.uncertainties[-1], better.uncertainties[-1])
    return worse.errors[-1] - better.errors[-1] <= SIGNIFICANT * chance


def _time_uncertainty(curve: Curve, target: float) -> float:
    """The relative standard error of the time to reach `target`: that of the error divided by the slope, and timing."""
    order = np.argsort(curve.seconds, kind="stable")
    errors, seconds = curve.errors[order], curve.seconds[order]
    above = np.flatnonzero(errors > target)
    i = min(above[-1] if len(above) else 0, len(errors) - 2)
    if not 0 < errors[i + 1] < errors[i]:
        return math.inf if errors[i + 1] > 0 else TIME_UNCERTAINTY
    slope = math.log(errors[i] / errors[i + 1]) / math.log(max(seconds[i + 1] / seconds[i], 1 + 1e-9))
    relative = max(curve.uncertainties[order][i : i + 2] / errors[i : i + 2])
    return math.hypot(relative / slope, TIME_UNCERTAINTY)


def _aside(measured: dict[str, Curve], names: Sequence[str]) -> str:
    """The samplers that do as well."""
    labels = [_label(measured[name]) for name in names]
    if not labels:
        return ""
    listed = labels[0] if len(labels) == 1 else f"{', '.join(labels[:-1])} and {labels[-1]}"
    return f" ({listed} {'does' if len(labels) == 1 else 'do'} as well, within the uncertainty)"


def _label(curve: Curve) -> str:
    return SAMPLERS[curve.sampler].label
