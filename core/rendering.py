"""Rendering: tiles of the picture, spread over threads.

Tiles and the blocks of 4×4 pixels in them lie on a grid that is fixed to the full frame, and a block is always
rendered whole, so that a packet holds the same rays whatever the border, the tiles, the batches or the threads.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from queue import Empty, SimpleQueue

import numpy as np

from .blocks import BLOCK, BlockGrid, Bounds
from .camera import check_camera
from .domains import Run
from .errors import SettingsError
from .film import DENOISING_ALBEDO, Film, develop, new_tile_sums
from .integrator import render_blocks
from .preparation import Prepared, prepare
from .scene import Scene
from .settings import RenderSettings

#: A tile's passes, and its dropped and blocked samples.
_TileResult = tuple[dict[str, np.ndarray], int, int]

#: How often the calling thread looks whether it should stop, in seconds.
POLL = 0.02
#: Within how many seconds a thread runs that the system has been asked for, on a busy machine too.
STARTS_WITHIN = 1.0


@dataclass(frozen=True)
class Tile:
    """A finished part of the picture: `passes` as in `Film`, `x` and `y` its lower left pixel in the full frame.

    It is number `done` of `total`, of a render that takes `memory` bytes beside its picture.
    """

    x: int
    y: int
    width: int
    height: int
    passes: dict[str, np.ndarray]
    done: int
    total: int
    memory: int


def render(
    scene: Scene,
    settings: RenderSettings,
    on_tile: Callable[[Tile], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> Film:
    """Render `scene`.

    `on_tile` is called from the calling thread as each tile is finished, `should_cancel` then and about 50 times a
    second. When that answers True the film comes back with the tiles that are done, and its `cancelled` set.

    Raises:
        SceneError: the scene cannot be rendered; the text says what to mend.
        SettingsError: the settings do not fit the scene.
    """
    start = time.perf_counter()
    check_camera(scene.camera)
    left, bottom, right, top = _region(scene, settings)
    film = _new_film(left, bottom, right, top, scene, settings)
    prepared = prepare(scene, settings)
    try:
        film.memory = prepared.memory
        film.cancelled = not _load_kernels(prepared, should_cancel)
        film.setup_seconds = time.perf_counter() - start
        start = time.perf_counter()
        if not film.cancelled:
            _render_tiles(film, prepared, on_tile, should_cancel)
        film.seconds = time.perf_counter() - start
    finally:
        prepared.let_go()
    return film


def _new_film(left: int, bottom: int, right: int, top: int, scene: Scene, settings: RenderSettings) -> Film:
    try:
        film = Film(left, bottom, right - left, top - bottom, settings.sample_count, scene.camera.resolution)
        if settings.denoising_albedo:
            film.passes[DENOISING_ALBEDO] = film.new_pass(DENOISING_ALBEDO)
        return film
    except MemoryError:
        raise SettingsError(f"a picture of {right - left} × {top - bottom} pixels does not fit into memory") from None


def _load_kernels(prepared: Prepared, should_cancel: Callable[[], bool] | None) -> bool:
    """Wait for the kernels. False where it was cancelled."""
    loaded: SimpleQueue[Future] = SimpleQueue()
    prepared.load_kernels().add_done_callback(loaded.put)
    while (loading := _next(loaded)) is None:
        if should_cancel is not None and should_cancel():
            return False
    loading.result()
    return True


def _region(scene: Scene, settings: RenderSettings) -> Bounds:
    width, height = scene.camera.resolution
    left, bottom, right, top = settings.border or (0, 0, width, height)
    if not (0 <= left < right <= width and 0 <= bottom < top <= height):
        raise SettingsError(f"the border {settings.border} does not lie inside the picture of {width} × {height}")
    return left, bottom, right, top


def _render_tiles(
    film: Film,
    prepared: Prepared,
    on_tile: Callable[[Tile], None] | None,
    should_cancel: Callable[[], bool] | None,
) -> None:
    stop = np.zeros(1, np.uint8)  # kernels look at it between batches
    tiles = _tiles(film, prepared.settings.tile_size)
    todo: SimpleQueue[Bounds] = SimpleQueue()
    done: SimpleQueue[tuple[Bounds, _TileResult] | BaseException] = SimpleQueue()
    for tile in tiles:
        todo.put(tile)

    def work() -> None:
        try:
            with prepared.packed.structure.user() as is_open:
                while is_open and not stop[0]:
                    bounds = todo.get_nowait()
                    done.put((bounds, _render_tile(bounds, prepared, stop)))
        except Empty:
            pass
        except BaseException as error:
            done.put(error)

    count = min(prepared.settings.thread_count, len(tiles))
    threads = [threading.Thread(target=work, name=f"rooks_{number}") for number in range(count)]
    delivered = begun = 0
    try:
        for thread in threads:
            begun += 1
            thread.start()
        while delivered < len(tiles):
            outcome = _next(done)
            if isinstance(outcome, BaseException):
                raise outcome
            if outcome is not None:
                delivered += 1
                bounds, (passes, dropped, blocked) = outcome
                film.dropped_samples += dropped
                film.blocked_samples += blocked
                film.negative_pixels += _raise_to_black(passes["Combined"])
                _deliver(film, bounds, passes, delivered, len(tiles), on_tile)
            if should_cancel is not None and should_cancel():
                film.cancelled = True
                break
    finally:
        # Also where on_tile raises, or Ctrl-C arrives: the threads end within a batch.
        stop[0] = 1
        for thread in threads[:begun]:
            _join(thread)


def _join(thread: threading.Thread) -> None:
    """Wait for a thread's end. Where Ctrl-C came while it was being started, first to see whether it was."""
    until = time.monotonic() + STARTS_WITHIN
    while time.monotonic() < until:
        try:
            thread.join()
        except RuntimeError:  # not yet, or never
            time.sleep(POLL)
        else:
            return


