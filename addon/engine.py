"""The render engine that Blender sees: F12, the command line, animation, render regions and passes.

Blender calls `render` once for each view layer. The scene is exported, `core.render` renders it, and each finished tile
goes into Blender's render result. Blender swallows exceptions that leave `render` and saves a black picture as if
nothing had happened, so that all of them end in an error report.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
import weakref

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from . import kernels, watch
from ._core import core
from .failures import failure_text
from .progress import Progress, finished_lines, losses
from .settings import render_settings

ENGINE_ID = "ROOKS"

#: How often the status line is brought up to date, in seconds.
STATUS_EVERY = 1.0

#: Our passes beside Combined: name, channels, the channels' letters, Blender's kind of pass, and who asks for it.
PASSES = (
    ("Depth", 1, "Z", "VALUE", lambda layer: layer.use_pass_z),
    ("Normal", 3, "XYZ", "VECTOR", lambda layer: layer.use_pass_normal),
    ("Sampling Error", 3, "RGB", "COLOR", lambda layer: layer.rooks.use_pass_sampling_error),
    ("Denoising Normal", 3, "XYZ", "VECTOR", lambda layer: layer.rooks.use_pass_denoising_data),
    ("Denoising Albedo", 3, "RGB", "COLOR", lambda layer: layer.rooks.use_pass_denoising_data),
)
#: The film's name of what has another one in Blender: compositor nodes made for Cycles find what they are linked to.
FILM_NAMES = {"Denoising Normal": "Normal"}


#: What the Performance panel says of the last render that was finished, a line each.
last_render: list[str] = []


class RooksRenderEngine(bpy.types.RenderEngine):
    """Rooks: sampling techniques from the textbooks, on Embree."""

    bl_idname = ENGINE_ID
    bl_label = "Rooks"
    bl_use_preview = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    _viewport = None
    _failure = ""

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            from .viewport import Viewport
        except (ImportError, core.errors.RooksError) as error:
            self._failure = failure_text(error)
            return
        if self._viewport is None:
            myself = weakref.ref(self)
            self._viewport = Viewport(lambda: _redraw(myself))
            weakref.finalize(self, self._viewport.close)
        self._viewport.update(context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.update_stats("", self._viewport.draw(context, depsgraph) if self._viewport else self._failure)

    def update_render_passes(self, scene: bpy.types.Scene = None, renderlayer: bpy.types.ViewLayer = None) -> None:
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for name, channels, letters, kind, is_wanted in PASSES:
            if is_wanted(renderlayer):
                self.register_pass(scene, renderlayer, name, channels, letters, kind)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            self._render(depsgraph)
        except KeyboardInterrupt:
            watch.worn().interrupted = True
            self._fail(rpt_("interrupted"))
        except Exception as error:
            self._fail(failure_text(error, watch.worn().err))

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        self.update_stats("", iface_("Reading the scene"))
        # Here, because Blender's start has no need of it.
        from .camera import export_camera
        from .export import export_scene
        from .metadata import metadata
        from .previews import without_floor

        worn = watch.worn()
        resolution = self.resolution_x, self.resolution_y
        settings = render_settings(depsgraph.scene_eval, resolution)
        scene, warnings = export_scene(depsgraph, export_camera(depsgraph, resolution))
        self._warn(warnings)
        if self.is_preview:
            scene = without_floor(scene)
        if not worn.on_scene(scene, settings):
            return
        wants_albedo = depsgraph.view_layer_eval.rooks.use_pass_denoising_data
        settings = dataclasses.replace(settings, denoising_albedo=wants_albedo)

        left, bottom = settings.border[:2] if settings.border else (0, 0)
        layer = depsgraph.view_layer_eval.name
        self.update_stats("", iface_("Loading the renderer"))
        if not kernels.wait_for_kernels(self._tell_compiling, self._should_stop):
            return
        self.update_stats("", iface_("Preparing the scene"))

        progress, told = Progress(settings), -math.inf

        def on_tile(tile: core.Tile) -> None:
            self._show(tile, tile.x - left, tile.y - bottom, layer)
            self.update_progress(tile.done / tile.total)
            progress.add(tile)
            worn.on_progress(tile.done, tile.total)

        def should_cancel() -> bool:
            nonlocal told
            # The clock in Blender's status line moves with its text only.
            if time.monotonic() > told + STATUS_EVERY:
                told = time.monotonic()
                self.update_stats("", progress.text)
            return self._should_stop()

        film = core.render(scene, settings, on_tile, should_cancel)
        self.update_stats("", progress.finished(film))
        self._warn(losses(film))
        if not self.is_preview:
            last_render[:] = finished_lines(film)
            self._note(metadata(depsgraph.scene_eval, film, settings))
        worn.films.append(film)
        worn.settings.append(settings)

    def _should_stop(self) -> bool:
        return self.test_break() or core.command_line.was_interrupted()

    def _tell_compiling(self, share: float) -> None:
        self.update_stats("", kernels.progress_text(share))
        self.update_progress(share)

    def _show(self, tile: core.Tile, x: int, y: int, layer: str) -> None:
        """Put a tile into Blender's picture; x and y count from the lower left corner of the render region."""
        result = self.begin_result(x, y, tile.width, tile.height, layer=layer)
        for render_pass in result.layers[0].passes:
            pixels = tile.passes.get(FILM_NAMES.get(render_pass.name, render_pass.name))
            if pixels is not None:
                render_pass.rect.foreach_set(pixels.reshape(-1))
        self.end_result(result)

    def _note(self, metadata: dict[str, str | int | float]) -> None:
        """Have Blender keep in the picture's file how it was made."""
        result = self.get_result()
        for key, value in metadata.items():
            result.stamp_data_add_field(f"rooks:{key}", str(value))

    def _warn(self, warnings: list[str]) -> None:
        watch.worn().warnings += warnings
        for warning in () if self.is_preview else warnings:
            self.report({"WARNING"}, warning)

    def _fail(self, text: str) -> None:
        watch.worn().error = text
        if self.is_preview:  # which Blender makes all by itself, and shows without a word
            self.update_stats("", text)
        else:
            self.report({"ERROR"}, text)


def _redraw(engine: weakref.ref[RooksRenderEngine]) -> None:
    """Ask for a redraw of the view that an engine draws, from any thread."""
    with contextlib.suppress(ReferenceError):  # Blender has freed it
        if engine() is not None:
            engine().tag_redraw()
