"""Embree, reached through the library that embreex brings: building the acceleration structure and tracing packets.

embreex's own `EmbreeScene.run` traces one ray at a time and knows no instances. The same shared library offers packets,
instances and shared buffers through Embree's C API (embree4/rtcore.h), and numba kernels can call it: the address of
each function is given to LLVM under its own name, so that compiled kernels can be cached on disk. Where the library
cannot be found, `embree_run` puts embreex's own call behind the same names.

Nothing else in Rooks knows Embree.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import llvmlite.binding
import numpy as np
from numba import types

from .batch import (
    ACTIVE,
    GEOMETRY,
    INSTANCE,
    INVALID,
    LANES,
    LIGHT_WEIGHT,
    MASK,
    ORIGIN,
    PACKET,
    PRIMITIVE,
    RAY_HIT_ROWS,
    RAY_ROWS,
    SHADOW,
    T_FAR,
    TRACED,
    Batch,
)
from .embree_run import CALLBACKS, RunScene
from .errors import RooksError
from .jit import kernel

_GEOMETRY_TRIANGLE, _GEOMETRY_INSTANCE = 0, 121
_BUFFER_INDEX, _BUFFER_VERTEX = 0, 1
_FORMAT_UINT3, _FORMAT_FLOAT3, _FORMAT_FLOAT3X4_ROW_MAJOR = 0x5003, 0x9003, 0x9134
_SCENE_FLAG_ROBUST = 1 << 2
_DEVICE_VERSION_MAJOR, _DEVICE_NATIVE_RAY16 = 1, 34
_RAY_QUERY_COHERENT = 1 << 16
#: Embree's validity mask of a lane.
_TRACE, _SKIP = np.uint32(0xFFFFFFFF), np.uint32(0)

#: RTCMemoryMonitorFunction: a pointer of the user's, the bytes more (or fewer), and whether that has happened already.
_MEMORY_MONITOR = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_ssize_t, ctypes.c_bool)

_TRACING = ("rtcIntersect1", "rtcOccluded1", "rtcIntersect16", "rtcOccluded16")
_single = types.void(types.uintp, types.uintp, types.uintp)
_packet = types.void(types.uintp, types.uintp, types.uintp, types.uintp)
# The names under which `load_library` gives the addresses to LLVM.
_intersect1 = types.ExternalFunction("rooks_rtcIntersect1", _single)
_occluded1 = types.ExternalFunction("rooks_rtcOccluded1", _single)
_intersect16 = types.ExternalFunction("rooks_rtcIntersect16", _packet)
_occluded16 = types.ExternalFunction("rooks_rtcOccluded16", _packet)


class Traversal(NamedTuple):
    """What a kernel needs to trace: the scene and the arguments' addresses, and whether packets are native."""

    scene: int
    coherent: int
    incoherent: int
    packets: bool


