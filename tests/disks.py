"""Disks that are full, and folders that can only be read."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest


@contextlib.contextmanager
def small_disk(folder: Path, megabytes: int) -> Iterator[None]:
    """Mount a disk of that size in a new folder; where this is not allowed the test is skipped."""
    folder.mkdir()
    try:
        command = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(folder)]
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("only root can mount a small disk, on Linux")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def fill(folder: Path, but: int = 0) -> None:
    """Write a file "filler" until its disk is full but for so many bytes."""
    with (folder / "filler").open("wb", buffering=0) as filler:
        with contextlib.suppress(OSError):
            while True:
                filler.write(bytes(4096))
        os.truncate(filler.fileno(), filler.tell() - but)


@contextlib.contextmanager
def read_only(folder: Path) -> Iterator[list[str]]:
    """Take the right to write in a folder and all below it; gives what to put before a command for which that holds.

    Root may write everywhere: the command runs without this capability of it (capabilities(7)).

    Raises:
        OSError: nothing here can take it.
    """
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    if is_root and not shutil.which("setpriv"):
        raise OSError("root may write everywhere, and there is no setpriv to take that from it")
    folders = [folder, *(path for path in folder.rglob("*") if path.is_dir())]
    for path in folders:
        path.chmod(0o555)
    try:
        yield ["setpriv", "--bounding-set=-dac_override"] if is_root else []
    finally:
        for path in folders:
            path.chmod(0o755)
