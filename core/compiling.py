"""Compiling all kernels, so that no render of this version has to wait for it.

Their types are the same whatever the scene, so that one small picture, of a scene that uses every stage, is enough.
"""

from __future__ import annotations

import numpy as np

from .kernel_cache import note_compiled
from .rendering import render
from .scene import Camera, Instance, Material, Mesh, Scene
from .settings import RenderSettings
from .shaders import Emission
from .values import EnvironmentTexture


def compile_kernels() -> None:
    """Compile what is not in the cache yet, which takes about a minute, and note that all is there."""
    load_kernels()
    note_compiled()


def load_kernels() -> None:
    """Have this process load the kernels: from the cache, where they are in it."""
    render(smallest_scene(), RenderSettings(samples=1, threads=1))


def smallest_scene() -> Scene:
    """One triangle that glows, under a world that varies, through a lens."""
    triangle = Mesh("triangle", np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32), np.array([(0, 1, 2)]))
    glowing = Instance(triangle, materials=(Material("glowing", Emission((1.0, 1.0, 1.0))),))
    sky = EnvironmentTexture(np.ones((2, 4, 3), np.float32))
    camera = Camera(np.eye(4), (4, 4), (-1.0, 1.0, -1.0, 1.0), lens_radius=0.1)
    return Scene(camera, (glowing,), world=sky)
