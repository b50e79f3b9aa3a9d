"""Each failure is one line that says what is wrong and what to do."""

from __future__ import annotations

import errno
import io
import sys
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")

from addon.engine import RooksRenderEngine
from addon.failures import failure_text
from core import SceneError


def test_what_is_wrong_with_a_scene_is_said_in_its_own_words():
    assert failure_text(SceneError("no camera: add one")) == "no camera: add one"


def test_a_part_that_cannot_be_loaded_is_named():
    err = io.StringIO()
    text = failure_text(ModuleNotFoundError("No module named 'numba'"), err)
    assert "No module named 'numba'" in text
    assert "install the zip again" in text
    assert not err.getvalue()


def test_too_little_memory_is_said():
    assert "not enough memory" in failure_text(MemoryError())


def test_a_full_disk_is_said():
    err = io.StringIO()
    text = failure_text(OSError(errno.ENOSPC, "No space left on device", "/home/kernels/x.nbc"), err)
    assert "/home/kernels/x.nbc" in text
    assert "make room" in text
    assert not err.getvalue()


def test_a_bug_leaves_its_traceback():
    err = io.StringIO()
    with pytest.raises(ZeroDivisionError) as caught:
        _ = 1 / 0
    assert failure_text(caught.value, err) == "internal error: ZeroDivisionError: division by zero"
    assert "Traceback" in err.getvalue()


def test_a_view_that_cannot_be_rendered_says_why(monkeypatch):
    monkeypatch.setitem(sys.modules, "addon.viewport", None)  # as where something that it needs is missing
    told = []
    engine = SimpleNamespace(_viewport=None, _failure="", update_stats=lambda _, text: told.append(text))
    RooksRenderEngine.view_update(engine, None, None)
    RooksRenderEngine.view_draw(engine, None, None)
    assert "install the zip again" in told[0]
