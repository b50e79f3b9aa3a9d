"""The render engine that Blender sees: F12, the command line, animation, render regions and passes.

Blender calls `render` once for each view layer. The scene is exported, `core.render` renders it, and each finished tile
goes into Blender's render result. Blender swallows exceptions that leave `render` and saves a black picture as if
nothing had happened, so that all of them end in an error report.
"""

from __future__ import annotations

import math
import time
import traceback

import bpy

from . import kernels, watch
from ._core import core
from .settings import render_settings

ENGINE_ID = "ROOKS"

#: How often the status line is brought up to date, in seconds.
STATUS_EVERY = 1.0

#: Our passes beside Combined: name, channels, the channels' letters, Blender's kind of pass, and who asks for it.
PASSES = (
    ("Depth", 1, "Z", "VALUE", lambda layer: layer.use_pass_z),
    ("Normal", 3, "XYZ", "VECTOR", lambda layer: layer.use_pass_normal),
    ("Sampling Error", 3, "RGB", "COLOR", lambda layer: layer.rooks.use_pass_sampling_error),
)


class RooksRenderEngine(bpy.types.RenderEngine):
    """Rooks: sampling techniques from the textbooks, on Embree."""

    bl_idname = ENGINE_ID
    bl_label = "Rooks"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    def update_render_passes(self, scene: bpy.types.Scene = None, renderlayer: bpy.types.ViewLayer = None) -> None:
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for name, channels, letters, kind, is_wanted in PASSES:
            if is_wanted(renderlayer):
                self.register_pass(scene, renderlayer, name, channels, letters, kind)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            self._render(depsgraph)
        except core.errors.RooksError as error:
            self._fail(str(error))
        except KeyboardInterrupt:
            watch.worn().interrupted = True
            self._fail("interrupted")
        except Exception as error:
            traceback.print_exc(file=watch.worn().err)
            self._fail(f"internal error: {type(error).__name__}: {error}".splitlines()[0])

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        self.update_stats("", "Reading the scene")
        # Here, because Blender's start has no need of it.
        from .export import export_scene

        worn = watch.worn()
        resolution = self.resolution_x, self.resolution_y
        settings = render_settings(depsgraph.scene_eval, resolution)
        scene, warnings = export_scene(depsgraph, resolution)
        for warning in warnings:
            self.report({"WARNING"}, warning)
        worn.warnings += warnings
        if not worn.on_scene(scene, settings):
            return

        left, bottom = settings.border[:2] if settings.border else (0, 0)
        layer = depsgraph.view_layer_eval.name
        self.update_stats("", "Loading the renderer")
        kernels.choose_cache_folder()
        preparing = "Preparing the scene" if kernels.are_compiled() else "Compiling kernels (first render only)"
        self.update_stats("", preparing)

        tiles, told = "", -math.inf

        def on_tile(tile: core.Tile) -> None:
            nonlocal tiles
            self._show(tile, tile.x - left, tile.y - bottom, layer)
            self.update_progress(tile.done / tile.total)
            tiles = f", {tile.done} of {tile.total} tiles"
            worn.on_progress(tile.done, tile.total)

        def should_cancel() -> bool:
            nonlocal told
            # The clock in Blender's status line moves with its text only.
            if tiles and time.monotonic() > told + STATUS_EVERY:
                told = time.monotonic()
                self.update_stats("", _intention(settings) + tiles)
            return self.test_break()

        film = core.render(scene, settings, on_tile, should_cancel)
        speed = "stopped" if film.cancelled else f"{film.samples_per_second / 1e6:.1f} million samples/s"
        self.update_stats("", f"{_intention(settings)}, {speed}")
        for lost in _losses(film):
            self.report({"WARNING"}, lost)
            worn.warnings.append(lost)
        worn.films.append(film)
        worn.settings.append(settings)

    def _show(self, tile: core.Tile, x: int, y: int, layer: str) -> None:
        """Put a tile into Blender's picture; x and y count from the lower left corner of the render region."""
        result = self.begin_result(x, y, tile.width, tile.height, layer=layer)
        for render_pass in result.layers[0].passes:
            pixels = tile.passes.get(render_pass.name)
            if pixels is not None:
                render_pass.rect.foreach_set(pixels.reshape(-1))
        self.end_result(result)

    def _fail(self, text: str) -> None:
        self.report({"ERROR"}, text)
        watch.worn().error = text


def sampler_text(settings: core.settings.RenderSettings) -> str:
    """The samplers by their names: one, or one for each domain."""
    labels = {domain: core.samplers.SAMPLERS[name].label for domain, name in settings.samplers.items()}
    if len(set(labels.values())) == 1:
        return labels["pixel"]
    return ", ".join(f"{label} ({domain})" for domain, label in labels.items())


def sample_text(settings: core.settings.RenderSettings) -> str:
    """The samples per pixel that are taken, and those asked for where they differ."""
    taken = settings.sample_count
    asked = "" if taken == settings.samples else f" ({settings.samples} asked for)"
    return f"{taken} sample{'s' * (taken != 1)} per pixel{asked}"


def _losses(film: core.Film) -> list[str]:
    """What of the picture could not be written as it was computed."""
    losses = []
    if film.dropped_samples:
        losses.append(f"{film.dropped_samples} samples were not finite numbers and were left out")
    if film.negative_pixels:
        losses.append(
            f"{film.negative_pixels} pixels were negative, by lamps or emission below 0, and are black instead"
        )
    return losses


def _intention(settings: core.settings.RenderSettings) -> str:
    return f"{sampler_text(settings)}, {sample_text(settings)}"
