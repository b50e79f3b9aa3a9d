"""Blender's window, driven from inside Blender: keys, the mouse, the view and what it shows, and notes of all that.

A story is a generator that a timer on the main thread moves on, and that yields the seconds to wait. What it notes are
lines of JSON in the file `notes`. Keys are pressed by xdotool, as the X server would pass them on from a keyboard.
"""

import gc
import importlib
import json
import subprocess
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

Steps = Iterator[float]

EXTENSION = "bl_ext.user_default.rooks"
SCENES = Path(__file__).parents[1] / "sample_scenes"

#: F12 by its code on the X server: by its name, xdotool presses Alt as well on some.
KEYS = {"F12": "96", "animation": "ctrl+96", "Escape": "Escape", "undo": "ctrl+z", "redo": "ctrl+shift+z"}

TICK = 0.01  # seconds, the shortest wait: also how finely a wait of the main thread is seen


class Screen:
    """What the 3-D view shows: each picture that the add-on draws in it, once, and what it says."""

    def __init__(self) -> None:
        self.texts: set[str] = set()
        self.pictures: list[tuple[int, int, int]] = []  # side of a pixel, samples done, samples in all
        self.latest = None
        self.text = ""
        viewports = importlib.import_module(f"{EXTENSION}.addon.viewport")
        draw = viewports.Viewport.draw

        def draw_and_look(viewport, context, depsgraph) -> str:
            self.text = draw(viewport, context, depsgraph)
            self.texts.add(self.text)
            picture = viewport._picture
            if picture is not None and picture is not self.latest:
                self.latest = picture
                self.pictures.append((picture.size, picture.done, picture.total))
            return self.text

        viewports.Viewport.draw = draw_and_look

    def is_complete(self) -> bool:
        return bool(self.pictures) and self.pictures[-1][1] == self.pictures[-1][2]

    def completed(self, within: float = 30.0, after: str = "a change") -> Steps:
        """Wait for the last of the pictures that are to come after something."""
        what = f"a complete picture after {after}"
        yield from wait_for(self.is_complete, within, lambda: f"{what}: {self.pictures}, the view says {self.text!r}")

    def restart(self) -> None:
        self.pictures.clear()


notes = Path()
folder = Path()
screen: Screen


def note(name: str, **values) -> None:
    with notes.open("a") as file:
        print(json.dumps({"name": name, "clock": time.time()} | values), file=file)


def wait_for(is_so: Callable[[], bool], within: float, what: Callable[[], str]) -> Steps:
    """Wait until something is so."""
    end = time.monotonic() + within
    while not is_so():
        if time.monotonic() > end or "error" in screen.text:
            raise TimeoutError(f"waited in vain, {within:g} s at most, for {what()}")
        yield TICK


def press(key: str) -> None:
    """Press a key, without waiting for what it does: that may need this thread."""
    subprocess.Popen(["xdotool", "key", KEYS[key]])


def xdotool(*arguments: str) -> str:
    return subprocess.run(["xdotool", *arguments], check=True, capture_output=True, text=True).stdout


def main_window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def view() -> tuple[bpy.types.Area, bpy.types.Region]:
    area = next(area for area in main_window().screen.areas if area.type == "VIEW_3D")
    return area, next(region for region in area.regions if region.type == "WINDOW")


def in_view() -> bpy.types.Context:
    """Operators work in the 3-D view."""
    area, region = view()
    return bpy.context.temp_override(window=main_window(), area=area, region=region)


def space() -> bpy.types.SpaceView3D:
    return view()[0].spaces.active


def settings() -> bpy.types.PropertyGroup:
    return bpy.context.scene.rooks


def window_id() -> str:
    """The number of Blender's first window on the X server."""
    return xdotool("search", "--onlyvisible", "--class", "blender").split()[0]


def enter() -> Steps:
    """The mouse over the 3-D view, the keyboard on its window, all render settings in sight."""
    for area in main_window().screen.areas:
        if area.type == "PROPERTIES":
            area.spaces.active.context = "RENDER"
    region = view()[1]
    x, y = region.x + region.width // 2, region.y + region.height // 2
    xdotool("windowfocus", "--sync", window_id())
    xdotool("mousemove", "--window", window_id(), str(x), str(main_window().height - y))
    yield 0.2


def size_view(side: int) -> Steps:
    """Give the window the size at which the 3-D view is a square of `side` pixels."""
    for _ in range(8):
        region = view()[1]
        missing = side - region.width, side - region.height
        if missing == (0, 0):
            return
        size = main_window().width + missing[0], main_window().height + missing[1]
        xdotool("windowsize", "--sync", window_id(), *map(str, size))
        yield 0.3
    if max(map(abs, missing)) > 4:
        raise RuntimeError(f"the 3-D view has {region.width} x {region.height} pixels instead of {side} x {side}")


def open_scene(name: str) -> Steps:
    with bpy.context.temp_override(window=main_window()):
        bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    yield 0.2
    yield from enter()


def show(kind: str = "RENDERED") -> None:
    space().shading.type = kind


def usage() -> tuple[list[str], int, float]:
    """The names of Python's threads, the number of all, and the memory in use in MB."""
    gc.collect()
    names = sorted(thread.name for thread in threading.enumerate())
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return names, len(list(Path("/proc/self/task").iterdir())), pages * 4096 / 1e6


def rendered(during: Callable[[], Steps | None], key: str = "F12") -> Steps:
    """Press F12 or another key that renders, do something meanwhile, and wait for the end. Returns the seconds."""
    yield from enter()
    start = time.perf_counter()
    yield from started_render(key)
    yield from during() or ()
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"), 30.0, lambda: "the end of the render")
    seconds = time.perf_counter() - start
    yield from close_other_windows()
    return seconds


def started_render(key: str = "F12") -> Steps:
    starts: list[bool] = []
    bpy.app.handlers.render_pre.append(lambda *_: starts.append(True))
    press(key)
    yield from wait_for(lambda: bool(starts), 5.0, lambda: f"a render to start: {key} was pressed")
    bpy.app.handlers.render_pre.clear()


def close_other_windows() -> Steps:
    yield 0.2
    for window in list(bpy.context.window_manager.windows)[1:]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.window_close()
    yield 0.2


def choose_png() -> None:
    image = bpy.context.scene.render.image_settings
    if hasattr(image, "media_type"):  # Blender 5.0 and later
        image.media_type = "IMAGE"
    image.file_format, image.color_mode = "PNG", "RGBA"


def save_render(name: str) -> str:
    path = folder / name
    choose_png()
    bpy.data.images["Render Result"].save_render(str(path))
    return str(path)


def begin(story: Callable[[], Steps]) -> None:
    """Let a timer tell the story, to its end or its failure."""
    steps = prepared(story)

    def tick() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            return None
        except BaseException:
            note("failure", step=story.__name__, text=traceback.format_exc())
            bpy.ops.wm.quit_blender()
            return None

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)


def prepared(story: Callable[[], Steps]) -> Steps:
    global screen
    screen = Screen()
    yield from story()
