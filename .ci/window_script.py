"""Inside Blender's window: do what a user does, and note what is to be seen. `window.py` starts this, and judges.

    blender … --python .ci/window_script.py -- STORY NOTES FOLDER

A story is a generator that a timer on the main thread moves on, and that yields the seconds to wait. What it notes are
lines of JSON in the file NOTES. Keys are pressed by xdotool, as the X server would pass them on from a keyboard.
"""

import gc
import importlib
import json
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

Steps = Iterator[float]

EXTENSION = "bl_ext.user_default.rooks"
SCENES = Path(__file__).parents[1] / "sample_scenes"
TURNED_SCENES = "still_life", "cornell_box", "glossy"

#: F12 by its code on the X server: by its name, xdotool presses Alt as well on some.
KEYS = {"F12": "96", "Escape": "Escape", "undo": "ctrl+z", "redo": "ctrl+shift+z"}

TICK = 0.01  # seconds, the shortest wait: also how finely a wait of the main thread is seen
SIDE = 512  # pixels, of the view that is turned
TURN_FOR = 3.0  # seconds
SAMPLES = 9  # few, and a count that every sampler can make
COMINGS_BACK = 50
WARM_UPS = 5  # comings back before the first count: by then all is there that is kept once and for all
ENDLESS = 16384  # samples: a render that does not end by itself while the script is at it


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


# Stories


def at_work() -> Steps:
    """A user at work in the window: one thing after the other, in one Blender."""
    yield from enter()
    for step in (chooses, changes, looks, takes_back, comes_back, turns, renders, escapes, opens):
        try:
            yield from step()
        except Exception:
            note("failure", step=step.__name__, text=traceback.format_exc())
            break
    note("quits")
    bpy.ops.wm.quit_blender()


def chooses() -> Steps:
    """Choose the engine in Blender's own first scene, and the rendered view."""
    bpy.context.scene.render.engine = "ROOKS"
    yield from size_view(SIDE)
    settings().preview_samples = SAMPLES
    show()
    start = time.monotonic()
    yield from screen.completed(within=170.0)
    announced = sorted(text for text in screen.texts if "ompiling" in text)
    note("chooses", pictures=screen.pictures, seconds=time.monotonic() - start, announced=announced)
    yield from photograph()


def photograph() -> Steps:
    """A picture, and what the X server shows of it without all that Blender draws over it."""
    space().overlay.show_overlays = space().show_gizmo = False
    space().region_3d.view_distance = 5.0
    yield from enter()
    screen.restart()
    space().region_3d.view_distance = 4.0
    yield from screen.completed()
    yield 0.3
    subprocess.run(["import", "-window", window_id(), str(folder / "view.png")], check=True)
    np.save(folder / "view.npy", screen.latest.pixels)
    region = view()[1]
    note("photograph", left=region.x, top=main_window().height - region.y - region.height)
    space().overlay.show_overlays = space().show_gizmo = True


def changes() -> Steps:
    """Change one thing after the other."""
    cube = bpy.data.objects["Cube"]

    def change_material() -> None:
        cube.active_material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.1, 0, 1)

    def change_mesh() -> None:
        cube.data.vertices[0].co.z += 0.5
        cube.data.update()

    for what, change in (
        ("a material", change_material),
        ("a light", lambda: setattr(bpy.data.objects["Light"].data, "energy", 200.0)),
        ("a mesh", change_mesh),
        ("a place", lambda: setattr(cube.location, "x", 1.0)),
        (
            "the world",
            lambda: setattr(bpy.context.scene.world.node_tree.nodes["Background"].inputs[1], "default_value", 2.0),
        ),
        ("hiding an object", lambda: cube.hide_set(True)),
        ("showing it again", lambda: cube.hide_set(False)),
        ("the sampler", lambda: setattr(settings(), "sampler", "RANDOM")),
        ("the seed", lambda: setattr(settings(), "seed", 7)),
        ("the samples", lambda: setattr(settings(), "preview_samples", 4 * SAMPLES)),
    ):
        before = screen.latest.pixels
        screen.restart()
        change()
        yield from screen.completed(after=what)
        note("changes", what=what, pictures=screen.pictures, differs=differ(before, screen.latest.pixels))
    settings().preview_samples = SAMPLES
    screen.restart()
    yield from screen.completed()


