"""Area lights as rays see them: where a ray meets one, and how one is sampled from nearby, by its solid angle.

An ellipse is sampled by the directions to the parallelogram around it. From close before it those that miss it bring
nothing. From elsewhere none has to: the point that a direction finds in the parallelogram is drawn into the ellipse by
the map of a square to a disk (Shirley and Chiu 1997). With both points in one plane, the density in steradians changes
by 4/π, the ratio of the areas, and by the cube of the ratio of the distances. From close by this cube has no bound, but
beside a disk it is small all the same: points there are drawn away from the rim that is near.
"""

from __future__ import annotations

import math

import numpy as np

from .jit import device
from .light_arrays import IS_ELLIPSE, LightArrays
from .solid_angle import Seen, see_parallelogram
from .warps import FOUR, HALF, INV_PI, ONE, QUARTER, TWO, ZERO, disk_to_square

#: Close before an ellipse is within 0.38 of the radius of a disk, its squared height in squared diagonals, and within
#: 1.2 of the radius beside the middle, its square in squared axes. That holds for what is at most a quarter longer than
#: wide, by its area in squared diagonals; of long ellipses points are drawn past where they are seen from.
_LOW, _BESIDE, _ROUND = np.float32(0.018), np.float32(0.36), np.float32(0.383)


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
def is_drawn_in(lights: LightArrays, light: int, x: float, y: float, z: float) -> bool:
    """Whether ellipse `light` is sampled from (x, y, z) by points of the parallelogram that are drawn into it."""
    o, n = lights.position, lights.normal
    dx, dy, dz = x - o[light, 0], y - o[light, 1], z - o[light, 2]
    height = dx * n[light, 0] + dy * n[light, 1] + dz * n[light, 2]
    s, t = place_on(lights, light, dx, dy, dz)
    is_beside = (lights.area[light] > _ROUND * lights.near[light]) & (s * s + t * t > _BESIDE)
    return (height * height > _LOW * lights.near[light]) | is_beside


@device
def density_drawn_in(angle: float, distance: float, drawn_from: float) -> float:
    """Per steradian, of a point of the ellipse at `distance`: `drawn_from` is that of the point that is drawn to it."""
    ratio = distance / drawn_from
    return FOUR * INV_PI / angle * (ratio * ratio * ratio)


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
    s, t = place_on(lights, light, dx, dy, dz)
    if lights.kind[light] == IS_ELLIPSE:
        return s * s + t * t <= QUARTER
    return (abs(s) <= HALF) & (abs(t) <= HALF)


@device
def place_on(lights: LightArrays, light: int, dx: float, dy: float, dz: float) -> tuple[float, float]:
    """The shares, -1/2 to 1/2 on the parallelogram, of an area light's axes in an offset d from its centre."""
    a, b = lights.along_u, lights.along_v
    s = dx * a[light, 0] + dy * a[light, 1] + dz * a[light, 2]
    t = dx * b[light, 0] + dy * b[light, 1] + dz * b[light, 2]
    return s, t


@device
def place_met(
    lights: LightArrays, light: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float
) -> tuple[float, float]:
    """The same of the point that lies d off o."""
    p = lights.position
    return place_on(lights, light, ox + dx - p[light, 0], oy + dy - p[light, 1], oz + dz - p[light, 2])


@device
def towards(
    lights: LightArrays, light: int, ox: float, oy: float, oz: float, s: float, t: float
) -> tuple[float, float, float, float]:
    """From o to the point with these shares of an area light's axes: the vector, and its length."""
    p, a, b = lights.position, lights.axis_u, lights.axis_v
    x = p[light, 0] - ox + s * a[light, 0] + t * b[light, 0]
    y = p[light, 1] - oy + s * a[light, 1] + t * b[light, 1]
    z = p[light, 2] - oz + s * a[light, 2] + t * b[light, 2]
    return x, y, z, np.float32(math.sqrt(x * x + y * y + z * z))


@device
def spread_of_area(
    lights: LightArrays,
    light: int,
    ox: float,
    oy: float,
    oz: float,
    x: float,
    y: float,
    z: float,
    distance: float,
    facing: float,
) -> float:
    """1 / the density, in steradians, with which the direction (x, y, z) is sampled from o, in which `meet_area` finds
    the light. That is, where rays off the surface compete with the samples.
    """
    if not is_near(lights, light, ox, oy, oz):
        return lights.area[light] * facing / (distance * distance)
    angle = np.float32(see_area(lights, light, ox, oy, oz).angle)
    if (lights.kind[light] != IS_ELLIPSE) | (not is_drawn_in(lights, light, ox, oy, oz)):
        return angle
    s, t = place_met(lights, light, ox, oy, oz, distance * x, distance * y, distance * z)
    s, t = disk_to_square(TWO * s, TWO * t)
    _, _, _, drawn_from = towards(lights, light, ox, oy, oz, s - HALF, t - HALF)
    return ONE / density_drawn_in(angle, distance, drawn_from)
