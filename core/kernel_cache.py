"""Where compiled kernels are kept: a folder that cannot go stale. Nothing here loads the compiler.

numba decides from a function's own file whether its cached machine code is still good, so an edit to a helper in
another file would go unseen. The folder is therefore named after the contents of all files of this folder; the folders
below it hold no kernels (a test sees to that). Folders of other versions that nobody has used for a month are removed.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import hashlib
import os
import platform
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

from .errors import RooksError

#: What has to be free where kernels are to be kept, in bytes. They take 6 MB.
_ROOM = 32 << 20

#: How long kernels that nobody uses are kept, in seconds: 30 days.
_KEPT_FOR = 30 * 24 * 3600


@functools.cache
def cache_folder() -> Path:
    """The folder of compiled kernels: below `ROOKS_CACHE_DIR` or the user's cache folder, else a temporary one.

    One that has them all need not be writable. A temporary one is removed when this process ends.

    Raises:
        RooksError: none of them can be written, or has room.
    """
    digest = hashlib.blake2b(digest_size=8)
    for source in _sources():
        digest.update(source.read_bytes())
    chosen = os.environ.get("ROOKS_CACHE_DIR")
    folder = (Path(chosen) if chosen else Path("~/.cache/rooks").expanduser()) / digest.hexdigest()
    if _is_filled(folder) or _can_write(folder):
        _note_use(folder)
        _remove_unused(folder)
        return folder
    try:
        # A new folder of this process's own: what lies in a shared one could be somebody else's code.
        temporary = Path(tempfile.mkdtemp(prefix="rooks-cache-")) / digest.hexdigest()
    except OSError:
        temporary = None
    if temporary is not None and _can_write(temporary):
        atexit.register(shutil.rmtree, temporary.parent, ignore_errors=True)
        return temporary
    if temporary is not None:
        shutil.rmtree(temporary.parent, ignore_errors=True)
    raise RooksError(
        f"compiled kernels can be kept neither in {folder.parent} nor in a temporary folder: make {_ROOM >> 20} MB of "
        "room, or set ROOKS_CACHE_DIR to a folder that can be written"
    )


def are_compiled() -> bool:
    """Whether all kernels have been compiled from the sources as they are, where they are, for this Python."""
    return _is_filled(cache_folder())


def note_compiled() -> None:
    """Note that all kernels are there."""
    if not are_compiled():
        _stamp(cache_folder()).touch()


def share_compiled() -> float:
    """How many of the kernels are there, by this process or another, in 0 … 1."""
    compiled = sum(1 for _ in cache_folder().rglob("*.nbi"))
    return min(compiled / _kernel_count(), 1.0)


@functools.cache
def _kernel_count() -> int:
    return sum(len(re.findall(r"^@kernel$", source.read_text("utf-8"), re.MULTILINE)) for source in _sources())


def _sources() -> list[Path]:
    return sorted(Path(__file__).parent.glob("*.py"))


def _stamp(folder: Path) -> Path:
    # What numba asks for, beside the contents: a reinstalled Rooks is compiled anew, and so it is for each processor.
    sources = ((str(source), source.stat().st_mtime_ns) for source in _sources())
    facts = [sys.implementation.cache_tag, _processor(), *sources]
    return folder / f"complete-{hashlib.blake2b(repr(facts).encode(), digest_size=8).hexdigest()}"


@functools.cache
def _processor() -> str:
    """What tells one kind of processor from another. numba asks LLVM, which takes too long to load."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:  # not Linux
        return platform.processor()
    kinds = ("model name", "flags", "Features", "CPU implementer", "CPU part")
    return "\n".join(sorted({line for line in lines if line.startswith(kinds)}))


def _is_filled(folder: Path) -> bool:
    try:
        return _stamp(folder).exists()
    except OSError:  # on the way there is what may not be entered
        return False


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return shutil.disk_usage(folder).free >= _ROOM
    except OSError:
        return False


def _note_use(folder: Path) -> None:
    """A folder's time is that of its last use."""
    with contextlib.suppress(OSError):
        os.utime(folder)


def _remove_unused(used: Path) -> None:
    """Remove the folders beside `used` after `_KEPT_FOR`. Who needs one after all compiles what is missing."""
    with contextlib.suppress(OSError):
        for folder in used.parent.iterdir():
            is_old = time.time() - folder.stat().st_mtime > _KEPT_FOR
            if is_old and folder != used and _holds_kernels_only(folder):
                for stamp in folder.glob("complete-*"):  # first: without it, nobody expects all to be there
                    stamp.unlink(missing_ok=True)
                shutil.rmtree(folder, ignore_errors=True)


def _holds_kernels_only(folder: Path) -> bool:
    files = [path.name for path in folder.rglob("*") if not path.is_dir()]
    is_named = re.fullmatch("[0-9a-f]{16}", folder.name)
    return bool(is_named and files) and all(re.search(r"^complete-|\.nb[ci]", name) for name in files)
