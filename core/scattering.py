"""Scattering: where a path goes on from a surface, and when it ends.

A path ends where it is absorbed, where it has used up its bounces, or by Russian roulette (Arvo and Kirk 1990): from
ROULETTE_FROM surfaces on, those included that it passed straight through, it survives with the probability of its
throughput, which is divided by it, so that the mean stays what it is. A ray whose bounces are used up still goes to the
next surface, and sees what that emits. Of transparent surfaces it passes one more than shadow rays do, as in Cycles.
"""

from __future__ import annotations

import math

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    BOUNCES_LEFT,
    CHOICE,
    DIFFUSE_LEFT,
    DIRECTION,
    GEOMETRIC_NORMAL,
    GLOSSY_LEFT,
    INVALID,
    LANES,
    LAST,
    LAST_OPAQUE,
    LAST_SURFACE,
    LOBE_COUNT,
    MASK,
    OFFSET,
    ORIGIN,
    PACKET,
    PASSED,
    POINT,
    POSITION,
    PRIMITIVE,
    RECEIVER,
    SEES_LAMPS,
    SHADING_NORMAL,
    SPREAD,
    T_FAR,
    T_NEAR,
    THROUGHPUT,
    TRANSMISSION_LEFT,
    TRANSPARENT_LEFT,
    Batch,
    Y,
    Z,
)
from .frames import to_world
from .jit import device, kernel
from .lobe_record import KIND, LOBE_SIZE, TRANSPARENT
from .lobes import (
    ABSORBED,
    DIFFUSE_REFLECTION,
    DIFFUSE_TRANSMISSION,
    GLOSSY_REFLECTION,
    STRAIGHT,
    first_lobe,
    sample_lobes,
)
from .scene import VISIBLE_TO_CAMERA, VISIBLE_TO_DIFFUSE, VISIBLE_TO_GLOSSY, VISIBLE_TO_TRANSMISSION
from .surface import JUST_AHEAD
from .warps import PI, square_to_cosine_hemisphere

_ZERO, _ONE = np.float32(0), np.float32(1)
#: A path is sure to live for so many surfaces. Ending it earlier saves rays but costs more noise (measured in a box
#: of albedo 0.5 and 0.8).
ROULETTE_FROM = 3


@kernel
def scatter_diffusely(batch: Batch, roulette: bool, packets: int) -> None:
    """Where all surfaces are Lambertian: send each path on in a cosine-weighted direction about the shading normal.

    For a Lambertian surface albedo/π × cosine / density is the albedo itself. A direction behind the triangle, which a
    smooth normal can give, ends the path: nothing can come from there.
    """
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            nx, ny, nz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
            lx, ly, cosine = square_to_cosine_hemisphere(f[i + POINT], f[i + POINT + Y])
            x, y, z = to_world(lx, ly, cosine, nx, ny, nz)
            gx, gy, gz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
            f[i + ACTIVE] = f[i + ACTIVE] if x * gx + y * gy + z * gz > _ZERO else _ZERO
            _start_ray(f, bits, i, x, y, z, gx, gy, gz)
            bits[i + MASK] = np.uint32(VISIBLE_TO_DIFFUSE)
            f[i + RECEIVER] = nx
            f[i + RECEIVER + Y] = ny
            f[i + RECEIVER + Z] = nz
            f[i + BOUNCES_LEFT] -= _ONE
            f[i + SPREAD] = PI / max(cosine, np.float32(1e-12))
            f[i + THROUGHPUT] *= f[i + ALBEDO]
            f[i + THROUGHPUT + Y] *= f[i + ALBEDO + Y]
            f[i + THROUGHPUT + Z] *= f[i + ALBEDO + Z]
    if roulette:
        _play_roulette(batch, packets)


@kernel
def _play_roulette(batch: Batch, packets: int) -> None:
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            _survive(f, i)


