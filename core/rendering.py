"""Rendering: tiles of the picture, spread over threads.

Tiles and the blocks of 4×4 pixels in them lie on a grid that is fixed to the full frame, and a block is always
rendered whole, so that a packet holds the same rays whatever the border, the tiles, the batches or the threads.
"""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np

from .batch import Batch, new_batch
from .camera import check_camera, pack_camera
from .direct_light import Clamp
from .domains import make_table
from .environment import NO_ENVIRONMENT
from .errors import SettingsError
from .film import PASSES, Film, develop, new_tile_sums
from .filters import offset_table
from .instructions import NONE
from .integrator import Frame, Limits, Points, Ways, render_blocks
from .lights import LightArrays, pack_lights
from .materials import fill_constants
from .mesh_lights import find_mesh_lights
from .packing import PackedScene, pack_scene
from .scattering import ROULETTE_FROM
from .scene import VISIBLE_TO_DIFFUSE, VISIBLE_TO_SURFACES, Scene
from .settings import RenderSettings
from .shared_use import SharedUse
from .world_light import picture_world

BLOCK = 4
#: How often the calling thread looks whether it should stop, in seconds.
POLL = 0.02


@dataclass(frozen=True)
class Tile:
    """A finished part of the picture: `passes` as in `Film`, `x` and `y` its lower left pixel in the full frame."""

    x: int
    y: int
    width: int
    height: int
    passes: dict[str, np.ndarray]
    done: int
    total: int


