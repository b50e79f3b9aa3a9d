"""What the status line says of a render."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

import core
from addon import progress
from addon.progress import Progress, clock_text, finished_lines

SETTINGS = core.RenderSettings(samples=16, sampler="n_rooks")


@pytest.mark.parametrize(
    ("seconds", "text"), [(0, "0:00"), (59.6, "1:00"), (61, "1:01"), (3600, "1:00:00"), (7325, "2:02:05")]
)
def test_times_are_read_as_on_a_clock(seconds, text):
    assert clock_text(seconds) == text


def tile(done: int, total: int) -> core.Tile:
    return core.Tile(0, 0, 64, 64, {}, done, total, memory=12_300_000)


def test_after_two_tiles_speed_and_what_is_left_are_known(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    told = Progress(SETTINGS)
    assert told.text == "N-Rooks, 16 samples per pixel"
    told.add(tile(1, 11))
    assert told.text == "N-Rooks, 16 samples per pixel, 12 MB, 1 of 11 tiles"
    now[0] += 2.0
    told.add(tile(3, 11))
    # One tile of 64 × 64 pixels is known to have taken part of these seconds; two are done since the first.
    assert told.text.endswith("3 of 11 tiles, 0.0 million samples/s, 0:08 left")


def test_the_end_is_told_with_the_films_own_figures():
    film = core.Film(0, 0, 100, 50, 16, (100, 50), finished_pixels=5000, seconds=0.5, setup_seconds=0.25)
    film.memory = 12_300_000
    assert Progress(SETTINGS).finished(film) == "N-Rooks, 16 samples per pixel, 0.2 million samples/s"
    assert finished_lines(film) == [
        "Last render: 0.2 s to set up, 0.5 s to trace",
        "Memory: 12 MB and the picture's own",
    ]
    film.cancelled, film.finished_pixels = True, 1250
    assert Progress(SETTINGS).finished(film).endswith("stopped")
    assert finished_lines(film)[0].endswith(", stopped at 25%")


def test_what_was_left_out_is_told():
    film = core.Film(0, 0, 100, 50, 16, (100, 50), dropped_samples=12, negative_pixels=3, blocked_samples=5)
    assert finished_lines(film)[2:] == [
        "12 samples were not finite numbers and were left out",
        "3 pixels were negative, by lamps or emission below 0, and are black instead",
        "5 samples passed as many transparent surfaces as Light Paths allow, and see the next one black: "
        "raise Transparent there",
    ]
