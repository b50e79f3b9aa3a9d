"""The charts' honesty: references, bias and variance, slopes, interpolation, and that no measurement is lost.

Seeds are fixed; statistical comparisons allow four standard errors.
"""

from __future__ import annotations

import csv
import json
import math
from itertools import combinations, pairwise

import numpy as np
import pytest

from core import Camera, RenderSettings, Scene, domains, preparation, render
from core.lab import chart, chart_data, chart_drawing, chart_tables, depth, scenes, style
from core.lab.cli import main
from core.lab.efficiency import (
    Curve,
    Needed,
    compare,
    curves,
    error_at,
    fit_slope,
    milestones,
    needed,
    times_fewer,
    yardstick,
)
from core.lab.measure import (
    ENOUGH_PICTURES,
    LIKE_SOBOL,
    MIN_PICTURES,
    REFERENCE_SEEDS,
    Cancelled,
    Laboratory,
    Study,
    assign_references,
    bias_and_variance,
    error_products,
)
from core.samplers import SAMPLERS

QUICK = ("--resolution", "12x8", "--seeds", "3", "--trials", "5")


def curve(sampler: str, counts, errors, seconds=None) -> Curve:
    counts, errors = np.array(counts), np.array(errors, float)
    seconds = counts / 1000 if seconds is None else np.array(seconds, float)
    return Curve(sampler, counts, errors, errors * 0.01, errors, errors, seconds)


def study(samplers=("random", "multi_jittered"), counts=(1, 4, 16), seeds=3, **settings) -> Study:
    return Study(scenes.sharp_edge((16, 12)), RenderSettings(threads=1, **settings), samplers, counts, seeds)


# References


def test_a_reference_never_shares_sampler_or_points_with_what_it_judges():
    for size in (1, 2, 3, 5, len(SAMPLERS)):
        for samplers in combinations(SAMPLERS, size):
            assigned = assign_references(samplers)
            assert set(assigned) == set(samplers)
            for judged, reference in assigned.items():
                assert judged != reference
                assert not {judged, reference} <= LIKE_SOBOL


def test_a_reference_never_shares_a_seed_with_what_is_judged():
    for seed in (0, 7, REFERENCE_SEEDS - 1, REFERENCE_SEEDS, 2**31 - 1):
        plan = study(seed=seed, seeds=40)
        judged = plan.judged_seeds()
        references = [plan.reference_seed(i) for i in range(1000)]
        assert len(set(judged)) == 40
        assert len(set(references)) == 1000
        assert max(judged) < REFERENCE_SEEDS <= min(references)
        assert max(references) < 2**31  # the largest seed that there is


def test_the_reference_is_as_good_as_it_says():
    """Against the exact coverage of the edge's pixels, which only they and none of the flat ones get wrong."""
    laboratory = Laboratory(study(samplers=("random",), counts=(16, 64), seeds=8))
    reference = laboratory.make_reference("sobol_owen", ["random"])
    exact = scenes.LIGHT + (scenes.DARK - scenes.LIGHT) * scenes.edge_coverage((16, 12))
    error = np.sqrt(np.mean((reference.picture - exact[..., None]) ** 2))
    # About 25 pixels are on the edge: the ratio of two such estimates is within a factor of two.
    assert reference.standard_error / 2 < error < reference.standard_error * 2
    cell, pictures = laboratory.measure_cell("random", 64, 64, reference)
    assert min(cell.rmse) > 10 * reference.standard_error
    for rmse, picture in zip(cell.rmse, pictures, strict=True):
        assert rmse == pytest.approx(np.sqrt(np.mean((picture - exact[..., None]) ** 2)), rel=0.05)


def test_a_reference_ends_when_it_has_cost_enough():
    """Random points cannot judge a lattice: a thousand times as many would be needed."""
    laboratory = Laboratory(study(samplers=("fibonacci",), counts=(64,), seeds=2))
    reference = laboratory.make_reference("random", ["fibonacci"])
    assert len(reference.seeds) == laboratory.study.most_pictures() == ENOUGH_PICTURES


def test_a_flat_picture_needs_no_more_than_a_few_pictures_for_reference():
    flat = Scene(Camera(np.eye(4), (8, 8), (-1, 1, -1, 1)), world=(1.0, 0.5, 0.25))
    laboratory = Laboratory(Study(flat, RenderSettings(threads=1), ("random",), (1,), 2))
    reference = laboratory.make_reference("sobol_owen", ["random"])
    assert len(reference.seeds) == MIN_PICTURES
    assert reference.standard_error == 0


