"""The shadow terminator: where shadow rays start on triangles that pass for a smooth surface.

Where normals are interpolated, light still comes to a surface that turns away from it when a triangle has its back to
it already: cut off there, the shadow has the triangles' corners for a border. As in Cycles, at grazing light the
ray starts above the triangle instead, where the smooth surface would be, and meets only what would shadow that.

The smooth surface is known by its tangent planes at the corners: it lies below all of them and above the paraboloid
that bulges between the corners by what their normals differ. The point lifted to the lowest of the planes is almost
that of Hanika ("Hacking the Shadow Terminator", Ray Tracing Gems II, 2021).
"""

from __future__ import annotations

import numpy as np

from .jit import device
from .warps import HALF, ONE, ZERO

Vector = tuple[float, float, float]
Corners = tuple[Vector, Vector, Vector]


@device
def lifts(corners: Corners, normals: np.ndarray, row: int, v: float, w: float) -> tuple[float, float]:
    """How far along its normal the smooth surface lies off the point at barycentrics (1 - v - w, v, w).

    For light from outside, at least 0, and for light from inside, at most 0. `normals[row]` are those of the corners.
    """
    a, b, c = corners
    u = ONE - v - w
    # How high the other corners stand above each corner's tangent plane.
    ab, ac = _rise(a, b, normals, row, 0), _rise(a, c, normals, row, 0)
    ba, bc = _rise(b, a, normals, row, 1), _rise(b, c, normals, row, 1)
    ca, cb = _rise(c, a, normals, row, 2), _rise(c, b, normals, row, 2)
    bulge = -HALF * (u * v * (ab + ba) + u * w * (ac + ca) + v * w * (bc + cb))
    # And the point itself.
    at_a, at_b, at_c = v * ab + w * ac, u * ba + w * bc, u * ca + v * cb
    # The planes, raised or lowered so that the triangle lies on one side of each.
    above = min(max(ab, ac, ZERO) - at_a, max(ba, bc, ZERO) - at_b, max(ca, cb, ZERO) - at_c)
    below = min(at_a - min(ab, ac, ZERO), at_b - min(ba, bc, ZERO), at_c - min(ca, cb, ZERO))
    return max(above, bulge, ZERO), min(-below, bulge, ZERO)


@device
def _rise(p: Vector, q: Vector, normals: np.ndarray, row: int, corner: int) -> float:
    n = normals
    return (q[0] - p[0]) * n[row, corner, 0] + (q[1] - p[1]) * n[row, corner, 1] + (q[2] - p[2]) * n[row, corner, 2]
