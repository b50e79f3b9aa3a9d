"""Rooks' core: sampling and rendering without Blender.

    >>> import core
    >>> film = core.render(scene, core.RenderSettings(samples=16, sampler="jittered"))

A scene is made of the dataclasses in `core.scene`. Importing this package costs little: numba and Embree are loaded by
the first render.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import OutputError, RooksError, SceneError, SettingsError
from .scene import (
    AreaLight,
    Camera,
    Checker,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
)
from .settings import RenderSettings

if TYPE_CHECKING:
    from .film import Film
    from .rendering import Tile

__all__ = [
    "AreaLight",
    "Camera",
    "Checker",
    "ImageTexture",
    "Instance",
    "Material",
    "Mesh",
    "OutputError",
    "PointLight",
    "RenderSettings",
    "RooksError",
    "Scene",
    "SceneError",
    "SettingsError",
    "SpotLight",
    "SunLight",
    "render",
    "write_exr",
]


def render(
    scene: Scene,
    settings: RenderSettings,
    on_tile: Callable[[Tile], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> Film:
    """Render a scene: see `core.rendering.render`, which this loads."""
    from . import rendering

    return rendering.render(scene, settings, on_tile, should_cancel)


def write_exr(path: str | Path, film: Film, metadata: dict[str, str | int | float]) -> None:
    """Write a film to an OpenEXR file: see `core.output.write_exr`, which this loads."""
    from . import output

    output.write_exr(path, film, metadata)
