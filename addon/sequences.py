"""Sequences of images: which file a texture shows at a frame of the scene, and that file as an image.

Of a sequence Blender hands out no pixels. The file of a frame is loaded as an image of its own for as long as it is
read. That changes Blender's data, which may only be done in the main thread: not in renders from Blender's window.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy


def can_be_read() -> bool:
    return threading.current_thread() is threading.main_thread()


def number_of(user: bpy.types.ImageUser, frame: int) -> int:
    """The number of the file that is shown at a frame of the scene."""
    place, count = frame - user.frame_start, max(user.frame_duration, 1)
    place = place % count if user.use_cyclic else min(max(place, 0), count - 1)
    return place + 1 + user.frame_offset


def file_of(path: str, number: int) -> Path:
    """The file with this number, which takes the place of the last digits in the name of another one."""
    other = Path(path)
    stem = re.sub(r"\d+(?=\D*$)", lambda digits: f"{number:0{len(digits[0])}d}", other.stem)
    return other.with_name(stem + other.suffix)


@contextmanager
def loaded(image: bpy.types.Image, number: int) -> Iterator[bpy.types.Image | None]:
    """The file of a sequence as an image, until the context is left. None where it is missing."""
    path = file_of(image.filepath_from_user(), number)
    if not can_be_read() or not path.is_file():
        yield None
        return
    shown = bpy.data.images.load(str(path), check_existing=False)
    try:
        shown.colorspace_settings.name = image.colorspace_settings.name
        shown.alpha_mode = image.alpha_mode
        yield shown
    finally:
        bpy.data.images.remove(shown)
