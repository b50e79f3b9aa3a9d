"""How kernels are compiled: numba's options in one place."""

from __future__ import annotations

from collections.abc import Callable

import numba
from numba.core import config

from .kernel_cache import cache_folder

#: LLVM may fuse and reorder, but must keep NaN and infinity: a degenerate triangle has to stay recognisable.
FAST_MATH = {"contract", "reassoc", "nsz", "arcp"}


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