def render(
    scene: Scene,
    settings: RenderSettings,
    on_tile: Callable[[Tile], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> Film:
    """Render `scene`.

    `on_tile` is called from the calling thread as each tile is finished, `should_cancel` about 50 times a second. When
    that answers True the film comes back with the tiles that are done, and its `cancelled` set.

    Raises:
        SceneError: the scene cannot be rendered; the text says what to mend.
        SettingsError: the settings do not fit the scene.
    """
    start = time.perf_counter()
    check_camera(scene.camera)
    left, bottom, right, top = _region(scene, settings)
    film = _new_film(left, bottom, right, top, scene, settings)
    packed = pack_scene(scene, settings.thread_count)
    embree = SharedUse(packed.embree.close)
    try:
        frame, registers = _make_frame(scene, settings, packed)
        workspace = functools.partial(_new_workspace, frame, registers)
        film.cancelled = not _load_kernels(frame, workspace, should_cancel)
        film.setup_seconds = time.perf_counter() - start
        start = time.perf_counter()
        if not film.cancelled:
            _render_tiles(film, frame, workspace, embree, settings, on_tile, should_cancel)
        film.seconds = time.perf_counter() - start
    finally:
        embree.let_go()
    return film


def _new_film(left: int, bottom: int, right: int, top: int, scene: Scene, settings: RenderSettings) -> Film:
    try:
        return Film(left, bottom, right - left, top - bottom, settings.sample_count, scene.camera.resolution)
    except MemoryError:
        raise SettingsError(f"a picture of {right - left} × {top - bottom} pixels does not fit into memory") from None


def _new_workspace(frame: Frame, registers: np.ndarray, packets: int) -> tuple[Batch, Batch]:
    """The working memory of one thread: the paths, and points looked at beside them where the scene asks for it."""
    lobes, ways = frame.scene.materials.largest_lobe_count, frame.ways
    looks_aside = ways.emitters_vary or ways.has_environment or ways.can_pass
    return new_batch(packets, lobes, registers), new_batch(packets if looks_aside else 0, lobes, registers)


def _load_kernels(
    frame: Frame, workspace: Callable[[int], tuple[Batch, Batch]], should_cancel: Callable[[], bool] | None
) -> bool:
    """Compile the kernels, or load them from the cache, by calling them for no blocks. False where it was cancelled.

    Compiling takes many seconds and cannot be stopped: it goes on by itself then, for the benefit of the next render.
    """
    no_blocks = np.zeros((0, 2), np.int64)
    pool = ThreadPoolExecutor(1, "rooks-compile")
    batch, side = workspace(1)
    sums, stop = new_tile_sums(1), np.zeros(1, np.uint8)
    loading = pool.submit(render_blocks, batch, side, frame, no_blocks, sums, stop)
    pool.shutdown(wait=False)
    while not wait([loading], timeout=POLL).done:
        if should_cancel is not None and should_cancel():
            return False
    loading.result()
    return True


def _region(scene: Scene, settings: RenderSettings) -> tuple[int, int, int, int]:
    width, height = scene.camera.resolution
    left, bottom, right, top = settings.border or (0, 0, width, height)
    if not (0 <= left < right <= width and 0 <= bottom < top <= height):
        raise SettingsError(f"the border {settings.border} does not lie inside the picture of {width} × {height}")
    return left, bottom, right, top


def _make_frame(scene: Scene, settings: RenderSettings, packed: PackedScene) -> tuple[Frame, np.ndarray]:
    """Everything that the kernels share, and the programs' registers as they begin.

    A domain that the scene does not use has an empty table.
    """
    arrays, programs, materials = packed.arrays, packed.programs, packed.arrays.materials
    registers = fill_constants(arrays, programs)
    camera = pack_camera(scene.camera, packed.center, offset_table(settings))
    only_diffuse = not any(material.has_lobes for material in programs.materials)
    kinds = VISIBLE_TO_DIFFUSE if only_diffuse else VISIBLE_TO_SURFACES
    lights = pack_lights([light for light in scene.lights if light.visibility & kinds], packed.center)
    can_pass = any(material.may_pass for material in programs.materials)
    world_varies = programs.world.start != NONE
    emitters = find_mesh_lights(scene, arrays.geometry, programs)
    has_emitters = len(emitters.area) > 0
    limits = _limits(settings, only_diffuse)
    surfaces_shine = any(material.may_emit for material in programs.materials)
    chooses_lamps = lights.each < len(lights.kind)
    ways = Ways(
        only_diffuse=only_diffuse,
        has_programs=bool((materials.program[:-1] != NONE).any()),
        chooses_lamps=chooses_lamps,
        has_emitters=has_emitters,
        emitters_vary=has_emitters and bool((materials.program[np.unique(emitters.material)] != NONE).any()),
        has_environment=world_varies,
        shines=surfaces_shine or world_varies or bool(materials.emission[materials.world].any()),
        surfaces_shine=surfaces_shine,
        lamps_can_be_met=not only_diffuse and bool((lights.area > 0).any()),
        can_pass=can_pass,
        hide_world=settings.film_transparent,
        light_samples=lights.each + chooses_lamps + has_emitters + world_varies,
        steps=limits.bounces + 1 + (limits.transparent + 1 if can_pass else 0),
    )
    pixels = scene.camera.resolution[0] * scene.camera.resolution[1]
    dimensions = _dimensions(ways, lights, camera.lens_radius > 0)
    frame = Frame(
        scene=arrays,
        traversal=packed.embree.traversal,
        camera=camera,
        lights=lights,
        emitters=emitters,
        environment=picture_world(arrays, programs, registers) if world_varies else NO_ENVIRONMENT,
        limits=limits,
        clamp=Clamp(np.float32(settings.clamp_indirect or np.inf), np.float32(limits.bounces)),
        ways=ways,
        points=Points(**{name: make_table(name, settings, count, pixels) for name, count in dimensions.items()}),
    )
    return frame, registers


def _limits(settings: RenderSettings, only_diffuse: bool) -> Limits:
    bounces = min(settings.max_bounces, settings.diffuse_bounces) if only_diffuse else settings.max_bounces
    return Limits(
        bounces,
        settings.diffuse_bounces,
        settings.glossy_bounces,
        settings.transmission_bounces,
        settings.transparent_bounces,
    )


def _dimensions(ways: Ways, lights: LightArrays, has_lens: bool) -> dict[str, int]:
    """How many point sets a path takes from each domain."""
    samples_lights = lights.extended.any() or ways.chooses_lamps or ways.has_emitters or ways.has_environment
    scatters = ways.steps if ways.steps > 1 or ways.shines or ways.lamps_can_be_met else 0
    # The choice of a lobe and Russian roulette take a set of their own.
    chooses = scatters > ROULETTE_FROM or not ways.only_diffuse
    return {
        "pixel": 1,
        "lens": int(has_lens),
        "light": ways.light_samples * ways.steps if samples_lights else 0,
        "bsdf": scatters * (2 if chooses else 1),
    }


def _render_tiles(
    film: Film,
    frame: Frame,
    workspace: Callable[[int], tuple[Batch, Batch]],
    embree: SharedUse,
    settings: RenderSettings,
    on_tile: Callable[[Tile], None] | None,
    should_cancel: Callable[[], bool] | None,
) -> None:
    stop = np.zeros(1, np.uint8)  # kernels look at it between batches
    memory = threading.local()

    def render_one(bounds: tuple[int, int, int, int]) -> tuple[dict[str, np.ndarray], int] | None:
        if not hasattr(memory, "workspace"):
            memory.workspace = workspace(settings.batch_packets)
        with embree.user() as is_open:
            return _render_tile(bounds, frame, settings, *memory.workspace, stop) if is_open else None

    tiles = list(_tiles(film, settings.tile_size))
    with ThreadPoolExecutor(settings.thread_count, "rooks") as pool:
        waiting: dict[Future, tuple[int, int, int, int]] = {}
        try:
            for tile in tiles:
                waiting[pool.submit(render_one, tile)] = tile
            while waiting:
                finished, _ = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
                for future in finished:
                    bounds, (passes, dropped) = waiting.pop(future), future.result()
                    film.dropped_samples += dropped
                    film.negative_pixels += _raise_to_black(passes["Combined"])
                    _deliver(film, bounds, passes, len(tiles) - len(waiting), len(tiles), on_tile)
                if should_cancel is not None and should_cancel():
                    film.cancelled = True
                    break
        finally:
            # Also where on_tile raises, or Ctrl-C arrives: the threads end within a batch.
            stop[0] = 1
            for future in waiting:
                future.cancel()


def _raise_to_black(combined: np.ndarray) -> int:
    """Write 0 where light that a negative lamp takes away leaves less than none. Returns how many pixels are such."""
    negative = combined < 0
    combined[negative] = 0
    return int(negative.any(axis=2).sum())


def _tiles(film: Film, size: int) -> Iterator[tuple[int, int, int, int]]:
    """The (left, bottom, right, top) of each tile, top row first as one reads, cut to the film."""
    size = -(-size // BLOCK) * BLOCK
    for y in reversed(range(film.y // size * size, film.y + film.height, size)):
        for x in range(film.x // size * size, film.x + film.width, size):
            yield (
                max(x, film.x),
                max(y, film.y),
                min(x + size, film.x + film.width),
                min(y + size, film.y + film.height),
            )


def _render_tile(
    bounds: tuple[int, int, int, int],
    frame: Frame,
    settings: RenderSettings,
    batch: Batch,
    side: Batch,
    stop: np.ndarray,
) -> tuple[dict[str, np.ndarray], int] | None:
    """Render the blocks that touch `bounds`: their passes and dropped samples; None where it was told to stop."""
    left, bottom, right, top = bounds
    x0, y0 = left // BLOCK * BLOCK, bottom // BLOCK * BLOCK
    columns, rows = -(-(right - x0) // BLOCK), -(-(top - y0) // BLOCK)
    blocks = np.array([(x0 + BLOCK * i, y0 + BLOCK * j) for j in range(rows) for i in range(columns)], np.int64)
    sums = new_tile_sums(len(blocks) * BLOCK * BLOCK)
    samples = settings.sample_count
    render_blocks(batch, side, frame, blocks, sums, stop)
    if stop[0]:
        return None
    window = np.s_[bottom - y0 : top - y0, left - x0 : right - x0]
    counts = _raster(sums.count[:, None], rows, columns)[window]
    dropped = counts.size * samples - int(counts.sum())
    return {name: _raster(values, rows, columns)[window] for name, values in develop(sums).items()}, dropped


def _raster(values: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """From block order (pixels, channels) to (height, width, channels)."""
    channels = values.shape[-1]
    blocks = values.reshape(rows, columns, BLOCK, BLOCK, channels).transpose(0, 2, 1, 3, 4)
    return blocks.reshape(rows * BLOCK, columns * BLOCK, channels)


def _deliver(
    film: Film,
    bounds: tuple[int, int, int, int],
    passes: dict[str, np.ndarray],
    done: int,
    total: int,
    on_tile: Callable[[Tile], None] | None,
) -> None:
    left, bottom, right, top = bounds
    place = np.s_[bottom - film.y : top - film.y, left - film.x : right - film.x]
    for name in PASSES:
        film.passes[name][place] = passes[name]
    film.finished_pixels += (right - left) * (top - bottom)
    if on_tile is not None:
        tile = {name: np.ascontiguousarray(values) for name, values in passes.items()}
        on_tile(Tile(left, bottom, right - left, top - bottom, tile, done, total))