@device
def _survive(f: np.ndarray, i: int) -> None:
    most = max(f[i + THROUGHPUT], f[i + THROUGHPUT + Y], f[i + THROUGHPUT + Z])
    chance = min(most, _ONE)
    lives = f[i + CHOICE + Y] < chance
    scale = _ONE / chance if lives else _ZERO
    f[i + ACTIVE] = f[i + ACTIVE] if lives else _ZERO
    f[i + THROUGHPUT] *= scale
    f[i + THROUGHPUT + Y] *= scale
    f[i + THROUGHPUT + Z] *= scale


@kernel
def scatter(batch: Batch, lobe_stride: int, clip_end: float, roulette: bool, packets: int) -> None:
    """Send each path on from whatever surface it is on, in a direction sampled from the surface's BSDF.

    A camera's ray that passes straight through still ends at `clip_end`.
    """
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if f[i + ACTIVE] == _ZERO:
                continue
            gx, gy, gz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
            count = np.int64(bits[i + LOBE_COUNT])
            if count == 0:
                x, y, z, r, g, b, density, event = _sample_lambert(f, i, gx, gy, gz)
            else:
                x, y, z, r, g, b, density, event = _sample(batch, lobe_stride, i, count, gx, gy, gz)
            f[i + THROUGHPUT] *= r
            f[i + THROUGHPUT + Y] *= g
            f[i + THROUGHPUT + Z] *= b
            if (event == ABSORBED) | (max(r, g, b) <= _ZERO):
                f[i + ACTIVE] = _ZERO
                continue
            ahead = x * gx + y * gy + z * gz > _ZERO
            sign = _ONE if ahead else -_ONE
            if event == STRAIGHT:
                f[i + PASSED] += f[i + T_FAR]
            _start_ray(f, bits, i, x, y, z, sign * gx, sign * gy, sign * gz)
            if event == STRAIGHT:
                if bits[i + MASK] == np.uint32(VISIBLE_TO_CAMERA):
                    f[i + T_FAR] = clip_end - f[i + PASSED]
                _pass_through(f, i)
            else:
                _remember(f, bits, i, count, density, event)
                _use_up(f, i, event)
                if roulette:
                    _survive(f, i)


@device
def _sample_lambert(
    f: np.ndarray, i: int, gx: float, gy: float, gz: float
) -> tuple[float, float, float, float, float, float, float, int]:
    """As `lobes.sample_lobes`, for the Lambertian surface of lane i."""
    lx, ly, cosine = square_to_cosine_hemisphere(f[i + POINT], f[i + POINT + Y])
    x, y, z = to_world(lx, ly, cosine, f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z])
    event = DIFFUSE_REFLECTION if x * gx + y * gy + z * gz > _ZERO else ABSORBED
    density = max(cosine, np.float32(1e-12)) / PI
    return x, y, z, f[i + ALBEDO], f[i + ALBEDO + Y], f[i + ALBEDO + Z], density, event


@device
def _sample(
    batch: Batch, lobe_stride: int, i: int, count: int, gx: float, gy: float, gz: float
) -> tuple[float, float, float, float, float, float, float, int]:
    f = batch.floats
    vx, vy, vz = f[i + DIRECTION], f[i + DIRECTION + Y], f[i + DIRECTION + Z]
    scale = -_ONE / np.float32(math.sqrt(vx * vx + vy * vy + vz * vz))
    first = first_lobe(i, lobe_stride)
    choice, u, v = f[i + CHOICE], f[i + POINT], f[i + POINT + Y]
    return sample_lobes(batch.lobes, first, count, vx * scale, vy * scale, vz * scale, gx, gy, gz, choice, u, v)


