"""Area lights as rays see them: where a ray meets one, and how one is sampled from nearby, by its solid angle."""

from __future__ import annotations

import numpy as np

from .jit import device
from .light_arrays import IS_ELLIPSE, LightArrays
from .solid_angle import Seen, see_parallelogram
from .warps import HALF, QUARTER, ZERO


@device
def is_near(lights: LightArrays, light: int, x: float, y: float, z: float) -> bool:
    """Whether (x, y, z) is near to lamp `light`: area lights are sampled by their solid angle from there."""
    o = lights.position
    dx, dy, dz = o[light, 0] - x, o[light, 1] - y, o[light, 2] - z
    return dx * dx + dy * dy + dz * dz < lights.near[light]


@device
def is_below(lights: LightArrays, light: int, x: float, y: float, z: float) -> bool:
    """Whether (x, y, z) lies on or before or behind area light `light`, seen along its normal."""
    o = lights.position
    return _is_on(lights, light, x - o[light, 0], y - o[light, 1], z - o[light, 2])


@device
def see_area(lights: LightArrays, light: int, x: float, y: float, z: float) -> Seen:
    """The parallelogram of area light `light`'s axes, as seen from (x, y, z)."""
    o, a, b = lights.position, lights.axis_u, lights.axis_v
    # In float64 before anything is subtracted: near is where float32 would cancel.
    edge_u = np.float64(a[light, 0]), np.float64(a[light, 1]), np.float64(a[light, 2])
    edge_v = np.float64(b[light, 0]), np.float64(b[light, 1]), np.float64(b[light, 2])
    corner = (
        np.float64(o[light, 0]) - x - 0.5 * (edge_u[0] + edge_v[0]),
        np.float64(o[light, 1]) - y - 0.5 * (edge_u[1] + edge_v[1]),
        np.float64(o[light, 2]) - z - 0.5 * (edge_u[2] + edge_v[2]),
    )
    return see_parallelogram(corner, edge_u, edge_v)


@device
def meet_area(
    lights: LightArrays, light: int, ox: float, oy: float, oz: float, x: float, y: float, z: float
) -> tuple[float, float, bool]:
    """Where the ray from o along (x, y, z), unit, meets an area light: the distance to its plane, the cosine there,
    above 0 on the side that shines, and whether it hits the light.
    """
    p, n = lights.position, lights.normal
    cx, cy, cz = p[light, 0] - ox, p[light, 1] - oy, p[light, 2] - oz
    facing = -(x * n[light, 0] + y * n[light, 1] + z * n[light, 2])
    height = -(cx * n[light, 0] + cy * n[light, 1] + cz * n[light, 2])
    distance = height / facing
    is_met = (facing > ZERO) & (height > ZERO)
    is_met &= _is_on(lights, light, distance * x - cx, distance * y - cy, distance * z - cz)
    return distance, facing, is_met


@device
def _is_on(lights: LightArrays, light: int, dx: float, dy: float, dz: float) -> bool:
    """Whether the point of an area light's plane that lies d off its centre belongs to the light."""
    a, b = lights.along_u, lights.along_v
    s = dx * a[light, 0] + dy * a[light, 1] + dz * a[light, 2]
    t = dx * b[light, 0] + dy * b[light, 1] + dz * b[light, 2]
    if lights.kind[light] == IS_ELLIPSE:
        return s * s + t * t <= QUARTER
    return (abs(s) <= HALF) & (abs(t) <= HALF)


@device
def spread_of_area(
    lights: LightArrays, light: int, x: float, y: float, z: float, distance: float, facing: float
) -> float:
    """1 / the density, in steradians, with which a direction is sampled in which `meet_area` finds the light.

    That is, where rays off the surface compete with the samples.
    """
    if is_near(lights, light, x, y, z):
        return np.float32(see_area(lights, light, x, y, z).angle)
    return lights.area[light] * facing / (distance * distance)
