"""The README and the pages of docs/ are true: their tables are the code's and the data's, and their Python runs."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import OpenEXR
import pytest

from core import SAMPLERS
from core.lab import chart_tables
from core.lab.efficiency import curves, fit_slope
from tests.stability.case import all_cases

README = Path(__file__).parent.parent / "README.md"

update = runpy.run_path(str(README.parent / "docs" / "update.py"))


@pytest.mark.parametrize("page", update["PAGES"], ids=lambda page: page.name)
def test_the_generated_parts_of_a_page_are_up_to_date(page):
    text = page.read_text(encoding="utf-8")
    assert update["updated"](text) == text, "run `make docs`, or docs/update.py where only code has changed"


def test_the_page_of_the_chart_is_that_of_its_data():
    assert update["CHART_PAGE"].read_text(encoding="utf-8") == update["chart_page"]()


def test_the_page_on_stability_has_every_case():
    text = (README.parent / "docs" / "stability.md").read_text(encoding="utf-8")
    for case in all_cases():
        assert f"| **{case.title}** |" in text, f"{case.name}: docs/stability.md needs a block for its group"


def test_what_the_page_on_stability_names_for_what_was_mended_is_there():
    text = (README.parent / "docs" / "stability.md").read_text(encoding="utf-8")
    heads, _, *rows = re.findall(r"^\| .*\|$", text.partition("## What Rooks changes")[0], flags=re.MULTILINE)
    cases = {case.name for case in all_cases()}
    assert heads.endswith("| fails without the fix |")
    for row in rows:
        named = re.findall(r"`(\S+?)`", row.split(" | ")[-1])
        assert named, row
        for name in named:
            file, _, test = name.rpartition("::")
            assert name in cases or f"\ndef {test}(" in (README.parent / "tests" / file).read_text("utf-8"), name


def test_the_page_on_stability_tells_of_the_samplers_in_every_row():
    measured = {outcome["name"]: outcome["samplers"] for outcome in update["data"]("stability")}
    for case in all_cases():
        assert case.samplers or list(measured[case.name]) == list(SAMPLERS), case.name


def test_the_example_of_the_core_runs_and_writes_its_picture(tmp_path, monkeypatch, capsys):
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out == "(320, 320, 4) 64 samples per pixel\n"
    with OpenEXR.File("shadow.exr") as picture:
        assert picture.header()["rooks:samples"] == 64
        pixels = picture.channels()["RGBA"].pixels
    # The shadow falls away from the lamp, around x = -0.75 m: 40 pixels left of the middle.
    shadow, open_floor = pixels[150:170, 85:125, 0].mean(), pixels[230:250, 85:125, 0].mean()
    assert shadow < 0.5 * open_floor


@pytest.mark.parametrize("page", update["PAGES"], ids=lambda page: page.name)
def test_what_a_page_shows_and_links_to_is_there(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!http|#)([^)#]*).*?\)", text):
        assert (page.parent / target).exists(), target


def test_the_docs_measured_slopes_are_within_a_tenth_of_the_expected_ones():
    for subject in update["data"]("chart")["subjects"].values():
        for name, curve in curves(chart_tables.cells(subject)).items():
            slope = fit_slope(curve.counts, curve.errors)
            if name in subject["expected"]:
                assert slope.value == pytest.approx(subject["expected"][name], abs=0.1), (subject["label"], name)


def test_the_docs_references_err_ten_times_less_than_what_they_judge():
    for subject in update["data"]("chart")["subjects"].values():
        assert subject["kind"] == "integrand" or subject["references"]
        for reference in subject["references"]:
            judged = [cell for cell in subject["cells"] if cell["sampler"] in reference["judges"]]
            assert reference["sampler"] not in reference["judges"]
            assert not set(reference["seeds"]) & {seed for cell in judged for seed in cell["seeds"]}
            assert 10 * reference["standard_error"] <= min(error for cell in judged for error in cell["rmse"])
