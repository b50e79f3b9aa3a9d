"""Writing a film to disk without Blender: one OpenEXR file with every pass and how it was made."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .files import replacing
from .film import CHANNELS, Film


def write_exr(path: str | Path, film: Film, metadata: dict[str, str | int | float]) -> None:
    """Write `film` to `path`: Combined as R, G, B, A, the other passes as layers of their names, all float32.

    `metadata` becomes header attributes named "rooks:key". The file appears whole or not at all.

    Raises:
        OutputError: the folder does not exist, or the file cannot be written there.
    """
    import OpenEXR  # here, because no other part of the core needs it

    channels = {}
    for name, values in film.passes.items():
        prefix = "" if name == "Combined" else f"{name}."
        for index, letter in enumerate(CHANNELS[name]):
            # OpenEXR keeps the top row first.
            channels[prefix + letter] = np.ascontiguousarray(values[::-1, :, index])
    width, height = film.resolution
    # Where the film lies in the full frame, counted from its upper left pixel.
    first = film.x, height - film.y - film.height
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "displayWindow": ((0, 0), (width - 1, height - 1)),
        "dataWindow": (first, (first[0] + film.width - 1, first[1] + film.height - 1)),
    }
    header |= {f"rooks:{key}": value for key, value in metadata.items()}
    with replacing(Path(path)) as temporary:
        OpenEXR.File(header, channels).write(str(temporary))