def test_a_chart_says_how_good_its_reference_is():
    reference = {"judges": ["random"], "sampler": "sobol_owen", "samples": 64, "seeds": [1] * 4, "standard_error": 0.02}
    subject = {"kind": "scene", "references": [reference], "cells": [cell_dict("random", 4, [0.1, 0.12])]}
    assert "1/5 of the smallest error charted (NOT 1/10" in chart_tables.reference_text(subject)[0]
    reference["standard_error"] = 0.005
    assert "1/20 of the smallest error charted." in chart_tables.reference_text(subject)[0]


def cell_dict(sampler: str, count: int, rmse: list[float], seconds: float = 0.1) -> dict:
    number = len(rmse)
    return {
        "sampler": sampler,
        "requested": count,
        "count": count,
        "seeds": list(range(number)),
        "rmse": rmse,
        "setup_seconds": [0.0] * number,
        "seconds": [seconds] * number,
        "bias_squared": 0.0,
        "bias_squared_error": 1e-6,
        "variance": float(np.mean(np.square(rmse))),
        "dropped_samples": 0,
    }


# The plan


def test_cells_have_the_count_that_is_really_made_and_each_once():
    cells = study(samplers=("z_sobol", "jittered"), counts=(17, 20, 32, 3)).cells()
    assert [(r, n) for name, r, n in cells if name == "z_sobol"] == [(3, 4), (17, 32)]
    assert [(r, n) for name, r, n in cells if name == "jittered"] == [(3, 4), (17, 20), (32, 36)]


def test_the_compared_sampler_takes_the_place_of_those_of_all_domains():
    plan = study(pixel_sampler="regular", light_sampler="hammersley")
    assert set(plan.settings_for("jittered", 9, 3).samplers.values()) == {"jittered"}


def test_cancelling_stops_a_laboratory():
    answers = iter([False] * 3)
    laboratory = Laboratory(study(), should_cancel=lambda: next(answers, True))
    with pytest.raises(Cancelled):
        laboratory.make_reference("sobol_owen", ["random", "multi_jittered"])


def test_the_share_done_never_falls_and_says_what_is_done():
    seen = []
    laboratory = Laboratory(study(), lambda share, what: seen.append((share, what)))
    laboratory.warm_up()
    reference = laboratory.make_reference("sobol_owen", ["random", "multi_jittered"])
    for cell in laboratory.study.cells():
        laboratory.measure_cell(*cell, reference)
    shares = [share for share, _ in seen]
    assert shares == sorted(shares)
    assert 0 <= shares[0] <= 0.01
    assert 0.8 < shares[-1] <= 1
    assert seen[-1][1] == "Multi-Jittered, 16 samples"


# Bias and variance


def synthetic(bias: float, sigma: float, seeds: int, reference_sigma: float, rng) -> tuple[np.ndarray, np.ndarray]:
    """Pictures and a reference of a black scene of 32 × 32 pixels; the bias has either sign."""
    sign = rng.choice([-1.0, 1.0], (32, 32, 3))
    pictures = bias * sign + rng.normal(0, sigma, (seeds, 32, 32, 3))
    return pictures.astype(np.float32), rng.normal(0, reference_sigma, (32, 32, 3))


@pytest.mark.parametrize(
    ("bias", "sigma", "reference"), [(0.3, 1.0, 0.05), (0.0, 1.0, 0.3), (0.05, 0.0, 0.01), (2, 1, 0)]
)
def test_bias_and_variance_are_told_apart_without_bias(bias, sigma, reference):
    rng = np.random.default_rng(21)
    found = np.array(
        [
            bias_and_variance(error_products(*synthetic(bias, sigma, 6, reference, rng)), reference**2)
            for _ in range(200)
        ]
    )
    for value, expected in ((found[:, 0], bias**2), (found[:, 2], sigma**2)):
        assert abs(value.mean() - expected) <= 4 * value.std() / np.sqrt(200) + 1e-6
    # The standard error that is given is that of the spread, or more: it holds the reference's variance too.
    assert found[:, 0].std() <= 1.1 * np.sqrt((found[:, 1] ** 2).mean())


