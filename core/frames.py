"""Directions about an axis: from a tangent space, whose z is along a unit vector, into the space of that vector."""

from __future__ import annotations

from .jit import device
from .warps import ONE, ZERO


@device
def tangents(x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Two unit vectors that make a right-handed base with the unit vector (x, y, z) (Duff et al. 2017)."""
    sign = ONE if z >= ZERO else -ONE
    a = -ONE / (sign + z)
    b = x * y * a
    return ONE + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y


@device
def to_world(x: float, y: float, z: float, nx: float, ny: float, nz: float) -> tuple[float, float, float]:
    """Turn (x, y, z) from the tangent space about the unit vector n into the space of n."""
    ax, ay, az, bx, by, bz = tangents(nx, ny, nz)
    return x * ax + y * bx + z * nx, x * ay + y * by + z * ny, x * az + y * bz + z * nz
