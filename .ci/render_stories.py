"""F12, and the ends of a render: Escape, other files, quitting Blender. `window_script.py` tells these."""

import importlib
import sys
import time

import bpy
import driven_window as window
from driven_window import Steps

ENDLESS = 16384  # samples: a render that does not end by itself while the script is at it


def renders() -> Steps:
    """Press F12 and wait for the picture."""
    yield from window.open_scene("cornell_box")
    bpy.context.scene.render.resolution_percentage = 25
    window.settings().samples = 16
    seconds = yield from window.rendered(lambda: None)
    window.note("renders", seconds=seconds, picture=window.save_render("render.png"))


def renders_to_slots() -> Steps:
    """Render once more, to another slot: the first slot keeps its picture."""
    slots = bpy.data.images["Render Result"].render_slots
    while len(slots) < 2:
        slots.new()
    slots.active_index = 1
    window.settings().samples = 1
    yield from window.rendered(lambda: None)
    pictures = [window.save_render("second.png")]
    slots.active_index = 0
    pictures.append(window.save_render("first.png"))
    window.note("renders_to_slots", pictures=pictures)


def animates() -> Steps:
    """Press Ctrl+F12: an animation."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = str(window.folder / "frame_")
    window.choose_png()
    yield from window.rendered(lambda: None, "animation")
    window.note("animates", written=sorted(path.name for path in window.folder.glob("frame_*")))


def escapes() -> Steps:
    """Press Escape during a render that would go on for long."""
    bpy.context.scene.render.resolution_percentage = 100
    window.settings().samples = 256
    window.settings().tile_size = 32
    ends: list[float] = []
    pressed: list[float] = []
    bpy.app.handlers.render_cancel.append(lambda *_: ends.append(time.perf_counter()))

    def during() -> Steps:
        yield 1.5
        pressed.append(time.perf_counter())
        window.press("Escape")

    yield from window.rendered(during)
    if not ends:
        raise RuntimeError("the render ended before Escape was pressed")
    window.note("escapes", seconds=ends[0] - pressed[0], picture=window.save_render("escaped.png"))
    bpy.app.handlers.render_cancel.clear()


def opens() -> Steps:
    """Open another file while the view renders, and while F12 does."""
    window.settings().preview_samples = ENDLESS
    window.show()
    window.screen.restart()
    yield from window.wait_for(
        lambda: len(window.screen.pictures) > 2, 20.0, lambda: f"pictures, the view says {window.screen.text!r}"
    )
    for during, scene in (("view", "glossy"), ("render", "cornell_box")):
        if during == "render":
            window.settings().samples = ENDLESS
            window.settings().tile_size = 16
            yield from window.started_render()
            yield 1.0
            if not bpy.app.is_job_running("RENDER"):
                raise RuntimeError("the render ended before another file was opened")
        start = time.perf_counter()
        yield from window.open_scene(scene)
        seconds = time.perf_counter() - start
        yield 1.0
        names, _, _ = window.usage()
        left = [name for name in names if name.startswith("rooks")]
        window.show()
        window.screen.restart()
        yield from window.screen.completed(within=60.0)
        window.note("opens", during=during, seconds=seconds, threads=left, pictures=window.screen.pictures[-1:])


def quits_viewing() -> Steps:
    """Quit while the view renders."""
    yield from window.enter()
    window.settings().preview_samples = ENDLESS
    window.show()
    yield from window.wait_for(
        lambda: len(window.screen.pictures) > 2, 30.0, lambda: f"pictures, the view says {window.screen.text!r}"
    )
    window.note("quits")
    bpy.ops.wm.quit_blender()


def quits_rendering() -> Steps:
    """Quit while F12 renders, and the view as well."""
    yield from window.enter()
    window.settings().samples = ENDLESS
    window.settings().preview_samples = ENDLESS
    window.show()
    yield from window.wait_for(
        lambda: len(window.screen.pictures) > 2, 30.0, lambda: f"pictures, the view says {window.screen.text!r}"
    )
    yield from window.started_render()
    yield 1.0
    if not bpy.app.is_job_running("RENDER"):
        raise RuntimeError("the render ended before Blender quit")
    window.note("quits")
    bpy.ops.wm.quit_blender()


def quits_compiling() -> Steps:
    """Quit while kernels are being compiled, and a view waits for them."""
    yield from window.enter()
    bpy.context.scene.render.engine = "ROOKS"
    window.show()
    yield from window.wait_for(
        lambda: "ompiling" in window.screen.text,
        10.0,
        lambda: f"compilation, the view says {window.screen.text!r}",
    )
    ends: list[float] = []
    bpy.app.handlers.render_cancel.append(lambda *_: ends.append(time.perf_counter()))
    yield from window.started_render()
    yield 3.0
    pressed = time.perf_counter()
    window.press("Escape")
    yield from window.wait_for(lambda: bool(ends), 20.0, lambda: "Escape to end a render that waits for kernels")
    window.note("escapes_compiling", seconds=ends[0] - pressed)
    yield from window.close_other_windows()
    window.note("quits", text=window.screen.text)
    bpy.ops.wm.quit_blender()


def quits_rendered() -> Steps:
    """Press F12 in a new Blender that has loaded the kernels, note when the first tile comes, and quit afterwards."""
    yield from window.enter()
    window.settings().samples = 16
    tiles: list[float] = []
    engine = importlib.import_module(f"{window.EXTENSION}.addon.engine").RooksRenderEngine
    show_tile = engine._show

    def show_and_look(*arguments) -> None:
        show_tile(*arguments)
        tiles.append(time.perf_counter())

    engine._show = show_and_look
    yield from window.wait_for(are_loaded, 10.0, lambda: "kernels to be loaded ahead of a render")
    start = time.perf_counter()
    window.press("F12")
    yield from window.wait_for(lambda: bool(tiles), 30.0, lambda: "the first tile")
    yield from window.wait_for(lambda: not bpy.app.is_job_running("RENDER"), 60.0, lambda: "the end of the render")
    window.note("quits", first_tile=tiles[0] - start)
    bpy.ops.wm.quit_blender()


def are_loaded() -> bool:
    integrator = sys.modules.get(f"{window.EXTENSION}.core.integrator")
    return integrator is not None and bool(integrator.render_blocks.signatures)
