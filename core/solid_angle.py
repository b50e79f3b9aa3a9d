"""Flat lights as the receiver sees them: points evenly spread over the solid angle of a rectangle or a triangle.

Against points that are even over the area, the cosine at the light and the squared distance no longer make noise. Each
`square_to_spherical_x(u, v, …)` stands beside the density that it makes, per steradian: 1 / solid angle. All places
are relative to the receiver.

Where the solid angle is small, a share of it is hard to tell in float32, and the area is as good: from `SMALL` down
points are even over the area, and the density is that of the point. A light seen from its own plane has no solid angle;
the density is 0 there, to say that it cannot be sampled.
"""

from __future__ import annotations

import numpy as np

from .arctangent import arctan2
from .jit import device, subroutine
from .warps import HALF, ONE, TWO, ZERO, cos_sin, square_to_triangle

#: The solid angle, in steradians, below which lights are sampled by area. There the rounding of the spherical maps
#: moves a point by up to 1e-4 of the light's width. (A square of this size that faces the receiver has a density per
#: area that varies by 0.1 %.)
SMALL = np.float32(1e-3)

#: Keeps roots and quotients of what may round to 0 finite.
_TINY = np.float32(1e-30)

Vector = tuple[float, float, float]


@device
def rectangle_solid_angle(x0: float, x1: float, y0: float, y1: float, z: float) -> float:
    """The solid angle of the rectangle [x0, x1] × [y0, y1] at height z over the receiver, to a relative 1e-5."""
    mirrored = x0 + x1 < ZERO
    near, far = (-x1 if mirrored else x0), (-x0 if mirrored else x1)
    half_numerator, half_denominator, _, _, _, _ = _half_solid_angle(near, far, y0, y1, z)
    return TWO * arctan2(half_numerator, half_denominator)


@device
def spherical_rectangle_pdf(x: float, y: float, x0: float, x1: float, y0: float, y1: float, z: float) -> float:
    """The density of `square_to_spherical_rectangle` at its point (x, y), per steradian."""
    return _rectangle_pdf(rectangle_solid_angle(x0, x1, y0, y1, z), x, y, (x1 - x0) * (y1 - y0), z)


@device
def square_to_spherical_rectangle(
    u: float, v: float, x0: float, x1: float, y0: float, y1: float, z: float
) -> tuple[float, float, float]:
    """A point (x, y) of the rectangle [x0, x1] × [y0, y1] at height z over the receiver, and its density.

    As Ureña, Fajardo and King (2013): u cuts off a share of the solid angle by a line of constant x, and v the same
    share of each such line's elevations. They find x from an arc cosine and a cosine of what is left near the horizon;
    here it is a quotient of sines of angles that are all counted from there, which float32 can hold.
    """
    # Mirrored, so that the middle lies at x >= 0.
    mirrored = x0 + x1 < ZERO
    near, far = (-x1 if mirrored else x0), (-x0 if mirrored else x1)
    w = ONE - u if mirrored else u
    height = abs(z)
    half_numerator, half_denominator, beyond, below, opening, across = _half_solid_angle(near, far, y0, y1, height)
    half_angle = arctan2(half_numerator, half_denominator)
    if TWO * half_angle < SMALL:
        x, y = x0 + u * (x1 - x0), y0 + v * (y1 - y0)
    else:
        x = _distance_from_foot(beyond, (ONE - w) * half_angle, y0, y1, height, opening, across)
        if x < ZERO:
            x = -_distance_from_foot(below, w * half_angle, y0, y1, height, opening, across)
        x = min(max(-x if mirrored else x, x0), x1)
        y = _height_on_line(v, x * x + height * height, y0, y1)
    return x, y, _rectangle_pdf(TWO * half_angle, x, y, (x1 - x0) * (y1 - y0), height)


@device
def _rectangle_pdf(solid_angle: float, x: float, y: float, area: float, z: float) -> float:
    if solid_angle >= SMALL:
        return ONE / solid_angle
    square = x * x + y * y + z * z
    # The area's projection, that times the cosine at the light, over the squared distance.
    projected = area * abs(z)
    return square * np.sqrt(square) / projected if projected > ZERO else ZERO


