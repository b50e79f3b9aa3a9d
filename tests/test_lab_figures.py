"""The lab's figures: that their numbers are true, their comparisons fair, and their pages hold what they say."""

from __future__ import annotations

import base64
import io
import json
import math
import re
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from scipy import stats

from core.lab import figure_edge, figure_horizon, figure_moire, figures, scenes, style
from core.lab.cli import main
from core.lab.figure_plates import MARGIN, Plate, picture_panel, sheet, text_width, wrap
from core.lab.figure_shots import REFERENCE_SAMPLER, Reference, Studio, regularity, regularity_of_noise, rmse, shrink
from core.lab.tone import display

NAMES = ["figure_4_1", "brute_force", "moire", "figure_5_19", "figure_5_20", "figure_5_21"]
SIX = ["regular", "random", "jittered", "n_rooks", "multi_jittered", "hammersley"]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The folder that the command fills, at a size for tests."""
    folder = tmp_path_factory.mktemp("figures") / "of the book"
    assert main(["figures", "--output", str(folder), "--resolution", "64x48", "--seed", "3", "--threads", "2"]) == 0
    return folder


@pytest.fixture(scope="module")
def numbers(written):
    return json.loads((written / "figures.json").read_text(encoding="utf-8"))


def make_all(resolution=(64, 64), **studio) -> dict[str, Plate]:
    """All plates against hasty references: for what does not depend on them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "REFERENCE_SAMPLES", 64)
        studio = Studio(**{"seed": 0, "threads": 1} | studio)
        return {plate.name: plate for plate in figures.make_plates(studio, resolution)}


@pytest.fixture(scope="module")
def plates():
    return make_all()


def panels_of(numbers) -> list[dict]:
    return [panel for figure in numbers["figures"].values() for panel in figure["panels"]]


# Files


def test_the_command_writes_each_figure_twice_a_sheet_and_the_numbers(written):
    names = [f"{name}.{kind}" for name in (*NAMES, "contact_sheet", "decorrelation") for kind in ("png", "svg")]
    assert sorted(path.name for path in written.iterdir()) == sorted([*names, "figures.json"])
    for path in written.glob("*.png"):
        with Image.open(path) as image:
            assert image.width > 1000
            assert image.height > 500
    for path in written.glob("*.svg"):
        assert ElementTree.parse(path).getroot().tag.endswith("svg")


def test_all_numbers_stand_with_their_settings_and_seeds(numbers):
    assert list(numbers["figures"]) == NAMES
    assert (numbers["resolution"], numbers["seed"]) == ("64x48", 3)
    for panel in panels_of(numbers):
        assert panel["seed"] == 3
        width, height = map(int, panel["resolution"].split("x"))
        assert panel["total_samples"] == width * height * panel["samples_per_pixel"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--resolution", "9x9"], "9x9 is not between 32 and 512 pixels each way"),
        (["--resolution", "640x64"], "640x64 is not between"),
        (["--resolution", "large"], "'large' is not a size"),
        (["--seed", "-1"], "must be between 0"),
        (["--threads", "two"], "'two' is not a whole number"),
    ],
)
def test_what_is_wrong_with_the_command_is_said_in_a_line(arguments, says, capsys, tmp_path):
    with pytest.raises(SystemExit) as stop:
        main(["figures", "--output", str(tmp_path / "figures"), *arguments])
    out, err = capsys.readouterr()
    assert stop.value.code == 2
    assert says in err
    assert err.startswith("rooks: ")
    assert (out, err.count("\n")) == ("", 1)
    assert not (tmp_path / "figures").exists()


