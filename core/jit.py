"""How kernels are compiled: numba's options in one place."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable

import numba
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator

from .kernel_cache import cache_folder

#: LLVM may fuse and reorder, but must keep NaN and infinity: a degenerate triangle has to stay recognisable.
FAST_MATH = {"contract", "reassoc", "nsz", "arcp"}


#: Modules are imported by several threads; numba's folder is one for all.
_choosing_folder = threading.Lock()


class _Locator(UserProvidedCacheLocator):
    """The folder that is chosen below, also where it can be read only, which numba's own would not take."""

    def ensure_cache_path(self) -> None:
        with contextlib.suppress(OSError):
            super().ensure_cache_path()


class _InChosenFolder(CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class _KernelCache(FunctionCache):
    """Kernels on disk. Where the disk is full, or a file on it is damaged, they are compiled once more."""

    _impl_class = _InChosenFolder

    def load_overload(self, signature: object, target_context: object) -> object | None:
        try:
            return super().load_overload(signature, target_context)
        except Exception:  # whatever unpickling makes of damaged bytes
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, signature: object, data: object) -> None:
        with contextlib.suppress(OSError):
            super().save_overload(signature, data)


def kernel(function: Callable) -> Callable:
    """Compile a function that loops over arrays: releases the GIL, and is cached on disk."""
    compiled = numba.njit(nogil=True, _nrt=False, error_model="numpy", fastmath=FAST_MATH)(function)
    if not config.DISABLE_JIT:
        with _choosing_folder:
            # Other users of numba in the same Blender keep their own folder.
            before, config.CACHE_DIR = config.CACHE_DIR, str(cache_folder())
            try:
                compiled._cache = _KernelCache(function)
            finally:
                config.CACHE_DIR = before
    return compiled


def device(function: Callable) -> Callable:
    """Compile a small function that kernels call for one sample; it is always inlined, and cached with its caller."""
    return numba.njit(nogil=True, forceinline=True, _nrt=False, error_model="numpy", fastmath=FAST_MATH)(function)


def subroutine(function: Callable) -> Callable:
    """Compile a function that kernels call for one sample, and that is too large to be copied to each call."""
    return numba.njit(nogil=True, _nrt=False, error_model="numpy", fastmath=FAST_MATH)(function)
