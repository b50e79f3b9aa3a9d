"""What a rendered viewport shows: soon something, in the end the render, and never what is no longer asked for."""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

import core
from addon import kernels, viewport_session
from addon.viewport_session import Picture, Session, View
from core import Camera, Instance, Material, RenderSettings, Scene, SceneError
from core.shaders import Emission
from tests.scenes import camera_down, floor, lambertian
from tests.test_rendering import still_life

SETTINGS = RenderSettings(samples=8)
RESTARTS, WARM_UPS = 1000, 100
MEGABYTES_MORE = 10


class Watched:
    """A session, and all pictures that it has had."""

    def __init__(self) -> None:
        self.pictures: list[Picture] = []
        self.session = Session(self._on_change)

    def _on_change(self) -> None:
        picture = self.session.picture
        if picture is not None and (not self.pictures or picture is not self.pictures[-1]):
            self.pictures.append(picture)

    def wait(self, condition: Callable[[], bool], seconds: float = 90) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, f"not in time: {self.session.text}"
            time.sleep(0.005)

    def wait_for_the_last_picture(self) -> Picture:
        self.wait(lambda: self.pictures and self.pictures[-1].done == self.pictures[-1].total)
        return self.pictures[-1]


@pytest.fixture
def watched(monkeypatch):
    monkeypatch.setattr(kernels, "start_compiling", lambda: None)  # in this process, if at all
    watched = Watched()
    yield watched
    watched.session.close()


def view_of(camera: Camera) -> View:
    return View(camera, (0, 0, *camera.resolution))


def grey(albedo: float) -> Scene:
    ground = Instance(floor(9), materials=(lambertian(albedo),))
    return Scene(camera_down(2, (64, 48)), (ground,), world=(1.0, 1.0, 1.0))


def test_it_begins_coarse_and_ends_as_the_render(watched):
    scene = still_life((150, 90))
    watched.session.show_scene(scene, SETTINGS)
    watched.session.show_view(view_of(scene.camera))
    last = watched.wait_for_the_last_picture()
    sizes = [picture.size for picture in watched.pictures]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] == viewport_session.LARGEST_PIXEL
    assert watched.session.text == "8 of 8 samples"
    expected = core.render(scene, SETTINGS).passes["Combined"]
    np.testing.assert_allclose(last.pixels, expected, rtol=2e-6, atol=1e-7)


def test_what_is_left_out_is_told(watched):
    """The floor takes away more light than there is."""
    ground = Instance(floor(9), materials=(Material("", Emission(-1.0)),))
    scene = Scene(camera_down(2, (64, 48)), (ground,))
    watched.session.show_scene(scene, SETTINGS)
    watched.session.show_view(view_of(scene.camera))
    watched.wait_for_the_last_picture()
    lost = "3072 pixels were negative, by lamps or emission below 0, and are black instead"
    assert watched.session.text == f"8 of 8 samples, {lost}"


def test_another_view_and_another_scene_are_shown_next(watched):
    watched.session.show_scene(grey(0.25), SETTINGS)
    watched.session.show_view(view_of(grey(0).camera))
    assert np.allclose(watched.wait_for_the_last_picture().pixels[..., :3], 0.25)
    watched.session.show_scene(grey(0.75), SETTINGS)
    watched.wait(lambda: np.allclose(watched.pictures[-1].pixels[..., :3], 0.75))
    watched.session.show_view(view_of(replace(grey(0).camera, resolution=(40, 30))))
    watched.wait(lambda: watched.pictures[-1].pixels.shape == (30, 40, 4))


def test_it_takes_as_many_threads_as_it_is_given(watched):
    def workers() -> int:
        return sum(thread.name.startswith("rooks-view_") for thread in threading.enumerate())

    watched.session.show_view(view_of(grey(0).camera))
    for count, albedo in ((1, 0.25), (3, 0.5), (1, 0.75)):
        watched.session.show_scene(grey(albedo), replace(SETTINGS, threads=count))
        watched.wait(
            lambda albedo=albedo: watched.pictures and np.allclose(watched.pictures[-1].pixels[..., 0], albedo)
        )
        watched.wait_for_the_last_picture()
        assert workers() == count


def test_a_part_of_the_view_stays_where_it_is(watched):
    camera = grey(0).camera
    watched.session.show_scene(grey(0.5), SETTINGS)
    watched.session.show_view(View(camera, (10, 20, 31, 41)))
    last = watched.wait_for_the_last_picture()
    assert (last.x, last.y, last.pixels.shape) == (10, 20, (21, 21, 4))
    for picture in watched.pictures:
        height, width = picture.pixels.shape[:2]
        assert picture.x <= 10 < 31 <= picture.x + width * picture.size
        assert picture.y <= 20 < 41 <= picture.y + height * picture.size


