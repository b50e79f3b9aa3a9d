"""Looking up textures: Blender's Checker and Image Texture nodes."""

from __future__ import annotations

import math

import numpy as np

from .jit import device
from .packed_materials import (
    CLIP,
    EXTEND,
    EXTENSION,
    FIRST,
    HEIGHT,
    IMAGE_SRGB_BYTES,
    KIND,
    MIRROR,
    REPEAT,
    SMOOTH,
    WIDTH,
    Textures,
)

_ONE, _HALF = np.float32(1), np.float32(0.5)
_INFINITY, _NAN = np.float32(np.inf), np.float32(np.nan)
_FARTHEST = np.float32(2.0**62)


@device
def is_first_check(x: float, y: float, z: float) -> bool:
    """Whether the checker's cell at (x, y, z), cells being cubes of side 1, has the checker's first colour."""
    return (_cell(x) + _cell(y) + _cell(z)) & 1 != 0


@device
def _cell(x: float) -> int:
    # Blender moves the pattern by a millionth, so that a face lying on a cell's edge falls into one cell.
    return np.int64(math.floor((x + np.float32(1e-6)) * np.float32(0.999999)))


@device
def image_color(textures: Textures, texture: int, x: float, y: float) -> tuple[float, float, float]:
    """The linear colour of an image at (x, y), which are 0 to 1 across it; NaN where they are not finite."""
    width, height = textures.table[texture, WIDTH], textures.table[texture, HEIGHT]
    extension = textures.table[texture, EXTENSION]
    x, y = x * np.float32(width), y * np.float32(height)
    # Not math.isfinite: the compiler's liberties with sums let it take that for granted.
    if not abs(x) + abs(y) < _INFINITY:
        return _NAN, _NAN, _NAN
    if textures.table[texture, SMOOTH] != 0:
        x, y = x - _HALF, y - _HALF
        left, below = np.floor(x), np.floor(y)
        s, t = x - left, y - below
        i, j = _whole(left), _whole(below)
        r00, g00, b00 = _texel(textures, texture, i, j, width, height, extension)
        r10, g10, b10 = _texel(textures, texture, i + 1, j, width, height, extension)
        r01, g01, b01 = _texel(textures, texture, i, j + 1, width, height, extension)
        r11, g11, b11 = _texel(textures, texture, i + 1, j + 1, width, height, extension)
        w00, w10, w01, w11 = (_ONE - s) * (_ONE - t), s * (_ONE - t), (_ONE - s) * t, s * t
        r = w00 * r00 + w10 * r10 + w01 * r01 + w11 * r11
        g = w00 * g00 + w10 * g10 + w01 * g01 + w11 * g11
        b = w00 * b00 + w10 * b10 + w01 * b01 + w11 * b11
    else:
        i, j = _whole(np.floor(x)), _whole(np.floor(y))
        r, g, b = _texel(textures, texture, i, j, width, height, extension)
    if textures.table[texture, KIND] == IMAGE_SRGB_BYTES:
        return _from_srgb(r), _from_srgb(g), _from_srgb(b)
    return r, g, b


@device
def _whole(x: float) -> int:
    """A float without a fraction as an integer, or the nearest that is far from where integers end."""
    return np.int64(min(max(x, -_FARTHEST), _FARTHEST))


@device
def _texel(
    textures: Textures, texture: int, i: int, j: int, width: int, height: int, extension: int
) -> tuple[float, float, float]:
    if extension == CLIP and (i < 0 or j < 0 or i >= width or j >= height):
        return np.float32(0), np.float32(0), np.float32(0)
    index = textures.table[texture, FIRST] + _wrap(j, height, extension) * width + _wrap(i, width, extension)
    if textures.table[texture, KIND] == IMAGE_SRGB_BYTES:
        scale = np.float32(1 / 255)
        return (
            np.float32(textures.bytes[index, 0]) * scale,
            np.float32(textures.bytes[index, 1]) * scale,
            np.float32(textures.bytes[index, 2]) * scale,
        )
    return textures.pixels[index, 0], textures.pixels[index, 1], textures.pixels[index, 2]


@device
def _wrap(i: int, size: int, extension: int) -> int:
    if extension == REPEAT:
        return i % size
    if extension == MIRROR:
        i = i % (2 * size)
        return min(i, 2 * size - 1 - i)
    assert extension in (EXTEND, CLIP)
    return min(max(i, 0), size - 1)


@device
def _from_srgb(value: float) -> float:
    """sRGB's transfer function, IEC 61966-2-1."""
    if value <= np.float32(0.04045):
        return value / np.float32(12.92)
    return np.float32(((value + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4))
