"""Comparing samplers on one scene: what is measured, and what is kept of the pictures to be shown.

The measurements are those of `measure`, in the form of `chart_data`. Besides, crops are shown of the places where the
samplers differ most, and maps of the error over the whole picture.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import SettingsError
from ..limits import MAX_SAMPLES
from ..samplers import SAMPLERS
from ..scene import Scene
from ..settings import RenderSettings
from . import chart_data, chart_drawing, comparison_drawing, style
from .chart_tables import cells, errs_by_a_pattern
from .efficiency import curves, yardstick
from .measure import Cancelled, Cell, Laboratory, Reference, Study
from .recommendation import recommend
from .tone import display

#: The name of the only subject in a comparison's data.
SUBJECT = "scene"
#: The smaller of the two counts shown is the smallest from here on: below it, everything is noise.
SMALL_COUNT = 4
#: So many crops at most, each with at least this share of what the first shows.
CROPS, WORTH_SHOWING = 3, 0.2


@dataclass(frozen=True)
class Shot:
    """One sampler at one count: the first seed's picture, uint8 sRGB (h, w, 3), and the RMSE of each pixel over seeds
    and channels, float32 (h, w); both top row first."""

    picture: np.ndarray
    error: np.ndarray


@dataclass(frozen=True)
class Crop:
    """A square of the picture, in pixels from its top left corner."""

    left: int
    top: int
    side: int

    def of(self, picture: np.ndarray) -> np.ndarray:
        return picture[self.top : self.top + self.side, self.left : self.left + self.side]


@dataclass(frozen=True)
class Comparison:
    """Everything that is needed to draw a comparison and to write it down.

    `data` is as in `chart_data`, with one subject. `reference` is uint8 sRGB (h, w, 3), top row first. `shots` are by
    sampler and count really taken, for the counts in `shown`, which are those asked for.
    """

    data: dict
    recommendation: str
    reference: np.ndarray
    shown: list[int]
    shots: dict[tuple[str, int], Shot]
    crops: list[Crop]

    @property
    def subject(self) -> dict:
        return self.data["subjects"][SUBJECT]

    @property
    def samplers(self) -> list[str]:
        """In the order of display."""
        return list(curves(cells(self.subject)))


def compare(
    scene: Scene,
    settings: RenderSettings,
    samplers: Sequence[str],
    counts: Sequence[int],
    seeds: int,
    on_progress: Callable[[float, str], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> Comparison | None:
    """Measure `samplers` × `counts` on the scene, with `seeds` pictures each; None where it was cancelled.

    The compared sampler takes the place of those of all domains in `settings`, the count that of `samples`; the rest
    stays. `on_progress(share, what)` is called before each picture, from the calling thread, `should_cancel` as often
    as `render` does.

    Raises:
        SettingsError: nothing to compare, or an unknown sampler or impossible count.
        SceneError: the scene cannot be rendered.
    """
    study = Study(scene, settings, list(dict.fromkeys(samplers)), sorted(set(counts)), seeds)
    _check(study)
    data = chart_data.new_data(_settings_record(study), settings.thread_count)
    subject = chart_data.new_subject(
        "Error of samplers on this scene",
        "scene",
        {"random": -0.5},
        "of Random alone",
        data["settings"]["resolution"],
    )
    data["subjects"][SUBJECT] = subject
    shown = _shown(study.counts)
    wanted = {(name, SAMPLERS[name].actual_count(n)) for name in study.samplers for n in shown}
    shots: dict[tuple[str, int], Shot] = {}
    references: list[Reference] = []

    def keep(cell: Cell, pictures: np.ndarray, reference: Reference) -> None:
        references.append(reference)
        if (cell.sampler, cell.count) in wanted:
            shots[cell.sampler, cell.count] = Shot(display(pictures[0]), _error_map(pictures, reference.picture))

    try:
        chart_data.measure_scene(data, SUBJECT, Laboratory(study, on_progress, should_cancel), keep)
    except Cancelled:
        return None
    if on_progress is not None:
        on_progress(1.0, "done")
    best = min(references, key=lambda reference: reference.standard_error)
    measured = curves(cells(subject))
    last = {name: SAMPLERS[name].actual_count(study.counts[-1]) for name in study.samplers}
    patterned = {c.sampler for c in cells(subject) if c.count == last[c.sampler] and errs_by_a_pattern(c)}
    sentence = recommend(measured, patterned)
    data["recommendation"] = sentence
    differing = _most_different(measured, shots, shown[-1])
    return Comparison(data, sentence, display(best.picture), shown, shots, choose_crops(differing))


def save(comparison: Comparison, folder: Path, name: str) -> list[Path]:
    """Write NAME.png and .svg, the sheet; NAME_chart.png and .svg; NAME.csv; NAME.json. The sheet's PNG comes first.

    Raises:
        OutputError: the folder cannot be made or written to.
    """
    style.make_folder(folder)
    sheet = style.save(comparison_drawing.draw_sheet(comparison), folder / name)
    chart = style.save(chart_drawing.draw_subject(comparison.data, SUBJECT), folder / f"{name}_chart")
    table = chart_data.write_csv(comparison.data, folder / f"{name}.csv")
    chart_data.save(comparison.data, folder / f"{name}.json")
    return [*sheet, *chart, table, folder / f"{name}.json"]


def _check(study: Study) -> None:
    if not study.samplers:
        raise SettingsError("there is nothing to compare: choose at least one sampler")
    unknown = [name for name in study.samplers if name not in SAMPLERS]
    if unknown:
        raise SettingsError(f"unknown sampler {unknown[0]!r}: choose of {', '.join(SAMPLERS)}")
    if not study.counts:
        raise SettingsError("there is nothing to compare: choose at least one number of samples")
    for count in (*study.counts, study.seeds):
        if not 1 <= operator.index(count) <= MAX_SAMPLES:
            raise SettingsError(f"samples and seeds must be between 1 and {MAX_SAMPLES}, not {count}")


def _settings_record(study: Study) -> dict:
    settings = study.settings
    left, bottom, right, top = settings.border or (0, 0, *study.scene.camera.resolution)
    return {
        "samplers": list(study.samplers),
        "counts": list(study.counts),
        "seeds": study.seeds,
        "resolution": [right - left, top - bottom],
        "seed": settings.seed,
        "max_bounces": settings.max_bounces,
        "pixel_filter": settings.pixel_filter,
        "filter_width": settings.filter_width,
        "film_transparent": settings.film_transparent,
    }


def _shown(counts: Sequence[int]) -> list[int]:
    """A small count, where differences are seen best, and the largest."""
    small = next((count for count in counts if count >= SMALL_COUNT), counts[-1])
    return sorted({small, counts[-1]})


def _error_map(pictures: np.ndarray, reference: np.ndarray) -> np.ndarray:
    squares = np.zeros(reference.shape[:2])
    for picture in pictures:
        squares += ((picture - reference) ** 2).mean(axis=2)
    return np.sqrt(squares[::-1] / len(pictures)).astype(np.float32)


# Crops


def _most_different(measured: dict, shots: dict[tuple[str, int], Shot], count: int) -> np.ndarray:
    """(h, w): by how much the yardstick errs more than the best at the largest count, or errs where it is alone."""
    errors = {name: shots[name, SAMPLERS[name].actual_count(count)].error for name in measured}
    worst = yardstick(measured).sampler
    best = min(measured, key=lambda name: measured[name].errors[-1])
    return errors[worst] if worst == best else np.abs(errors[worst] - errors[best])


def choose_crops(score: np.ndarray) -> list[Crop]:
    """Up to CROPS squares that do not overlap, where the sum of `score` (h, w), ≥ 0, is largest; the largest first."""
    height, width = score.shape
    side = min(max(min(height, width) // 5, 16), 64, height, width)
    sums = np.pad(score.astype(np.float64).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    inside = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    crops: list[Crop] = []
    least = WORTH_SHOWING * inside.max()
    while len(crops) < CROPS and inside.max() >= least:
        top, left = map(int, np.unravel_index(np.argmax(inside), inside.shape))
        crops.append(Crop(left, top, side))
        inside[max(top - side + 1, 0) : top + side, max(left - side + 1, 0) : left + side] = -np.inf
    return crops
