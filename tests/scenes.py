"""Small scenes for the core's tests: meshes, placements, cameras, and a probe that reads irradiance off a floor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from core import Camera, Instance, Material, Mesh, RenderSettings, Scene, render
from core.shaders import Diffuse, Emission

WHITE = Material("white", Diffuse((1.0, 1.0, 1.0)))
BLACK = Material("black", None)


def emitter(radiance: float = 1.0) -> Material:
    return Material("emitter", Emission((1.0, 1.0, 1.0), radiance))


def lambertian(albedo: float) -> Material:
    return Material("lambertian", Diffuse((albedo, albedo, albedo)))


# Meshes


def polygon(corners: Sequence, name: str = "polygon", **more) -> Mesh:
    """A convex polygon, as a fan of triangles."""
    fan = [(0, i, i + 1) for i in range(1, len(corners) - 1)]
    return Mesh(name, np.array(corners, np.float32), np.array(fan, np.int32), **more)


def quad(center: Sequence, edge_u: Sequence, edge_v: Sequence, name: str = "quad", **more) -> Mesh:
    """A parallelogram about `center` that faces `edge_u` × `edge_v`."""
    c, u, v = (np.array(vector, np.float64) for vector in (center, edge_u, edge_v))
    return polygon([c - u / 2 - v / 2, c + u / 2 - v / 2, c + u / 2 + v / 2, c - u / 2 + v / 2], name, **more)


def floor(size: float = 10.0, center: Sequence = (0, 0, 0), **more) -> Mesh:
    return quad(center, (size, 0, 0), (0, size, 0), "floor", **more)


def sphere(radius: float = 1.0, center: Sequence = (0, 0, 0), rings: int = 24, smooth: bool = False) -> Mesh:
    """A closed sphere of latitudes and longitudes, its triangles counter-clockwise from outside."""
    around = 2 * rings
    theta = np.linspace(0, np.pi, rings + 1)[1:-1, None]
    phi = np.arange(around) * (2 * np.pi / around)
    body = np.stack(np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), -1)
    units = np.concatenate([[[0, 0, 1]], body.reshape(-1, 3), [[0, 0, -1]]])
    triangles = []
    last = len(units) - 1
    for j in range(around):
        k = (j + 1) % around
        triangles.append((0, 1 + j, 1 + k))
        triangles.append((last, last - around + k, last - around + j))
        for ring in range(rings - 2):
            a, b = 1 + ring * around, 1 + (ring + 1) * around
            triangles += [(a + j, b + j, b + k), (a + j, b + k, a + k)]
    triangles = np.array(triangles, np.int32)
    normals = units[triangles].astype(np.float32) if smooth else None
    return Mesh("sphere", (units * radius + center).astype(np.float32), triangles, normals)


def box(size: float = 1.0, center: Sequence = (0, 0, 0)) -> Mesh:
    """A closed cube."""
    half = size / 2
    corners = np.array([(x, y, z) for z in (-half, half) for y in (-half, half) for x in (-half, half)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    return Mesh("box", (corners + center).astype(np.float32), np.array(triangles, np.int32))


# Placements


def translation(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scaling(x: float, y: float, z: float) -> np.ndarray:
    return np.diag([x, y, z, 1.0])


def rotation(axis: int, angle: float) -> np.ndarray:
    """The rotation by `angle` radians about x, y or z (0, 1, 2)."""
    matrix = np.eye(4)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix[a, a] = matrix[b, b] = math.cos(angle)
    matrix[b, a], matrix[a, b] = math.sin(angle), -math.sin(angle)
    return matrix


# Cameras


def camera_down(
    width: float, pixels: tuple[int, int] = (16, 16), at: Sequence = (0, 0, 0), height: float = 1.0, **more
) -> Camera:
    """An orthographic camera `height` above `at` that looks down on `width` metres of floor, x right and y up."""
    x, y = width / 2, width / 2 * pixels[1] / pixels[0]
    more = {"clip_start": 0.0, "clip_end": 1e9} | more
    return Camera(translation(at[0], at[1], at[2] + height), pixels, window=(-x, x, -y, y), orthographic=True, **more)


def camera_forward(half_width: float = 0.5, pixels: tuple[int, int] = (16, 16), **more) -> Camera:
    """A perspective camera at the origin that looks along -z: pixel (x, y) at depth z sees (x z, y z, -z)."""
    half_height = half_width * pixels[1] / pixels[0]
    more = {"clip_start": 0.0, "clip_end": 1e9} | more
    return Camera(np.eye(4), pixels, window=(-half_width, half_width, -half_height, half_height), **more)


def pixel_centers(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """The window coordinates x (1, width) and y (height, 1) of the pixels' centres, bottom row first."""
    left, right, bottom, top = camera.window
    width, height = camera.resolution
    x = left + (np.arange(width) + 0.5) * (right - left) / width
    y = bottom + (np.arange(height) + 0.5) * (top - bottom) / height
    return x[None, :], y[:, None]


# Pictures


def picture(scene: Scene, *, channel: int | None = 0, **settings) -> np.ndarray:
    """The Combined pass, float64: one channel (height, width), or all four."""
    settings = {"samples": 16, "threads": 1} | settings
    combined = render(scene, RenderSettings(**settings)).passes["Combined"].astype(np.float64)
    return combined if channel is None else combined[..., channel]


class Estimate(NamedTuple):
    """A mean over seeds and the standard error of it, measured from the spread between the seeds."""

    mean: np.ndarray | float
    error: np.ndarray | float

    def agrees(self, expected: np.ndarray | float, rounding: float = 2e-5) -> bool:
        """Whether all is within four standard errors, and what float32 may round."""
        off = np.abs(self.mean - expected)
        return bool(np.all(off <= 4 * self.error + rounding * np.abs(expected)))


def estimate(measure: Callable[[int], np.ndarray | float], seeds: int = 24) -> Estimate:
    """The mean of `measure(seed)` over seeds.

    With 24 seeds four standard errors are exceeded by chance with a probability of 6e-4 (Student's t).
    """
    values = np.array([measure(seed) for seed in range(seeds)], np.float64)
    return Estimate(values.mean(axis=0), values.std(axis=0, ddof=1) / math.sqrt(seeds))


def irradiance(
    lights: Sequence,
    *,
    at: Sequence = (0.0, 0.0, 0.0),
    instances: tuple[Instance, ...] = (),
    world: tuple[float, float, float] = (0.0, 0.0, 0.0),
    samples: int = 256,
    seeds: int = 24,
    **settings,
) -> Estimate:
    """The irradiance at `at` on a floor: a white one's radiance times π, over a patch a tenth of a millimetre wide."""
    patch = Instance(floor(0.01, at), materials=(WHITE,))
    scene = Scene(camera_down(1e-4, (4, 4), at), (patch, *instances), tuple(lights), world)
    return estimate(lambda seed: np.pi * picture(scene, samples=samples, seed=seed, **settings).mean(), seeds)
