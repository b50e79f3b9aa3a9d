"""Slow, plain twins of kernels: the definition, one sample at a time, in Python's own integers and float64."""

from __future__ import annotations

import itertools
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


def place_on_curve(x: int, y: int, digits: int, salt: int) -> int:
    """Where a Z-curve through 2^digits × 2^digits pixels comes by, its quarters in one of 24 orders in each square."""
    if digits == 0:
        return 0
    half = 2 ** (digits - 1)
    order = list(itertools.permutations(range(4)))[hash32(x // 2**digits, y // 2**digits, salt + digits - 1) % 24]
    quarter = 2 * (y // half % 2) + x // half % 2
    return order[quarter] * half**2 + place_on_curve(x, y, digits - 1, salt)


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


def owen_scrambled_sobol(set_count: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """2^k points of Sobol's sequence, scrambled as Owen (1995) says: float64 (set_count, count, 2).

    Digit by digit, a coin of its own for each node of the binary tree; below the k digits that a point shares with no
    other, all further coins together are one even number.
    """
    digits = count.bit_length() - 1
    points = np.empty((set_count, count, 2))
    for axis in (0, 1):
        numbers = [_sobol_digits(i, digits, axis) for i in range(count)]
        for level in range(digits):
            coins = rng.integers(2, size=(set_count, 1 << level))
            node = [number >> (digits - level) for number in numbers]
            digit = np.array([number >> (digits - 1 - level) & 1 for number in numbers])
            flipped = digit ^ coins[:, node]
            points[..., axis] = flipped * 0.5 ** (level + 1) + (points[..., axis] if level else 0)
        points[..., axis] += rng.random((set_count, count)) * 0.5**digits
    return points


def _sobol_digits(index: int, digits: int, axis: int) -> int:
    """A coordinate of Sobol's point `index` in units of 2^-digits: mirrored digits, through Pascal's triangle in y."""
    result = 0
    for row in range(digits):
        columns = [row] if axis == 0 else range(row, digits)
        ones = sum(math.comb(column, row) * (index >> column & 1) for column in columns)
        result |= ones % 2 << (digits - 1 - row)
    return result
