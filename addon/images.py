"""Blender's images as arrays of colour and of opacity.

Cycles multiplies colours by their opacity when it loads an image, as the file has them encoded, and divides again where
a node's Alpha is used beside its Color. Data, and images whose alpha mode is None or Channel Packed, stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from . import sequences

#: What Blender shows where an image is missing.
MISSING = (1.0, 0.0, 1.0)

#: Rows of an image that are converted at a time.
STRIP = 64

#: Colour spaces whose pixels are used as they are.
UNCHANGED_SPACES = {"Non-Color", "Linear Rec.709", "Linear", "Raw", "Generic Data", "Utilities - Raw", ""}


class Images:
    """Reads what is asked for of each image once, however many textures use it. None is no image.

    Of sequences that is the file which a texture's `ImageUser` shows at `frame`, by default the current one.
    """

    def __init__(self, frame: int | None = None) -> None:
        self._frame = bpy.context.scene.frame_current if frame is None else frame
        self._read: dict[tuple[str, int, int], np.ndarray | None] = {}

    def colors(
        self, image: bpy.types.Image | None, user: bpy.types.ImageUser | None = None, straight: bool = False
    ) -> np.ndarray:
        """(height, width, 3), bottom row first: uint8 in sRGB, as in the file, or float32 in linear Rec.709.

        The colours are multiplied by their opacity, or `straight`, as they are where it is used beside them. A missing
        image is one magenta pixel. Of a tiled image (UDIM) the first tile is read.
        """
        found = self._once("straight" if straight else "colors", image, user, lambda shown: _colors(shown, straight))
        return np.array([[MISSING]], np.float32) if found is None else found

    def opacity(self, image: bpy.types.Image | None, user: bpy.types.ImageUser | None = None) -> np.ndarray | None:
        """(height, width, 3) float32: the alpha channel, thrice. None where there is none, or it is not to be used."""
        return self._once("opacity", image, user, _opacity)

    def problem_of(self, image: bpy.types.Image | None, user: bpy.types.ImageUser | None = None) -> str | None:
        """What is wrong with an image, if anything."""
        if image is None:
            return rpt_("no image is chosen")
        if image.source == "MOVIE":
            text = rpt_('image "{name}" is a movie, which is not read: save it as a sequence of images')
            return text.format(name=image.name)
        if image.source == "SEQUENCE" and not sequences.can_be_read():
            text = rpt_('image "{name}" is a sequence, which is only read in renders from the command line')
            return text.format(name=image.name)
        with self._shown(image, user) as shown:
            if not _has_pixels(shown):
                return rpt_('image "{name}" cannot be loaded').format(name=image.name)
            return _problem_of_pixels(shown, image.name)

    def _once(
        self,
        what: str,
        image: bpy.types.Image | None,
        user: bpy.types.ImageUser | None,
        read: Callable[[bpy.types.Image], np.ndarray | None],
    ) -> np.ndarray | None:
        if image is None:
            return None
        key = (what, image.as_pointer(), self._number(image, user))
        if key not in self._read:
            with self._shown(image, user) as shown:
                self._read[key] = read(shown) if _has_pixels(shown) else None
        return self._read[key]

    def _number(self, image: bpy.types.Image, user: bpy.types.ImageUser | None) -> int:
        """Which file of a sequence is shown; 0 for other images."""
        return sequences.number_of(user, self._frame) if image.source == "SEQUENCE" and user is not None else 0

    def _shown(
        self, image: bpy.types.Image, user: bpy.types.ImageUser | None
    ) -> AbstractContextManager[bpy.types.Image | None]:
        """The image that has the pixels, for as long as they are read; None where there is none."""
        if image.source == "SEQUENCE":
            return sequences.loaded(image, self._number(image, user))
        return nullcontext(None if image.source == "MOVIE" else image)


def _has_pixels(image: bpy.types.Image | None) -> bool:
    if image is None:
        return False
    count = image.size[0] * image.size[1] * image.channels
    return count > 0 and len(image.pixels) == count


def _problem_of_pixels(image: bpy.types.Image, name: str) -> str | None:
    space = image.colorspace_settings.name
    if not image.is_float and space != "sRGB" and space not in UNCHANGED_SPACES:
        return rpt_('image "{name}" has the colour space {space}, and is read as sRGB').format(name=name, space=space)
    if image.source == "TILED" and len(image.tiles) > 1:
        return rpt_('only the first tile of image "{name}" is shown, and magenta in place of the others').format(
            name=name
        )
    return None


def _colors(image: bpy.types.Image, straight: bool) -> np.ndarray:
    """In strips of rows: what stands between a large image's pixels and its colours would fill the memory."""
    raw = _pixels(image)
    # Blender makes float images linear when it loads them, and keeps bytes as they are in the file.
    is_linear = image.is_float or image.colorspace_settings.name in UNCHANGED_SPACES
    colors = np.empty((*raw.shape[:2], 3), np.float32 if is_linear else np.uint8)
    for row in range(0, len(raw), STRIP):
        strip = _colors_of(image, raw[row : row + STRIP], straight)
        colors[row : row + STRIP] = strip if is_linear else np.rint(strip * 255.0)
    return colors


def _colors_of(image: bpy.types.Image, raw: np.ndarray, straight: bool) -> np.ndarray:
    """(rows, width, 3) float32, as the file has them, of some rows of pixels."""
    colors = raw[:, :, :3] if image.channels >= 3 else np.repeat(raw[:, :, :1], 3, axis=2)
    if image.channels == 4 and image.alpha_mode in ("STRAIGHT", "PREMUL") and not image.colorspace_settings.is_data:
        alpha = raw[:, :, 3:]
        # Blender itself multiplies the colours of float images when it loads them, and never those of bytes.
        if straight and image.is_float:
            colors = np.divide(colors, alpha, out=colors.copy(), where=alpha > 0.0)
        elif not straight and not image.is_float:
            colors = np.floor(colors * 255.0 * alpha + 1e-3) / 255.0  # Cycles does it in whole numbers, rounded down
    return colors


def _opacity(image: bpy.types.Image) -> np.ndarray | None:
    if image.channels < 4 or image.alpha_mode == "NONE":
        return None
    alpha = _pixels(image)[:, :, 3:]
    return None if (alpha == 1.0).all() else np.repeat(alpha, 3, axis=2)


def _pixels(image: bpy.types.Image) -> np.ndarray:
    """(height, width, channels) float32, as Blender keeps them."""
    width, height = image.size
    raw = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(raw)
    return raw.reshape(height, width, image.channels)
