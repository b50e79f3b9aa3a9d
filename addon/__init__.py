"""Rooks in Blender: everything that touches bpy, and no rendering.

Blender imports this package as part of the extension and calls `register`; the command line (`python -m addon`) does
the same on Blender's Python module. Modules that need bpy are imported inside the functions, so that the package can be
imported, and its help text shown, without Blender.
"""

from __future__ import annotations

import atexit

_registered = False


def register() -> None:
    """Make the engine, its settings and its panels known to Blender."""
    global _registered
    if _registered:
        return
    import bpy

    from . import engine, properties, ui

    properties.register()
    bpy.utils.register_class(engine.RooksRenderEngine)
    ui.register()
    _registered = True
    # Blender as a Python module crashes or hangs at exit while an engine in Python is registered.
    atexit.register(unregister)


def unregister() -> None:
    """Take back all that `register` did; nothing if that has happened already."""
    global _registered
    if not _registered:
        return
    _registered = False
    atexit.unregister(unregister)
    import bpy

    from . import engine, properties, ui

    ui.unregister()
    bpy.utils.unregister_class(engine.RooksRenderEngine)
    properties.unregister()
