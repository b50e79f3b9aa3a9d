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

from .lobe_record import LOBE_SIZE

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
ALBEDO = 53 * LANES  # (3) of a Lambertian surface
# What a lamp would add if nothing is in the way, before colour; 0 where its shadow ray need not be traced.
LIGHT_WEIGHT = 56 * LANES
# The first surface hit, for the passes.
ALPHA = 57 * LANES
DEPTH = 58 * LANES
NORMAL = 59 * LANES  # (3)
# More of the surface hit last.
MATERIAL = 62 * LANES  # uint32
SIDE = 63 * LANES  # 1 where it was hit from the front, -1 from the back
EMISSION = 64 * LANES  # (3) towards the viewer, W/(m² sr)
LOBE_COUNT = 67 * LANES  # uint32: how many lobes it has; 0: it is Lambertian
# The light sample.
LIGHT_COLOR = 68 * LANES  # (3) where each lane has its own: radiance / (π × the sample's density), or as for `lights`
LIGHT_SPREAD = 71 * LANES  # 1 / the sample's density, steradians; 0 for a light without a size
LIGHT_VISIBILITY = 72 * LANES  # uint32: bits of `scene`
REFLECTED = 73 * LANES  # (3) what of the light the surface reflects to the viewer, × π
# The triangle that the light sample is on.
EMITTER = 76 * LANES  # uint32: its number in `mesh_lights`
CHOSEN_CHANCE = 77 * LANES  # the probability with which it was chosen
CHOSEN_V = 78 * LANES  # barycentric coordinates of the point that was chosen of it
CHOSEN_W = 79 * LANES
# How the path came here, for multiple importance sampling. A ray that passes through a transparent surface remembers.
SPREAD = 80 * LANES  # 1 / the density of its direction, steradians; 0 from the camera and off mirrors
SEES_LAMPS = 81 * LANES  # 1 where lamps that it meets count
RECEIVER = 82 * LANES  # (3) the normal where it last scattered, 0 where light can come from both sides
PASSED = 85 * LANES  # how far it has gone since, through transparent surfaces, metres
# How it goes on.
CHOICE = 86 * LANES  # (2) the point looked up for the choice of a lobe, and for Russian roulette
LAST = 88 * LANES  # 0 while the next surface is shaded, else LAST_OPAQUE or LAST_SURFACE
DIFFUSE_LEFT = 89 * LANES  # the bounces of each kind that are left
GLOSSY_LEFT = 90 * LANES
TRANSMISSION_LEFT = 91 * LANES
TRANSPARENT_LEFT = 92 * LANES
BOUNCES_LEFT = 93 * LANES  # and of all kinds together
# Where a smooth surface's shadow rays start: see `smooth_lift`.
LIFT = 94 * LANES  # metres along SHADING_NORMAL, for light that comes from its side
LIFT_BEYOND = 95 * LANES  # and for light from the other, which is against it
LIFT_BELOW = 96 * LANES  # the cosine to the light below which they are lifted
# An even number of rows, each a cache line: processors fetch lines in pairs (a third faster than with an odd one).
PACKET = 98 * LANES

#: Values of LAST: of the next surface only its emission counts, and what lies straight behind it; only its emission.
LAST_OPAQUE, LAST_SURFACE = np.float32(1), np.float32(2)

#: Rows of an Embree ray and of its hit.
RAY_ROWS, RAY_HIT_ROWS = 12, 21
#: Embree's "no such id".
INVALID = np.uint32(0xFFFFFFFF)
NO_REGISTERS = np.zeros((0, 3), np.float32)


class Batch(NamedTuple):
    """The working memory of one thread: `bits` is a uint32 view of the same memory as `floats`."""

    floats: np.ndarray
    bits: np.ndarray
    ray: np.ndarray  # one RTCRayHit, for rays that are traced alone
    ray_bits: np.ndarray
    lobes: np.ndarray  # the lobes of each lane's surface: see `lobes`
    registers: np.ndarray  # of the programs: see `programs`


def new_batch(packets: int, lobes: int = 0, registers: np.ndarray = NO_REGISTERS) -> Batch:
    """Memory for `packets` packets, aligned as Embree asks (64 bytes), of up to `lobes` lobes for each lane.

    `registers` are the programs' registers as they begin.
    """
    floats, ray = _aligned(packets * PACKET), _aligned(RAY_HIT_ROWS)
    records = np.zeros(packets * LANES * lobes * LOBE_SIZE, np.float32)
    return Batch(floats, floats.view(np.uint32), ray, ray.view(np.uint32), records, registers.copy())


def _aligned(count: int, alignment: int = 64) -> np.ndarray:
    memory = np.zeros(count * 4 + alignment, np.uint8)
    start = -memory.ctypes.data % alignment
    return memory[start : start + count * 4].view(np.float32)