def test_without_bias_its_estimate_is_as_often_below_zero_as_above():
    rng = np.random.default_rng(22)
    below = sum(bias_and_variance(error_products(*synthetic(0, 1, 5, 0, rng)), 0)[0] < 0 for _ in range(200))
    assert 70 < below < 130


@pytest.mark.parametrize("seeds", [2, 3, 5])
def test_bias_that_is_not_there_is_hardly_ever_significant(seeds):
    """As charts judge it, from three standard errors on: 2 % of the time at most, where three seeds are few."""
    rng = np.random.default_rng(24)
    found = [bias_and_variance(error_products(*synthetic(0, 1, seeds, 0.01, rng)), 1e-4) for _ in range(200)]
    assert sum(bias > 3 * error for bias, error, _ in found) <= 4


def test_a_single_seed_tells_no_bias():
    products = error_products(*synthetic(1, 1, 1, 0, np.random.default_rng(1)))
    assert products.shape == (1, 1)
    assert bias_and_variance(products, 0.0) == (None, None, None)


def test_errors_are_taken_in_pieces_without_loss():
    rng = np.random.default_rng(23)
    pictures, reference = rng.random((3, 200, 150, 3), np.float32), rng.random((200, 150, 3))
    expected = ((pictures - reference) ** 2).mean(axis=(1, 2, 3))
    np.testing.assert_allclose(np.diag(error_products(pictures, reference)), expected, rtol=1e-12)


# Slopes, equal error, equal time


def test_the_slope_of_a_power_law_is_its_exponent():
    counts = np.array([1, 4, 16, 64, 256])
    slope = fit_slope(counts, 3.0 * counts**-0.75)
    assert slope.value == pytest.approx(-0.75)
    assert slope.error == pytest.approx(0, abs=1e-9)
    bent = np.where(counts < 16, 7.0, 3.0 * counts**-0.75)  # few samples do not count
    assert fit_slope(counts, bent).value == pytest.approx(-0.75)


def test_the_slopes_standard_error_is_the_spread_of_slopes():
    rng = np.random.default_rng(24)
    counts = np.array([16, 36, 64, 144, 256])
    slopes = [fit_slope(counts, counts**-0.5 * np.exp(rng.normal(0, 0.05, 5))) for _ in range(2000)]
    spread = np.std([slope.value for slope in slopes])
    assert np.sqrt(np.mean([slope.error**2 for slope in slopes])) == pytest.approx(spread, rel=0.1)


def test_there_is_no_slope_of_one_point_or_of_no_error():
    assert fit_slope(np.array([4, 16]), np.array([1.0, 0.5])) is None
    assert fit_slope(np.array([16, 64]), np.array([0.0, 0.0])) is None
    assert math.isnan(fit_slope(np.array([16, 64]), np.array([1.0, 0.5])).error)


def test_between_counts_a_power_law_is_followed():
    counts = np.array([1.0, 16, 256])
    errors = 2 * counts**-0.75
    assert needed(counts, errors, 2 * 100**-0.75).amount == pytest.approx(100)
    assert needed(counts, errors, errors[1]).amount == pytest.approx(16)
    assert error_at(counts, errors, 100) == pytest.approx(2 * 100**-0.75)


def test_beyond_the_counts_there_are_bounds_only():
    counts, errors = np.array([4.0, 16]), np.array([0.2, 0.1])
    assert needed(counts, errors, 0.3) == Needed(4, "≤")
    assert needed(counts, errors, 0.09) == Needed(16, ">")
    assert error_at(counts, errors, 3.9) is None
    assert error_at(counts, errors, 16.1) is None
    assert needed(counts, np.array([0.2, 0.0]), 0.1) == Needed(16, "≤")
    assert Needed(16, ">").text() == ">16"


def test_of_an_error_that_rises_again_the_last_fall_counts():
    counts, errors = np.array([1.0, 4, 16, 64]), np.array([0.4, 0.1, 0.3, 0.05])
    assert 16 < needed(counts, errors, 0.2).amount < 64


def test_times_out_of_order_are_sorted():
    seconds, errors = np.array([3.0, 1.0, 9.0]), np.array([1 / 3, 1.0, 1 / 9])
    assert needed(seconds, errors, 1 / 2).amount == pytest.approx(2)
    assert error_at(seconds, errors, 2) == pytest.approx(1 / 2)


