"""Rooks' core: sampling and rendering without Blender.

    >>> import core
    >>> film = core.render(scene, core.RenderSettings(samples=16, sampler="jittered"))

A scene is made of the dataclasses in `core.scene`. Importing this package costs next to nothing: its parts load when
they are first asked for, numpy with the scene, numba and Embree with the first render.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import shaders, values
    from .errors import OutputError, RooksError, SceneError, SettingsError
    from .film import Film
    from .output import write_exr
    from .rendering import Tile, render
    from .samplers import SAMPLERS
    from .scene import (
        AreaLight,
        Camera,
        Instance,
        Material,
        Mesh,
        PointLight,
        Scene,
        SpotLight,
        SunLight,
    )
    from .settings import RenderSettings

_HOME = {
    "errors": ("OutputError", "RooksError", "SceneError", "SettingsError"),
    "film": ("Film",),
    "output": ("write_exr",),
    "rendering": ("Tile", "render"),
    "samplers": ("SAMPLERS",),
    "scene": (
        "AreaLight",
        "Camera",
        "Instance",
        "Material",
        "Mesh",
        "PointLight",
        "Scene",
        "SpotLight",
        "SunLight",
    ),
    "settings": ("RenderSettings",),
}
_PARTS = {
    "command_line",
    "compiling",
    "files",
    "kernel_cache",
    "lab",
    "limits",
    "preparation",
    "progressive",
    "shaders",
    "values",
    *_HOME,
}

__all__ = [
    "SAMPLERS",
    "AreaLight",
    "Camera",
    "Film",
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
    "Tile",
    "render",
    "shaders",
    "values",
    "write_exr",
]


def __getattr__(name: str) -> Any:
    """Load a part of the package, or the part that a public name stands in, on first use (PEP 562)."""
    if name in _PARTS:
        return import_module(f".{name}", __name__)
    for part, names in _HOME.items():
        if name in names:
            return getattr(import_module(f".{part}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
