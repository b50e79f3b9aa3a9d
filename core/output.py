"""Writing a film to disk without Blender: one OpenEXR file with every pass and how it was made."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

import numpy as np

from .errors import OutputError
from .film import PASSES, Film


def write_exr(path: str | Path, film: Film, metadata: dict[str, str | int | float]) -> None:
    """Write `film` to `path`: Combined as R, G, B, A, the other passes as layers of their names, all float32.

    `metadata` becomes header attributes named "rooks:key". The file appears whole or not at all.

    Raises:
        OutputError: the folder does not exist, or the file cannot be written there.
    """
    import OpenEXR  # here, because no other part of the core needs it

    channels = {}
    for name, letters in PASSES.items():
        prefix = "" if name == "Combined" else f"{name}."
        for index, letter in enumerate(letters):
            # OpenEXR keeps the top row first.
            channels[prefix + letter] = np.ascontiguousarray(film.passes[name][::-1, :, index])
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    header |= {f"rooks:{key}": value for key, value in metadata.items()}
    with replacing(Path(path)) as temporary:
        OpenEXR.File(header, channels).write(str(temporary))


@contextlib.contextmanager
def replacing(path: Path):
    """A temporary path beside `path`, which takes its place when the block ends well and is removed when it does not.

    Raises:
        OutputError: the folder does not exist or cannot be written to.
    """
    check_writable(path)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes files that only their owner can read; a picture follows the user's own mask.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"cannot write {path}: {error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def check_writable(path: Path) -> None:
    """Raise an OutputError now if `path` could not be written later."""
    folder = path.parent
    if not folder.is_dir():
        raise OutputError(f"cannot write {path}: the folder {folder} does not exist")
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write {path}: the folder {folder} cannot be written to")
