"""How a script follows the renders that it starts: `watched_render(Watch())`.

Blender keeps what happens inside a render engine to itself: the operator says neither how far it is, nor which samples
were taken, nor why nothing came out. The engine writes all that into the watch that is being worn, if there is one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TextIO

from ._core import core


@dataclass
class Watch:
    """What the engine did: one film and its settings per view layer, in the order in which they were rendered."""

    on_progress: Callable[[int, int], None] = lambda done, total: None
    #: Gets each view layer as it was exported, and says whether a picture of it is wanted.
    on_scene: Callable[[core.scene.Scene, core.settings.RenderSettings], bool] = lambda scene, settings: True
    #: Where the tracebacks of bugs go.
    err: TextIO = field(default_factory=lambda: sys.stderr)
    films: list[core.Film] = field(default_factory=list)
    settings: list[core.settings.RenderSettings] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    error: str | None = None
    interrupted: bool = False


_worn: Watch | None = None


def worn() -> Watch:
    """The watch to report to: the one being worn, else one that nobody reads."""
    return _worn or Watch()


@contextmanager
def watching(watch: Watch) -> Iterator[Watch]:
    global _worn
    before, _worn = _worn, watch
    try:
        yield watch
    finally:
        _worn = before


def watched_render(watch: Watch, **options) -> None:
    """Call Blender's render operator, with `options`, in the sight of a watch.

    Raises:
        SceneError: it came to nothing; the text is the engine's, or else Blender's.
        KeyboardInterrupt: a signal has come to end the command.
    """
    import bpy

    if core.command_line.was_interrupted():  # while Blender was loading or opened a file
        raise core.command_line.Ended
    with watching(watch):
        try:
            outcome = bpy.ops.render.render(**options)
        except RuntimeError as error:
            watch.error = watch.error or str(error).splitlines()[0].removeprefix("Error: ")
    if watch.interrupted or core.command_line.was_interrupted():
        raise core.command_line.Ended
    if watch.error is None and "FINISHED" not in outcome:
        watch.error = "Blender rendered nothing"
    if watch.error:
        raise core.errors.SceneError(watch.error)