def differ(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape != other.shape or not np.array_equal(one, other)


def looks() -> Steps:
    """Look through the camera, and at parts of the picture only."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIDE

    def look_through_camera() -> None:
        space().region_3d.view_perspective = "CAMERA"

    def border_of_camera() -> None:
        scene.render.use_border = True
        scene.render.border_min_x = scene.render.border_min_y = 0.25
        scene.render.border_max_x = scene.render.border_max_y = 0.75

    def border_of_view() -> None:
        space().region_3d.view_perspective = "PERSP"
        space().use_render_border = True
        space().render_border_min_x, space().render_border_max_x = 0.25, 0.5
        space().render_border_min_y, space().render_border_max_y = 0.5, 1.0

    def no_border() -> None:
        scene.render.use_border = space().use_render_border = False

    for what, look in (
        ("camera", look_through_camera),
        ("border of the camera", border_of_camera),
        ("border of the view", border_of_view),
        ("all", no_border),
    ):
        screen.restart()
        look()
        yield from screen.completed(after=what)
        picture = screen.latest
        height, width = picture.pixels.shape[:2]
        region = view()[1]
        note("looks", what=what, place=(picture.x, picture.y), size=(width, height), view=(region.width, region.height))


def takes_back() -> Steps:
    """Move something, undo, and redo, by the keys."""
    with in_view():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["Cube"].select_set(True)
        bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
        bpy.ops.ed.undo_push(message="Start")
    yield from enter()
    yield from screen.completed()
    before = screen.latest.pixels
    seen = {}
    for what, change in (("move", move), ("undo", lambda: press("undo")), ("redo", lambda: press("redo"))):
        screen.restart()
        change()
        yield from screen.completed(after=what)
        seen[what] = screen.latest.pixels
    note(
        "takes_back",
        moves=differ(before, seen["move"]),
        undoes=not differ(before, seen["undo"]),
        redoes=not differ(seen["move"], seen["redo"]),
    )


def move() -> None:
    with in_view():
        bpy.ops.transform.translate("EXEC_DEFAULT", True, value=(0.0, 0.5, 0.5))


def comes_back() -> Steps:
    """Leave the rendered view and come back, many times."""
    for count in range(WARM_UPS + COMINGS_BACK):
        if count == WARM_UPS:
            names, threads, memory = usage()
        show("SOLID")
        yield 0.02
        screen.restart()
        show()
        yield from wait_for(lambda: bool(screen.pictures), 10.0, lambda: f"a picture, the view says {screen.text!r}")
    yield from screen.completed()
    names_after, threads_after, memory_after = usage()
    new_names = [name for name in names_after if names_after.count(name) > names.count(name)]
    note(
        "comes_back",
        times=COMINGS_BACK,
        new_names=new_names,
        threads=(threads, threads_after),
        megabytes=(memory, memory_after),
    )


def turns() -> Steps:
    """Turn the view of sample scenes, step by step as the mouse does."""
    for name in TURNED_SCENES:
        yield from open_scene(name)
        yield from size_view(SIDE)
        # What Blender draws over a view costs more than the picture where OpenGL is software.
        space().overlay.show_overlays = False
        show()
        screen.restart()
        yield from screen.completed(within=60.0)
        region_3d = space().region_3d
        region_3d.view_perspective = "PERSP"
        yield 0.1
        screen.restart()
        gaps = []
        start = last = time.perf_counter()
        while last < start + TURN_FOR:
            region_3d.view_rotation = Quaternion((0.0, 0.0, 1.0), 0.02) @ region_3d.view_rotation
            yield TICK
            now = time.perf_counter()
            gaps.append(now - last)
            last = now
        rate = len(screen.pictures) / (last - start)
        sizes = sorted({picture[0] for picture in screen.pictures})
        screen.restart()
        yield from screen.completed()
        region = view()[1]
        size = region.width, region.height
        note("turns", scene=name, view=size, rate=rate, gap=max(gaps), sizes=sizes)


def renders() -> Steps:
    """Press F12 and wait for the picture."""
    yield from open_scene("cornell_box")
    bpy.context.scene.render.resolution_percentage = 25
    settings().samples = 16
    seconds = yield from rendered(lambda: None)
    note("renders", seconds=seconds, picture=save_render("render.png"))


def escapes() -> Steps:
    """Press Escape during a render that would go on for long."""
    bpy.context.scene.render.resolution_percentage = 100
    settings().samples = 256
    settings().tile_size = 32
    ends: list[float] = []
    pressed: list[float] = []
    bpy.app.handlers.render_cancel.append(lambda *_: ends.append(time.perf_counter()))

    def during() -> Steps:
        yield 1.5
        pressed.append(time.perf_counter())
        press("Escape")

    yield from rendered(during)
    if not ends:
        raise RuntimeError("the render ended before Escape was pressed")
    note("escapes", seconds=ends[0] - pressed[0], picture=save_render("escaped.png"))
    bpy.app.handlers.render_cancel.clear()


def rendered(during: Callable[[], Steps | None]) -> Steps:
    """Press F12, do something meanwhile, and wait for the end; returns the seconds that it took."""
    yield from enter()
    start = time.perf_counter()
    yield from started_render()
    yield from during() or ()
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"), 30.0, lambda: "the end of the render")
    seconds = time.perf_counter() - start
    yield from close_other_windows()
    return seconds


def started_render() -> Steps:
    starts: list[bool] = []
    bpy.app.handlers.render_pre.append(lambda *_: starts.append(True))
    press("F12")
    yield from wait_for(lambda: bool(starts), 5.0, lambda: "a render to start after F12 was pressed")
    bpy.app.handlers.render_pre.clear()


def close_other_windows() -> Steps:
    yield 0.2
    for window in list(bpy.context.window_manager.windows)[1:]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.window_close()
    yield 0.2


def save_render(name: str) -> str:
    path = folder / name
    image = bpy.context.scene.render.image_settings
    if hasattr(image, "media_type"):  # Blender 5.0 and later
        image.media_type = "IMAGE"
    image.file_format, image.color_mode = "PNG", "RGBA"
    bpy.data.images["Render Result"].save_render(str(path))
    return str(path)


def opens() -> Steps:
    """Open another file while the view renders, and while F12 does."""
    settings().preview_samples = ENDLESS
    show()
    screen.restart()
    yield from wait_for(lambda: len(screen.pictures) > 2, 20.0, lambda: f"pictures, the view says {screen.text!r}")
    for during, scene in (("view", "glossy"), ("render", "cornell_box")):
        if during == "render":
            settings().samples = ENDLESS
            settings().tile_size = 16
            yield from started_render()
            yield 1.0
            if not bpy.app.is_job_running("RENDER"):
                raise RuntimeError("the render ended before another file was opened")
        start = time.perf_counter()
        yield from open_scene(scene)
        seconds = time.perf_counter() - start
        yield 1.0
        names, _, _ = usage()
        left = [name for name in names if name.startswith("rooks")]
        show()
        screen.restart()
        yield from screen.completed(within=60.0)
        note("opens", during=during, seconds=seconds, threads=left, pictures=screen.pictures[-1:])


def quits_viewing() -> Steps:
    """Quit while the view renders."""
    yield from enter()
    settings().preview_samples = ENDLESS
    show()
    yield from wait_for(lambda: len(screen.pictures) > 2, 30.0, lambda: f"pictures, the view says {screen.text!r}")
    note("quits")
    bpy.ops.wm.quit_blender()


def quits_rendering() -> Steps:
    """Quit while F12 renders, and the view as well."""
    yield from enter()
    settings().samples = ENDLESS
    settings().preview_samples = ENDLESS
    show()
    yield from wait_for(lambda: len(screen.pictures) > 2, 30.0, lambda: f"pictures, the view says {screen.text!r}")
    yield from started_render()
    yield 1.0
    if not bpy.app.is_job_running("RENDER"):
        raise RuntimeError("the render ended before Blender quit")
    note("quits")
    bpy.ops.wm.quit_blender()


def quits_compiling() -> Steps:
    """Quit while kernels are being compiled, and a view waits for them."""
    yield from enter()
    bpy.context.scene.render.engine = "ROOKS"
    show()
    yield from wait_for(lambda: "ompiling" in screen.text, 10.0, lambda: f"compilation, the view says {screen.text!r}")
    yield 1.0
    note("quits", text=screen.text)
    bpy.ops.wm.quit_blender()


def quits_rendered() -> Steps:
    """Press F12 as the first thing in a new Blender, note when the first tile comes, and quit after the render."""
    yield from enter()
    settings().samples = 16
    tiles: list[float] = []
    engine = importlib.import_module(f"{EXTENSION}.addon.engine").RooksRenderEngine
    show_tile = engine._show

    def show_and_look(*arguments) -> None:
        show_tile(*arguments)
        tiles.append(time.perf_counter())

    engine._show = show_and_look
    start = time.perf_counter()
    press("F12")
    yield from wait_for(lambda: bool(tiles), 30.0, lambda: "the first tile")
    yield from wait_for(lambda: not bpy.app.is_job_running("RENDER"), 60.0, lambda: "the end of the render")
    note("quits", first_tile=tiles[0] - start)
    bpy.ops.wm.quit_blender()


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


if __name__ == "__main__":
    name, notes_file, folder_name = sys.argv[sys.argv.index("--") + 1 :]
    notes, folder = Path(notes_file), Path(folder_name)
    stories = at_work, quits_viewing, quits_rendering, quits_rendered, quits_compiling
    begin({story.__name__: story for story in stories}[name])
