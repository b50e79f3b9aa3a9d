"""The pixel filter: the pixel's sample points are warped so that their density *is* the filter (Ernst, Stamminger and
Greiner 2006), and every sample then counts the same."""

from __future__ import annotations

import numpy as np

from .settings import RenderSettings

#: Entries of the inverse distribution, linear in between: at width 1.5, 99.7 % of the samples are within 1e-4 pixels of
#: their place, the far tails within 0.05.
RESOLUTION = 4096


def offset_table(settings: RenderSettings) -> np.ndarray:
    """The offset from the pixel's lower left corner, in pixels, for sample coordinate i / (len - 1): float32 (R,).

    The box filter is the pixel itself, two entries.
    """
    if settings.pixel_filter == "box":
        return np.array([0, 1], np.float32)
    x = np.linspace(-0.5, 0.5, 8 * RESOLUTION + 1)
    cumulative = np.concatenate([[0], np.cumsum((blackman_harris(x[1:]) + blackman_harris(x[:-1])) / 2)])
    inverse = np.interp(np.linspace(0, 1, RESOLUTION), cumulative / cumulative[-1], x)
    return (0.5 + settings.filter_width * inverse).astype(np.float32)


def blackman_harris(x: np.ndarray) -> np.ndarray:
    """The four-term window of Harris (1978, table 1, 92 dB) on [-1/2, 1/2], zero outside."""
    angle = 2 * np.pi * (np.asarray(x) + 0.5)
    window = 0.35875 - 0.48829 * np.cos(angle) + 0.14128 * np.cos(2 * angle) - 0.01168 * np.cos(3 * angle)
    return np.where(np.abs(x) <= 0.5, window, 0)
