"""The integrator: from sample numbers to radiance, a batch at a time.

It is the textbook's path tracer (Kajiya 1986) with next-event estimation: at each surface every lamp is sampled (one of
them, where there are many), one point of the glowing meshes and one direction of the world where that varies; and one
direction sampled from the BSDF carries the path on, and gathers what it meets. Light that can be found both ways is
weighted by multiple importance sampling (Veach 1997). `max_bounces` 0 is direct light from everything that shines. A
stage that cannot change the picture is not run: where all surfaces are Lambertian, the stages are those for that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .batch import (
    ACTIVE,
    ALBEDO,
    BOUNCES_LEFT,
    CHOICE,
    DIFFUSE_LEFT,
    GLOSSY_LEFT,
    INVALID,
    LANES,
    LAST,
    LAST_SURFACE,
    LOBE_COUNT,
    PACKET,
    PASSED,
    POINT,
    PRIMITIVE,
    RADIANCE,
    RECEIVER,
    SEES_LAMPS,
    SPREAD,
    T_FAR,
    THROUGHPUT,
    TRANSMISSION_LEFT,
    TRANSPARENT_LEFT,
    Batch,
    Y,
    Z,
)
from .camera import CameraArrays, aim_through_lens, aim_through_pinhole, start_rays
from .denoising import add_albedos
from .direct_light import Clamp, add_light, add_reflected, reflect, reflect_diffusely
from .domains import PointTable, Run, look_up_points
from .embree import Traversal, intersect_coherent, intersect_incoherent, occluded_coherent, occluded_incoherent
from .emission import add_emission, add_lamps
from .environment import EnvironmentMap
from .film import TileSums, add_samples
from .jit import device, kernel
from .light_arrays import LightArrays
from .lights import describe_light, narrow_to_cone, sample_chosen_lights, sample_light
from .materials import run_programs
from .mesh_lights import MeshLights, color_light, sample_mesh_lights, visit_emitters
from .packing import SceneArrays
from .scattering import ROULETTE_FROM, end_last, scatter, scatter_diffusely
from .scene import VISIBLE_TO_SHADOWS
from .shadow_tint import follow_shadow_rays, tint_shadows
from .surface import find_surfaces, record_first_hits
from .world_light import sample_world

_ZERO, _ONE = np.float32(0), np.float32(1)


class Limits(NamedTuple):
    """How often a path may be reflected or pass on, in all and by kind."""

    bounces: int
    diffuse: int
    glossy: int
    transmission: int
    transparent: int


class Ways(NamedTuple):
    """Which stages the scene needs."""

    only_diffuse: bool  # all surfaces are Lambertian
    has_programs: bool
    chooses_lamps: bool  # there are so many that one is chosen
    has_emitters: bool  # glowing meshes to be sampled
    emitters_vary: bool  # and their materials have programs
    has_environment: bool  # a world to be sampled
    shines: bool  # a ray can meet a glowing surface or the world
    surfaces_shine: bool
    lamps_can_be_met: bool
    can_pass: bool  # light can go straight through a surface
    hide_world: bool  # from the camera: the film is transparent
    wants_albedo: bool  # for denoising
    # At each surface: one of each lamp, or after the first of them one of all others; then one of all glowing meshes,
    # if there are any; then one of the world, if that is sampled.
    light_samples: int
    steps: int  # surfaces at which a path can be lit and scattered, or pass straight through


class Points(NamedTuple):
    """The sample points of each domain."""

    pixel: PointTable
    lens: PointTable
    light: PointTable
    bsdf: PointTable


class Frame(NamedTuple):
    """All that stays the same through a render."""

    scene: SceneArrays
    traversal: Traversal
    camera: CameraArrays
    lights: LightArrays
    emitters: MeshLights
    environment: EnvironmentMap
    limits: Limits
    clamp: Clamp
    ways: Ways
    points: Points


class Block(NamedTuple):
    """Which samples a batch holds: see `domains.look_up_points`."""

    blocks: np.ndarray
    run: Run
    first: int
    packets: int


@kernel
def render_blocks(
    batch: Batch, side: Batch, frame: Frame, blocks: np.ndarray, run: Run, sums: TileSums, stop: np.ndarray
) -> None:
    """Render the samples `run` of each pixel of `blocks`, batch after batch, into `sums`, as long as `stop` (1,) is 0.

    `blocks` is (B, 2) int64: the lower left pixel of each block of 4×4 pixels, whose samples are numbered as in
    `domains`. `side` is a second batch, for looking at other points than the paths' own while these wait.
    """
    ways, scene, traversal = frame.ways, frame.scene, frame.traversal
    samples, lobe_stride = run.count, scene.materials.largest_lobe_count
    capacity = len(batch.floats) // PACKET
    # A block's 16 pixels times n samples are n whole packets.
    total = len(blocks) * samples
    for first in range(0, total, capacity):
        if stop[0]:
            return
        packets = min(capacity, total - first)
        block = Block(blocks, run, first * LANES, packets)
        _begin(batch, frame.limits, packets)
        _shoot_camera_rays(batch, frame.camera, frame.points, block)
        intersect_coherent(batch, traversal, packets)
        for step in range(ways.steps + 1):
            # Arrive: turn hits into surfaces, add what the rays have met, and end those paths that end here.
            if ways.lamps_can_be_met and step > 0:
                add_lamps(batch, frame.lights, frame.clamp, packets)
            find_surfaces(batch, scene, packets)
            if step == 0:
                record_first_hits(batch, packets)
            if ways.has_programs:
                run_programs(batch, scene, packets)
            if ways.wants_albedo and step == 0:
                add_albedos(batch, sums, scene.materials, ways.hide_world, block.first, samples, packets)
            if ways.shines:
                world = scene.materials.world
                add_emission(batch, world, frame.emitters, frame.environment, ways.hide_world, frame.clamp, packets)
            if not _end_paths(batch, lobe_stride, sums, packets) or step == ways.steps:
                break
            # Light the surfaces.
            for sample in range(ways.light_samples):
                _sample_a_light(batch, side, frame, block, step, sample)
            # Scatter, and go on.
            last = step == ways.steps - 1
            if last and not (ways.shines or ways.lamps_can_be_met):
                break
            _scatter(batch, frame, lobe_stride, block, step)
            if last and not (ways.surfaces_shine or ways.lamps_can_be_met or ways.can_pass):
                _look_at_world(batch, traversal, packets)
            else:
                intersect_incoherent(batch, traversal, packets)
        add_samples(sums, batch, not ways.hide_world, first * LANES, samples, packets * LANES)


@kernel
def _begin(batch: Batch, limits: Limits, packets: int) -> None:
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            f[i + THROUGHPUT] = f[i + THROUGHPUT + Y] = f[i + THROUGHPUT + Z] = _ONE
            f[i + RADIANCE] = f[i + RADIANCE + Y] = f[i + RADIANCE + Z] = _ZERO
            # A ray that misses keeps this: what an earlier batch left could be NaN, which survives a factor of 0.
            f[i + ALBEDO] = f[i + ALBEDO + Y] = f[i + ALBEDO + Z] = _ZERO
            bits[i + LOBE_COUNT] = np.uint32(0)
            f[i + SPREAD] = f[i + SEES_LAMPS] = f[i + PASSED] = f[i + LAST] = _ZERO
            f[i + RECEIVER] = f[i + RECEIVER + Y] = f[i + RECEIVER + Z] = _ZERO
            f[i + BOUNCES_LEFT] = np.float32(limits.bounces)
            f[i + DIFFUSE_LEFT] = np.float32(limits.diffuse)
            f[i + GLOSSY_LEFT] = np.float32(limits.glossy)
            f[i + TRANSMISSION_LEFT] = np.float32(limits.transmission)
            f[i + TRANSPARENT_LEFT] = np.float32(limits.transparent)


@device
def _shoot_camera_rays(batch: Batch, camera: CameraArrays, points: Points, block: Block) -> None:
    _look_up(batch, POINT, points.pixel, 0, block)
    count = block.packets * LANES
    start_rays(batch, camera, block.blocks, block.first, block.run.count, count)
    if camera.lens_radius > _ZERO:
        _look_up(batch, POINT, points.lens, 0, block)
        aim_through_lens(batch, camera, block.packets)
    else:
        aim_through_pinhole(batch, camera, block.packets)


@device
def _look_up(batch: Batch, row: int, table: PointTable, dimension: int, block: Block) -> None:
    look_up_points(batch, row, table, dimension, block.blocks, block.run, block.first, block.packets * LANES)


@kernel
def _end_paths(batch: Batch, lobe_stride: int, sums: TileSums, packets: int) -> bool:
    """End the paths that have met nothing, or used up their bounces. Returns whether any goes on."""
    f, bits = batch.floats, batch.bits
    more = False
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if f[i + ACTIVE] > _ZERO:
                if bits[i + PRIMITIVE] == INVALID:
                    f[i + ACTIVE] = _ZERO
                elif f[i + LAST] > _ZERO:
                    if f[i + LAST] == LAST_SURFACE:
                        sums.blocked[0] += 1
                    end_last(batch, lobe_stride, i)
            more |= f[i + ACTIVE] > _ZERO
    return more


@device
def _sample_a_light(batch: Batch, side: Batch, frame: Frame, block: Block, step: int, sample: int) -> None:
    """Take light sample number `sample` at the surfaces that the paths have reached, and add its light."""
    ways, lights, scene, packets = frame.ways, frame.lights, frame.scene, block.packets
    is_lamp = sample < lights.each
    rest = sample - lights.each
    if not is_lamp or lights.extended[sample]:
        _look_up(batch, POINT, frame.points.light, step * ways.light_samples + sample, block)
    looks_aside = False
    if is_lamp:
        sample_light(batch, lights, sample, packets)
        if not ways.only_diffuse:
            describe_light(batch, lights, sample, packets)
        if lights.spot[sample]:
            narrow_to_cone(batch, lights, sample, packets)
    elif ways.chooses_lamps and rest == 0:
        sample_chosen_lights(batch, lights, packets)
    elif ways.has_emitters and rest == ways.chooses_lamps:
        sample_mesh_lights(batch, frame.emitters, scene.materials.emission, packets)
        if ways.emitters_vary:
            visit_emitters(batch, side, frame.emitters, scene, packets)
            find_surfaces(side, scene, packets)
            looks_aside = True
    else:
        sample_world(batch, side, frame.environment, scene.materials.world, packets)
        looks_aside = True
    if looks_aside:
        run_programs(side, scene, packets)
        color_light(batch, side, packets)
    if is_lamp and ways.only_diffuse:
        reflect_diffusely(batch, packets)
    else:
        reflect(batch, scene.materials.largest_lobe_count, rest >= ways.chooses_lamps, packets)
    if not is_lamp or lights.cast_shadow[sample]:
        occluded_coherent(batch, frame.traversal, VISIBLE_TO_SHADOWS, packets)
        more = ways.can_pass and follow_shadow_rays(batch, side, packets)
        while more:
            intersect_incoherent(side, frame.traversal, packets)
            find_surfaces(side, scene, packets)
            run_programs(side, scene, packets)
            more = tint_shadows(batch, side, scene.materials.largest_lobe_count, packets)
    if is_lamp and ways.only_diffuse:
        add_light(batch, lights, sample, frame.clamp, packets)
    else:
        add_reflected(batch, frame.clamp, packets)


@device
def _scatter(batch: Batch, frame: Frame, lobe_stride: int, block: Block, step: int) -> None:
    """Send the paths on from the surfaces that they have reached."""
    ways, points = frame.ways, frame.points.bsdf
    roulette = step >= ROULETTE_FROM
    if roulette or not ways.only_diffuse:
        _look_up(batch, CHOICE, points, ways.steps + step, block)
    _look_up(batch, POINT, points, step, block)
    if ways.only_diffuse:
        scatter_diffusely(batch, roulette, block.packets)
    else:
        scatter(batch, lobe_stride, frame.camera.clip_end, roulette, block.packets)


@kernel
def _look_at_world(batch: Batch, traversal: Traversal, packets: int) -> None:
    """The last stretch, where only the world can be met: ask no more than whether something is in the way."""
    f = batch.floats
    occluded_incoherent(batch, traversal, packets)
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            f[i + ACTIVE] = f[i + ACTIVE] if f[i + T_FAR] >= _ZERO else _ZERO
