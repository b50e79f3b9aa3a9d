"""Random scenes: thousands of scenes as hypothesis draws them, each of which has to be a picture or a clear error.

To repeat those of one seed: python -m tests.stability.random_scenes COUNT SEED
"""

from __future__ import annotations

import multiprocessing
import sys
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed
from hypothesis import settings as hypothesis_settings

from core import RenderSettings, Scene, SceneError, SettingsError, render

from .case import Record, case
from .drawn_scenes import scenes_with_settings

#: What `make stability` has the time for.
SCENES = 10_000
QUICK_SCENES = 200
PROCESSES = 2

FAULTS = ("another error", "a pixel that is no finite number", "another second picture")
_WORDS = {
    "happens": "A scene that nobody thought of crashes Blender, or makes black, white or different pixels.",
    "why": "Numbers that are huge, tiny, negative or none meet in ways that no single test puts together; what becomes "
    "a place in a table may read memory that is not there.",
    "rooks": "Draws scenes and settings with such numbers, renders each twice, with other threads and tiles, and finds "
    "the same finite picture, or one line that names what cannot be rendered.",
    "samplers": "Drawn with the scenes, one for each domain: all of them keep the bounds.",
}


@case("200 random scenes", **_WORDS)
def some_random_scenes(record: Record) -> None:
    _claim(record, _try_scenes(QUICK_SCENES, 0), QUICK_SCENES)


@case("Thousands of random scenes", is_slow=True, **_WORDS)
def many_random_scenes(record: Record) -> None:
    try:
        with ProcessPoolExecutor(PROCESSES, multiprocessing.get_context("spawn")) as pool:
            parts = list(pool.map(_try_scenes, [SCENES // PROCESSES] * PROCESSES, range(1, 1 + PROCESSES)))
    except BrokenProcessPool:
        record.claim("processes that crashed", 1, at_most=0)
    else:
        _claim(record, sum(parts, Counter()), SCENES)


def _claim(record: Record, found: Counter, count: int) -> None:
    tried = found["tried"]
    record.claim("scenes", tried, at_least=count)
    record.claim("refused with one line, share", found["refused"] / tried, at_most=0.5)
    record.claim("lit, share", found["lit"] / tried, at_least=0.1)
    for fault in (
        "another error",
        "a pixel that is no finite number",
        "another second picture",
    ):
        record.claim(fault, found[fault], at_most=0)


def _try_scenes(count: int, number: int) -> Counter:
    """Draw `count` scenes by a seed, render each, and count what came of it. Faults are told on stderr."""
    found = Counter()

    @seed(number)
    @hypothesis_settings(
        max_examples=count,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
    )
    @given(scenes_with_settings())
    def try_one(drawn: tuple[Scene, RenderSettings]) -> None:
        fate, fault = _fate(*drawn)
        found.update(["tried", *fate])
        if fault:
            print(f"seed {number}, scene {found['tried']}: {fault}\n{drawn}", file=sys.stderr)

    try_one()
    return found


def _fate(scene: Scene, settings: RenderSettings) -> tuple[list[str], str]:
    """What to count of a scene, and what is wrong if anything is."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # numpy's, of numbers that overflow
            film = render(scene, settings)
            again = render(scene, replace(settings, threads=2, tile_size=4, batch_packets=7))
    except (SceneError, SettingsError) as error:
        return (["refused"], "") if "\n" not in str(error) else (["another error"], str(error))
    except Exception as error:
        return ["another error"], repr(error)
    for name, pixels in film.passes.items():
        if not np.isfinite(pixels).all():
            return ["a pixel that is no finite number"], name
        if not np.array_equal(pixels, again.passes[name]):
            return ["another second picture"], name
    if (film.dropped_samples, film.negative_pixels) != (again.dropped_samples, again.negative_pixels):
        return ["another second picture"], "what was dropped"
    return ["lit"] * bool(film.passes["Combined"][..., :3].any()), ""


if __name__ == "__main__":
    print(dict(_try_scenes(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)))