def test_turning_the_view_all_the_time_shows_something_all_the_time(watched):
    """What has come first after a change is finished, whatever comes next."""
    scene = still_life((300, 200))
    watched.session.show_scene(scene, replace(SETTINGS, samples=4096))
    watched.session.show_view(view_of(scene.camera))
    watched.wait(lambda: len(watched.pictures) > 3)
    before, start = len(watched.pictures), time.monotonic()
    for k in range(100):
        matrix = scene.camera.matrix.copy()
        matrix[0, 3] += 0.01 * k
        watched.session.show_view(view_of(replace(scene.camera, matrix=matrix)))
        time.sleep(0.01)
    shown = len(watched.pictures) - before
    assert shown >= 10 * (time.monotonic() - start)


def test_what_is_wrong_is_said_and_can_be_mended(watched):
    watched.session.show_view(view_of(grey(0).camera))
    watched.session.show_scene(
        replace(grey(0.5), camera=replace(grey(0).camera, clip_start=5.0, clip_end=1.0)), SETTINGS
    )
    broken = replace(grey(0.5), instances=(Instance(floor(9), np.full((4, 4), np.nan)),))
    watched.session.show_scene(broken, SETTINGS)
    watched.wait(lambda: watched.session.error is not None)
    assert "4 × 4 finite numbers" in watched.session.text
    assert watched.session.picture is None
    watched.session.show_scene(grey(0.5), SETTINGS)
    watched.wait_for_the_last_picture()
    assert watched.session.error is None


def test_a_bug_is_an_error_and_not_the_end(watched, monkeypatch, capsys):
    real = core.preparation.prepare
    monkeypatch.setattr(core.preparation, "prepare", lambda *arguments: 1 / 0)
    watched.session.show_view(view_of(grey(0).camera))
    watched.session.show_scene(grey(0.5), SETTINGS)
    watched.wait(lambda: watched.session.error is not None)
    assert watched.session.error == "internal error: ZeroDivisionError: division by zero"
    assert "Traceback" in capsys.readouterr().err
    monkeypatch.setattr(core.preparation, "prepare", real)
    watched.session.show_scene(grey(0.5), SETTINGS)
    watched.wait_for_the_last_picture()


def test_nothing_is_left_of_sessions_that_are_closed(watched):
    threads = threading.active_count()
    structures = []
    for _ in range(30):
        session = Session(lambda: None)
        session.show_scene(still_life(), replace(SETTINGS, samples=4096))
        session.show_view(view_of(still_life().camera))
        deadline = time.monotonic() + 60
        while session.picture is None and time.monotonic() < deadline:
            time.sleep(0.002)
        structures.append(session._prepared.packed.structure)
        session.close()
    assert threading.active_count() <= threads
    assert not any(structure.join() for structure in structures), "Embree's memory has been given back"


def usage() -> tuple[int, int, float]:
    """Threads, open files, and the memory in use in MB."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd")), pages * os.sysconf("SC_PAGESIZE") / 1e6


def restart() -> None:
    """Open a viewport, wait for its first picture, and close it while it goes on rendering."""
    there = threading.Event()
    session = Session(there.set)
    session.show_scene(grey(0.5), SETTINGS)
    session.show_view(view_of(grey(0.5).camera))
    assert there.wait(300), "kernels may have to be compiled first"
    assert session.error is None
    session.close()


@pytest.mark.slow
def test_a_thousand_restarts_leave_nothing_behind(monkeypatch):
    monkeypatch.setattr(kernels, "start_compiling", lambda: None)
    for _ in range(WARM_UPS):
        restart()
    threads, files, memory = usage()
    for _ in range(RESTARTS):
        restart()
    threads_after, files_after, memory_after = usage()
    print(f"{RESTARTS} restarts: {memory_after - memory:+.1f} MB, threads {threads} -> {threads_after}")
    assert (threads_after, files_after) == (threads, files)
    assert memory_after - memory < MEGABYTES_MORE


def test_views_are_compared_by_all_that_is_seen():
    camera = grey(0).camera
    view, same = view_of(camera), view_of(replace(camera, matrix=camera.matrix.copy()))
    assert view.is_same(same)
    moved = camera.matrix.copy()
    moved[0, 3] += 1e-6
    others = [replace(camera, matrix=moved), replace(camera, clip_end=5.0), replace(camera, resolution=(63, 48))]
    assert not any(view.is_same(view_of(other)) for other in others)
    assert not view.is_same(View(camera, (0, 0, 8, 8)))
    assert not view.is_same(None)


def test_errors_of_the_main_thread_are_shown_as_well(watched):
    watched.session.show_error(str(SceneError("the camera is panoramic")))
    assert watched.session.text == "the camera is panoramic"
