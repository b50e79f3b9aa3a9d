"""Inside Blender's window: do what a user does, and note what is to be seen. `window.py` starts this, and judges.

blender … --python .ci/window_script.py -- STORY NOTES FOLDER
"""

import importlib
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driven_window as window
from driven_window import Steps

TURNED_SCENES = "still_life", "cornell_box", "glossy"
SIDE = 512  # pixels, of the view that is turned
TURN_FOR = 3.0  # seconds
SAMPLES = 9  # few, and a count that every sampler can make
COMINGS_BACK = 50
WARM_UPS = 5  # comings back before the first count: by then all is there that is kept once and for all
ENDLESS = 16384  # samples: a render that does not end by itself while the script is at it


def at_work() -> Steps:
    """A user at work in the window: one thing after the other, in one Blender."""
    yield from window.enter()
    for step in (chooses, changes, looks, takes_back, comes_back, turns, renders, escapes, opens):
        try:
            yield from step()
        except Exception:
            window.note("failure", step=step.__name__, text=traceback.format_exc())
            break
    window.note("quits")
    bpy.ops.wm.quit_blender()


def chooses() -> Steps:
    """Choose the engine in Blender's own first scene, and the rendered view."""
    bpy.context.scene.render.engine = "ROOKS"
    yield from window.size_view(SIDE)
    window.settings().preview_samples = SAMPLES
    window.show()
    start = time.monotonic()
    yield from window.screen.completed(within=170.0)
    announced = sorted(text for text in window.screen.texts if "ompiling" in text)
    window.note("chooses", pictures=window.screen.pictures, seconds=time.monotonic() - start, announced=announced)
    yield from photograph()


def photograph() -> Steps:
    """A picture, and what the X server shows of it without all that Blender draws over it."""
    window.space().overlay.show_overlays = window.space().show_gizmo = False
    window.space().region_3d.view_distance = 5.0
    yield from window.enter()
    window.screen.restart()
    window.space().region_3d.view_distance = 4.0
    yield from window.screen.completed()
    yield 0.3
    subprocess.run(["import", "-window", window.window_id(), str(window.folder / "view.png")], check=True)
    np.save(window.folder / "view.npy", window.screen.latest.pixels)
    region = window.view()[1]
    window.note("photograph", left=region.x, top=window.main_window().height - region.y - region.height)
    window.space().overlay.show_overlays = window.space().show_gizmo = True


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
        ("the sampler", lambda: setattr(window.settings(), "sampler", "RANDOM")),
        ("the seed", lambda: setattr(window.settings(), "seed", 7)),
        ("the samples", lambda: setattr(window.settings(), "preview_samples", 4 * SAMPLES)),
    ):
        before = window.screen.latest.pixels
        window.screen.restart()
        change()
        yield from window.screen.completed(after=what)
        window.note(
            "changes", what=what, pictures=window.screen.pictures, differs=differ(before, window.screen.latest.pixels)
        )
    window.settings().preview_samples = SAMPLES
    window.screen.restart()
    yield from window.screen.completed()


