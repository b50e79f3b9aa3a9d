"""Inside Blender's window: arrange what docs/blender.md shows, and photograph it. `screenshots.py` starts this.

    blender --python docs/screenshots_script.py -- NOTES FOLDER

The window is driven by `.ci/driven_window.py`. Each note says which part of a photograph is to be kept.
"""

import importlib
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import addon_utils
import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / ".ci"))
import driven_window as window

#: The window, in pixels of the screen; and while it shows the panels, which are taller.
SIZE = 1280, 800
TALL = 1280, 1220
#: The properties get this much more width, in pixels, so that no name is cut off.
WIDER = 110
COARSE = 8  # side of the pixels in the coarse picture of the view
#: The passes beside the picture, in the order of their menu, and where this is: from the right and from the top.
PASSES = ("depth", "normal", "sampling_error", "denoising_normal", "denoising_albedo")
SHOWN_PASSES = ("normal", "sampling_error", "denoising_albedo")  # depth is in metres, and white
PASS_MENU = 90, 13  # pixels
NEXT_PASS = "5" if bpy.app.version >= (5, 0) else "4"  # the wheel down, or in older Blenders up
Steps = window.Steps


class Hold:
    """Stops the viewport's thread at the first picture for which `at` is true, until it is let go."""

    def __init__(self) -> None:
        self.at: Callable[[object], bool] = lambda _picture: False
        self._goes_on = threading.Event()
        self.is_held = False
        sessions = importlib.import_module(f"{window.EXTENSION}.addon.viewport_session")
        publish = sessions.Session._publish

        def publish_and_wait(session, picture) -> None:
            publish(session, picture)
            if self.at(picture):
                self.at, self.is_held = lambda _picture: False, True
                self._goes_on.wait()

        sessions.Session._publish = publish_and_wait

    def held(self, at: Callable[[object], bool]) -> Steps:
        """Wait for a picture, and keep it in the view."""
        self._goes_on.clear()
        self.at, self.is_held = at, False
        yield from window.wait_for(lambda: self.is_held, 240.0, lambda: "the picture to be held")
        yield 0.5  # until it is drawn

    def let_go(self) -> None:
        self._goes_on.set()


def shoot(name: str, area: bpy.types.Area | None = None) -> None:
    """Photograph the screen, of which the window or an area of it is to be kept."""
    subprocess.run(["import", "-window", "root", str(window.folder / f"{name}.png")], check=True)
    whole = window.main_window()
    left, top, width, height = 0, 0, whole.width, whole.height
    if area is not None:
        left, top, width, height = area.x, whole.height - area.y - area.height, area.width, area.height
    window.note("shot", shot=name, box=(left, top, left + width, top + height))


def area(kind: str) -> bpy.types.Area:
    return next(area for area in window.main_window().screen.areas if area.type == kind)


def point(x: int, y: int) -> None:
    """Move the mouse to a place in the window, which Blender counts from below."""
    place = str(x), str(window.main_window().height - 1 - y)
    window.xdotool("mousemove", "--window", window.window_id(), *place)


def drag(place: tuple[int, int], way: tuple[int, int]) -> Steps:
    """Drag what is at a place, the edge of an area for one."""
    point(*place)
    yield 0.3
    window.xdotool("mousedown", "1")
    yield 0.3
    for share in (0.5, 1.0):
        point(round(place[0] + share * way[0]), round(place[1] + share * way[1]))
        yield 0.3
    window.xdotool("mouseup", "1")
    yield 0.5


def story() -> Steps:
    """All pictures, one after the other."""
    bpy.context.preferences.use_preferences_save = False
    open_performance()
    yield 3.0  # until the window takes the mouse
    for step in (refines, turned, panels, passes, compares, errors):
        yield from step()
    bpy.ops.wm.quit_blender()


def open_performance() -> None:
    """Register the panel as one that is open: whether it is, is Blender's own secret."""
    importlib.import_module(f"{window.EXTENSION}.addon.ui").ROOKS_RENDER_PT_performance.bl_options = set()
    addon_utils.disable(window.EXTENSION)
    addon_utils.enable(window.EXTENSION)


