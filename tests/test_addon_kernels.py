"""Kernels are there before the first render asks for them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from addon import kernels  # noqa: E402
from core import compiling, kernel_cache  # noqa: E402

ROOT = Path(__file__).parents[1]

LOADS = """
import sys, addon
from addon import kernels
addon.register()
heavy = {"addon" + name for name in kernels._MODULES} | {"core.integrator"}
assert not heavy & set(sys.modules), "registering alone loads what can wait"
kernels.start_loading()
kernels._loader.join()  # to its end, however long: stop() does not wait for that
kernels.stop()
assert heavy <= set(sys.modules), "modules are not loaded"
from core.integrator import render_blocks
assert render_blocks.signatures, "kernels are not loaded"
"""


def test_what_a_render_needs_is_loaded_ahead():
    compiling.compile_kernels()  # which are in the cache
    result = subprocess.run([sys.executable, "-c", LOADS], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert (result.returncode, result.stderr) == (0, "")


def test_what_cannot_be_loaded_is_left_for_the_render_to_report(monkeypatch):
    calls = []

    def fail() -> None:
        calls.append(1)
        raise ImportError("no module named numba")

    monkeypatch.setattr(compiling, "load_kernels", fail)
    monkeypatch.setattr(kernel_cache, "are_compiled", lambda: True)
    kernels._load()
    assert calls
