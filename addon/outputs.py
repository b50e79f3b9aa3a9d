"""Where pictures go: which files a command will write, and, before anything is rendered, whether it can."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ._core import core

#: Blender's name for the format of each file ending that is saved as displayed.
DISPLAY_FORMATS = {
    ".png": "PNG",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".webp": "WEBP",
    ".bmp": "BMP",
    ".tga": "TARGA",
    ".hdr": "HDR",
}
ENDINGS = (".exr", *DISPLAY_FORMATS)


def plan_outputs(
    blend: Path, outputs: Sequence[str], file_count: int, frames: Sequence[int] | None
) -> dict[int | None, list[Path]]:
    """The files that each frame of one .blend is saved to, after a look whether they can be written.

    Without a range of `frames` there is one, None: the file's own.

    Raises:
        OutputError: a path cannot be written, or names no known format.
    """
    paths = [path for output in outputs for path in _expand(blend, output, file_count)]
    for path in paths:
        _check_format(path)
    if frames is None:
        plan = {None: paths}
    else:
        plan = {frame: [_frame_path(path, frame) for path in paths] for frame in frames}
    for planned in plan.values():
        for path in planned:
            core.files.check_writable(path)
    return plan


def _frame_path(path: Path, frame: int) -> Path:
    """Where one frame of a range is saved: its number, of four digits and more, ends the name."""
    return path.with_stem(f"{path.stem}_{'-' if frame < 0 else ''}{abs(frame):04}")


def _expand(blend: Path, output: str, file_count: int) -> list[Path]:
    path = Path(output)
    if output.endswith(("/", os.sep)) or path.is_dir():
        return [path / f"{blend.stem}.exr", path / f"{blend.stem}.png"]
    if file_count > 1:
        raise core.errors.OutputError(f"{output} cannot hold {file_count} pictures: give --output a folder")
    return [path]


def _check_format(path: Path) -> None:
    if path.suffix.lower() not in ENDINGS:
        raise core.errors.OutputError(f"{path}: the name of a picture must end in one of {' '.join(ENDINGS)}")
