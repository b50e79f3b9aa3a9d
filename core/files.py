"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .errors import OutputError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path`, which takes its place when the block ends well and is removed when it does not.

    Raises:
        OutputError: the folder does not exist or cannot be written to.
    """
    check_writable(path)
    temporary = path.with_name(f".rooks-{secrets.token_hex(8)}{path.suffix}")
    try:
        # Exclusive, and with the rights that the user's own mask gives to new files.
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield temporary
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"cannot write {path}: {error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def check_writable(path: Path) -> None:
    """Raise an OutputError now if `path` could not be written later."""
    folder = path.parent
    try:
        if not folder.is_dir():
            raise OutputError(f"cannot write {path}: the folder {folder} does not exist, make it first")
        if path.is_dir():
            raise OutputError(f"cannot write {path}: it is a folder, choose another name for the picture")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from None
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(f"cannot write into the folder {folder}: {error.strerror}") from None
