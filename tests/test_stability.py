"""The cases of the stability suite that take seconds; `make stability` runs them all."""

from __future__ import annotations

import pytest

from core import SAMPLERS, RenderSettings
from tests.stability.case import KEPT, WRONG, Case, Record, all_cases, by_sampler, compare_samplers, run

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


def test_samplers_are_compared_in_place_of_a_cases_own():
    def measure(record: Record) -> None:
        for settings in (
            RenderSettings(samples=3),
            RenderSettings(samples=3, sampler="jittered", lens_sampler="random"),
        ):
            assert len(set(settings.samplers.values())) == 1
            record.claim("samples", settings.sample_count, at_most=3)
        record.claim("of Random", RenderSettings(samples=3, sampler="random").sample_count, at_most=3)

    found = compare_samplers(Case("a", "counts", "A", "", "", "", measure))
    broken = "samples: 4 (at most 3); samples: 4 (at most 3)"
    assert by_sampler(found) == [f"Regular, Jittered, ZSobol: {broken}", f"The others: {KEPT}"]
    assert set(RenderSettings(sampler="jittered").samplers.values()) == {"jittered"}


def test_of_many_broken_claims_two_are_told():
    case = Case("a", "counts", "A", "", "", "", lambda record: [record.claim("n", n, at_most=0) for n in range(5)])
    assert by_sampler(compare_samplers(case)) == ["All: n: 1 (at most 0); n: 2 (at most 0); and 2 more"]


def test_what_all_samplers_do_is_one_line():
    assert by_sampler(dict.fromkeys(SAMPLERS, "right")) == ["All: right"]
    assert len(by_sampler({name: f"{k}" for k, name in enumerate(SAMPLERS)})) == len(SAMPLERS)
