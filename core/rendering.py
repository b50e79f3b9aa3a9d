"""Rendering: tiles of the picture, spread over threads.

Tiles and the blocks of 4×4 pixels in them lie on a grid that is fixed to the full frame, and a block is always
rendered whole, so that a packet holds the same rays whatever the border, the tiles, the batches or the threads.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np

from .batch import LANES, PACKET, Batch, new_batch
from .camera import check_camera, pack_camera
from .domains import make_table
from .errors import SceneError, SettingsError
from .film import PASSES, Film, TileSums, add_samples, develop, new_tile_sums
from .filters import offset_table
from .integrator import Frame, trace_samples
from .jit import kernel
from .lights import pack_lights
from .packing import PackedScene, pack_scene
from .scene import Scene
from .settings import RenderSettings
from .shared_use import SharedUse

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
    if not np.isfinite(scene.world).all():
        raise SceneError("the world's colour is not a finite number")
    left, bottom, right, top = _region(scene, settings)
    film = _new_film(left, bottom, right, top, scene, settings)
    packed = pack_scene(scene, settings.thread_count)
    embree = SharedUse(packed.embree.close)
    try:
        frame = _make_frame(scene, settings, packed)
        film.cancelled = not _load_kernels(frame, should_cancel)
        film.setup_seconds = time.perf_counter() - start
        start = time.perf_counter()
        if not film.cancelled:
            _render_tiles(film, frame, embree, settings, on_tile, should_cancel)
        film.seconds = time.perf_counter() - start
    finally:
        embree.let_go()
    return film


def _new_film(left: int, bottom: int, right: int, top: int, scene: Scene, settings: RenderSettings) -> Film:
    try:
        return Film(left, bottom, right - left, top - bottom, settings.sample_count, scene.camera.resolution)
    except MemoryError:
        raise SettingsError(f"a picture of {right - left} × {top - bottom} pixels does not fit into memory") from None


def _load_kernels(frame: Frame, should_cancel: Callable[[], bool] | None) -> bool:
    """Compile the kernels, or load them from the cache, by calling them for no blocks. False where it was cancelled.

    Compiling takes many seconds and cannot be stopped: it goes on by itself then, for the benefit of the next render.
    """
    no_blocks = np.zeros((0, 2), np.int64)
    pool = ThreadPoolExecutor(1, "rooks-compile")
    loading = pool.submit(_render_blocks, new_batch(1), frame, no_blocks, new_tile_sums(1), True, np.zeros(1, np.uint8))
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


def _make_frame(scene: Scene, settings: RenderSettings, packed: PackedScene) -> Frame:
    """Everything that the kernels share. A domain that the scene does not use has an empty table."""
    camera = pack_camera(scene.camera, packed.center, offset_table(settings))
    lights = pack_lights(scene.lights, packed.center)
    world_shines = any(scene.world)
    directions = settings.max_bounces + (1 if world_shines or packed.surfaces_shine else 0)
    pixels = scene.camera.resolution[0] * scene.camera.resolution[1]
    dimensions = {
        "pixel": 1,
        "lens": int(camera.lens_radius > 0),
        "light": len(lights.kind) * (settings.max_bounces + 1) if lights.extended.any() else 0,
        "bsdf": directions,
    }
    tables = {f"{name}_points": make_table(name, settings, count, pixels) for name, count in dimensions.items()}
    world = np.array(scene.world, np.float32)
    return Frame(
        scene=packed.arrays,
        traversal=packed.embree.traversal,
        camera=camera,
        lights=lights,
        world=world,
        backdrop=world * (not settings.film_transparent),
        world_shines=world_shines,
        surfaces_shine=packed.surfaces_shine,
        max_bounces=settings.max_bounces,
        **tables,
    )


def _render_tiles(
    film: Film,
    frame: Frame,
    embree: SharedUse,
    settings: RenderSettings,
    on_tile: Callable[[Tile], None] | None,
    should_cancel: Callable[[], bool] | None,
) -> None:
    stop = np.zeros(1, np.uint8)  # kernels look at it between batches
    memory = threading.local()

    def render_one(bounds: tuple[int, int, int, int]) -> tuple[dict[str, np.ndarray], int] | None:
        if not hasattr(memory, "batch"):
            memory.batch = new_batch(settings.batch_packets)
        with embree.user() as is_open:
            return _render_tile(bounds, frame, settings, memory.batch, stop) if is_open else None

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
                    _deliver(film, bounds, passes, len(tiles) - len(waiting), len(tiles), on_tile)
                if should_cancel is not None and should_cancel():
                    film.cancelled = True
                    break
        finally:
            # Also where on_tile raises, or Ctrl-C arrives: the threads end within a batch.
            stop[0] = 1
            for future in waiting:
                future.cancel()


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
    stop: np.ndarray,
) -> tuple[dict[str, np.ndarray], int] | None:
    """Render the blocks that touch `bounds`: their passes and dropped samples; None where it was told to stop."""
    left, bottom, right, top = bounds
    x0, y0 = left // BLOCK * BLOCK, bottom // BLOCK * BLOCK
    columns, rows = -(-(right - x0) // BLOCK), -(-(top - y0) // BLOCK)
    blocks = np.array([(x0 + BLOCK * i, y0 + BLOCK * j) for j in range(rows) for i in range(columns)], np.int64)
    sums = new_tile_sums(len(blocks) * BLOCK * BLOCK)
    samples = settings.sample_count
    _render_blocks(batch, frame, blocks, sums, not settings.film_transparent, stop)
    if stop[0]:
        return None
    window = np.s_[bottom - y0 : top - y0, left - x0 : right - x0]
    counts = _raster(sums.count[:, None], rows, columns)[window]
    dropped = counts.size * samples - int(counts.sum())
    return {name: _raster(values, rows, columns)[window] for name, values in develop(sums).items()}, dropped


@kernel
def _render_blocks(
    batch: Batch, frame: Frame, blocks: np.ndarray, sums: TileSums, opaque: bool, stop: np.ndarray
) -> None:
    """Render all samples of `blocks` (B, 2) batch after batch, as long as `stop` (1,) is 0."""
    samples = frame.pixel_points.points.shape[2]
    capacity = len(batch.floats) // PACKET
    # A block's 16 pixels times n samples are n whole packets.
    total = len(blocks) * samples
    for first in range(0, total, capacity):
        if stop[0]:
            return
        packets = min(capacity, total - first)
        trace_samples(batch, frame, blocks, first * LANES, packets)
        add_samples(sums, batch, opaque, first * LANES, samples, packets * LANES)


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