def test_equal_error_and_equal_time_of_power_laws():
    counts = np.array([1, 4, 16, 64, 256])
    random = curve("random", counts, counts**-0.5)
    half = curve("jittered", counts, 0.5 * counts**-0.5, counts / 500)  # half the error, and twice the time per sample
    assert yardstick({"jittered": half, "random": random}) is random
    assert random.counts[milestones(random)].tolist() == [16, 64, 256]
    found = compare(half, random)
    assert [needed.amount for needed in found.samples] == pytest.approx([4, 16, 64])
    assert [needed.amount for needed in found.seconds] == pytest.approx([0.008, 0.032, 0.128])
    assert found.error_ratios == pytest.approx([0.5 * math.sqrt(2)] * 3)


def test_the_worst_is_the_yardstick_where_there_is_no_random():
    worse = curve("regular", [1, 4], [0.5, 0.4])
    assert yardstick({"jittered": curve("jittered", [1, 4], [0.9, 0.2]), "regular": worse}) is worse


def test_how_many_times_the_samples_random_needs():
    counts = [16, 64, 256]
    measured = {
        "random": curve("random", counts, [0.4, 0.2, 0.1]),
        "jittered": curve("jittered", counts, [0.2, 0.1, 0.01]),
        "hammersley": curve("hammersley", counts, [0.3, 0.05, 0.02]),
        "sobol_owen": curve("sobol_owen", counts, [0.001, 0.001, 0.001]),  # not one of the six
    }
    found = times_fewer(measured)
    assert {n: f.best for n, f in found.items()} == {16: "jittered", 64: "hammersley", 256: "jittered"}
    assert [f.ratio for f in found.values()] == pytest.approx([4, 16, 100])
    assert found[16].uncertainty == pytest.approx(2 * 4 * 0.01 * math.sqrt(2))
    assert times_fewer({"jittered": measured["jittered"]}) == {}


def test_curves_are_of_the_mean_square_and_the_median_time():
    times = {"setup_seconds": [0.1, 0.1, 0.1], "seconds": [0.2, 0.9, 0.3]}
    (found,) = curves([chart_data.Cell(**cell_dict("random", 4, [3.0, 4.0, 0.0]) | times)]).values()
    assert found.errors[0] == pytest.approx(math.sqrt(25 / 3))
    assert found.seconds[0] == pytest.approx(0.4)


def test_a_sampler_needs_its_own_time_for_its_own_error():
    """Also where one of its counts takes longer than a larger one: nobody would choose that."""
    errors = np.array([8.0, 5.0, 4.0, 2.0])
    its = Curve("random", np.array([16, 36, 64, 256]), *[errors] * 4, np.array([1.0, 5.0, 4.0, 9.0]))
    standing = compare(its, its)
    assert [needed.amount for needed in standing.seconds] == pytest.approx([1, 4, 9])
    assert standing.error_ratios == pytest.approx([1, 1, 1])


# How deep a good sampler still helps


def path_data(errors: dict[int, dict[str, float]]) -> dict:
    """A chart of paths: errors at 16 samples, by bounces and sampler."""
    subjects = {}
    for bounces, its in errors.items():
        subject = chart_data.new_subject(f"{bounces}", "scene", {}, "", (8, 8), bounces)
        subject["cells"] = [cell_dict(name, 16, [error, error]) for name, error in its.items()]
        subjects[f"box{bounces}"] = subject
    return {"subjects": subjects}


def test_the_advantage_is_randoms_error_over_that_of_a_sampler():
    data = path_data({4: {"random": 0.3, "jittered": 0.2}, 1: {"random": 0.4, "jittered": 0.1}})
    heads, rows = depth.table(data)
    assert [head.split(",")[0] for head in heads[1:]] == ["1 bounce", "4 bounces"]
    assert rows == [["Jittered", "4.00", "1.50"]]
    lines = chart_tables.claim(data)
    assert lines[0].startswith("How many dimensions deep")
    assert "1 bounce, 6 dimensions: for the error of the best of the six Random needs 16 " in lines[1]
    assert "4 bounces, 18 dimensions: for the error of the best of the six Random needs 2.25 " in lines[2]


