"""Compiled kernels: where Blender keeps them, and how they are there before the first render.

They are compiled by a process of its own, which Blender does not have to wait for, and which can be stopped. It starts
when Rooks is chosen as the render engine, or else with the first render. Once they are compiled a thread loads them,
with the modules that a render needs: that takes most of a second, which F12 does not have to wait for.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ._core import core

#: How often is asked for news, in seconds.
POLL = 0.05

#: Imports the core under the name that it has here, by which numba finds what it has compiled.
_SCRIPT = """
import importlib, os, sys, types
core, folder = sys.argv[1:]
parents = core.split(".")[:-1]
for count in range(1, len(parents) + 1):
    package = sys.modules[".".join(parents[:count])] = types.ModuleType(".".join(parents[:count]))
    package.__path__ = [folder]
hasattr(os, "nice") and os.nice(5)
importlib.import_module(core + ".compiling").compile_kernels()
"""

#: How long the end of Rooks waits for the thread that loads, in seconds.
ENDS_WITHIN = 2.0

#: What `engine` imports when it renders.
_MODULES = ".camera", ".export", ".metadata", ".previews"

_process: subprocess.Popen | None = None
_loader: threading.Thread | None = None
_lock = threading.Lock()


def choose_cache_folder() -> None:
    """As an installed extension, keep compiled kernels in Blender's folder for the extension's files.

    To be called before the first render. `ROOKS_CACHE_DIR`, where the user has set it, stays as it is.
    """
    # The core creates it, and has a folder to turn to where that fails; Blender would print a traceback.
    _choose_folder("ROOKS_CACHE_DIR", "kernels")


def choose_drawing_folder() -> None:
    """The same for what matplotlib keeps, its list of fonts. To be called before the first comparison."""
    _choose_folder("MPLCONFIGDIR", "matplotlib")


def _choose_folder(variable: str, name: str) -> None:
    if folder := _own_folder(name):
        os.environ.setdefault(variable, folder)


def _own_folder(name: str) -> str:
    """A folder within the one that Blender has for the files of an installed extension; empty where it is none."""
    extension = __package__.rpartition(".")[0]
    if not extension.startswith("bl_ext."):
        return ""
    return bpy.utils.extension_path_user(extension, path=name, create=False)


def start_compiling() -> None:
    """Start to compile the kernels in the background, if that is needed and not being done.

    Raises:
        RooksError: there is no folder to keep them in.
    """
    global _process
    choose_cache_folder()
    with _lock:
        if _process is None and not core.kernel_cache.are_compiled() and Path(sys.executable or "").is_file():
            _remove_older_kernels()
            _process = _start()


def _remove_older_kernels() -> None:
    """After an upgrade, take away the other version's. Should it still run somewhere, it compiles them once more."""
    kept, own = core.kernel_cache.cache_folder(), _own_folder("kernels")
    if own and kept.parent == Path(own):
        for folder in kept.parent.iterdir():
            if folder != kept:
                shutil.rmtree(folder, ignore_errors=True)


def _start() -> subprocess.Popen:
    folder = str(Path(core.__file__).parents[1])
    return subprocess.Popen(
        [sys.executable, "-c", _SCRIPT, core.__name__, folder],
        env=os.environ
        | {
            "PYTHONPATH": os.pathsep.join([*filter(None, sys.path), folder]),
            # That of this process, which may be a temporary one of its own.
            "ROOKS_CACHE_DIR": str(core.kernel_cache.cache_folder().parent),
        },
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # Windows would open a console
    )


def start_loading() -> None:
    """Start to load in the background what the first render would have to load, if that was not done before.

    It waits for the compilation that `start_compiling` has started.
    """
    global _loader
    if _loader is None:
        _loader = threading.Thread(target=_load, name="rooks-load")
        _loader.start()


def _load() -> None:
    with contextlib.suppress(Exception):  # whatever is wrong, the render meets it again, and says so
        for module in _MODULES:
            import_module(module, __package__)
        if (process := _process) is not None:
            process.wait()
        if core.kernel_cache.are_compiled():
            core.compiling.load_kernels()


def wait_for_kernels(on_progress: Callable[[float], None], should_cancel: Callable[[], bool]) -> bool:
    """Wait until the kernels are compiled; False where it was cancelled. The compilation goes on then.

    Where it fails, the render compiles them itself, and says what is wrong if that fails too.
    """
    start_compiling()
    process, told = _process, None
    while process is not None and process.poll() is None:
        # Blender draws, or in the background prints, all that it is told.
        if (share := round(core.kernel_cache.share_compiled(), 2)) != told:
            on_progress(share)
            told = share
        if should_cancel():
            return False
        time.sleep(POLL)
    return not should_cancel()


def progress_text(share: float) -> str:
    """What to tell the user meanwhile."""
    return iface_("Compiling kernels, first render only: {share:.0%}").format(share=share)


def stop() -> None:
    """End the compilation, of which is kept what is compiled, and the loading, which takes a second."""
    global _process, _loader
    with _lock:
        if _process is not None:
            _process.kill()
            _process.wait()
            _process = None
    if _loader is not None:
        _loader.join(ENDS_WITHIN)  # longer where a kernel is damaged, and compiled once more
        _loader = None
