"""The world as a light: directions sampled where it is bright, for worlds that are not of one colour."""

from __future__ import annotations

import numpy as np

from .batch import (
    ACTIVE,
    DIRECTION,
    EMISSION,
    LANES,
    LIGHT_COLOR,
    LIGHT_SPREAD,
    LIGHT_VISIBILITY,
    LIGHT_WEIGHT,
    LOBE_COUNT,
    MATERIAL,
    PACKET,
    POINT,
    SHADOW,
    T_FAR,
    Batch,
    Y,
    Z,
    new_batch,
)
from .environment import EnvironmentMap, build_environment, panorama_to_direction, sample_environment
from .jit import kernel
from .materials import run_programs
from .packing import SceneArrays
from .programs import Programs
from .scene import VISIBLE_TO_SURFACES
from .values import EnvironmentTexture
from .warps import INV_PI

_ZERO, _ONE = np.float32(0), np.float32(1)
#: The picture of the world that directions are sampled by is as wide as the widest panorama in it, within these.
_NARROWEST, _WIDEST = 256, 4096


def picture_world(scene: SceneArrays, programs: Programs, registers: np.ndarray) -> EnvironmentMap:
    """Look at the world in all directions, and build the map that directions are sampled by."""
    widths = [texture.pixels.shape[1] for texture in programs.textures if isinstance(texture, EnvironmentTexture)]
    width = min(max([*widths, _NARROWEST]), _WIDEST)
    radiance = np.zeros((width // 2, width, 3), np.float32)
    packets = -(-width // LANES)
    batch = new_batch(packets, scene.materials.largest_lobe_count, registers)
    for row in range(len(radiance)):
        _look(batch, scene.materials.world, radiance, row, packets)
        run_programs(batch, scene, packets)
        _see(batch, radiance, row)
    return build_environment(radiance)


@kernel
def _look(batch: Batch, world: int, radiance: np.ndarray, row: int, packets: int) -> None:
    """Aim the lanes at the middles of a row's cells."""
    height, width = radiance.shape[0], radiance.shape[1]
    v = (np.float32(row) + np.float32(0.5)) / np.float32(height)
    for j in range(packets * LANES):
        i = j // LANES * PACKET + j % LANES
        x, y, z = panorama_to_direction((np.float32(j) + np.float32(0.5)) / np.float32(width), v)
        batch.floats[i + ACTIVE] = _ONE
        batch.bits[i + MATERIAL] = np.uint32(world)
        batch.bits[i + LOBE_COUNT] = np.uint32(0)
        for channel in range(3):
            batch.floats[i + EMISSION + channel * LANES] = _ZERO
        batch.floats[i + DIRECTION] = x
        batch.floats[i + DIRECTION + Y] = y
        batch.floats[i + DIRECTION + Z] = z


@kernel
def _see(batch: Batch, radiance: np.ndarray, row: int) -> None:
    for j in range(radiance.shape[1]):
        i = j // LANES * PACKET + j % LANES
        for channel in range(3):
            radiance[row, j, channel] = batch.floats[i + EMISSION + channel * LANES]


@kernel
def sample_world(batch: Batch, side: Batch, environment: EnvironmentMap, world: int, packets: int) -> None:
    """Choose a direction by the points looked up last, for every lane, and look there in `side`.

    `world` is the world's material.
    """
    f, bits, to, to_bits = batch.floats, batch.bits, side.floats, side.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            to[i + ACTIVE] = f[i + ACTIVE]
            f[i + LIGHT_WEIGHT] = f[i + ACTIVE]
            if f[i + ACTIVE] == _ZERO:
                continue
            x, y, z, density = sample_environment(environment, f[i + POINT], f[i + POINT + Y])
            spread = _ONE / density
            f[i + LIGHT_SPREAD] = spread
            f[i + LIGHT_COLOR] = f[i + LIGHT_COLOR + Y] = f[i + LIGHT_COLOR + Z] = spread * INV_PI
            f[i + SHADOW + DIRECTION] = x
            f[i + SHADOW + DIRECTION + Y] = y
            f[i + SHADOW + DIRECTION + Z] = z
            f[i + SHADOW + T_FAR] = np.float32(np.inf)
            bits[i + LIGHT_VISIBILITY] = np.uint32(VISIBLE_TO_SURFACES)
            to[i + DIRECTION] = x
            to[i + DIRECTION + Y] = y
            to[i + DIRECTION + Z] = z
            to_bits[i + MATERIAL] = np.uint32(world)
            to_bits[i + LOBE_COUNT] = np.uint32(0)
            to[i + EMISSION] = to[i + EMISSION + Y] = to[i + EMISSION + Z] = _ZERO
