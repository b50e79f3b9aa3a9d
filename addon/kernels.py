"""Where Blender keeps Rooks' caches, and whether kernels still have to be compiled."""

from __future__ import annotations

import os

import bpy

from ._core import core


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
    extension = __package__.rpartition(".")[0]
    if not extension.startswith("bl_ext."):
        return
    folder = bpy.utils.extension_path_user(extension, path=name, create=False)
    if folder:
        os.environ.setdefault(variable, folder)


def are_compiled() -> bool:
    """Whether compiled kernels of this version are on disk. Loads the renderer."""
    _ = core.render  # which loads `core.jit` as well
    return any(core.jit.cache_folder().rglob("*.nbi"))
