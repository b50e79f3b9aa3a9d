"""The rendered view as a user sees it: chosen, changed, turned, left and come back to. `window_script.py` tells it."""

import subprocess
import time
from collections.abc import Callable, Generator
from pathlib import Path

import bpy
import driven_window as window
import numpy as np
from driven_window import Steps
from mathutils import Quaternion

TURNED_SCENES = sorted(path.stem for path in window.SCENES.glob("*.blend"))
SIDE = 512  # pixels, of the view that is turned
SMALL_SIDE = 320  # of the view before that: its pictures are soon complete
TURN_FOR = 2.0  # seconds
SAMPLES = 9  # few, and a count that every sampler can make
COMINGS_BACK = 50
RESTARTS = 1000
WARM_UPS = 5  # before the first count: by then all is there that is kept once and for all


def chooses() -> Steps:
    """Choose the engine in Blender's own first scene, and the rendered view."""
    bpy.context.scene.render.engine = "ROOKS"
    yield from window.size_view(SMALL_SIDE)
    window.settings().preview_samples = SAMPLES
    window.show()
    start = time.monotonic()
    yield from window.screen.completed(within=170.0)
    announced = sorted(text for text in window.screen.texts if "ompiling" in text)
    window.note("chooses", pictures=window.screen.pictures, seconds=time.monotonic() - start, announced=announced)
    yield from photograph()


def photograph() -> Steps:
    """A picture, as Blender saves it, and as the X server shows it without all that Blender draws over it."""
    window.space().overlay.show_overlays = window.space().show_gizmo = False
    window.space().region_3d.view_distance = 5.0
    yield from window.enter()
    window.screen.restart()
    window.space().region_3d.view_distance = 4.0
    yield from window.screen.completed()
    yield 0.3
    shown, picture = window.folder / "view.png", window.folder / "picture.png"
    subprocess.run(["import", "-window", window.window_id(), str(shown)], check=True)
    save_as_shown(window.screen.latest.pixels, picture)
    region = window.view()[1]
    top = window.main_window().height - region.y - region.height
    window.note("photograph", shown=str(shown), picture=str(picture), left=region.x, top=top)
    window.space().overlay.show_overlays = window.space().show_gizmo = True


def save_as_shown(pixels: np.ndarray, path: Path) -> None:
    """Save a linear picture with the scene's view transform."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("picture", width, height, alpha=True, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    window.choose_png()
    image.save_render(str(path), scene=bpy.context.scene)
    bpy.data.images.remove(image)


def changes() -> Steps:
    """Change one thing after the other."""
    scene, cube = bpy.context.scene, bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=1)
    cube.location.z += 0.5
    cube.keyframe_insert("location", frame=20)

    def change_material() -> None:
        cube.active_material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.1, 0, 1)

    def change_mesh() -> None:
        cube.data.vertices[0].co.z += 0.5
        cube.data.update()

    def add_floor() -> None:
        with window.in_view():
            bpy.ops.mesh.primitive_plane_add(size=8.0, location=(0.0, 0.0, -1.0))

    def indirect_only(is_so: bool) -> None:
        collection = bpy.context.view_layer.layer_collection.children[0]
        collection.indirect_only = is_so

    def override() -> None:
        bpy.context.view_layer.material_override = bpy.data.materials.new("Override")

    for what, change in (
        ("a material", change_material),
        ("a light", lambda: setattr(bpy.data.objects["Light"].data, "energy", 200.0)),
        ("a mesh", change_mesh),
        ("a new object", add_floor),
        ("a place", lambda: setattr(bpy.data.objects["Plane"].location, "x", 1.0)),
        ("the frame", lambda: scene.frame_set(10)),
        (
            "the world",
            lambda: setattr(scene.world.node_tree.nodes["Background"].inputs[1], "default_value", 2.0),
        ),
        ("hiding an object", lambda: cube.hide_set(True)),
        ("showing it again", lambda: cube.hide_set(False)),
        ("the sampler", lambda: setattr(window.settings(), "sampler", "RANDOM")),
        ("the seed", lambda: setattr(window.settings(), "seed", 7)),
        ("the bounces", lambda: setattr(window.settings(), "max_bounces", 1)),
        ("the clamp", lambda: setattr(window.settings(), "clamp_indirect", 0.01)),
        ("the filter", lambda: setattr(window.settings(), "pixel_filter", "BLACKMAN_HARRIS")),
        ("the film", lambda: setattr(scene.render, "film_transparent", True)),
        ("what is seen indirectly only", lambda: indirect_only(True)),
        ("what is seen directly too", lambda: indirect_only(False)),
        ("a view layer's material", override),
        ("the world's place", lambda: setattr(scene, "world", None)),
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
    scene.render.resolution_x = scene.render.resolution_y = SMALL_SIDE

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
    note_growth("comes_back", COMINGS_BACK, names, threads, memory)


def restarts() -> Steps:
    """Change a setting very many times, mostly before a picture of the last change is finished."""
    for count in range(WARM_UPS + RESTARTS):
        if count == WARM_UPS:
            names, threads, memory = window.usage()
        window.settings().seed = count
        window.screen.restart()
        if count % 20 == 0:
            yield from window.wait_for(lambda: bool(window.screen.pictures), 10.0, lambda: "a picture")
        yield 2 * window.TICK
    yield from window.screen.completed()
    note_growth("restarts", RESTARTS, names, threads, memory)


def note_growth(what: str, times: int, names: list[str], threads: int, memory: float) -> None:
    """What there is more of since some time before: its threads' names, their number, and its memory."""
    names_after, threads_after, memory_after = window.usage()
    window.note(
        what,
        times=times,
        new_names=[name for name in names_after if names_after.count(name) > names.count(name)],
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
        window.space().region_3d.view_perspective = "PERSP"
        yield 0.1
        window.screen.restart()
        rate, gap = yield from kept_moving(turn)
        sizes = sorted({picture[0] for picture in window.screen.pictures})
        window.screen.restart()
        yield from window.screen.completed()
        region = window.view()[1]
        size = region.width, region.height
        window.note("turns", scene=name, view=size, rate=rate, gap=gap, sizes=sizes)


def turn() -> None:
    region_3d = window.space().region_3d
    region_3d.view_rotation = Quaternion((0.0, 0.0, 1.0), 0.02) @ region_3d.view_rotation


def drags() -> Steps:
    """Drag an object of a sample scene, which is exported again and again."""
    yield from window.open_scene("still_life")
    yield from window.size_view(SIDE)
    window.space().overlay.show_overlays = False
    window.show()
    window.screen.restart()
    yield from window.screen.completed(within=60.0)
    obj = next(obj for obj in bpy.context.scene.objects if obj.type == "MESH")
    window.screen.restart()
    rate, gap = yield from kept_moving(lambda: setattr(obj.location, "x", obj.location.x + 0.002))
    yield from window.screen.completed()
    window.note("drags", what=obj.name, rate=rate, gap=gap)


def kept_moving(move: Callable[[], None]) -> Generator[float, None, tuple[float, float]]:
    """Move something at each tick; returns the pictures per second, and how long the window waited at most."""
    gaps = []
    start = last = time.perf_counter()
    while last < start + TURN_FOR:
        move()
        yield window.TICK
        now = time.perf_counter()
        gaps.append(now - last)
        last = now
    return len(window.screen.pictures) / (last - start), max(gaps)
