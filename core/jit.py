"""How kernels are compiled: numba's options in one place, and a compile cache that cannot go stale.

numba decides from a function's own file whether its cached machine code is still good, so an edit to a helper in
another file would go unseen. The cache therefore lives in a folder named after the contents of all files of this
folder; the folders below it hold no kernels (a test sees to that).
"""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numba
from numba.core import config

#: LLVM may fuse and reorder, but must keep NaN and infinity: a degenerate triangle has to stay recognisable.
FAST_MATH = {"contract", "reassoc", "nsz", "arcp"}


@functools.cache
def cache_folder() -> Path:
    """The folder of compiled kernels: below `ROOKS_CACHE_DIR` or the user's cache folder, else a temporary one."""
    digest = hashlib.blake2b(digest_size=8)
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    chosen = os.environ.get("ROOKS_CACHE_DIR")
    folder = (Path(chosen) if chosen else Path("~/.cache/rooks").expanduser()) / digest.hexdigest()
    if _can_write(folder):
        return folder
    # A new folder of this process's own: what lies in a shared one could be somebody else's code.
    return Path(tempfile.mkdtemp(prefix="rooks-cache-"))


def kernel(function: Callable) -> Callable:
    """Compile a function that loops over arrays: releases the GIL, and is cached on disk."""
    # Other users of numba in the same Blender keep their own folder.
    before, config.CACHE_DIR = config.CACHE_DIR, str(cache_folder())
    try:
        return numba.njit(nogil=True, cache=True, _nrt=False, error_model="numpy", fastmath=FAST_MATH)(function)
    finally:
        config.CACHE_DIR = before


def device(function: Callable) -> Callable:
    """Compile a small function that kernels call for one sample; it is always inlined, and cached with its caller."""
    return numba.njit(nogil=True, forceinline=True, _nrt=False, error_model="numpy", fastmath=FAST_MATH)(function)


def subroutine(function: Callable) -> Callable:
    """Compile a function that kernels call for one sample, and that is too large to be copied to each call."""
    return numba.njit(nogil=True, _nrt=False, error_model="numpy", fastmath=FAST_MATH)(function)


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