@device
def _half_solid_angle(
    x0: float, x1: float, y0: float, y1: float, z: float
) -> tuple[float, float, float, float, float, float]:
    """Half of three solid angles in the endless strip y0 … y1, each as y and x of `arctan2`.

    The rectangle's, whose middle must lie at x >= 0; those beyond x1 and below x0, which share y = `opening`; and the
    whole strip's, `opening` and `across`. In this order: y, x, x, x, y, x.

    Half of an endless strip is a triangle with one corner on the horizon. Van Oosterom and Strackee's formula (1983) of
    its solid angle is written here without differences of large numbers, and so is that of two such angles' difference.
    """
    z = abs(z)
    opening, across = z * (y1 - y0), y0 * y1 + z * z
    r00, r01 = np.sqrt(x0 * x0 + y0 * y0 + z * z), np.sqrt(x0 * x0 + y1 * y1 + z * z)
    r10, r11 = np.sqrt(x1 * x1 + y0 * y0 + z * z), np.sqrt(x1 * x1 + y1 * y1 + z * z)
    beyond = _cotangent(x1, r10, r11, y0, y1, z)
    up_to = _cotangent(x0, r00, r01, y0, y1, z)
    below = _cotangent(-x0, r00, r01, y0, y1, z)
    # How much `beyond` is more than `up_to`, through r10² - r00² = x1² - x0².
    middle = x0 + x1
    more = (ONE + middle / (r10 + r00)) * (r11 + x1) + (r00 + x0) * (ONE + middle / (r11 + r01))
    return opening * (x1 - x0) * more, up_to * beyond + opening * opening, beyond, below, opening, across


@device
def _cotangent(x: float, r0: float, r1: float, y0: float, y1: float, z: float) -> float:
    """(r0 + x)(r1 + x) + y0 y1 + z²: the cotangent of half the strip's solid angle beyond x, times z (y1 - y0)."""
    base = x * x + z * z
    first, second = x + base / (r0 + abs(y0)), x + base / (r1 + abs(y1))
    return TWO * max(y0 * y1, ZERO) + abs(y0) * second + abs(y1) * first + first * second + z * z


@device
def _distance_from_foot(
    cotangent: float, more: float, y0: float, y1: float, z: float, opening: float, across: float
) -> float:
    """The x >= 0 beyond which half of the strip's solid angle is that of `cotangent` and `more` (radians).

    With k for the sum, γ0 and γ1 for the angles between the strip's sides and the plane z = 0, seen from the receiver
    outwards, and Δ for the strip's opening, π - γ0 - γ1:
    x / z = sin(Δ - 2k) / (2 √(sin k sin(Δ - k) sin(γ0 + k) sin(γ1 + k))). Negative if k is more than half of Δ.
    """
    cosine, sine = cos_sin(more)
    scale = ONE / np.sqrt(cotangent * cotangent + opening * opening)
    cos_k, sin_k = (cotangent * cosine - opening * sine) * scale, (opening * cosine + cotangent * sine) * scale
    # Those of Δ - k, longer by √(y0² + z²) √(y1² + z²), as is the product of the last two sines below.
    sin_rest, cos_rest = opening * cos_k - across * sin_k, across * cos_k + opening * sin_k
    numerator = z * (sin_rest * cos_k - cos_rest * sin_k)
    sides = (z * cos_k - y0 * sin_k) * (z * cos_k + y1 * sin_k)
    x = HALF * numerator / (np.sqrt(max(sin_k * sin_rest, _TINY)) * np.sqrt(max(sides, _TINY)))
    # Over a strip that is almost half the sky Δ - 2k comes so near to -π that rounding may take it past.
    return -abs(x) if cos_k < ZERO else x


@device
def _height_on_line(v: float, square: float, y0: float, y1: float) -> float:
    """The y between y0 and y1 whose elevation's sine is the share v from that of y0 to that of y1.

    The sine is y / √(square + y²), where `square` is the line's squared distance; next to 1 it is told by its lack.
    """
    r0, r1 = np.sqrt(square + y0 * y0), np.sqrt(square + y1 * y1)
    one_sided = y0 * y1 > ZERO
    span = square * (y1 - y0) * (y0 + y1) / (r0 * r1 * (y1 * r0 + y0 * r1)) if one_sided else y1 / r1 - y0 / r0
    above = (r1 - y1 if y1 < ZERO else square / (r1 + y1)) / r1 + (ONE - v) * span
    below = (r0 + y0 if y0 > ZERO else square / (r0 - y0)) / r0 + v * span
    y = HALF * np.sqrt(square) * (below - above) / np.sqrt(max(below * above, _TINY))
    return min(max(y, y0), y1)


@device
def triangle_solid_angle(a: Vector, b: Vector, c: Vector) -> float:
    """The solid angle of the triangle with these corners about the receiver (van Oosterom and Strackee 1983).

    To a relative 1e-5 if it is not seen edge on: the distance of its plane is then a small difference.
    """
    ra, rb, rc = _length(a), _length(b), _length(c)
    a_b = _sum(_scaled(a, ONE / ra), _scaled(b, ONE / rb))
    return TWO * arctan2(_volume(a, b, c) / (ra * rb * rc), _denominator(a_b, _scaled(c, ONE / rc)))


@device
def spherical_triangle_pdf(point: Vector, a: Vector, b: Vector, c: Vector) -> float:
    """The density of `square_to_spherical_triangle` at a point of the triangle, per steradian."""
    return _triangle_pdf(triangle_solid_angle(a, b, c), point, _volume(a, b, c))


