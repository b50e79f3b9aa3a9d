"""From the unit square to where rays start or go: each `square_to_x(u, v, …)` beside the density `x_pdf` it makes.

All take (u, v) in [0, 1)² and keep area: a share of the square becomes the same share of the domain, so points that
are even in one are even in the other. A density is per unit area, or per steradian for directions (unit vectors, z
along the axis), and integrates to 1 over the domain.

Everything is float32: numba would widen an expression with one Python float in it, so constants are typed here, once.
Nothing branches or calls a library, so that loops over the lanes of a packet become SIMD.
"""

from __future__ import annotations

import math

import numpy as np

from .arctangent import arctan2
from .jit import device

ZERO, QUARTER, HALF, ONE, TWO, FOUR = (np.float32(number) for number in (0, 0.25, 0.5, 1, 2, 4))
PI = np.float32(math.pi)
TWO_PI = np.float32(2 * math.pi)
QUARTER_PI = np.float32(math.pi / 4)
SQRT_HALF = np.float32(math.sqrt(0.5))
INV_PI = np.float32(1 / math.pi)
#: The largest float32 below 1.
BELOW_ONE = np.float32(1 - 2.0**-24)
INV_TWO_PI = np.float32(0.5 / math.pi)
INV_FOUR_PI = np.float32(0.25 / math.pi)
TWO_INV_PI = np.float32(2 / math.pi)

#: π/2 in two parts, the first short enough that its small multiples are exact (Cody and Waite 1980).
HALF_PI_HIGH = np.float32(1.5703125)
HALF_PI_LOW = np.float32(math.pi / 2 - 1.5703125)

#: Minimax polynomials on |x| <= π/4: (sin x - x) / x³ and (cos x - 1 + x²/2) / x⁴ in powers of x², fitted with
#: Lawson's algorithm. Their own error is below 4e-9, so that of the result is float32's rounding.
SIN_3, SIN_5, SIN_7 = np.float32(-0.16666654595), np.float32(0.00833215982), np.float32(-0.00019515153)
COS_4, COS_6, COS_8 = np.float32(0.04166664684), np.float32(-0.00138873663), np.float32(0.00002443831)


@device
def clamp01(x: float) -> float:
    """x, or the nearer end of 0 to 1 where it lies outside."""
    return min(max(x, ZERO), ONE)


@device
def cos_sin_octant(angle: float) -> tuple[float, float]:
    """(cos, sin) of an angle in [-π/4, π/4], to float32's rounding."""
    z = angle * angle
    cosine = ONE - HALF * z + z * z * (COS_4 + z * (COS_6 + z * COS_8))
    sine = angle + angle * z * (SIN_3 + z * (SIN_5 + z * SIN_7))
    return cosine, sine


@device
def cos_sin(angle: float) -> tuple[float, float]:
    """(cos, sin) of an angle of up to some hundred turns either way, to 1e-6 within the first few."""
    quarter = np.floor(angle * TWO_INV_PI + HALF)
    cosine, sine = cos_sin_octant((angle - quarter * HALF_PI_HIGH) - quarter * HALF_PI_LOW)
    quadrant = quarter - FOUR * np.floor(QUARTER * quarter)
    # The cosine and the sine of the whole right angles: 0, 1 or -1.
    turn_cosine, turn_sine = abs(quadrant - TWO) - ONE, ONE - abs(quadrant - ONE)
    return turn_cosine * cosine - turn_sine * sine, turn_sine * cosine + turn_cosine * sine


@device
def square_to_disk(u: float, v: float) -> tuple[float, float]:
    """A point of the unit disk: concentric squares become concentric circles (Shirley and Chiu 1997).

    Distances between points are kept better than in polar coordinates, and so is what makes a point set good.
    """
    a, b = TWO * u - ONE, TWO * v - ONE
    wide = abs(a) > abs(b)
    radius, other = (a if wide else b), (b if wide else a)
    cosine, sine = cos_sin_octant(QUARTER_PI * (other / (radius if radius != ZERO else ONE)))
    return radius * (cosine if wide else sine), radius * (sine if wide else cosine)


@device
def disk_to_square(x: float, y: float) -> tuple[float, float]:
    """Where in the square `square_to_disk` takes a point of the unit disk from."""
    wide = abs(x) > abs(y)
    main, other = (x if wide else y), (y if wide else x)
    radius = np.float32(math.sqrt(x * x + y * y))
    across = radius * arctan2(other, abs(main)) / QUARTER_PI
    along = radius if main >= ZERO else -radius
    a, b = (along if wide else across), (across if wide else along)
    return HALF + HALF * a, HALF + HALF * b


@device
def disk_pdf() -> float:
    """The density of `square_to_disk` on the unit disk, per area."""
    return INV_PI


@device
def square_to_ellipse(u: float, v: float, half_width: float, half_height: float) -> tuple[float, float]:
    """A point of the ellipse about the origin with these half-axes along x and y: a stretched disk."""
    x, y = square_to_disk(u, v)
    return half_width * x, half_height * y


@device
def ellipse_pdf(half_width: float, half_height: float) -> float:
    """The density of `square_to_ellipse`, per area."""
    return INV_PI / (half_width * half_height)


