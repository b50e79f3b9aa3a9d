"""What a picture says of itself in its file: how it was sampled, from what, and how long it took."""

from __future__ import annotations

import bpy

from ._core import core
from .settings import LIGHT_PATHS


def metadata(
    scene: bpy.types.Scene, film: core.Film, settings: core.settings.RenderSettings
) -> dict[str, str | int | float]:
    return {
        **{f"{domain}_sampler": name for domain, name in settings.samplers.items()},
        "samples_requested": settings.samples,
        "samples": film.samples,
        "dropped_samples": film.dropped_samples,
        "negative_pixels": film.negative_pixels,
        "blocked_samples": film.blocked_samples,
        "seed": settings.seed,
        **{name: getattr(settings, name) for name in LIGHT_PATHS},
        "pixel_filter": settings.pixel_filter,
        "seconds": film.seconds,
        "million_samples_per_second": film.samples_per_second / 1e6,
        "blender": bpy.app.version_string,
        "scene": scene.name,
        "frame": scene.frame_current,
    }
