"""From linear radiance to what a screen shows: sRGB's transfer function (IEC 61966-2-1), clipped, and nothing else."""

from __future__ import annotations

import numpy as np


def display(linear: np.ndarray) -> np.ndarray:
    """uint8 sRGB (h, w, 3), top row first, of linear Rec.709 (h, w, 3), bottom row first. NaN is black."""
    value = np.clip(np.nan_to_num(np.asarray(linear, np.float64)[::-1], nan=0.0), 0, 1)
    encoded = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)
