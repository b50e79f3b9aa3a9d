"""What a rendered viewport shows, made in a thread of its own: a coarse picture at each change, then better ones.

The thread knows nothing of Blender: Blender frees an engine when it likes, and a thread that held it would reach into
freed memory.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from bpy.app.translations import pgettext_iface as iface_

from . import kernels
from ._core import core
from .failures import failure_text
from .progress import losses

NewScene = tuple["core.scene.Scene", "core.settings.RenderSettings"]

#: The first picture after a change is to be there after so many seconds: its pixels are as large as that takes.
FIRST_PICTURE = 0.04
LARGEST_PIXEL = 16
#: Finished passes are shown no more often than this, in seconds: copying them to the screen takes time as well.
SHOW_EVERY = 0.1
#: Not waited for longer, in seconds: a thread that has to compile the kernels itself ends when it has done so.
ENDS_WITHIN = 2.0


@dataclass(frozen=True)
class View:
    """What a region shows: the camera has as many pixels as the region, `bounds` is the part to be rendered."""

    camera: core.scene.Camera
    bounds: tuple[int, int, int, int]

    def coarser(self, size: int) -> View:
        """The same with pixels `size` times as large; its picture may stand over to the right and the top."""
        left, bottom, right, top = self.bounds
        bounds = left // size, bottom // size, -(-right // size), -(-top // size)
        return View(core.progressive.coarser(self.camera, size), bounds)

    @property
    def pixels(self) -> int:
        left, bottom, right, top = self.bounds
        return (right - left) * (top - bottom)

    def is_same(self, other: View | None) -> bool:
        return other is not None and self._all() == other._all()

    def _all(self) -> dict:
        return vars(self.camera) | {"matrix": self.camera.matrix.tobytes(), "bounds": self.bounds}


@dataclass(frozen=True)
class Picture:
    """A picture to be drawn: float32 (height, width, 4), bottom row first, at (x, y) with pixels of `size`.

    `losses` says what of it could not be kept as it was computed.
    """

    pixels: np.ndarray
    x: int
    y: int
    size: int
    done: int
    total: int
    losses: tuple[str, ...]


class Session:
    """Renders what it is told to in a thread of its own, until it is closed.

    `on_change` is called from that thread when there is something new in `picture`, `activity` or `error`.
    """

    def __init__(self, on_change: Callable[[], None]) -> None:
        self.picture: Picture | None = None
        self.activity = ""
        self.error: str | None = None
        self._on_change = on_change
        self._news = threading.Condition()
        self._scene: NewScene | None = None
        self._view: View | None = None
        self._is_closed = self._may_stop = False
        self._stop = np.zeros(1, np.uint8)
        # From here on only the thread's own.
        self._prepared: core.preparation.Prepared | None = None
        self._shown: View | None = None
        self._seconds_per_pixel = 1.0  # unknown: start with the coarsest
        self._pool: ThreadPoolExecutor | None = None
        self._threads = 0  # of the pool
        self._thread = threading.Thread(target=self._run, name="rooks-viewport", daemon=True)
        self._thread.start()

    def show_scene(self, scene: core.scene.Scene, settings: core.settings.RenderSettings) -> None:
        """Show another scene from now on, or the same one changed."""
        with self._news:
            self._scene = scene, settings
            self._wake()

    def show_view(self, view: View) -> None:
        """Look at the scene from somewhere else."""
        with self._news:
            self._view = view
            self._wake()

    @property
    def text(self) -> str:
        """What is being done, in a few words."""
        if self.error is not None:
            return self.error
        if self.activity or self.picture is None:
            return self.activity
        done = iface_("{done} of {total} samples").format(done=self.picture.done, total=self.picture.total)
        return ", ".join((done, *self.picture.losses))

    def show_error(self, text: str) -> None:
        """There is nothing to be seen, and this is why."""
        self.picture, self.error = None, text

    def close(self) -> None:
        """Stop, and wait for the thread, which mostly ends within milliseconds."""
        with self._news:
            self._is_closed = True
            self._stop[0] = 1
            self._news.notify()
        if threading.current_thread() is not self._thread:  # which may be the one to find that Blender has gone
            self._thread.join(ENDS_WITHIN)

    def _wake(self) -> None:
        # What comes first after a change is finished, or turning the view would show nothing new.
        self._stop[0] = self._may_stop
        self._news.notify()

    def _run(self) -> None:
        """The thread: from news to pictures."""
        pictures: Iterator[Picture] = iter(())
        is_idle = True
        while (news := self._take_news(wait=is_idle)) is not None:
            try:
                if any(news):
                    pictures = self._pictures(*news)
                picture = next(pictures, None)
                is_idle = picture is None
                if picture is not None:
                    self._publish(picture)
            except Exception as error:
                is_idle = self._fail(failure_text(error))
        self._let_go()

    def _take_news(self, wait: bool) -> tuple[NewScene | None, View | None] | None:
        """The scene and the view, where they are new; None when there is no more to come."""
        with self._news:
            if wait:
                self._news.wait_for(lambda: self._is_closed or self._scene or self._view)
            news = self._scene, self._view
            self._scene = self._view = None
            if any(news):
                self._may_stop = False
            if not self._is_closed:
                self._stop[0] = 0
            return None if self._is_closed else news

    def _pictures(self, scene: NewScene | None, view: View | None) -> Iterator[Picture]:
        """Better and better pictures of what is to be shown now, until something stops them."""
        self._shown = view or self._shown
        if scene is not None and not self._prepare(*scene):
            return
        if self._prepared is None or self._shown is None:
            return
        size = self._first_size(self._shown)
        while size > 1:
            yield from self._passes(self._shown.coarser(size), size, 1)
            size //= 2
        yield from self._passes(self._shown, 1, self._prepared.settings.sample_count)

    def _passes(self, view: View, size: int, count: int) -> Iterator[Picture]:
        """`count` passes with pixels of `size`, of which the first and the last are shown, and some between."""
        progressive = core.progressive.Progressive(self._prepared, view.camera, view.bounds)
        shown = -math.inf
        while progressive.done < count:
            start = time.perf_counter()
            if not progressive.add_pass(self._pool, self._stop):
                return
            now = time.perf_counter()
            self._seconds_per_pixel = (now - start) / view.pixels
            if progressive.done == count or now > shown + SHOW_EVERY:
                shown = now
                left, bottom = view.bounds[:2]
                done = progressive.done if size == 1 else 0
                total = self._prepared.settings.sample_count
                lost = tuple(losses(progressive))
                yield Picture(progressive.pixels(), left * size, bottom * size, size, done, total, lost)

    def _first_size(self, view: View) -> int:
        """The side of the first picture's pixels, a power of two."""
        size = 1
        while size < LARGEST_PIXEL and view.pixels / size**2 * self._seconds_per_pixel > FIRST_PICTURE:
            size *= 2
        return size

    def _prepare(self, scene: core.scene.Scene, settings: core.settings.RenderSettings) -> bool:
        """Get ready to render a scene. False where the session was closed meanwhile."""
        before, self._prepared = self._prepared, None
        try:
            if before is None and not self._wait_for_kernels():
                return False
            self._prepared = core.preparation.prepare(scene, settings, before)
        finally:
            if before is not None:
                before.let_go()
        if before is None:
            self._prepared.load_kernels().result()
        self._take_threads(settings.thread_count)
        return True

    def _take_threads(self, count: int) -> None:
        if count != self._threads:
            self._let_threads_go()
            self._pool, self._threads = ThreadPoolExecutor(count, "rooks-view"), count

    def _let_threads_go(self) -> None:
        if self._pool is not None:
            self._pool.shutdown()

    def _wait_for_kernels(self) -> bool:
        def tell(share: float) -> None:
            before, self.activity = self.activity, kernels.progress_text(share)
            if self.activity != before:
                self._on_change()

        is_done = kernels.wait_for_kernels(tell, lambda: self._is_closed)
        self.activity = ""
        return is_done

    def _publish(self, picture: Picture) -> None:
        with self._news:
            self._may_stop = True
        self.picture, self.error = picture, None
        self._on_change()

    def _fail(self, text: str) -> bool:
        self.show_error(text)
        self._on_change()
        return True

    def _let_go(self) -> None:
        self._let_threads_go()
        if self._prepared is not None:
            self._prepared.let_go()
            self._prepared = None
