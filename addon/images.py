"""Blender's images as arrays of colour."""

from __future__ import annotations

import bpy
import numpy as np

#: What Blender shows where an image is missing.
MISSING = np.array([[[1.0, 0.0, 1.0]]], dtype=np.float32)

#: Colour spaces whose pixels are used as they are.
UNCHANGED_SPACES = {"Non-Color", "Linear Rec.709", "Linear", "Raw", "Generic Data", "Utilities - Raw", ""}


def read_image(image: bpy.types.Image | None) -> tuple[np.ndarray, str | None]:
    """(height, width, 3), bottom row first, and what is wrong with the image, if anything.

    The pixels are uint8 in sRGB, as in the file, or float32 in linear Rec.709. A missing image is one magenta pixel, as
    in Blender. Of a tiled image (UDIM) the first tile is read.
    """
    if image is None:
        return MISSING, "no image is chosen"
    width, height = image.size
    channels = image.channels
    if not width * height * channels or len(image.pixels) != width * height * channels:
        return MISSING, f'image "{image.name}" cannot be loaded'
    raw = np.empty(width * height * channels, dtype=np.float32)
    image.pixels.foreach_get(raw)
    raw = raw.reshape(height, width, channels)
    pixels = raw[:, :, :3] if channels >= 3 else np.repeat(raw[:, :, :1], 3, axis=2)

    problem = f'only the first tile of image "{image.name}" is used' if image.source == "TILED" else None
    space = image.colorspace_settings.name
    # Blender makes float images linear when it loads them, and keeps bytes as they are in the file.
    if image.is_float or space in UNCHANGED_SPACES:
        return np.ascontiguousarray(pixels), problem
    if space != "sRGB":
        problem = f'image "{image.name}" has the colour space {space}, and is read as sRGB'
    return np.rint(pixels * 255.0).astype(np.uint8), problem


def mean_of_panorama(pixels: np.ndarray) -> tuple[float, float, float]:
    """The mean over all directions of an equirectangular picture: a row counts by the cosine of its latitude."""
    linear = srgb_to_linear(pixels / 255.0) if pixels.dtype == np.uint8 else pixels
    height = linear.shape[0]
    weights = np.cos(((np.arange(height) + 0.5) / height - 0.5) * np.pi)
    mean = np.average(linear.mean(axis=1, dtype=np.float64), axis=0, weights=weights)
    return float(mean[0]), float(mean[1]), float(mean[2])


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """The transfer function of IEC 61966-2-1."""
    return np.where(encoded < 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
