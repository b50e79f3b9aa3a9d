"""A scene just as the engine would render it, for those who render it themselves, and more than once.

Blender shows a scene as it is rendered (hidden objects left out, modifiers at their render level) to a render engine
alone, inside a render. So a render is started that ends when the scene has been exported. It is a render of a copy of
the scene: the copy can have another size, and what the user rendered last stays in the render window.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TextIO

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import kernels
from ._core import core
from .blend_files import keep_first_layer
from .camera import frame_resolution, no_camera_text
from .engine import ENGINE_ID
from .watch import Watch, watched_render


@dataclass(frozen=True)
class Handover:
    """A scene that Blender has nothing to do with any more, and what is to be said about it."""

    scene: core.scene.Scene
    settings: core.settings.RenderSettings
    warnings: tuple[str, ...]


def hand_over(scene: bpy.types.Scene, resolution: tuple[int, int], err: TextIO = sys.stderr) -> Handover:
    """Export the first view layer of a scene as a final render of `resolution` pixels would.

    Tracebacks of bugs go to `err`.

    Raises:
        SceneError: it cannot be rendered, or not now.
    """
    if scene.camera is None:
        raise core.errors.SceneError(no_camera_text(scene))
    if bpy.app.is_job_running("RENDER"):
        raise core.errors.SceneError(rpt_("Blender is rendering: wait until it is done, or stop it"))
    taken: list[tuple[core.scene.Scene, core.settings.RenderSettings]] = []

    def take(exported: core.scene.Scene, settings: core.settings.RenderSettings) -> bool:
        taken.append((exported, settings))
        return False

    watch = Watch(on_scene=take, err=err)
    copy = scene.copy()
    try:
        copy.render.engine = ENGINE_ID
        copy.render.use_sequencer = copy.render.use_compositing = False
        copy.render.resolution_x, copy.render.resolution_y = resolution
        copy.render.resolution_percentage = 100
        left_out = keep_first_layer(copy)
        watched_render(watch, scene=copy.name)
    finally:
        # Not scenes.remove: without a window it crashes Blender 4.3.
        bpy.data.batch_remove([copy])
    if not taken:
        raise core.errors.SceneError(rpt_("Blender rendered nothing: switch on a view layer"))
    kernels.choose_cache_folder()
    kernels.choose_drawing_folder()
    return Handover(*taken[0], (*watch.warnings, *left_out))


def size_within(render: bpy.types.RenderSettings, longest: int) -> tuple[int, int]:
    """The size of a scene's pictures, made smaller where its longer side has more than `longest` pixels."""
    width, height = frame_resolution(render)
    scale = min(longest / max(width, height), 1.0)
    return max(round(width * scale), 4), max(round(height * scale), 4)