def test_the_advantages_standard_error_is_that_of_a_quotient():
    measured = {name: curve(name, [16], [error]) for name, error in (("random", 0.4), ("jittered", 0.1))}
    assert depth.advantage(measured, "jittered", 16) == pytest.approx((4, 4 * math.hypot(0.01, 0.01)))
    assert depth.advantage(measured, "random", 16) == (1, 0)
    assert depth.advantage(measured, "jittered", 64) is None
    assert depth.advantage({"jittered": measured["jittered"]}, "jittered", 16) is None


def test_without_random_or_paths_nothing_is_said_of_depth():
    for errors in ({}, {1: {"jittered": 0.1}}):
        assert depth.table(path_data(errors))[1] == []
        assert not any("dimensions" in line for line in chart_tables.claim(path_data(errors)))


def test_a_path_takes_as_many_numbers_as_are_said(monkeypatch):
    """A point on the lamp from each surface and a direction for each bounce, as long as there is no roulette."""
    for bounces in (1, 2):
        asked = {}

        def make_table(domain, settings, dimensions, pixels, asked=asked, really=domains.make_table):
            asked[domain] = dimensions
            return really(domain, settings, dimensions, pixels)

        monkeypatch.setattr(preparation, "make_table", make_table)
        rendered = chart.RENDERED["box1"]
        settings = rendered.settings | {"max_bounces": bounces, "diffuse_bounces": bounces}
        render(rendered.make((12, 12)), RenderSettings(samples=1, threads=1, **settings))
        assert asked["lens"] == 0
        # The BSDF's table has one set more, for the surface at which the path ends.
        assert 2 * (asked["light"] + asked["bsdf"] - 1) == depth.dimensions(bounces)


# The command


def chart_run(folder, *more: str) -> int:
    subjects = () if "--subjects" in more else ("--subjects", "disk", "pixel")
    samplers = ("--samplers", "random", "jittered", "z_sobol")
    return main(["chart", *QUICK, *subjects, *samplers, "--counts", "4", "9", "16", "--output", str(folder), *more])


