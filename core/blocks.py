"""Blocks of 4×4 pixels, and the parts of a picture that they cover.

Blocks lie on a grid that is fixed to the full frame, and a block is always rendered whole, so that a packet holds the
same rays whatever the border, the tiles, the batches or the threads.
"""

from __future__ import annotations

import numpy as np

BLOCK = 4

#: (left, bottom, right, top) in pixels of the full frame, right and top outside.
Bounds = tuple[int, int, int, int]


class BlockGrid:
    """The blocks that touch `bounds`, row after row from the bottom.

    `blocks` is (B, 2) int64, the lower left pixel of each.
    """

    def __init__(self, bounds: Bounds) -> None:
        left, bottom, right, top = bounds
        x0, y0 = left // BLOCK * BLOCK, bottom // BLOCK * BLOCK
        self._columns, self._rows = -(-(right - x0) // BLOCK), -(-(top - y0) // BLOCK)
        self._window = np.s_[bottom - y0 : top - y0, left - x0 : right - x0]
        y, x = np.mgrid[: self._rows, : self._columns].reshape(2, -1)
        self.blocks = np.stack([x0 + BLOCK * x, y0 + BLOCK * y], axis=1).astype(np.int64)

    @property
    def pixels(self) -> int:
        """How many pixels the blocks have, those outside of the bounds too."""
        return len(self.blocks) * BLOCK * BLOCK

    def raster(self, values: np.ndarray) -> np.ndarray:
        """Pixels in the blocks' order, (pixels, channels), as the picture inside the bounds, (height, width, channels).

        Within a block pixels are numbered row after row, from its lower left one.
        """
        rows, columns, channels = self._rows, self._columns, values.shape[-1]
        blocks = values.reshape(rows, columns, BLOCK, BLOCK, channels).transpose(0, 2, 1, 3, 4)
        return blocks.reshape(rows * BLOCK, columns * BLOCK, channels)[self._window]