@device
def square_to_rectangle(u: float, v: float, half_width: float, half_height: float) -> tuple[float, float]:
    """A point of the rectangle about the origin with these half-edges along x and y."""
    return half_width * (TWO * u - ONE), half_height * (TWO * v - ONE)


@device
def rectangle_pdf(half_width: float, half_height: float) -> float:
    """The density of `square_to_rectangle`, per area."""
    return ONE / (FOUR * half_width * half_height)


@device
def square_to_triangle(u: float, v: float) -> tuple[float, float, float]:
    """Barycentric coordinates, which add up to 1, of a point in any triangle (Heitz 2019).

    The halves of the square, cut along its diagonal, are sheared into the halves of the triangle. Unlike the map with a
    square root this squeezes no side of the square into a corner, so even points stay more even.
    """
    upper = v > u
    half_smaller = HALF * (u if upper else v)
    rest = (v if upper else u) - half_smaller
    return ONE - max(u, v), (half_smaller if upper else rest), (rest if upper else half_smaller)


@device
def triangle_pdf(area: float) -> float:
    """The density of `square_to_triangle` on a triangle of this area, per area."""
    return ONE / area


@device
def square_to_polygon(u: float, v: float, blades: int, rotation: float) -> tuple[float, float]:
    """A point of the regular polygon with `blades` >= 3 corners on the unit circle.

    As in Cycles' bokeh, a side's middle lies at the angle `rotation` (radians from x towards y), and its corners π /
    blades to either side. u picks one of the triangles between a side and the centre; what is left of it and v pick
    the point there.
    """
    sides = np.float32(blades)
    side = np.floor(u * sides)
    _, left, right = square_to_triangle(u * sides - side, v)
    half_cosine, half_sine = cos_sin(PI / sides)
    along, across = (left + right) * half_cosine, (left - right) * half_sine
    cosine, sine = cos_sin(rotation + side * (TWO_PI / sides))
    return cosine * along - sine * across, sine * along + cosine * across


@device
def polygon_pdf(blades: int) -> float:
    """The density of `square_to_polygon`, per area."""
    sides = np.float32(blades)
    half_cosine, half_sine = cos_sin(PI / sides)
    return ONE / (sides * half_cosine * half_sine)


@device
def square_to_sphere(u: float, v: float) -> tuple[float, float, float]:
    """A uniform direction: the square folded to an octahedron and blown up, area by area (Clarberg 2008).

    The middle of the square is +z, its corners -z. No two distant parts of the square meet in a pole, as they do in
    cylindrical coordinates.
    """
    a, b = TWO * u - ONE, TWO * v - ONE
    wide, high = abs(a), abs(b)
    upper = wide + high <= ONE
    # 1 at the equator, 0 at the poles.
    radius = wide + high if upper else (ONE - wide) + (ONE - high)
    cosine, sine = cos_sin_octant(QUARTER_PI * ((high - wide) / (radius if radius != ZERO else ONE)))
    # The angle in the quadrant is π/4 more than that of (cosine, sine).
    scale = SQRT_HALF * radius * np.sqrt(TWO - radius * radius)
    x, y = scale * (cosine - sine), scale * (cosine + sine)
    z = ONE - radius * radius
    return (x if a >= ZERO else -x), (y if b >= ZERO else -y), (z if upper else -z)


@device
def sphere_pdf() -> float:
    """The density of `square_to_sphere`, per steradian."""
    return INV_FOUR_PI


@device
def one_minus_cos(sin_squared: float) -> float:
    """1 - cos of an angle up to π/2 from its squared sine, as s² / (1 + c), which keeps all digits of tiny angles."""
    return sin_squared / (ONE + np.sqrt(max(ONE - sin_squared, ZERO)))


@device
def square_to_cap(u: float, v: float, one_minus_cos_max: float) -> tuple[float, float, float]:
    """A uniform direction within an angle of +z, given by 1 - cos of it: 0 (not included) to 2, the whole sphere.

    The disk's area-preserving map to the sphere (Lambert 1772): 1 - cos grows with the square of the radius. x and y
    keep their relative precision however small the angle is, if `one_minus_cos_max` has it: see `one_minus_cos`.
    """
    x, y = square_to_disk(u, v)
    depth = one_minus_cos_max * (x * x + y * y)
    scale = np.sqrt(one_minus_cos_max * max(TWO - depth, ZERO))
    return scale * x, scale * y, ONE - depth


@device
def cap_pdf(one_minus_cos_max: float) -> float:
    """The density of `square_to_cap`, per steradian."""
    return INV_TWO_PI / one_minus_cos_max


@device
def square_to_cosine_hemisphere(u: float, v: float) -> tuple[float, float, float]:
    """A direction on the side of +z, as likely as its z is large: a disk projected up onto the sphere (Malley 1988).

    z can be 0, on the rim.
    """
    x, y = square_to_disk(u, v)
    return x, y, np.sqrt(max(ONE - (x * x + y * y), ZERO))


@device
def cosine_hemisphere_pdf(z: float) -> float:
    """The density of `square_to_cosine_hemisphere` in a direction with this z, per steradian."""
    return z * INV_PI
