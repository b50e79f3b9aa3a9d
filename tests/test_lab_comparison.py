"""Comparing samplers on a scene: the sentence, the crops, what is written, cancelling, and scenes at the edge."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from core import Camera, RenderSettings, Scene, SettingsError
from core.lab import comparison, scenes
from core.lab.comparison import Crop, choose_crops, compare
from core.lab.efficiency import Curve
from core.lab.recommendation import recommend

SETTINGS = RenderSettings(threads=1)
#: A picture without any error.
FLAT = Scene(Camera(np.eye(4), (20, 12), (-1, 1, -0.6, 0.6)), world=(1, 0.5, 0.2))
COUNTS = np.array([4, 16, 64, 256])


def curve(sampler: str, factor: float = 1.0, slope: float = -0.5, *, slower: float = 1.0, noise: float = 0.01) -> Curve:
    errors = factor * COUNTS**slope
    return Curve(sampler, COUNTS, errors, noise * errors, errors, errors, slower * COUNTS / 1000)


def last(its: Curve) -> Curve:
    """The curve where only its last count was measured."""
    return Curve(its.sampler, *(getattr(its, name)[-1:] for name in list(its.__dataclass_fields__)[1:]))


def sentence(*its: Curve) -> str:
    return recommend({one.sampler: one for one in its}, ())


def edge(width: int = 16, height: int = 12) -> Scene:
    return scenes.sharp_edge((width, height))


# The recommendation


def test_the_best_reaches_the_error_of_random_in_a_share_of_its_time():
    """With a quarter of the error and twice the time per sample: 1/16 of the samples, 1/8 of the time."""
    found = sentence(curve("random"), curve("multi_jittered", 0.25, slower=2), curve("n_rooks", 0.5, slower=2))
    assert found == "Multi-Jittered for this scene: the error of Random in 0.12 of its time."


def test_what_is_as_good_is_named():
    found = sentence(curve("random"), curve("jittered", 0.25), curve("hammersley", 0.2505), curve("fibonacci", 0.255))
    assert found.startswith(
        "Jittered for this scene: the error of Random in 0.06 of its time (Hammersley and Fibonacci do"
    )


def test_without_random_the_worst_is_the_yardstick():
    found = sentence(curve("regular", 2.0), curve("jittered"), curve("sobol_owen", 1.0, slower=3))
    assert found == "Jittered for this scene: the error of Regular in 0.25 of its time."


def test_a_best_that_errs_by_a_pattern_is_not_praised_without_saying_so():
    measured = {"random": curve("random"), "regular": curve("regular", 0.5)}
    assert recommend(measured, {"regular"}) == (
        "Regular for this scene: the error of Random in 0.25 of its time, but as a pattern and not as noise."
    )
    assert "pattern" not in recommend(measured, {"random"})
    once = {name: last(its) for name, its in measured.items()}
    assert recommend(once, {"regular"}).endswith("in 1.00 of its time, but as a pattern and not as noise.")


def test_regular_points_err_by_a_pattern_and_jittered_ones_by_noise():
    """At a straight edge regular points err less than random ones, and always in the same way."""
    for best, is_pattern in (("regular", True), ("jittered", False)):
        found = compare(edge(24, 16), RenderSettings(threads=1), ["random", best], [16], 8)
        assert found.recommendation.startswith(found.data["settings"]["samplers"][1].title())
        assert ("as a pattern" in found.recommendation) == is_pattern


def test_within_the_uncertainty_nobody_is_recommended():
    better = curve("jittered", 0.97, noise=0.04)
    assert sentence(curve("random", noise=0.04), better) == "No sampler is clearly better than Random for this scene."
    assert (
        sentence(curve("random"), curve("jittered", 1.3)) == "No sampler is clearly better than Random for this scene."
    )
    dear = curve("jittered", 0.5, slower=4)  # a quarter of the samples, each four times as dear
    assert sentence(curve("random"), dear) == "No sampler is clearly better than Random for this scene."


def test_an_error_below_all_measured_is_a_bound():
    found = sentence(curve("random"), curve("jittered", 0.01))
    assert found == "Jittered for this scene: the error of Random in at most 0.02 of its time."


def test_with_one_count_errors_are_compared():
    found = sentence(last(curve("random")), last(curve("jittered", 0.5, slower=1.1)))
    assert found == "Jittered for this scene: at 256 samples 0.50 of the error of Random, in 1.10 of its time."
    found = sentence(last(curve("random")), last(curve("jittered", 0.99)))
    assert found == "No sampler is clearly better than Random for this scene at 256 samples."


def test_one_sampler_has_nothing_to_be_compared_with():
    assert sentence(curve("jittered")).startswith("Only Jittered was measured")


def test_without_error_there_is_nothing_to_choose():
    assert sentence(curve("random", 0), curve("jittered", 0)).startswith("Every sampler renders this scene exactly")
    assert sentence(curve("random", 0), curve("jittered", 1)).startswith("Random renders this scene exactly")


# Crops


def test_crops_are_where_the_score_is():
    score = np.zeros((100, 160))
    score[40:50, 100:110] = 5
    score[70:80, 20:30] = 4
    first, second = choose_crops(score)
    assert first.side == second.side == 20
    assert first.of(score).sum() == 500
    assert second.of(score).sum() == 400


def test_crops_do_not_overlap_and_lie_inside():
    rng = np.random.default_rng(1)
    for height, width in ((1, 1), (4, 90), (16, 16), (33, 70), (400, 300)):
        crops = choose_crops(rng.random((height, width)))
        covered = np.zeros((height, width), int)
        for crop in crops:
            assert crop.of(covered).shape == (crop.side, crop.side)
            crop.of(covered)[:] += 1
        assert 1 <= len(crops) <= 3
        assert covered.max() == 1


def test_a_flat_score_gives_crops_too():
    assert choose_crops(np.zeros((12, 20))) == [Crop(0, 0, 12)]


# Comparing


@pytest.fixture(scope="module")
def three():
    """Three samplers, one of which cannot make 9 points, at three counts."""
    return compare(edge(), SETTINGS, ["z_sobol", "random", "multi_jittered"], [36, 4, 9], 4)


def test_a_comparison_holds_what_was_measured(three):
    assert three.samplers == ["random", "multi_jittered", "z_sobol"]
    made = {(cell["sampler"], cell["count"]) for cell in three.subject["cells"]}
    assert made == {*((name, n) for name in ("random", "multi_jittered") for n in (4, 9, 36))} | {
        ("z_sobol", n) for n in (4, 16, 64)
    }
    assert three.shown == [4, 36]
    assert set(three.shots) == {("random", 4), ("multi_jittered", 4), ("z_sobol", 4)} | {
        *(("random", 36), ("multi_jittered", 36), ("z_sobol", 64))
    }
    for shot in three.shots.values():
        assert shot.picture.shape == (12, 16, 3)
        assert shot.error.shape == (12, 16)


def test_error_maps_are_what_the_error_is_made_of(three):
    cells = {(cell["sampler"], cell["count"]): cell for cell in three.subject["cells"]}
    for key, shot in three.shots.items():
        assert np.mean(shot.error.astype(float) ** 2) == pytest.approx(np.mean(np.square(cells[key]["rmse"])), rel=1e-5)
    # Only pixels on the edge err; the maps are the right way up: it leans over to the right.
    top, bottom = three.shots["random", 4].error[0], three.shots["random", 4].error[-1]
    assert top.argmax() > bottom.argmax()


def test_saving_writes_the_sheet_first(three, tmp_path):
    paths = comparison.save(three, tmp_path / "new", "edge")
    assert [path.name for path in paths] == [
        *("edge.png", "edge.svg", "edge_chart.png", "edge_chart.svg", "edge.csv", "edge.json")
    ]
    assert sorted((tmp_path / "new").iterdir()) == sorted(paths)
    with Image.open(paths[0]) as picture:
        assert picture.width > 2000
    with paths[4].open(encoding="utf-8") as stream:
        assert len(list(csv.DictReader(stream))) == 9 * 4
    written = json.loads(paths[5].read_text(encoding="utf-8"))
    assert written == three.data
    assert written["recommendation"] == three.recommendation


def test_a_thread_can_compare_and_save(tmp_path):
    written = []

    def work():
        found = compare(edge(), SETTINGS, ["random", "jittered"], [4], 2)
        written.extend(comparison.save(found, tmp_path, "thread"))

    worker = threading.Thread(target=work)
    worker.start()
    worker.join()
    assert len(written) == 6


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("scene", "settings", "samplers", "counts", "seeds"),
    [
        (edge(), {}, ["random"], [1], 1),
        (
            Scene(Camera(np.eye(4), (20, 12), (-1, 1, -0.6, 0.6)), world=(1, 0.5, 0.2)),
            {},
            ["random", "regular"],
            [1, 4],
            2,
        ),
        (edge(20, 16), {"film_transparent": True, "border": (8, 4, 17, 9)}, ["jittered", "n_rooks"], [1, 4], 2),
        (scenes.everything((16, 12)), {"max_bounces": 1}, ["sobol_owen", "correlated_multi_jittered"], [2, 7], 2),
    ],
    ids=["one of everything", "flat", "border", "two references"],
)
def test_comparisons_at_the_edge_are_drawn(scene, settings, samplers, counts, seeds, tmp_path):
    found = compare(scene, RenderSettings(threads=1, **settings), samplers, counts, seeds)
    assert found.recommendation.endswith(".")
    assert all(path.stat().st_size > 0 for path in comparison.save(found, tmp_path, "edge"))


def test_a_border_is_all_that_is_compared():
    found = compare(edge(20, 16), RenderSettings(threads=1, border=(8, 4, 17, 9)), ["random"], [4], 2)
    assert found.reference.shape == (5, 9, 3)


def test_progress_rises_to_the_end():
    seen = []
    compare(edge(), SETTINGS, ["random", "jittered"], [1, 4], 2, lambda share, what: seen.append(share))
    assert seen == sorted(seen)
    assert seen[0] >= 0
    assert seen[-1] == 1
    assert len(seen) > 8


@pytest.mark.parametrize("after", [0, 3, 8, 20])
def test_a_cancelled_comparison_is_none(after):
    """Cancelled in the warm-up, the pilots, the reference and the cells: each of the 24 renders asks at least once."""
    asked = []

    def should_cancel() -> bool:
        asked.append(1)
        return len(asked) > after

    assert compare(edge(), SETTINGS, ["random", "jittered"], [1, 4], 4, None, should_cancel) is None


@pytest.mark.parametrize(
    ("samplers", "counts", "seeds", "message"),
    [
        ([], [4], 2, "at least one sampler"),
        (["random"], [], 2, "at least one number of samples"),
        (["poisson"], [4], 2, "unknown sampler 'poisson'"),
        (["random"], [0], 2, "not 0"),
        (["random"], [4], 0, "not 0"),
    ],
)
def test_what_cannot_be_compared_is_said(samplers, counts, seeds, message):
    with pytest.raises(SettingsError, match=message):
        compare(edge(), SETTINGS, samplers, counts, seeds)


def test_comparing_needs_neither_scipy_nor_rich_nor_pyplot(tmp_path):
    """Where they cannot be imported, as in Blender, or must not be, as in a thread."""
    code = f"""
import sys
from pathlib import Path
sys.modules |= dict.fromkeys(("scipy", "rich", "matplotlib.pyplot"))
from core import RenderSettings
from core.lab import comparison, scenes
found = comparison.compare(scenes.sharp_edge((8, 6)), RenderSettings(threads=1), ["random", "jittered"], [1, 4], 2)
print(len(comparison.save(found, Path({str(tmp_path)!r}), "bare")))
"""
    here = Path(__file__).parent.parent
    done = subprocess.run([sys.executable, "-c", code], cwd=here, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "6"
