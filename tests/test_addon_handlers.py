"""What happens in Blender reaches the viewports and the kernels, and nothing is left of it in the end."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

import addon  # noqa: E402
from addon import handlers, kernels  # noqa: E402
from tests.addon_helpers import empty_scene  # noqa: E402

LISTS = ("load_post", "undo_post", "redo_post")


@pytest.fixture
def viewports(monkeypatch) -> list[str]:
    """What the viewports are told; their module needs a window."""
    told: list[str] = []
    calls = {name: lambda name=name: told.append(name) for name in ("forget_all", "close_all")}
    monkeypatch.setitem(sys.modules, "addon.viewport", SimpleNamespace(**calls))
    return told


@pytest.fixture
def compilations(monkeypatch) -> list[str]:
    """What is done about kernels, in a Blender that seems to have a window."""
    told: list[str] = []
    monkeypatch.setattr(kernels, "start_compiling", lambda: told.append("compile"))
    monkeypatch.setattr(kernels, "start_loading", lambda: told.append("load"))
    monkeypatch.setattr(kernels, "stop", lambda: told.append("stop"))
    return told


def seem_to_have_a_window(monkeypatch) -> None:
    monkeypatch.setattr(handlers, "bpy", SimpleNamespace(app=SimpleNamespace(background=False), data=bpy.data))


def ours(name: str) -> list:
    return [handler for handler in getattr(bpy.app.handlers, name) if handler.__module__ == "addon.handlers"]


def test_handlers_are_there_once_and_outlive_files():
    for _ in range(2):
        empty_scene()
        assert [len(ours(name)) for name in LISTS] == [1, 1, 1]


def test_opening_a_file_makes_viewports_forget_the_last_one(viewports):
    empty_scene()
    assert viewports == ["forget_all"]


def test_undoing_and_redoing_make_viewports_forget(viewports):
    scene = empty_scene()
    viewports.clear()
    bpy.ops.ed.undo_push(message="before")
    scene.rooks.samples = 5
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert viewports == ["forget_all"]
    bpy.ops.ed.redo()
    assert viewports == ["forget_all"] * 2


def test_without_a_viewport_none_is_told(monkeypatch):
    monkeypatch.delitem(sys.modules, "addon.viewport", raising=False)
    handlers._on_undo()
    assert "addon.viewport" not in sys.modules


@pytest.mark.parametrize(("engine", "expected"), [("ROOKS", ["compile", "load"]), ("CYCLES", [])])
def test_kernels_are_compiled_or_loaded_as_soon_as_a_scene_is_to_be_rendered_with_rooks(
    compilations, monkeypatch, engine, expected
):
    empty_scene().render.engine = engine
    seem_to_have_a_window(monkeypatch)
    handlers._get_ready()
    assert compilations == expected


def test_any_scene_of_the_file_counts(compilations, monkeypatch):
    empty_scene().render.engine = "CYCLES"
    bpy.data.scenes.new("Other").render.engine = "ROOKS"
    seem_to_have_a_window(monkeypatch)
    handlers._get_ready()
    assert compilations == ["compile", "load"]


def test_without_a_window_nothing_is_compiled_ahead(compilations):
    empty_scene()
    handlers._get_ready()
    assert compilations == []


def test_in_the_end_viewports_are_closed_compiling_is_stopped_and_no_handler_is_left(viewports, compilations):
    addon.unregister()
    try:
        assert viewports == ["close_all"]
        assert compilations == ["stop"]
        assert [ours(name) for name in LISTS] == [[], [], []]
        assert not bpy.app.timers.is_registered(handlers._get_ready)
    finally:
        addon.register()