def _next(queue: SimpleQueue) -> object | None:
    """What comes next, if it comes in time to look whether to stop.

    A signal can raise anywhere in the thread that waits. It would leave a Future or a Condition locked for ever, which
    the other threads then wait for; this queue is C's, and is not left half-way.
    """
    try:
        return queue.get(timeout=POLL)
    except Empty:
        return None


def _raise_to_black(combined: np.ndarray) -> int:
    """Write 0 where light that a negative lamp takes away leaves less than none. Returns how many pixels are such."""
    negative = combined < 0
    combined[negative] = 0
    return int(negative.any(axis=2).sum())


def _tiles(film: Film, size: int) -> list[Bounds]:
    """The tiles, cut to the film, in a spiral from its middle: what a picture is about tends to be there."""
    size = -(-size // BLOCK) * BLOCK
    right, top = film.x + film.width, film.y + film.height
    tiles = [
        (max(x, film.x), max(y, film.y), min(x + size, right), min(y + size, top))
        for y in range(film.y // size * size, top, size)
        for x in range(film.x // size * size, right, size)
    ]

    def place(tile: Bounds) -> tuple[int, float]:
        columns = (tile[0] // size) - (film.x + film.width // 2) // size
        rows = (tile[1] // size) - (film.y + film.height // 2) // size
        return max(abs(columns), abs(rows)), math.atan2(rows, columns)

    return sorted(tiles, key=place)


def _render_tile(bounds: Bounds, prepared: Prepared, stop: np.ndarray) -> _TileResult | None:
    """Render the blocks that touch `bounds`: their passes, dropped and blocked samples; None where it was stopped."""
    grid, samples = BlockGrid(bounds), prepared.settings.sample_count
    sums = new_tile_sums(grid.pixels, prepared.settings.denoising_albedo)
    render_blocks(*prepared.workspace(), prepared.frame, grid.blocks, Run(0, samples), sums, stop)
    if stop[0]:
        return None
    counts = grid.raster(sums.count[:, None])
    dropped = counts.size * samples - int(counts.sum())
    passes = {name: grid.raster(values) for name, values in develop(sums, samples).items()}
    return passes, dropped, int(sums.blocked[0])


def _deliver(
    film: Film,
    bounds: Bounds,
    passes: dict[str, np.ndarray],
    done: int,
    total: int,
    on_tile: Callable[[Tile], None] | None,
) -> None:
    left, bottom, right, top = bounds
    place = np.s_[bottom - film.y : top - film.y, left - film.x : right - film.x]
    for name, values in passes.items():
        film.passes[name][place] = values
    film.finished_pixels += (right - left) * (top - bottom)
    if on_tile is not None:
        tile = {name: np.ascontiguousarray(values) for name, values in passes.items()}
        on_tile(Tile(left, bottom, right - left, top - bottom, tile, done, total, film.memory))
