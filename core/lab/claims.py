"""The lecture's claims about the textbook's samplers, each checked against what was measured, in one sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..samplers import TEXTBOOK
from .criteria import MOST_UNEVEN, Marks

YES_NO = {True: "✓", False: "✗"}


def findings(measured: Mapping[str, Sequence[Marks]]) -> list[str]:
    """A sentence for each claim about samplers that were measured; `measured` has the marks at each count by name."""
    sentences = []
    if "hammersley" in measured:
        sentences.append(_well_distributed(measured["hammersley"]))
    if "n_rooks" in measured:
        sentences.append(_no_better_than_random(measured["n_rooks"]))
    if set(TEXTBOOK) <= measured.keys():
        perfect = [name for name in TEXTBOOK if all(all(marks.criteria) for marks in measured[name])]
        who = " and ".join(perfect) or "none"
        sentences.append(f"Of the textbook's six, all four marks are met by: {who} ({_counts(measured['regular'])}).")
    return sentences


def _well_distributed(measured: Sequence[Marks]) -> str:
    met = [all(marks.criteria[number] for marks in measured) for number in range(3)]
    plane, filled, distance = (
        _listed([getattr(marks, name).value for marks in measured]) for name in ("unevenness", "filled", "distance")
    )
    return (
        f'"Hammersley samples are well distributed", that is, have marks 1 to 3: {_verdict(all(met))}. '
        f"1 {YES_NO[met[0]]} the plane is {plane} times as uneven as random points leave it; "
        f"2 {YES_NO[met[1]]} {filled} of the strata are filled; "
        f"3 {YES_NO[met[2]]} the smallest distance is {distance} of the largest possible ({_counts(measured)})."
    )


def _no_better_than_random(measured: Sequence[Marks]) -> str:
    plane = [marks.unevenness.value for marks in measured]
    return (
        f'"N-rooks is no better than random in 2-D": {_verdict(min(plane) > MOST_UNEVEN)}. '
        f"The plane is {_listed(plane)} times as uneven as random points leave it ({_counts(measured)})."
    )


def _verdict(holds: bool) -> str:
    return "holds" if holds else "does not hold"


def _listed(values: Sequence[float]) -> str:
    return "/".join(f"{value:.2f}" for value in values)


def _counts(measured: Sequence[Marks]) -> str:
    return "n = " + "/".join(str(marks.count) for marks in measured)
