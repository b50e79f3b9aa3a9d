"""Slow, plain twins of kernels: the definition, one sample at a time, in Python's own integers and float64."""

from __future__ import annotations

import math

import numpy as np


def hash32(*values: int) -> int:
    """The last step of MurmurHash3 (Appleby 2011) once per value."""
    state = 0x9E3779B9
    for value in values:
        state = (state ^ (value % 2**32)) * 0x85EBCA6B % 2**32
        state = (state ^ (state >> 13)) * 0xC2B2AE35 % 2**32
        state ^= state >> 16
    return state


def set_of_pixel(salt: int, set_count: int, x: int, y: int, dimension: int) -> int:
    return (hash32(x, y, salt) + dimension * (hash32(y, x, salt ^ 0x5BD1E995) | 1)) % set_count


def point_of_sample(points: np.ndarray, salt: int, dimension: int, blocks: np.ndarray, number: int) -> np.ndarray:
    """Sample `number` of a tile: blocks of 4×4 pixels, in each its pixels row by row, in each its samples."""
    samples = points.shape[2]
    block, pixel, i = number // (16 * samples), number // samples % 16, number % samples
    x, y = blocks[block][0] + pixel % 4, blocks[block][1] + pixel // 4
    return points[:, set_of_pixel(salt, points.shape[1], int(x), int(y), dimension), i]


def linear_of_srgb(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def texel(pixels: np.ndarray, i: int, j: int, extension: str) -> np.ndarray:
    """Pixel (i, j), or what stands in its place outside of the image."""
    height, width = pixels.shape[:2]
    inside = 0 <= i < width and 0 <= j < height
    if extension == "clip" and not inside:
        return np.zeros(3)
    if extension == "mirror":
        i, j = (
            (k if k < size else 2 * size - 1 - k) for k, size in ((i % (2 * width), width), (j % (2 * height), height))
        )
    elif extension == "repeat":
        i, j = i % width, j % height
    else:
        i, j = min(max(i, 0), width - 1), min(max(j, 0), height - 1)
    return pixels[j, i].astype(np.float64)


def image_color(pixels: np.ndarray, u: float, v: float, extension: str, interpolation: str) -> np.ndarray:
    """The linear colour at (u, v): pixel (i, j) of the image has its centre at ((i + ½) / width, (j + ½) / height)."""
    height, width = pixels.shape[:2]
    bytes_ = pixels.dtype == np.uint8
    scaled = pixels / 255 if bytes_ else pixels
    x, y = u * width, v * height
    if interpolation == "closest":
        color = texel(scaled, math.floor(x), math.floor(y), extension)
    else:
        i, j = math.floor(x - 0.5), math.floor(y - 0.5)
        s, t = x - 0.5 - i, y - 0.5 - j
        color = (1 - t) * ((1 - s) * texel(scaled, i, j, extension) + s * texel(scaled, i + 1, j, extension))
        color += t * ((1 - s) * texel(scaled, i, j + 1, extension) + s * texel(scaled, i + 1, j + 1, extension))
    return np.array([linear_of_srgb(value) for value in color]) if bytes_ else color


def checker_is_first_color(x: float, y: float, z: float) -> bool:
    """Blender's checker: its second colour fills the cell at the origin, its first the cells that share a face."""
    return (math.floor(x) + math.floor(y) + math.floor(z)) % 2 == 1
