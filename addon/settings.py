"""Blender's render settings, and `scene.rooks`, as the renderer's `RenderSettings`."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core

Border = tuple[int, int, int, int]

#: Settings of light paths, which have one name everywhere: in Blender, on the command line and in the renderer.
BOUNCES = ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_bounces")
LIGHT_PATHS = (*BOUNCES, "clamp_indirect")


def render_settings(scene: bpy.types.Scene, resolution: tuple[int, int]) -> core.settings.RenderSettings:
    """The settings of a final render of `resolution` pixels.

    Raises:
        SettingsError: a setting is out of its range.
    """
    return _settings(scene, scene.rooks.samples, render_border(scene.render, resolution))


def viewport_settings(scene: bpy.types.Scene) -> core.settings.RenderSettings:
    """The settings of the rendered viewport.

    Raises:
        SettingsError: a setting is out of its range.
    """
    return _settings(scene, scene.rooks.preview_samples, None)


def _settings(scene: bpy.types.Scene, samples: int, border: Border | None) -> core.settings.RenderSettings:
    rooks = scene.rooks
    return core.settings.RenderSettings(
        samples=samples,
        **sampling(rooks),
        seed=(rooks.seed + scene.frame_current * rooks.use_animated_seed) % (core.limits.MAX_SEED + 1),
        **{name: getattr(rooks, name) for name in LIGHT_PATHS},
        pixel_filter=rooks.pixel_filter.lower(),
        filter_width=scene.render.filter_size,
        film_transparent=scene.render.film_transparent,
        border=border,
        tile_size=rooks.tile_size,
        threads=scene.render.threads if scene.render.threads_mode == "FIXED" else 0,
    )


def render_border(render: bpy.types.RenderSettings, resolution: tuple[int, int]) -> Border | None:
    """The render region in pixels, (left, bottom, right, top), rounded as Blender does; None for the full frame."""
    if not render.use_border:
        return None
    import numpy as np  # here, because Blender's start must not wait for it

    width, height = resolution

    def pixel(share: float, size: int) -> int:
        # Blender multiplies in float32: in double precision 0.7 of 40 would be 27.
        return int(np.float32(min(max(share, 0.0), 1.0)) * np.float32(size))

    left, right = (pixel(x, width) for x in (render.border_min_x, render.border_max_x))
    bottom, top = (pixel(y, height) for y in (render.border_min_y, render.border_max_y))
    if (left, bottom, right, top) == (0, 0, width, height):
        return None
    if left >= right or bottom >= top:
        raise core.errors.SettingsError(rpt_("the render region is empty: draw it larger, or switch it off"))
    return left, bottom, right, top


def sampling(rooks: bpy.types.PropertyGroup) -> dict[str, str]:
    """The fields of `RenderSettings` that name samplers: one for all domains, or one for each as well."""
    names = ["sampler"]
    if rooks.use_separate_samplers:
        names += ["pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler"]
    return {name: getattr(rooks, name).lower() for name in names}
