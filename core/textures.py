"""Colours that vary over a surface: Blender's Checker and Image Texture nodes."""

from __future__ import annotations

import math

import numpy as np

from .jit import device
from .packed_materials import CHECKER, CLIP, EXTEND, IMAGE_SRGB_BYTES, MIRROR, REPEAT
from .packing import SceneArrays

_ONE, _HALF = np.float32(1), np.float32(0.5)


@device
def texture_color(scene: SceneArrays, texture: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The linear colour of a texture at its own coordinates (x, y, z)."""
    if scene.texture_kind[texture] == CHECKER:
        return _checker(scene, texture, x, y, z)
    return _image(scene, texture, x, y)


@device
def _checker(scene: SceneArrays, texture: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    scale = scene.texture_scale[texture]
    odd = (_cell(x * scale) + _cell(y * scale) + _cell(z * scale)) & 1
    a, b = scene.texture_color1, scene.texture_color2
    if odd:
        return a[texture, 0], a[texture, 1], a[texture, 2]
    return b[texture, 0], b[texture, 1], b[texture, 2]


@device
def _cell(x: float) -> int:
    # Blender moves the pattern by a millionth, so that a face lying on a cell's edge falls into one cell.
    return np.int64(math.floor((x + np.float32(1e-6)) * np.float32(0.999999)))


@device
def _image(scene: SceneArrays, texture: int, x: float, y: float) -> tuple[float, float, float]:
    width, height = scene.texture_size[texture, 0], scene.texture_size[texture, 1]
    extension = scene.texture_extension[texture]
    x, y = x * np.float32(width), y * np.float32(height)
    if scene.texture_smooth[texture]:
        x, y = x - _HALF, y - _HALF
        left, below = math.floor(x), math.floor(y)
        s, t = np.float32(x - left), np.float32(y - below)
        i, j = np.int64(left), np.int64(below)
        r00, g00, b00 = _texel(scene, texture, i, j, width, height, extension)
        r10, g10, b10 = _texel(scene, texture, i + 1, j, width, height, extension)
        r01, g01, b01 = _texel(scene, texture, i, j + 1, width, height, extension)
        r11, g11, b11 = _texel(scene, texture, i + 1, j + 1, width, height, extension)
        w00, w10, w01, w11 = (_ONE - s) * (_ONE - t), s * (_ONE - t), (_ONE - s) * t, s * t
        r = w00 * r00 + w10 * r10 + w01 * r01 + w11 * r11
        g = w00 * g00 + w10 * g10 + w01 * g01 + w11 * g11
        b = w00 * b00 + w10 * b10 + w01 * b01 + w11 * b11
    else:
        i, j = np.int64(math.floor(x)), np.int64(math.floor(y))
        r, g, b = _texel(scene, texture, i, j, width, height, extension)
    if scene.texture_kind[texture] == IMAGE_SRGB_BYTES:
        return _from_srgb(r), _from_srgb(g), _from_srgb(b)
    return r, g, b


@device
def _texel(
    scene: SceneArrays, texture: int, i: int, j: int, width: int, height: int, extension: int
) -> tuple[float, float, float]:
    if extension == CLIP and (i < 0 or j < 0 or i >= width or j >= height):
        return np.float32(0), np.float32(0), np.float32(0)
    index = scene.texture_first[texture] + _wrap(j, height, extension) * width + _wrap(i, width, extension)
    if scene.texture_kind[texture] == IMAGE_SRGB_BYTES:
        scale = np.float32(1 / 255)
        return (
            np.float32(scene.bytes[index, 0]) * scale,
            np.float32(scene.bytes[index, 1]) * scale,
            np.float32(scene.bytes[index, 2]) * scale,
        )
    return scene.pixels[index, 0], scene.pixels[index, 1], scene.pixels[index, 2]


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
