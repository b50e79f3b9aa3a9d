"""A chess rook as a mesh, for pictures worth looking at."""

from __future__ import annotations

import numpy as np

from ..scene import Mesh

#: Half the outline of a chess rook from its foot up and over the wall: radius and height in millimetres.
_OUTLINE = (
    (17, 0), (18.5, 2), (18.5, 5), (16, 7), (16, 8.5), (12, 11), (10.6, 15), (9.6, 21), (9.3, 28), (9.4, 33), (9.8, 36),
    (13, 37), (13, 39.5), (11, 40.5), (12.5, 41.5), (14.3, 43), (14.3, 54), (9.8, 54), (9.8, 48), (0, 48),
)  # fmt: skip
_WALL, _NOTCH = 54, 4.5  # the height of the wall, and how far its notches are cut into it


def chess_rook(steps: int = 240) -> Mesh:
    """A chess rook on the origin, its foot 0.9 wide: the outline turned about z, with six notches in the wall."""
    radius, height = np.array(_OUTLINE, np.float64).T[:, :, None]
    angle = np.arange(steps) * (2 * np.pi / steps)
    notched = angle % (np.pi / 3) < np.pi / 9
    z = np.where(notched & (height == _WALL), _WALL - _NOTCH, height)
    vertices = np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), z), axis=-1) / 41
    ring = np.arange(len(_OUTLINE) - 1)[:, None] * steps
    here = np.arange(steps)
    a, b = ring + here, ring + np.roll(here, -1)
    triangles = np.concatenate([np.stack((a, b, b + steps), -1), np.stack((a, b + steps, a + steps), -1)])
    return Mesh("rook", vertices.reshape(-1, 3).astype(np.float32), triangles.reshape(-1, 3).astype(np.int32))