class PlacedTriangles(NamedTuple):
    """One entry of the structure: triangles, and where they stand (None: they are in world space already).

    `vertices` (V, 3) float32 and `triangles` (T, 3) uint32 are shared, not copied: they must outlive the structure, and
    the vertices must be followed by at least 4 more bytes of memory. `matrix` is (3, 4) float32.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    matrix: np.ndarray | None
    mask: int


def build_scene(entries: Sequence[PlacedTriangles], threads: int) -> EmbreeScene | RunScene:
    """Build the acceleration structure; entry i is what a hit names as its geometry or instance i.

    Raises:
        RooksError: embreex is not installed, or Embree cannot start or runs out of memory.
    """
    lib = load_library()
    if lib is None:
        scene = RunScene(entries)
        scene.traversal = Traversal(scene.address, 0, 0, True)
        return scene
    return EmbreeScene(lib, entries, threads)


class EmbreeScene:
    """An acceleration structure over placed triangles, in Embree's memory until it is closed."""

    def __init__(self, lib: ctypes.CDLL, entries: Sequence[PlacedTriangles], threads: int) -> None:
        self._lib = lib
        self._entries = entries  # keeps the shared buffers alive
        self._shared: dict[int, int] = {}
        self._device = lib.rtcNewDevice(f"threads={threads},set_affinity=0".encode())
        if not self._device:
            raise RooksError(f"Embree cannot start on this processor (error {lib.rtcGetDeviceError(None)})")
        assert lib.rtcGetDeviceProperty(self._device, _DEVICE_VERSION_MAJOR) == 4, "the ray layouts are Embree 4's"
        self._memory: list[int] = []
        # Not a method: an object that its own callback holds is freed late.
        memory = self._memory
        self._on_memory = _MEMORY_MONITOR(lambda _user, count, _is_done: memory.append(count) is None)
        lib.rtcSetDeviceMemoryMonitorFunction(self._device, self._on_memory, None)
        self._scene = lib.rtcNewScene(self._device)
        lib.rtcSetSceneFlags(self._scene, _SCENE_FLAG_ROBUST)
        for index, entry in enumerate(entries):
            geometry = self._triangles(entry) if entry.matrix is None else self._instance(entry)
            lib.rtcSetGeometryMask(geometry, entry.mask)
            lib.rtcCommitGeometry(geometry)
            lib.rtcAttachGeometryByID(self._scene, geometry, index)
            lib.rtcReleaseGeometry(geometry)
        lib.rtcCommitScene(self._scene)
        error = lib.rtcGetDeviceError(self._device)
        if error:
            self.close()
            raise RooksError(f"Embree could not build the scene (error {error}; 4 is out of memory)")
        # RTCIntersectArguments: flags, then a feature mask of all ones; every pointer null.
        self._arguments = np.zeros((2, 16), np.uint32)
        self._arguments[:, 1] = INVALID
        self._arguments[0, 0] = _RAY_QUERY_COHERENT
        coherent, incoherent = (int(row.ctypes.data) for row in self._arguments)
        packets = lib.rtcGetDeviceProperty(self._device, _DEVICE_NATIVE_RAY16) == 1
        self.traversal = Traversal(self._scene, coherent, incoherent, packets)

    @property
    def memory(self) -> int:
        """Bytes that the structure takes, beside the buffers that it shares."""
        return sum(self._memory)

    def close(self) -> None:
        """Give the memory back. The structure must not be traced after that."""
        for scene in (self._scene, *self._shared.values()):
            self._lib.rtcReleaseScene(scene)
        self._lib.rtcReleaseDevice(self._device)

    def _triangles(self, entry: PlacedTriangles) -> int:
        lib = self._lib
        geometry = lib.rtcNewGeometry(self._device, _GEOMETRY_TRIANGLE)
        for kind, form, array in (
            (_BUFFER_VERTEX, _FORMAT_FLOAT3, entry.vertices),
            (_BUFFER_INDEX, _FORMAT_UINT3, entry.triangles),
        ):
            lib.rtcSetSharedGeometryBuffer(geometry, kind, 0, form, array.ctypes.data, 0, 12, len(array))
        return geometry

    def _instance(self, entry: PlacedTriangles) -> int:
        lib = self._lib
        key = entry.triangles.ctypes.data
        if key not in self._shared:
            shared = self._shared[key] = lib.rtcNewScene(self._device)
            lib.rtcSetSceneFlags(shared, _SCENE_FLAG_ROBUST)
            geometry = self._triangles(entry)
            # Embree's default mask is 1; here the instance's own mask decides.
            lib.rtcSetGeometryMask(geometry, int(INVALID))
            lib.rtcCommitGeometry(geometry)
            lib.rtcAttachGeometryByID(shared, geometry, 0)
            lib.rtcReleaseGeometry(geometry)
            lib.rtcCommitScene(shared)
        geometry = lib.rtcNewGeometry(self._device, _GEOMETRY_INSTANCE)
        lib.rtcSetGeometryInstancedScene(geometry, self._shared[key])
        lib.rtcSetGeometryTransform(geometry, 0, _FORMAT_FLOAT3X4_ROW_MAJOR, entry.matrix.ctypes.data)
        return geometry


@functools.cache
def load_library() -> ctypes.CDLL | None:
    """Embree's C functions, callable from Python; None where they are not to be had. LLVM then knows how to trace.

    Raises:
        RooksError: embreex is not installed.
    """
    path = library_path()
    try:
        lib = None if path is None else _open_library(path)
    except (OSError, AttributeError):  # it does not load, or lacks a function
        lib = None
    _tell_llvm(CALLBACKS if lib is None else {name: getattr(lib, name) for name in _TRACING})
    return lib