def errors_in(folder) -> dict:
    data = chart_data.load(folder / "chart.json")
    return {
        (name, cell["sampler"], cell["count"]): (cell["rmse"], cell["bias_squared"], cell["variance"])
        for name, subject in data["subjects"].items()
        for cell in subject["cells"]
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A small chart that was not interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    assert chart_run(folder) == 0
    return folder


def test_a_chart_writes_pictures_tables_and_numbers(whole):
    names = {path.name for path in whole.iterdir()}
    assert names == {
        *(f"{subject}.{kind}" for subject in ("disk", "pixel", "overview") for kind in ("png", "svg")),
        *("chart.json", "chart.csv", "chart.md"),
    }
    with (whole / "chart.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    # 4, 9 and 16 of each; z_sobol makes 16 of 9.
    assert len(rows) == 2 * (3 + 3 + 2) * 3
    assert {int(row["count"]) for row in rows} == {4, 9, 16}
    data = chart_data.load(whole / "chart.json")
    for subject in data["subjects"].values():
        for reference in subject["references"]:
            assert not set(reference["seeds"]) & {seed for cell in subject["cells"] for seed in cell["seeds"]}
            assert reference["sampler"] not in reference["judges"]
    text = (whole / "chart.md").read_text(encoding="utf-8")
    assert "three times fewer" in text
    assert "| Jittered |" in text
    assert "of the smallest error charted" in text
    assert "thread" in text


@pytest.mark.parametrize("after", [1, 10])
def test_an_interrupted_chart_goes_on_and_ends_the_same(whole, tmp_path, monkeypatch, capsys, after):
    kept = []

    def save(data, file, really=chart_data.save):
        really(data, file)
        kept.append(file)
        if len(kept) == after:
            raise KeyboardInterrupt

    monkeypatch.setattr(chart, "draw", lambda *_: [])
    with monkeypatch.context() as patch:
        patch.setattr(chart, "save", save)
        assert chart_run(tmp_path) == 130
    assert "the same command goes on" in capsys.readouterr().err
    some = errors_in(tmp_path)
    assert 0 < len(some) < len(errors_in(whole))
    before = (tmp_path / "chart.json").read_text(encoding="utf-8")
    assert chart_run(tmp_path) == 0
    assert errors_in(tmp_path) == errors_in(whole)
    # What had been measured was not measured again: its times are the same to the last digit.
    after_data = json.loads((tmp_path / "chart.json").read_text(encoding="utf-8"))
    for name, subject in json.loads(before)["subjects"].items():
        assert after_data["subjects"][name]["cells"][: len(subject["cells"])] == subject["cells"]


def test_pictures_and_tables_come_from_the_json_alone(whole, tmp_path, monkeypatch):
    (tmp_path / "chart.json").write_bytes((whole / "chart.json").read_bytes())
    monkeypatch.setattr(chart, "measure_all", lambda *_: pytest.fail("measured again"))
    assert main(["chart", "--redraw", "--output", str(tmp_path)]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in whole.iterdir()}
    for path in whole.iterdir():
        # In an SVG the solver behind matplotlib's layout may leave another sixth digit.
        if path.suffix != ".svg":
            assert (tmp_path / path.name).read_bytes() == path.read_bytes()


def test_nothing_that_is_drawn_leaves_the_page(whole):
    data = chart_data.load(whole / "chart.json")
    for figure in (
        *(chart_drawing.draw_subject(data, name) for name in data["subjects"]),
        chart_drawing.draw_overview(data),
    ):
        with style.drawing():
            box = figure.get_tightbbox()
        width, height = figure.get_size_inches()
        assert min(box.x0, box.y0) > -0.01
        assert box.x1 < width + 0.01
        assert box.y1 < height + 0.01


def test_other_settings_do_not_touch_what_was_measured(whole, capsys):
    before = (whole / "chart.json").read_bytes()
    assert chart_run(whole, "--seeds", "4") == 1
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "seeds 3, now 4" in message
    assert "--restart" in message
    assert (whole / "chart.json").read_bytes() == before


def test_restarting_measures_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(chart, "draw", lambda *_: [])
    few = ("--subjects", "step")
    assert chart_run(tmp_path, *few) == 0
    first = errors_in(tmp_path)
    assert chart_run(tmp_path, *few, "--restart", "--seed", "100") == 0
    assert errors_in(tmp_path).keys() == first.keys()
    assert errors_in(tmp_path) != first


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "cannot read"),
        ("{}", "no chart of this version"),
        ("[]", "no chart of this version"),
        ('{"format": 1}', "no chart of this version"),
        ('{"format": 1, "subjects": {"disk": {}}}', "no chart of this version"),
        ('{"format": 1, "settings": [], "machine": {}, "versions": {}, "subjects": {}}', "no chart of this version"),
        (None, "no "),
    ],
)
def test_a_file_that_is_no_chart_is_refused_in_one_line(tmp_path, capsys, content, message):
    if content is not None:
        (tmp_path / "chart.json").write_text(content, encoding="utf-8")
    assert main(["chart", "--redraw", "--output", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "domain"),
    [("pixel", "pixel"), ("lens", "lens"), ("light", "light"), ("hemisphere", "bsdf"), ("lobe", "bsdf")],
)
def test_a_subject_leaves_its_own_domain_to_chance(name, domain):
    """With one random sample in one domain, and one in the middle of all others, two seeds differ in that alone."""
    rendered = chart.RENDERED[name]
    scene = rendered.make((24, 16))
    differences = {}
    for other in ("pixel", "lens", "light", "bsdf"):
        settings = {"samples": 1, "sampler": "regular", f"{other}_sampler": "random"} | rendered.settings
        first, second = (render(scene, RenderSettings(seed=seed, threads=1, **settings)) for seed in (1, 2))
        change = first.passes["Combined"] - second.passes["Combined"]
        differences[other] = float(np.sqrt(np.mean(change**2)))
    assert differences.pop(domain) > 0.1
    assert max(differences.values()) < 0.01


@pytest.mark.parametrize("reach", [1.0, 1.3, 1.8, 2.5, 4.9, 5.1, 30.0, 1e4])
def test_times_are_written_beside_each_other(reach):
    """However near to each other they are: one or more of them, and no two that touch."""
    errors = np.array([0.2, 0.1])
    measured = {"random": Curve("random", np.array([4, 16]), *[errors] * 4, 0.2 * np.array([1.0, reach]))}
    with style.drawing():
        figure = style.figure(12, 6)
        chart_drawing.draw_errors(figure, measured, [])
        figure.draw_without_rendering()
        axis = figure.axes[1].xaxis
        low, high = axis.get_view_interval()
        shown = [tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
        boxes = sorted((label.get_window_extent() for label in shown), key=lambda box: box.x0)
    assert boxes
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
