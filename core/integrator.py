"""The integrator: from sample numbers to radiance, a batch at a time.

It is the textbook's path tracer over Lambertian surfaces (Kajiya 1986): at each surface every lamp is sampled once
(next-event estimation), and one cosine-weighted direction carries the path on. That direction also brings the
light of the world and of glowing surfaces, so `max_bounces` 0 is direct light from everything that shines. A stage
that cannot change the picture is not run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    DIRECTION,
    GEOMETRIC_NORMAL,
    LANES,
    OFFSET,
    ORIGIN,
    PACKET,
    POINT,
    POSITION,
    RADIANCE,
    SHADING_NORMAL,
    T_FAR,
    T_NEAR,
    THROUGHPUT,
    Batch,
    Y,
    Z,
)
from .camera import CameraArrays, aim_through_lens, aim_through_pinhole, start_rays
from .domains import PointTable, look_up_points
from .embree import Traversal, intersect_coherent, intersect_incoherent, occluded_coherent, occluded_incoherent
from .jit import kernel
from .lights import LightArrays, add_light, sample_light, to_world
from .packing import SceneArrays
from .scene import VISIBLE_TO_CAMERA, VISIBLE_TO_SHADOWS, VISIBLE_TO_SURFACES
from .surface import JUST_AHEAD, find_surfaces, record_first_hits
from .warps import square_to_cosine_hemisphere

_ZERO, _ONE = np.float32(0), np.float32(1)


class Frame(NamedTuple):
    """All that stays the same through a render."""

    scene: SceneArrays
    traversal: Traversal
    camera: CameraArrays
    lights: LightArrays
    world: np.ndarray  # (3,) float32: radiance of the background
    backdrop: np.ndarray  # (3,) float32: the background as the camera sees it
    world_shines: bool
    surfaces_shine: bool
    max_bounces: int
    pixel_points: PointTable
    lens_points: PointTable
    light_points: PointTable
    bsdf_points: PointTable


@kernel
def trace_samples(batch: Batch, frame: Frame, blocks: np.ndarray, first: int, packets: int) -> None:
    """Fill RADIANCE and the first hits' passes for samples `first` and on of a tile, numbered as in `domains`.

    `blocks` is (B, 2) int64: the lower left pixel of each block of 4×4 pixels.
    """
    count = packets * LANES
    _begin(batch, packets)
    look_up_points(batch, frame.pixel_points, 0, blocks, first, count)
    start_rays(batch, frame.camera, blocks, first, frame.pixel_points.points.shape[2], count)
    if frame.camera.lens_radius > _ZERO:
        look_up_points(batch, frame.lens_points, 0, blocks, first, count)
        aim_through_lens(batch, frame.camera, packets)
    else:
        aim_through_pinhole(batch, frame.camera, packets)
    intersect_coherent(batch, frame.traversal, VISIBLE_TO_CAMERA, packets)
    find_surfaces(batch, frame.scene, frame.backdrop, packets)
    record_first_hits(batch, packets)
    for bounce in range(frame.max_bounces + 1):
        for light in range(len(frame.lights.kind)):
            dimension = bounce * len(frame.lights.kind) + light
            if frame.lights.extended[light]:
                look_up_points(batch, frame.light_points, dimension, blocks, first, count)
            sample_light(batch, frame.lights, light, packets)
            if frame.lights.cast_shadow[light]:
                occluded_coherent(batch, frame.traversal, VISIBLE_TO_SHADOWS, packets)
            add_light(batch, frame.lights, light, packets)
        last = bounce == frame.max_bounces
        if last and not (frame.world_shines or frame.surfaces_shine):
            break
        look_up_points(batch, frame.bsdf_points, bounce, blocks, first, count)
        _scatter(batch, packets)
        if last and not frame.surfaces_shine:
            occluded_incoherent(batch, frame.traversal, VISIBLE_TO_SURFACES, packets)
            _add_world(batch, frame.world, packets)
        else:
            intersect_incoherent(batch, frame.traversal, VISIBLE_TO_SURFACES, packets)
            find_surfaces(batch, frame.scene, frame.world, packets)


@kernel
def _begin(batch: Batch, packets: int) -> None:
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            f[i + THROUGHPUT] = f[i + THROUGHPUT + Y] = f[i + THROUGHPUT + Z] = _ONE
            f[i + RADIANCE] = f[i + RADIANCE + Y] = f[i + RADIANCE + Z] = _ZERO
            # A ray that misses keeps this: what an earlier batch left could be NaN, which survives a factor of 0.
            f[i + ALBEDO] = f[i + ALBEDO + Y] = f[i + ALBEDO + Z] = _ZERO


@kernel
def _scatter(batch: Batch, packets: int) -> None:
    """Send each active path on in a cosine-weighted direction about the shading normal.

    For a Lambertian surface albedo/π × cosine / density is the albedo itself. A direction behind the triangle, which a
    smooth normal can give, ends the path: nothing can come from there.
    """
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            x, y, z = square_to_cosine_hemisphere(f[i + POINT], f[i + POINT + Y])
            x, y, z = to_world(x, y, z, f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z])
            gx, gy, gz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
            f[i + ACTIVE] = f[i + ACTIVE] if x * gx + y * gy + z * gz > _ZERO else _ZERO
            f[i + ORIGIN] = f[i + POSITION] + f[i + OFFSET] * gx
            f[i + ORIGIN + Y] = f[i + POSITION + Y] + f[i + OFFSET] * gy
            f[i + ORIGIN + Z] = f[i + POSITION + Z] + f[i + OFFSET] * gz
            f[i + DIRECTION] = x
            f[i + DIRECTION + Y] = y
            f[i + DIRECTION + Z] = z
            f[i + T_NEAR] = JUST_AHEAD
            f[i + T_FAR] = np.float32(np.inf)
            f[i + THROUGHPUT] *= f[i + ALBEDO]
            f[i + THROUGHPUT + Y] *= f[i + ALBEDO + Y]
            f[i + THROUGHPUT + Z] *= f[i + ALBEDO + Z]


@kernel
def _add_world(batch: Batch, world: np.ndarray, packets: int) -> None:
    """Add the background's radiance (3,) to the paths that nothing blocks."""
    f = batch.floats
    red, green, blue = world[0], world[1], world[2]
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            seen = f[i + ACTIVE] if f[i + T_FAR] >= _ZERO else _ZERO
            f[i + RADIANCE] += seen * red * f[i + THROUGHPUT]
            f[i + RADIANCE + Y] += seen * green * f[i + THROUGHPUT + Y]
            f[i + RADIANCE + Z] += seen * blue * f[i + THROUGHPUT + Z]
