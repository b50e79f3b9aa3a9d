"""What Rooks does when something happens in Blender: an engine is chosen, a file is loaded, something is undone."""

from __future__ import annotations

import contextlib
import sys

import bpy
from bpy.app.handlers import persistent

from . import kernels
from ._core import core
from .engine import ENGINE_ID

#: Whose subscription to changes of the engine it is.
_owner = object()


def register() -> None:
    bpy.app.handlers.load_post.append(_on_load)
    bpy.app.handlers.undo_post.append(_on_undo)
    bpy.app.handlers.redo_post.append(_on_undo)
    _subscribe()
    # While extensions are enabled Blender has no scenes to look at.
    if not bpy.app.background:
        bpy.app.timers.register(_get_ready, first_interval=0.0, persistent=True)


def unregister() -> None:
    if bpy.app.timers.is_registered(_get_ready):
        bpy.app.timers.unregister(_get_ready)
    bpy.msgbus.clear_by_owner(_owner)
    bpy.app.handlers.redo_post.remove(_on_undo)
    bpy.app.handlers.undo_post.remove(_on_undo)
    bpy.app.handlers.load_post.remove(_on_load)
    _for_viewports("close_all")
    kernels.stop()


@persistent
def _on_load(*_arguments) -> None:
    _subscribe()  # a subscription ends with the file
    _for_viewports("forget_all")
    _get_ready()


@persistent
def _on_undo(*_arguments) -> None:
    _for_viewports("forget_all")


def _subscribe() -> None:
    bpy.msgbus.clear_by_owner(_owner)
    bpy.msgbus.subscribe_rna(key=(bpy.types.RenderSettings, "engine"), owner=_owner, args=(), notify=_get_ready)


def _get_ready() -> None:
    """Compile or load the kernels while the user is still at work on the scene that Rooks is to render."""
    if not bpy.app.background and any(scene.render.engine == ENGINE_ID for scene in bpy.data.scenes):
        with contextlib.suppress(core.errors.RooksError, OSError):  # the render will say what is wrong
            kernels.start_compiling()
            kernels.start_loading()


def _for_viewports(do: str) -> None:
    # Without a window there are none, and their module cannot be loaded.
    viewport = sys.modules.get(f"{__package__}.viewport")
    if viewport is not None:
        getattr(viewport, do)()
