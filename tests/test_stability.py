"""The cases of the stability suite that take seconds; `make stability` runs them all."""

from __future__ import annotations

import pytest

from tests.stability.case import WRONG, Case, Record, all_cases, run

QUICK = [case for case in all_cases() if not case.is_slow]


@pytest.mark.parametrize("case", QUICK, ids=lambda case: case.name)
def test_a_case_keeps_its_claims(case):
    assert run(case).verdict != WRONG


@pytest.mark.parametrize(
    ("value", "bounds"), [(2, {"at_most": 1}), (0, {"at_least": 1}), (float("nan"), {"at_least": 0, "at_most": 1})]
)
def test_a_broken_claim_makes_a_case_wrong(value, bounds):
    case = Case("a", "counts", "A", "", "", "", lambda record: record.claim("figure", value, **bounds))
    assert run(case).verdict == WRONG


def test_an_exception_makes_a_case_wrong(capsys):
    def fail(record: Record) -> None:
        raise ValueError("nobody thought of this")

    assert run(Case("a", "counts", "A", "", "", "", fail)).verdict == WRONG
    assert "nobody thought of this" in capsys.readouterr().err


def test_a_figure_shows_its_bounds():
    record = Record()
    record.claim("leaks", 0, at_most=0)
    assert record.figures == ["leaks: 0 (at most 0)"]
    assert not record.broken