@subroutine
def square_to_spherical_triangle(
    u: float, v: float, a: Vector, b: Vector, c: Vector
) -> tuple[float, float, float, float]:
    """Barycentric coordinates of a point of the triangle with these corners, and its density.

    As Arvo (1995): u cuts off a share of the solid angle by an arc from b to the opposite side, and v the same share of
    the cap through each such arc. The arc's end is found from tangents of half the solid angles, without the triangle's
    angles, and the point as a sum of the corners with weights >= 0, so that no plane has to be hit.
    """
    volume = _volume(a, b, c)
    ra, rb, rc = _length(a), _length(b), _length(c)
    unit_a, unit_b, unit_c = _scaled(a, ONE / ra), _scaled(b, ONE / rb), _scaled(c, ONE / rc)
    a_b, c_a = _sum(unit_a, unit_b), _sum(unit_c, unit_a)
    half_angle = arctan2(volume / (ra * rb * rc), _denominator(a_b, unit_c))
    if TWO * half_angle < SMALL:
        share_a, share_b, share_c = square_to_triangle(u, v)
    else:
        end_a, end_c = _end_of_arc(u * half_angle, volume / (ra * rb * rc), a_b, c_a, unit_c)
        at_b, at_end = _along_arc(v, unit_b, _sum(_scaled(unit_a, end_a), _scaled(unit_c, end_c)))
        share_a, share_b, share_c = at_end * end_a / ra, at_b / rb, at_end * end_c / rc
        scale = ONE / (share_a + share_b + share_c)
        share_a, share_b, share_c = share_a * scale, share_b * scale, share_c * scale
    point = _sum(_sum(_scaled(a, share_a), _scaled(b, share_b)), _scaled(c, share_c))
    return share_a, share_b, share_c, _triangle_pdf(TWO * half_angle, point, volume)


@device
def _triangle_pdf(solid_angle: float, point: Vector, volume: float) -> float:
    if solid_angle >= SMALL:
        return ONE / solid_angle
    distance = _length(point)
    # The volume is twice the area times the distance of its plane.
    return TWO * distance * distance * distance / volume if volume > ZERO else ZERO


@device
def _end_of_arc(half_angle: float, volume: float, a_b: Vector, c_a: Vector, c: Vector) -> tuple[float, float]:
    """(α, γ) of the unit vector e = αa + γc with which a and b make a triangle of half the solid angle σ.

    By van Oosterom and Strackee's formula tan σ = γ volume / (1 + a·b + b·e + e·a), so (1 + α) : γ is a known r : t; e
    is one long, and that makes it the mirror image of -a in the direction of ra + tc. All are unit vectors; a_b and c_a
    are the sums a + b and c + a, whose squares, twice 1 + a·b and 1 + c·a, keep their digits where a side is almost
    half a turn long.
    """
    cosine, sine = cos_sin(half_angle)
    one_plus_ac = HALF * _dot(c_a, c_a)
    t = sine * HALF * _dot(a_b, a_b)
    # a·c + b·c is (a + b)·c.
    r = max(volume * cosine - sine * _dot(a_b, c), ZERO)
    difference = r - t
    scale = ONE / max(difference * difference + TWO * r * t * one_plus_ac, _TINY)
    alpha, gamma = difference * (r + t) * scale, TWO * t * (difference + one_plus_ac * t) * scale
    return max(alpha, ZERO), max(gamma, ZERO)


@device
def _along_arc(v: float, b: Vector, end: Vector) -> tuple[float, float]:
    """(β, ε) of the unit vector βb + ε end on the arc from b to `end` that cuts off the share v of 1 - cos."""
    both = _sum(b, end)
    one_plus_cosine = max(HALF * _dot(both, both), _TINY)
    depth = TWO - one_plus_cosine
    at_end = np.sqrt(v * (TWO - v * depth) / one_plus_cosine)
    return max(ONE - v * depth - at_end * (ONE - depth), ZERO), at_end


@device
def _denominator(a_b: Vector, c: Vector) -> float:
    """1 + a·b + b·c + c·a of unit vectors, from a + b and c."""
    return HALF * _dot(a_b, a_b) + _dot(a_b, c)


@device
def _volume(a: Vector, b: Vector, c: Vector) -> float:
    """|a · (b × c)|, from the triangle's sides."""
    p, q = (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (c[0] - a[0], c[1] - a[1], c[2] - a[2])
    cross = (p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])
    return abs(_dot(a, cross))


@device
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@device
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@device
def _scaled(a: Vector, factor: float) -> Vector:
    return a[0] * factor, a[1] * factor, a[2] * factor


@device
def _length(a: Vector) -> float:
    return np.sqrt(max(_dot(a, a), _TINY))