def open_scene(name: str, size: tuple[int, int] = SIZE) -> Steps:
    """Open a scene in a window of a size, with room for the properties' names."""
    yield from window.open_scene(name)
    window.xdotool("windowsize", "--sync", window.window_id(), *map(str, size))
    yield 1.5  # until all areas have found their places
    edge = area("PROPERTIES")
    yield from drag((edge.x - 1, edge.y + edge.height // 2), (-WIDER, 0))
    bpy.context.scene.render.engine = "ROOKS"
    yield from window.enter()


def refines() -> Steps:
    """The view through the camera: coarse, half way, finished."""
    yield from open_scene("still_life")
    window.space().region_3d.view_perspective = "CAMERA"
    window.show()
    hold = Hold()
    yield from hold.held(lambda picture: picture.size == COARSE)
    shoot("viewport_coarse", area("VIEW_3D"))
    hold.let_go()
    yield from hold.held(lambda picture: picture.done >= picture.total // 2)
    shoot("viewport_half", area("VIEW_3D"))
    hold.let_go()
    yield from window.screen.completed()
    yield 0.5
    shoot("viewport")
    shoot("viewport_finished", area("VIEW_3D"))


def turned() -> Steps:
    """Another scene, from another side."""
    yield from open_scene("glossy")
    window.space().region_3d.view_perspective = "PERSP"
    window.screen.restart()
    window.show()
    yield from window.screen.completed(60.0)
    yield 0.5
    shoot("turned")


def panels() -> Steps:
    """The render properties, after a small picture that Performance tells of."""
    yield from open_scene("still_life", TALL)
    show_renders(False)
    bpy.context.scene.render.resolution_percentage = 25
    yield from window.started_render()
    yield from ended_render()
    edge = area("PROPERTIES")
    yield from drag((edge.x + edge.width // 2, edge.y + edge.height), (0, 400))
    shoot("panels", area("PROPERTIES"))


def compares() -> Steps:
    """Compare Samplers, and the sheet that it shows."""
    yield from open_scene("still_life")
    show_renders(True)
    wishes = window.settings().comparison
    wishes.samplers = {"RANDOM", "JITTERED", "MULTI_JITTERED", "SOBOL_OWEN"}
    wishes.counts, wishes.seeds, wishes.size = "4 16", 4, 120
    with window.in_view():
        bpy.ops.rooks.compare_samplers("INVOKE_DEFAULT")
    operators = importlib.import_module(f"{window.EXTENSION}.addon.compare_operators")
    yield from window.wait_for(lambda: operators.running() is None, 120.0, lambda: "the samplers to be compared")
    yield 2.5  # until it is drawn, by OpenGL in software
    shoot("comparison")


def errors() -> Steps:
    """What cannot be rendered: in the view, and in the report after F12."""
    yield from open_scene("still_life")
    bpy.context.scene.camera.data.type = "PANO"
    window.space().region_3d.view_perspective = "CAMERA"
    window.show()
    yield 3.0
    shoot("error")
    window.show("SOLID")
    show_renders(False)
    yield from window.started_render()
    yield from ended_render()
    region = window.view()[1]
    point(region.x + region.width // 2, region.y + region.height // 2)  # Blender shows reports when the mouse moves
    yield 2.5  # until it is drawn, by OpenGL in software
    shoot("report")


def passes() -> Steps:
    """A render result, and its passes, to which the mouse wheel turns on their menu with Ctrl."""
    yield from open_scene("still_life")
    show_renders(True)
    window.settings().samples = 16
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = True
    layer.rooks.use_pass_sampling_error = layer.rooks.use_pass_denoising_data = True
    yield from window.started_render()
    yield from ended_render()
    yield 1.0
    shoot("render")
    image = area("IMAGE_EDITOR")
    for nearer in range(2):  # Blender wants to see the mouse move on the menu
        point(image.x + image.width - PASS_MENU[0] + nearer, image.y + image.height - PASS_MENU[1])
        yield 1.0
    for name in PASSES:
        window.xdotool("keydown", "ctrl", "click", NEXT_PASS, "keyup", "ctrl")
        yield 2.5  # until it is drawn, by OpenGL in software
        if name in SHOWN_PASSES:
            shoot(f"pass_{name}", image)


def ended_render() -> Steps:
    yield from window.wait_for(lambda: not bpy.app.is_job_running("RENDER"), 120.0, lambda: "the end of the render")
    yield 1.0


def show_renders(they_are: bool) -> None:
    """Let pictures take the window's place, as no window manager is there to place another; or let them not."""
    bpy.context.preferences.view.render_display_type = "SCREEN" if they_are else "NONE"


if __name__ == "__main__":
    notes_file, folder = sys.argv[sys.argv.index("--") + 1 :]
    window.notes, window.folder = Path(notes_file), Path(folder)
    window.begin(story)
