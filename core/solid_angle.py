"""Parallelograms as seen from a point: their solid angle, and directions even over it.

Points that are even over a lamp's area are far from even as seen from nearby: few fall where the lamp is close, and
each of those counts enormously. The formulas are Van Oosterom's and Strackee's (1983) and Peters's (2021, *BRDF
Importance Sampling for Polygonal Lights*, section 4). They are evaluated in float64: a triangle that is near is flat or
fills half of all directions, and what float32 leaves of its determinant then is mostly rounding. Corners are given
relative to the point, vectors as tuples of three float64.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .jit import device, subroutine

Vector = tuple[float, float, float]


class Seen(NamedTuple):
    """A parallelogram as seen from a point, cut into two triangles along the diagonal from `apex` to `middle`."""

    apex: Vector  # unit directions to the corners, in their order
    first: Vector
    middle: Vector
    last: Vector
    first_volume: float  # the determinants of the triangles' directions, without their signs
    last_volume: float
    first_angle: float  # the solid angle of the first triangle
    angle: float  # of both; 0 where the parallelogram's plane goes through the point


@device
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@device
def _times(scale: float, a: Vector) -> Vector:
    return scale * a[0], scale * a[1], scale * a[2]


@device
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@device
def _unit(a: Vector) -> tuple[Vector, float]:
    """The vector's direction, and 1 / its length; of (0, 0, 0) both are 0."""
    square = _dot(a, a)
    scale = 1.0 / math.sqrt(square) if square > 0.0 else 0.0
    return _times(scale, a), scale


@device
def _solid_angle(volume: float, a: Vector, b: Vector, c: Vector) -> float:
    """Of the triangle of these unit vectors, whose determinant is ± `volume`."""
    return 2.0 * math.atan2(volume, 1.0 + _dot(a, b) + _dot(b, c) + _dot(c, a))


@device
def _sweep(angle: float, v: float, volume: float, apex: Vector, first: Vector, last: Vector) -> Vector:
    """The direction at v between `apex` and where the triangle that it makes with `first`, and with a point of the arc
    from there to `last`, has the solid angle `angle`. `volume` is the determinant of the three, not 0.
    """
    cosine, sine = math.cos(0.5 * angle), math.sin(0.5 * angle)
    # Both are divided by the volume, which can be small.
    share = sine / volume
    ahead = cosine - (_dot(apex, last) + _dot(first, last)) * share
    aside = (1.0 + _dot(apex, first)) * share
    between, _ = _unit(_sum(_times(ahead, first), _times(aside, last)))
    end = _sum(_times(2.0 * _dot(first, between), between), _times(-1.0, first))
    # Even over the triangle between the apex and the arc is even in the cosine off the apex (Archimedes).
    along = _dot(apex, end)
    cosine = 1.0 - v * (1.0 - along)
    beside, _ = _unit(_sum(end, _times(-along, apex)))
    return _sum(_times(cosine, apex), _times(math.sqrt(max(1.0 - cosine * cosine, 0.0)), beside))


@device
def _volume(a: Vector, b: Vector, c: Vector) -> float:
    """|a · (b × c)|"""
    x, y, z = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    return abs(a[0] * x + a[1] * y + a[2] * z)


@subroutine
def see_parallelogram(corner: Vector, a: Vector, b: Vector) -> Seen:
    """The parallelogram with this corner and the edges a and b from it, as seen from the point."""
    apex, scale_0 = _unit(corner)
    first, scale_1 = _unit(_sum(corner, a))
    middle, scale_2 = _unit(_sum(_sum(corner, a), b))
    last, scale_3 = _unit(_sum(corner, b))
    volume = _volume(corner, a, b) * scale_0 * scale_2
    first_volume, last_volume = volume * scale_1, volume * scale_3
    first_angle = angle = 0.0
    if min(first_volume, last_volume) > 0.0:
        first_angle = _solid_angle(first_volume, apex, first, middle)
        angle = first_angle + _solid_angle(last_volume, apex, middle, last)
    return Seen(apex, first, middle, last, first_volume, last_volume, first_angle, angle)


@subroutine
def direction_in(seen: Seen, u: float, v: float) -> tuple[float, float, float]:
    """A unit direction, even over a parallelogram whose solid angle is not 0: two triangles, swept in one go."""
    swept = u * seen.angle
    if swept < seen.first_angle:
        x, y, z = _sweep(swept, v, seen.first_volume, seen.apex, seen.first, seen.middle)
    else:
        x, y, z = _sweep(swept - seen.first_angle, v, seen.last_volume, seen.apex, seen.middle, seen.last)
    return np.float32(x), np.float32(y), np.float32(z)