@device
def _start_ray(
    f: np.ndarray, bits: np.ndarray, i: int, x: float, y: float, z: float, nx: float, ny: float, nz: float
) -> None:
    """Start a ray a step off the surface, on the side of (nx, ny, nz)."""
    f[i + ORIGIN] = f[i + POSITION] + f[i + OFFSET] * nx
    f[i + ORIGIN + Y] = f[i + POSITION + Y] + f[i + OFFSET] * ny
    f[i + ORIGIN + Z] = f[i + POSITION + Z] + f[i + OFFSET] * nz
    f[i + DIRECTION] = x
    f[i + DIRECTION + Y] = y
    f[i + DIRECTION + Z] = z
    f[i + T_NEAR] = JUST_AHEAD
    f[i + T_FAR] = np.float32(np.inf)
    bits[i + PRIMITIVE] = INVALID


@device
def _pass_through(f: np.ndarray, i: int) -> None:
    """A transparent surface is no bounce, and the ray stays of the kind that it was."""
    f[i + TRANSPARENT_LEFT] -= _ONE
    if f[i + TRANSPARENT_LEFT] < _ZERO:
        f[i + LAST] = LAST_SURFACE


@device
def _remember(f: np.ndarray, bits: np.ndarray, i: int, count: int, density: float, event: int) -> None:
    """Keep what the other side of multiple importance sampling has to know of this ray, and what it is to hit."""
    reflects = event in (DIFFUSE_REFLECTION, GLOSSY_REFLECTION)
    facing = _ONE if reflects & (count == 0) else _ZERO
    f[i + RECEIVER] = facing * f[i + SHADING_NORMAL]
    f[i + RECEIVER + Y] = facing * f[i + SHADING_NORMAL + Y]
    f[i + RECEIVER + Z] = facing * f[i + SHADING_NORMAL + Z]
    f[i + SPREAD] = _ONE / density if density > _ZERO else _ZERO
    f[i + SEES_LAMPS] = _ONE if count > 0 else _ZERO
    f[i + PASSED] = _ZERO
    if event in (DIFFUSE_REFLECTION, DIFFUSE_TRANSMISSION):
        bits[i + MASK] = np.uint32(VISIBLE_TO_DIFFUSE)
    elif event == GLOSSY_REFLECTION:
        bits[i + MASK] = np.uint32(VISIBLE_TO_GLOSSY)
    else:
        bits[i + MASK] = np.uint32(VISIBLE_TO_TRANSMISSION)


@device
def _use_up(f: np.ndarray, i: int, event: int) -> None:
    """Count the bounce, for all and for its kind."""
    row = TRANSMISSION_LEFT
    if event == DIFFUSE_REFLECTION:
        row = DIFFUSE_LEFT
    elif event == GLOSSY_REFLECTION:
        row = GLOSSY_LEFT
    f[i + row] -= _ONE
    f[i + BOUNCES_LEFT] -= _ONE
    if (f[i + row] < _ZERO) | (f[i + BOUNCES_LEFT] < _ZERO):
        f[i + LAST] = LAST_OPAQUE


@device
def end_last(batch: Batch, lobe_stride: int, i: int) -> None:
    """End the path of lane i, which has used up its bounces; where light goes straight through it may go on."""
    f, bits = batch.floats, batch.bits
    kept = np.int64(0)
    if f[i + LAST] == LAST_OPAQUE:
        kept = _keep_transparent(batch, first_lobe(i, lobe_stride), i)
    bits[i + LOBE_COUNT] = np.uint32(kept)
    f[i + ACTIVE] = _ONE if kept > 0 else _ZERO


@device
def _keep_transparent(batch: Batch, first: int, i: int) -> int:
    """Move the transparent lobes of lane i to the front; their count."""
    kept = np.int64(0)
    for k in range(np.int64(batch.bits[i + LOBE_COUNT])):
        if batch.lobes[first + k * LOBE_SIZE + KIND] == np.float32(TRANSPARENT):
            for j in range(LOBE_SIZE):
                batch.lobes[first + kept * LOBE_SIZE + j] = batch.lobes[first + k * LOBE_SIZE + j]
            kept += 1
    return kept