def test_a_folder_that_cannot_be_is_said_before_anything_is_rendered(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(figures, "make_plates", lambda *_: pytest.fail("it rendered"))
    (tmp_path / "taken").write_text("mine")
    assert main(["figures", "--output", str(tmp_path / "taken")]) == 1
    assert re.fullmatch(r"rooks: cannot make the folder .*taken.*\n", capsys.readouterr().err)
    assert (tmp_path / "taken").read_text() == "mine"


# The sharp edge


def is_dark(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return x * math.cos(scenes.EDGE_ANGLE) - y * math.sin(scenes.EDGE_ANGLE) > 0


def edge_errors(numbers) -> dict[tuple[str, int], float]:
    panels = numbers["figures"]["figure_4_1"]["panels"]
    return {(panel["sampler"], panel["samples_per_pixel"]): panel["rmse_of_coverage"] for panel in panels}


@pytest.mark.parametrize("count", [1, 16])
def test_regular_rays_miss_the_coverage_by_what_the_closed_form_says(numbers, count):
    root = math.isqrt(count)
    x, y = np.meshgrid((np.arange(7 * root) + 0.5) / root - 3.5, (np.arange(5 * root) + 0.5) / root - 2.5)
    seen = is_dark(x, y).reshape(5, root, 7, root).mean(axis=(1, 3))
    # For one ray the middle one lies on the edge itself: it is off by a half on either side.
    assert edge_errors(numbers)["regular", count] == pytest.approx(rmse(seen, scenes.edge_coverage()), abs=1e-6)


def test_jittered_rays_miss_the_coverage_by_what_the_closed_form_says():
    cells = scenes.edge_coverage((28, 20))
    # A cell's one ray is dark with the probability of the cell's coverage.
    expected = np.mean((cells * (1 - cells)).reshape(5, 4, 7, 4).sum(axis=(1, 3)) / 16**2)
    scene, exact = scenes.sharp_edge(), scenes.edge_coverage()
    shots = [Studio(seed, 1).shoot(scene, "jittered", 16) for seed in range(100)]
    squares = [np.mean((figure_edge.coverage(shot.picture) - exact) ** 2) for shot in shots]
    assert stats.ttest_1samp(squares, expected).pvalue > 1e-3


# Brute force


def test_brute_force_and_sampling_cost_the_same(numbers):
    panels = numbers["figures"]["brute_force"]["panels"]
    assert [panel["part"] for panel in panels] == ["(a)", "(b)", "(c)"]
    assert len({panel["total_samples"] for panel in panels}) == 1
    assert panels[0]["samples_per_pixel"] == 1
    assert panels[2]["samples_per_pixel"] == 16


def test_brute_force_averaged_is_regular_sampling():
    studio = Studio(0, 1)
    fine = studio.shoot(scenes.checkerboard((128, 96)), "regular", 1)
    coarse = studio.shoot(scenes.checkerboard((32, 24)), "regular", 16)
    np.testing.assert_allclose(shrink(fine.picture, 4), coarse.picture, atol=1e-6)


def test_a_coarser_reference_is_the_mean_of_the_finer_ones_pixels():
    reference = Studio(0, 1).reference(scenes.checkerboard((64, 64)), 256)
    coarse = Studio(5, 1).reference(scenes.checkerboard((16, 16)), 4096)
    off = rmse(reference.shrunk(4).picture, coarse.picture)
    assert off < 2 * math.hypot(reference.shrunk(4).error, coarse.error)


# Moiré


def test_regular_points_leave_a_pattern_and_irregular_ones_noise():
    studio, scene = Studio(0, 2), scenes.checkerboard((256, 256))
    window = figure_moire.band((256, 256))
    truth = studio.reference(scene, 256).cut(window)
    noise = regularity_of_noise(truth.picture.shape[1])
    for count in figure_moire.COUNTS:
        found = {}
        for name in figure_moire.SAMPLERS:
            found[name] = regularity(studio.shoot(scene, name, count).picture[window] - truth.picture)
        assert found["regular"] > 2 * max(found["jittered"], found["multi_jittered"])
        assert max(found["jittered"], found["multi_jittered"]) < 1.25 * noise


@pytest.mark.parametrize("width", [24, 128, 192])
def test_white_noise_has_the_expected_regularity(width):
    # Odd and even widths aside, of m frequencies the largest has Fisher's expected share, up to the energy's weights
    # and the highest frequency, which has but one phase.
    rng = np.random.default_rng(1)
    found = [regularity(np.repeat(rng.normal(size=(400, width, 1)), 3, axis=2)) for _ in range(20)]
    assert np.mean(found) == pytest.approx(regularity_of_noise(width), rel=0.06)


def test_a_wave_along_rows_is_all_pattern_and_no_error_none():
    x = np.arange(64)[None, :] + 7 * np.arange(10)[:, None]
    wave = np.repeat(np.sin(2 * np.pi * 5 / 64 * x)[:, :, None], 3, axis=2)
    assert regularity(wave) == pytest.approx(1)
    assert regularity(wave + 3) == pytest.approx(1), "an offset is no pattern"
    assert regularity(np.zeros((4, 8, 3))) == 0


# References


def test_a_reference_knows_its_own_error():
    rng = np.random.default_rng(2)
    truth = rng.random((200, 200, 3))
    first, second = (truth + rng.normal(scale=0.01, size=truth.shape) for _ in range(2))
    reference = Reference(first, second, 1, (1, 2))
    assert reference.error == pytest.approx(0.01 / math.sqrt(2), rel=0.02)
    assert rmse(reference.picture, truth) == pytest.approx(reference.error, rel=0.02)


def test_a_reference_errs_ten_times_less_than_what_it_judges(numbers):
    judged = [panel for panel in panels_of(numbers) if "rmse" in panel]
    assert len(judged) == 3 + 12 + 12
    for panel in judged:
        assert 0 < panel["rmse_of_the_reference"] < panel["rmse"] / 10


def test_a_reference_shares_neither_sampler_nor_seed_with_what_it_judges(numbers):
    for seed in (0, 2**31 - 1):
        reference = Studio(seed, 1).reference(scenes.sharp_edge(), 4)
        assert len({seed, *reference.seeds}) == 3
        assert max(reference.seeds) < 2**31
    assert REFERENCE_SAMPLER not in {panel["sampler"] for panel in panels_of(numbers)}


# The horizon


def test_the_six_are_shown_with_one_and_with_256_samples(numbers):
    shown = [
        (panel["sampler"], panel["samples_per_pixel"])
        for name in ("figure_5_19", "figure_5_20", "figure_5_21")
        for panel in numbers["figures"][name]["panels"]
    ]
    assert shown == [(name, count) for name in SIX for count in figure_horizon.COUNTS]


def test_more_samples_err_less(numbers):
    for name in ("figure_5_19", "figure_5_20", "figure_5_21"):
        first, many, other, others_many = (panel["rmse"] for panel in numbers["figures"][name]["panels"])
        assert many < first / 10
        assert others_many < other / 10


def test_figures_depend_on_the_seed_and_not_on_threads(plates):
    again = make_all(threads=2)
    other = make_all(seed=1)
    assert all(again[name].numbers == plate.numbers for name, plate in plates.items())
    assert other["figure_5_19"].numbers["panels"][3]["rmse"] != plates["figure_5_19"].numbers["panels"][3]["rmse"]


def test_the_progress_bar_ends_at_its_end():
    done = []
    make_all((32, 32), on_progress=done.append)
    assert sum(done) == pytest.approx(figures.RENDERS)


# Pages


def stated_errors(plate: Plate) -> list[str]:
    lines = [line for row in plate.rows for panel in row for line in panel.lines]
    return [number for line in lines for number in re.findall(r"RMSE(?: of coverage)? (\d\.\d+)", line)]


def test_every_picture_has_its_error_below_it(plates):
    for plate in plates.values():
        expected = [panel.get("rmse", panel.get("rmse_of_coverage")) for panel in plate.numbers["panels"]]
        assert stated_errors(plate) == [f"{error:.4f}" for error in expected]


@pytest.mark.parametrize("resolution", [(64, 64), (100, 40)])
def test_no_text_leaves_the_page_or_touches_another(resolution, plates):
    made = plates if resolution == (64, 64) else make_all(resolution)
    for plate in made.values():
        figure = plate.figure()
        with style.drawing():
            figure.draw_without_rendering()
            texts = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
            boxes = np.array([text.get_window_extent().extents for text in texts])
        assert (boxes[:, :2] >= 0).all()
        assert (boxes[:, 2:] <= figure.bbox.size).all()
        x0, y0, x1, y1 = boxes.T[:, :, None]
        overlap = (x0 < x1.T) & (x1 > x0.T) & (y0 < y1.T) & (y1 > y0.T)
        assert np.count_nonzero(overlap) == len(boxes), "each meets itself alone"


def test_a_page_shows_every_pixel_as_a_square_of_dots(tmp_path):
    picture = np.random.default_rng(3).random((37, 53, 3))
    plate = Plate("page", [[picture_panel(picture, "(a) noise", width=384)]], "What is seen.", {})
    png, svg = style.save(sheet([plate, plate], [(0, 0), (plate.width + 1, 333)]), tmp_path / "page")
    expected = np.kron(display(picture), np.ones((7, 7, 1), np.uint8))
    with Image.open(png) as image:
        page = np.asarray(image.convert("RGB"))
    for x, y in ((0, 0), (plate.width + 1, 333)):
        seen = page[y + MARGIN : y + MARGIN + expected.shape[0], x + MARGIN : x + MARGIN + expected.shape[1]]
        assert np.array_equal(seen, expected)
    embedded = re.findall(r'"data:image/png;base64,\s*([^"]+)"', svg.read_text())
    assert len(embedded) == 2
    with Image.open(io.BytesIO(base64.b64decode(embedded[0]))) as image:
        assert image.size == (53, 37), "the pixels themselves"
    assert svg.read_text().count("image-rendering:pixelated") == 2


def test_captions_break_between_words_where_the_line_is_full():
    text = "Points that are even over the square, 4\N{NO-BREAK SPACE}×\N{NO-BREAK SPACE}4 of them, and irregular. " * 4
    lines = wrap(text.strip(), 500)
    assert " ".join(lines) == text.strip()
    assert all(text_width(line) <= 500 for line in lines)
    for line, following in pairwise(lines):
        assert text_width(f"{line} {following.split(' ')[0]}") > 500
