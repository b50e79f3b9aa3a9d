"""Tracing through embreex's own `EmbreeScene.run`, for where Embree's C functions cannot be found.

Python functions take the place of Embree's, under the same names and with the same arguments, so that the kernels do
not know the difference. It is slow: each packet goes through Python, under its lock. embreex knows neither instances
nor visibility masks, so instances are copied into the world, and each kind of ray has a scene of its own.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .batch import (
    DIRECTION,
    GEOMETRY,
    HIT_NORMAL,
    HIT_V,
    HIT_W,
    INSTANCE,
    LANES,
    MASK,
    ORIGIN,
    PRIMITIVE,
    RAY_HIT_ROWS,
    RAY_ROWS,
    T_FAR,
    T_NEAR,
)

if TYPE_CHECKING:
    from .embree import PlacedTriangles, Traversal

_scenes: dict[int, RunScene] = {}


class RunScene:
    """What `embree.EmbreeScene` is, over embreex's own scenes. `address` is what a kernel hands back as the scene."""

    traversal: Traversal
    memory = 0  # embreex does not say

    def __init__(self, entries: Sequence[PlacedTriangles]) -> None:
        self._entries = entries
        self._by_mask: dict[int, tuple] = {}
        self.address = id(self)
        _scenes[self.address] = self

    def close(self) -> None:
        _scenes.pop(self.address, None)

    def trace(self, rays: np.ndarray, hits: bool) -> None:
        """Trace rays (rows, n) float32 as Embree does: write the nearest hits, or T_FAR = -inf where one is blocked."""
        masks = rays.view(np.uint32)[MASK // LANES]
        for mask in np.unique(masks):
            chosen = np.ascontiguousarray(rays[:, masks == mask])
            self._trace(chosen, hits, int(mask))
            rays[:, masks == mask] = chosen

    def _trace(self, rays: np.ndarray, hits: bool, mask: int) -> None:
        bits = rays.view(np.uint32)
        scene, placements = self._scene(mask)
        if scene is None:
            return
        origin, direction = _vectors(rays, ORIGIN), _vectors(rays, DIRECTION)
        near, far = rays[T_NEAR // LANES], rays[T_FAR // LANES]
        # embreex starts every ray at 0.
        start = origin + near[:, None] * direction
        found = scene.run(start, direction, dists=(far - near).copy(), query="INTERSECT", output=1)
        hit = found["primID"] != -1
        if not hits:
            far[hit] = -np.inf
            return
        far[hit] = found["tfar"][hit] + near[hit]
        rays[HIT_V // LANES, hit], rays[HIT_W // LANES, hit] = found["u"][hit], found["v"][hit]
        bits[PRIMITIVE // LANES, hit] = found["primID"][hit]
        for lane in np.flatnonzero(hit):
            placement = placements[found["geomID"][lane]]
            matrix, normal = self._entries[placement].matrix, found["Ng"][lane]
            if matrix is None:
                bits[GEOMETRY // LANES, lane] = placement
            else:
                bits[GEOMETRY // LANES, lane], bits[INSTANCE // LANES, lane] = 0, placement
                # Embree gives an instance's normal in the instance's own space.
                normal = matrix[:, :3].T @ normal * (-1 if np.linalg.det(matrix[:, :3]) < 0 else 1)
            rays[HIT_NORMAL // LANES : HIT_NORMAL // LANES + 3, lane] = normal

    def _scene(self, mask: int) -> tuple:
        """embreex's scene of all that `mask` can see (None where that is nothing), and its geometries' placements."""
        if mask not in self._by_mask:
            self._by_mask[mask] = _build(self._entries, mask)
        return self._by_mask[mask]


def _callbacks() -> dict[str, Callable]:
    packet = ctypes.CFUNCTYPE(None, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_size_t)
    single = ctypes.CFUNCTYPE(None, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_size_t)

    def trace_packet(rows: int) -> Callable:
        def trace(valid: int, scene: int, rays: int, _arguments: int) -> None:
            lanes = np.flatnonzero(_memory(valid, ctypes.c_int32, LANES))
            all_rays = _memory(rays, ctypes.c_float, rows * LANES).reshape(rows, LANES)
            chosen = np.ascontiguousarray(all_rays[:, lanes])
            _scenes[scene].trace(chosen, hits=rows == RAY_HIT_ROWS)
            all_rays[:, lanes] = chosen

        return packet(trace)

    def trace_single(rows: int) -> Callable:
        def trace(scene: int, ray: int, _arguments: int) -> None:
            _scenes[scene].trace(_memory(ray, ctypes.c_float, rows).reshape(rows, 1), hits=rows == RAY_HIT_ROWS)

        return single(trace)

    return {
        "rtcIntersect1": trace_single(RAY_HIT_ROWS),
        "rtcOccluded1": trace_single(RAY_ROWS),
        "rtcIntersect16": trace_packet(RAY_HIT_ROWS),
        "rtcOccluded16": trace_packet(RAY_ROWS),
    }


def _build(entries: Sequence[PlacedTriangles], mask: int) -> tuple:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    placements = [index for index, entry in enumerate(entries) if entry.mask & mask]
    if not placements:
        return None, placements
    scene = EmbreeScene(robust=True)
    for index in placements:
        entry = entries[index]
        vertices = entry.vertices
        if entry.matrix is not None:
            vertices = vertices @ entry.matrix[:, :3].T + entry.matrix[:, 3]
        TriangleMesh(scene, vertices.astype(np.float32), entry.triangles.astype(np.int32))
    return scene, placements


def _vectors(rays: np.ndarray, row: int) -> np.ndarray:
    return np.ascontiguousarray(rays[row // LANES : row // LANES + 3].T)


def _memory(address: int, kind: type, count: int) -> np.ndarray:
    return np.ctypeslib.as_array((kind * count).from_address(address))


#: A function for each name in Embree's tracing interface, callable from C.
CALLBACKS = _callbacks()
