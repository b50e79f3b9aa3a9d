"""Tangents for normal maps: the space of Mikkelsen (2008), in which most tools bake them.

Each triangle has a direction in which u grows. A corner's tangent is the mean of those of the triangles around it that
it is joined to, each laid into the plane of the corner's normal and weighted by its angle there. Triangles are joined
at an edge whose ends have the same positions, normals and texture coordinates in both, unless the texture is mirrored
between them.

Blender's own `Mesh.calc_tangents` does the same, but refuses faces of more than four corners, and divides faces into
other triangles than those that are rendered.
"""

from __future__ import annotations

import numpy as np


def corner_tangents(positions: np.ndarray, normals: np.ndarray, uvs: np.ndarray) -> np.ndarray:
    """The tangent of each corner of T triangles, and the sign of the bitangent: (T, 3, 4) float32.

    `positions` and `normals` (unit) are (T, 3, 3), `uvs` (T, 3, 2), all in the mesh's space. The bitangent is sign ×
    normal × tangent. Tangents are unit vectors: where the texture coordinates have no direction, the mesh's X, with a
    sign of -1, as in Blender.
    """
    along_u, is_upright = _directions(positions, uvs)
    laid = _unit((along_u[:, None] - normals * _dot(normals, along_u[:, None])).astype(np.float64))
    weighted = laid * _angles(positions, normals)[..., None]
    joined = _joined(_equal_corners(np.concatenate([positions, normals, uvs], axis=2)), is_upright)
    sums = np.stack([np.bincount(joined, weighted[..., axis].ravel()) for axis in range(3)], axis=-1)
    tangents = _unit(sums)[joined].reshape(-1, 3, 3)
    has_none = ~tangents.any(axis=2)
    tangents[has_none] = 1.0, 0.0, 0.0
    signs = np.where(is_upright[:, None] & ~has_none, 1.0, -1.0)[..., None]
    return np.concatenate([tangents, signs], axis=2).astype(np.float32)


def _directions(positions: np.ndarray, uvs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle's unit direction of growing u, (T, 3), and whether the texture is not mirrored on it, (T,)."""
    edge1, edge2 = positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]
    (s1, t1), (s2, t2) = (uvs[:, 1] - uvs[:, 0]).T, (uvs[:, 2] - uvs[:, 0]).T
    area = s1 * t2 - t1 * s2
    # Triangles without an area in the texture have no direction, and join those that are upright.
    return _unit(edge1 * t2[:, None] - edge2 * t1[:, None]) * np.sign(area)[:, None], area >= 0.0


def _angles(positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The angle of each corner, (T, 3), seen along its normal."""
    sides = []
    for step in (1, 2):
        side = np.roll(positions, -step, axis=1) - positions
        sides.append(_unit(side - normals * _dot(normals, side)))
    return np.arccos(np.clip(_dot(*sides)[..., 0], -1.0, 1.0))


def _equal_corners(corners: np.ndarray) -> np.ndarray:
    """A number for each corner, (T, 3), the same for those that are equal in all (T, 3, n) respects."""
    bits = (corners.astype(np.float32) + np.float32(0)).view(np.uint32).astype(np.uint64)  # + 0: -0 is the same as 0
    mixed = np.zeros(corners.shape[:2], np.uint64)
    for respect in np.moveaxis(bits, 2, 0):
        # An odd multiplier and a shift spread the bits: two different corners agree once in 2^64.
        mixed = (mixed ^ respect) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(32)
    return np.unique(mixed, return_inverse=True)[1].reshape(mixed.shape)


def _joined(vertices: np.ndarray, is_upright: np.ndarray) -> np.ndarray:
    """A number for each corner, (3 T,), the same for those at one of `vertices` (T, 3) that edges join."""
    corners = np.arange(vertices.size).reshape(vertices.shape)
    starts, ends = vertices.ravel(), np.roll(vertices, -1, axis=1).ravel()
    first, second = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    swap = starts > ends
    low, high = np.where(swap, second, first), np.where(swap, first, second)  # the corners at either end of an edge
    edges = np.minimum(starts, ends) * vertices.size + np.maximum(starts, ends)
    keys = 2 * edges + np.repeat(is_upright, 3)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    one, other = order[same], order[same + 1]
    return _components(vertices.size, np.concatenate([low[one], high[one]]), np.concatenate([low[other], high[other]]))


def _components(count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """For each of `count` things the lowest number of those that links, from `one` to `other`, connect it with."""
    lowest = np.arange(count)
    while True:
        before = lowest.copy()
        reached = np.minimum(lowest[one], lowest[other])
        np.minimum.at(lowest, one, reached)
        np.minimum.at(lowest, other, reached)
        lowest = lowest[lowest]
        if np.array_equal(lowest, before):
            return lowest


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(axis=-1, keepdims=True)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors made one long; those of no length stay 0."""
    lengths = np.sqrt(_dot(vectors, vectors))
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)
