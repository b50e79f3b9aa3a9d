"""A batch: the samples that go through the stages together, kept in packets of 16 lanes.

A packet is what Embree traces at once and what one AVX-512 register holds. All that is known of its 16 samples lies in
one run of memory, row after row of 16 numbers: `floats[p * PACKET + ROW + lane]`. One flat array with constant offsets
is what lets LLVM see that rows do not overlap, and turn a stage's loop over the lanes into SIMD (3 times faster than
the same loop over a (packets, rows, 16) array). A batch is made once per thread and used again: small enough to stay
in a core's own cache.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LANES = 16

#: From one component of a vector to the next.
Y, Z = LANES, 2 * LANES

# Embree's RTCRayHit16 (rtcore_ray.h): the ray in world space, re-centred, then the hit.
ORIGIN = 0 * LANES
T_NEAR = 3 * LANES
DIRECTION = 4 * LANES
TIME = 7 * LANES
T_FAR = 8 * LANES
MASK = 9 * LANES
HIT_NORMAL = 12 * LANES
HIT_V = 15 * LANES
HIT_W = 16 * LANES
PRIMITIVE = 17 * LANES
GEOMETRY = 18 * LANES
INSTANCE = 19 * LANES
# Embree's RTCRay16, of the shadow ray, and the lanes that a trace is asked for.
SHADOW = 21 * LANES
TRACED = 33 * LANES
# The path.
ACTIVE = 34 * LANES  # 1 where it goes on, 0 where it has ended
POINT = 35 * LANES  # (2) the sample point looked up last, in [0, 1)²
THROUGHPUT = 37 * LANES  # (3)
RADIANCE = 40 * LANES  # (3) gathered so far, W/(m² sr)
# The surface hit last.
POSITION = 43 * LANES  # (3)
OFFSET = 46 * LANES  # how far to step off it so that rounding cannot put a ray behind it, metres
GEOMETRIC_NORMAL = 47 * LANES  # (3) unit, towards the viewer
SHADING_NORMAL = 50 * LANES  # (3) unit, on the same side
ALBEDO = 53 * LANES  # (3)
# What a lamp would add if nothing is in the way, before colour; 0 where its shadow ray need not be traced.
LIGHT_WEIGHT = 56 * LANES
# The first surface hit, for the passes.
ALPHA = 57 * LANES
DEPTH = 58 * LANES
NORMAL = 59 * LANES  # (3)
PACKET = 62 * LANES

#: Rows of an Embree ray and of its hit.
RAY_ROWS, RAY_HIT_ROWS = 12, 21
#: Embree's "no such id".
INVALID = np.uint32(0xFFFFFFFF)


class Batch(NamedTuple):
    """The working memory of one thread: `bits` is a uint32 view of the same memory as `floats`."""

    floats: np.ndarray
    bits: np.ndarray
    ray: np.ndarray  # one RTCRayHit, for rays that are traced alone
    ray_bits: np.ndarray


def new_batch(packets: int) -> Batch:
    """Memory for `packets` packets, aligned as Embree asks (64 bytes)."""
    floats, ray = _aligned(packets * PACKET), _aligned(RAY_HIT_ROWS)
    return Batch(floats, floats.view(np.uint32), ray, ray.view(np.uint32))


def _aligned(count: int, alignment: int = 64) -> np.ndarray:
    memory = np.zeros(count * 4 + alignment, np.uint8)
    start = -memory.ctypes.data % alignment
    return memory[start : start + count * 4].view(np.float32)