def differ(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape != other.shape or not np.array_equal(one, other)


def looks() -> Steps:
    """Look through the camera, and at parts of the picture only."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIDE

    def look_through_camera() -> None:
        window.space().region_3d.view_perspective = "CAMERA"

    def border_of_camera() -> None:
        scene.render.use_border = True
        scene.render.border_min_x = scene.render.border_min_y = 0.25
        scene.render.border_max_x = scene.render.border_max_y = 0.75

    def border_of_view() -> None:
        window.space().region_3d.view_perspective = "PERSP"
        window.space().use_render_border = True
        window.space().render_border_min_x, window.space().render_border_max_x = 0.25, 0.5
        window.space().render_border_min_y, window.space().render_border_max_y = 0.5, 1.0

    def no_border() -> None:
        scene.render.use_border = window.space().use_render_border = False

    for what, look in (
        ("camera", look_through_camera),
        ("border of the camera", border_of_camera),
        ("border of the view", border_of_view),
        ("all", no_border),
    ):
        window.screen.restart()
        look()
        yield from window.screen.completed(after=what)
        picture = window.screen.latest
        height, width = picture.pixels.shape[:2]
        region = window.view()[1]
        window.note(
            "looks", what=what, place=(picture.x, picture.y), size=(width, height), view=(region.width, region.height)
        )


def takes_back() -> Steps:
    """Move something, undo, and redo, by the keys."""
    with window.in_view():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["Cube"].select_set(True)
        bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
        bpy.ops.ed.undo_push(message="Start")
    yield from window.enter()
    yield from window.screen.completed()
    before = window.screen.latest.pixels
    seen = {}
    for what, change in (
        ("move", move),
        ("undo", lambda: window.press("undo")),
        ("redo", lambda: window.press("redo")),
    ):
        window.screen.restart()
        change()
        yield from window.screen.completed(after=what)
        seen[what] = window.screen.latest.pixels
    window.note(
        "takes_back",
        moves=differ(before, seen["move"]),
        undoes=not differ(before, seen["undo"]),
        redoes=not differ(seen["move"], seen["redo"]),
    )


def move() -> None:
    with window.in_view():
        bpy.ops.transform.translate("EXEC_DEFAULT", True, value=(0.0, 0.5, 0.5))


def comes_back() -> Steps:
    """Leave the rendered view and come back, many times."""
    for count in range(WARM_UPS + COMINGS_BACK):
        if count == WARM_UPS:
            names, threads, memory = window.usage()
        window.show("SOLID")
        yield 0.02
        window.screen.restart()
        window.show()
        yield from window.wait_for(
            lambda: bool(window.screen.pictures),
            10.0,
            lambda: f"a picture, the view says {window.screen.text!r}",
        )
    yield from window.screen.completed()
    names_after, threads_after, memory_after = window.usage()
    new_names = [name for name in names_after if names_after.count(name) > names.count(name)]
    window.note(
        "comes_back",
        times=COMINGS_BACK,
        new_names=new_names,
        threads=(threads, threads_after),
        megabytes=(memory, memory_after),
    )


def turns() -> Steps:
    """Turn the view of sample scenes, step by step as the mouse does."""
    for name in TURNED_SCENES:
        yield from window.open_scene(name)
        yield from window.size_view(SIDE)
        # What Blender draws over a view costs more than the picture where OpenGL is software.
        window.space().overlay.show_overlays = False
        window.show()
        window.screen.restart()
        yield from window.screen.completed(within=60.0)
        region_3d = window.space().region_3d
        region_3d.view_perspective = "PERSP"
        yield 0.1
        window.screen.restart()
        gaps = []
        start = last = time.perf_counter()
        while last < start + TURN_FOR:
            region_3d.view_rotation = Quaternion((0.0, 0.0, 1.0), 0.02) @ region_3d.view_rotation
            yield window.TICK
            now = time.perf_counter()
            gaps.append(now - last)
            last = now
        rate = len(window.screen.pictures) / (last - start)
        sizes = sorted({picture[0] for picture in window.screen.pictures})
        window.screen.restart()
        yield from window.screen.completed()
        region = window.view()[1]
        size = region.width, region.height
        window.note("turns", scene=name, view=size, rate=rate, gap=max(gaps), sizes=sizes)


def renders() -> Steps:
    """Press F12 and wait for the picture."""
    yield from window.open_scene("cornell_box")
    bpy.context.scene.render.resolution_percentage = 25
    window.settings().samples = 16
    seconds = yield from window.rendered(lambda: None)
    window.note("renders", seconds=seconds, picture=window.save_render("render.png"))


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
    yield 1.0
    window.note("quits", text=window.screen.text)
    bpy.ops.wm.quit_blender()


def are_loaded() -> bool:
    integrator = sys.modules.get(f"{window.EXTENSION}.core.integrator")
    return integrator is not None and bool(integrator.render_blocks.signatures)


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


if __name__ == "__main__":
    name, notes_file, folder_name = sys.argv[sys.argv.index("--") + 1 :]
    window.notes, window.folder = Path(notes_file), Path(folder_name)
    stories = at_work, quits_viewing, quits_rendering, quits_rendered, quits_compiling
    window.begin({story.__name__: story for story in stories}[name])