def _open_library(path: Path) -> ctypes.CDLL:
    # On Linux, Blender's own programs load another Embree for all to see; ours must bind to itself.
    lib = ctypes.CDLL(str(path), mode=getattr(os, "RTLD_DEEPBIND", 0) | getattr(os, "RTLD_NOW", 0))
    pointer, number = ctypes.c_void_p, ctypes.c_uint
    signatures = {
        "rtcNewDevice": (pointer, [ctypes.c_char_p]),
        "rtcReleaseDevice": (None, [pointer]),
        "rtcGetDeviceError": (ctypes.c_int, [pointer]),
        "rtcGetDeviceProperty": (ctypes.c_ssize_t, [pointer, ctypes.c_int]),
        "rtcSetDeviceMemoryMonitorFunction": (None, [pointer, _MEMORY_MONITOR, pointer]),
        "rtcNewScene": (pointer, [pointer]),
        "rtcReleaseScene": (None, [pointer]),
        "rtcSetSceneFlags": (None, [pointer, ctypes.c_int]),
        "rtcCommitScene": (None, [pointer]),
        "rtcNewGeometry": (pointer, [pointer, ctypes.c_int]),
        "rtcReleaseGeometry": (None, [pointer]),
        "rtcCommitGeometry": (None, [pointer]),
        "rtcSetGeometryMask": (None, [pointer, number]),
        "rtcAttachGeometryByID": (None, [pointer, pointer, number]),
        "rtcSetGeometryInstancedScene": (None, [pointer, pointer]),
        "rtcSetGeometryTransform": (None, [pointer, number, ctypes.c_int, pointer]),
        "rtcSetSharedGeometryBuffer": (
            None,
            [pointer, ctypes.c_int, number, ctypes.c_int, pointer, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_size_t],
        ),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(lib, name)
        function.restype, function.argtypes = result, arguments
    return lib


def _tell_llvm(functions: dict) -> None:
    for name, function in functions.items():
        llvmlite.binding.add_symbol(f"rooks_{name}", ctypes.cast(function, ctypes.c_void_p).value)


def library_path() -> Path | None:
    """Where embreex keeps its Embree: beside it on Linux and Windows, inside it on macOS; None where it is not there.

    Raises:
        RooksError: embreex is not installed.
    """
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        raise RooksError("embreex is not installed: it brings Embree, which traces the rays")
    package = Path(spec.origin).parent
    pattern = {"win32": "embree4*.dll", "darwin": "libembree4*.dylib"}.get(sys.platform, "libembree4*.so*")
    folders = (package.parent / "embreex.libs", package / ".dylibs", package)
    return next((path for folder in folders for path in sorted(folder.glob(pattern))), None)


@kernel
def intersect_coherent(batch: Batch, traversal: Traversal, packets: int) -> None:
    """Find the nearest hit of each active lane among what its MASK can see, the rays of a packet being neighbours.

    All rays of a packet must be of the same kind.
    """
    if not traversal.packets:
        intersect_incoherent(batch, traversal, packets)
        return
    memory = batch.bits.ctypes.data
    for p in range(packets):
        at = p * PACKET
        for i in range(at, at + LANES):
            batch.bits[i + TRACED] = _TRACE if batch.floats[i + ACTIVE] > 0 else _SKIP
            batch.bits[i + PRIMITIVE] = INVALID
            batch.bits[i + GEOMETRY] = INVALID
            batch.bits[i + INSTANCE] = INVALID
        _intersect16(memory + (at + TRACED) * 4, traversal.scene, memory + at * 4, traversal.coherent)


@kernel
def intersect_incoherent(batch: Batch, traversal: Traversal, packets: int) -> None:
    """Find the nearest hit of each active lane one by one: faster than packets where rays scatter."""
    bits, ray = batch.bits, batch.ray_bits
    for p in range(packets):
        at = p * PACKET
        for i in range(at, at + LANES):
            bits[i + PRIMITIVE] = INVALID
            if batch.floats[i + ACTIVE] > 0:
                bits[i + GEOMETRY] = INVALID
                bits[i + INSTANCE] = INVALID
                for row in range(RAY_HIT_ROWS):
                    ray[row] = bits[i + row * LANES]
                _intersect1(traversal.scene, ray.ctypes.data, traversal.incoherent)
                for row in range(T_FAR // LANES, RAY_HIT_ROWS):
                    bits[i + row * LANES] = ray[row]


@kernel
def occluded_coherent(batch: Batch, traversal: Traversal, mask: int, packets: int) -> None:
    """Set T_FAR of each shadow ray that carries light and is blocked by what `mask` can see to minus infinity."""
    for p in range(packets):
        for i in range(p * PACKET + SHADOW, p * PACKET + SHADOW + LANES):
            batch.bits[i + MASK] = np.uint32(mask)
    _occluded(batch, traversal, traversal.coherent, SHADOW, LIGHT_WEIGHT, packets)


@kernel
def occluded_incoherent(batch: Batch, traversal: Traversal, packets: int) -> None:
    """Set T_FAR of each active lane's ray that is blocked by what its MASK can see to minus infinity."""
    _occluded(batch, traversal, traversal.incoherent, ORIGIN, ACTIVE, packets)


@kernel
def _occluded(batch: Batch, traversal: Traversal, arguments: int, rays: int, wanted: int, packets: int) -> None:
    """Trace the rays that begin at row `rays`, in the lanes where row `wanted` is positive."""
    bits, ray, memory = batch.bits, batch.ray_bits, batch.bits.ctypes.data
    for p in range(packets):
        at = p * PACKET
        any_lane = _SKIP
        for i in range(at, at + LANES):
            trace = _TRACE if batch.floats[i + wanted] > 0 else _SKIP
            bits[i + TRACED] = trace
            any_lane |= trace
        if any_lane == _SKIP:
            continue
        if traversal.packets:
            _occluded16(memory + (at + TRACED) * 4, traversal.scene, memory + (at + rays) * 4, arguments)
        else:
            for i in range(at, at + LANES):
                if bits[i + TRACED] == _TRACE:
                    for row in range(RAY_ROWS):
                        ray[row] = bits[i + rays + row * LANES]
                    _occluded1(traversal.scene, ray.ctypes.data, arguments)
                    bits[i + rays + T_FAR] = ray[T_FAR // LANES]
