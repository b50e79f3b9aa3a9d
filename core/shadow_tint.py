"""Shadows through transparent surfaces: what is left of the light after all that it passes straight through."""

from __future__ import annotations

import numpy as np

from .batch import (
    ACTIVE,
    GEOMETRIC_NORMAL,
    INVALID,
    LANES,
    LIGHT_WEIGHT,
    LOBE_COUNT,
    MASK,
    OFFSET,
    ORIGIN,
    PACKET,
    POSITION,
    PRIMITIVE,
    RAY_ROWS,
    REFLECTED,
    SHADOW,
    T_FAR,
    T_NEAR,
    TRANSPARENT_LEFT,
    Batch,
    Y,
    Z,
)
from .jit import kernel
from .lobe_record import KIND, LOBE_SIZE, TRANSPARENT, WEIGHT
from .lobes import first_lobe
from .packing import TINTS_SHADOWS
from .surface import JUST_AHEAD

_ZERO, _ONE = np.float32(0), np.float32(1)


@kernel
def follow_shadow_rays(batch: Batch, side: Batch, packets: int) -> bool:
    """Make rays in `side` of the shadow rays that nothing opaque blocks, to look at what tints them.

    Returns whether there is one.
    """
    any_ray = False
    f, to, to_bits = batch.floats, side.floats, side.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            wanted = (f[i + LIGHT_WEIGHT] > _ZERO) & (f[i + SHADOW + T_FAR] >= _ZERO)
            to[i + ACTIVE] = _ONE if wanted else _ZERO
            any_ray |= wanted
            for row in range(RAY_ROWS):
                to[i + row * LANES] = f[i + SHADOW + row * LANES]
            to_bits[i + MASK] = np.uint32(TINTS_SHADOWS)
            to[i + TRANSPARENT_LEFT] = f[i + TRANSPARENT_LEFT]
    return any_ray


@kernel
def tint_shadows(batch: Batch, side: Batch, lobe_stride: int, packets: int) -> bool:
    """Multiply the light with what passes the surfaces that `side` has hit, and go on behind them.

    Returns whether there is a ray that goes on.
    """
    f, to, to_bits = batch.floats, side.floats, side.bits
    more = False
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if to[i + ACTIVE] == _ZERO:
                continue
            if to_bits[i + PRIMITIVE] == INVALID:
                to[i + ACTIVE] = _ZERO
                continue
            red = green = blue = _ZERO
            first = first_lobe(i, lobe_stride)
            for k in range(np.int64(to_bits[i + LOBE_COUNT])):
                at = first + k * LOBE_SIZE
                if side.lobes[at + KIND] == np.float32(TRANSPARENT):
                    red += side.lobes[at + WEIGHT]
                    green += side.lobes[at + WEIGHT + 1]
                    blue += side.lobes[at + WEIGHT + 2]
            f[i + REFLECTED] *= red
            f[i + REFLECTED + Y] *= green
            f[i + REFLECTED + Z] *= blue
            to[i + TRANSPARENT_LEFT] -= _ONE
            if (max(red, green, blue) <= _ZERO) | (to[i + TRANSPARENT_LEFT] < _ZERO):
                f[i + LIGHT_WEIGHT] = _ZERO
                to[i + ACTIVE] = _ZERO
                continue
            # The normal is on the side that the ray came from.
            step = to[i + OFFSET]
            to[i + ORIGIN] = to[i + POSITION] - step * to[i + GEOMETRIC_NORMAL]
            to[i + ORIGIN + Y] = to[i + POSITION + Y] - step * to[i + GEOMETRIC_NORMAL + Y]
            to[i + ORIGIN + Z] = to[i + POSITION + Z] - step * to[i + GEOMETRIC_NORMAL + Z]
            f[i + SHADOW + T_FAR] -= to[i + T_FAR]
            to[i + T_FAR] = f[i + SHADOW + T_FAR]
            to[i + T_NEAR] = JUST_AHEAD
            more = True
    return more
