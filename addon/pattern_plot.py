"""A sampler's points as a small picture for the panel: the unit square, and beside it the projections.

The square's x runs to the right and y upwards; the strip below holds the projection on x, the strip to the right that
on y, one line for each point. The points are a set that the sampler makes with the scene's seed. Pictures are made when
a panel is first drawn, in well under a hundredth of a second, and kept.
"""

from __future__ import annotations

from typing import NamedTuple

from ._core import core

#: Sides in pixels: the square, the strips, the gap between them.
SQUARE, STRIP, GAP = 288, 26, 6
SIDE = SQUARE + GAP + STRIP
#: More points than this would touch in the strips. A smaller set is shown then; a part of a larger one is no good set.
MOST_POINTS = 256
#: How many pictures are kept.
KEPT = 32

#: What Blender's dark themes and its light one both set off, sRGB.
PAPER, INK = 0.09, 0.92

_previews = None


class Plot(NamedTuple):
    """A picture for `UILayout.template_icon`, and how many points are in it."""

    icon: int
    count: int


def plot_of(name: str, count: int, seed: int) -> Plot:
    """The picture of a set of `count` points, or of as many as can be shown, made once."""
    import bpy.utils.previews

    global _previews
    if _previews is None:
        _previews = bpy.utils.previews.new()
    shown = count if count <= MOST_POINTS else core.samplers.SAMPLERS[name].actual_count(MOST_POINTS)
    key = f"{name} {shown} {seed}"
    if key not in _previews:
        while len(_previews) >= KEPT:
            del _previews[next(iter(_previews))]
        preview = _previews.new(key)
        preview.image_size = SIDE, SIDE
        preview.image_pixels_float.foreach_set(raster(pattern(name, shown, seed)).reshape(-1))
    return Plot(_previews[key].icon_id, shown)


def forget() -> None:
    """Free all pictures."""
    global _previews
    if _previews is None:
        return
    import bpy.utils.previews

    bpy.utils.previews.remove(_previews)
    _previews = None


def pattern(name: str, count: int, seed: int):
    """A set of the sampler's points, float32 (count, 2)."""
    import numpy as np  # here, because Blender's start must not wait for it

    return core.samplers.SAMPLERS[name](1, count, np.random.default_rng(seed))[0]


def raster(points):
    """Draw points, (n, 2) in [0, 1): RGBA, float32 (SIDE, SIDE, 4), bottom row first."""
    import numpy as np

    center = points * SQUARE  # in pixels, from the square's lower left corner
    spacing = SQUARE / np.sqrt(len(points))
    square = _discs(center, radius=float(np.clip(0.16 * spacing, 1.3, 5)))
    width = float(np.clip(0.5 * SQUARE / len(points), 1, 3))
    along_x, along_y = (_lines(center[:, axis], width) for axis in (0, 1))

    grey = np.zeros((SIDE, SIDE), np.float32)
    opaque = np.zeros((SIDE, SIDE), np.float32)
    start = SIDE - SQUARE
    for place, ink in (
        (np.s_[start:, :SQUARE], square),
        (np.s_[:STRIP, :SQUARE], np.tile(along_x, (STRIP, 1))),
        (np.s_[start:, SIDE - STRIP :], np.tile(along_y[:, None], (1, STRIP))),
    ):
        grey[place] = PAPER + (INK - PAPER) * ink
        opaque[place] = 1
    return np.stack([grey, grey, grey, opaque], axis=-1)


def _discs(center, radius: float):
    """How much discs cover of each pixel of the square, (SQUARE, SQUARE), to a good approximation."""
    import numpy as np

    reach = int(radius) + 2
    offset = np.arange(-reach, reach + 1)
    column, row = (np.floor(center[:, axis, None]).astype(int) + offset for axis in (0, 1))
    dx, dy = column + 0.5 - center[:, 0, None], row + 0.5 - center[:, 1, None]
    ink = np.clip(radius + 0.5 - np.hypot(dx[:, None, :], dy[:, :, None]), 0, 1)
    square = np.zeros((SQUARE + 2 * reach, SQUARE + 2 * reach), np.float32)
    np.maximum.at(square, (row[:, :, None] + reach, column[:, None, :] + reach), ink)
    return square[reach:-reach, reach:-reach]


def _lines(center, width: float):
    """How much lines across a strip cover of each pixel along it, (SQUARE,)."""
    import numpy as np

    pixel = np.arange(SQUARE) + 0.5
    return np.clip((width + 1) / 2 - np.abs(pixel - center[:, None]), 0, 1).max(axis=0).astype(np.float32)
