"""Rooks in Blender: everything that touches bpy, and no rendering.

Blender imports this package as part of the extension and calls `register`; the command line (`python -m addon`) does
the same on Blender's Python module. Modules that need bpy are imported inside the functions, so that the package can be
imported, and its help text shown, without Blender.
"""

from __future__ import annotations

import atexit

_registered = False
_command = None


def is_registered() -> bool:
    return _registered


def register() -> None:
    """Make the engine, its settings, panels, operators and commands known to Blender."""
    global _registered, _command
    if _registered:
        return
    import bpy

    from . import blender_panels, compare_operators, engine, handlers, presets, properties, translations, ui

    translations.register()
    properties.register()
    bpy.utils.register_class(engine.RooksRenderEngine)
    compare_operators.register()
    presets.register()
    ui.register()
    blender_panels.register()
    handlers.register()
    _command = bpy.utils.register_cli_command("rooks", _run_command)
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

    from . import blender_panels, compare_operators, engine, handlers, presets, properties, translations, ui

    bpy.utils.unregister_cli_command(_command)
    handlers.unregister()
    blender_panels.unregister()
    ui.unregister()
    presets.unregister()
    compare_operators.unregister()
    bpy.utils.unregister_class(engine.RooksRenderEngine)
    properties.unregister()
    translations.unregister()


def _run_command(arguments: list[str]) -> int:
    """`blender FILE.blend --command rooks …`"""
    from .cli import run_in_blender

    return run_in_blender(arguments)
