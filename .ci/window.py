"""Try the extension's zip in the window of a real Blender: rendered view, F12, Escape, undo, other files, quitting.

    .venv/bin/python .ci/window.py ZIP BLENDER [ARG...]

BLENDER [ARG...] is a command as in `real_blender.py`, and BLENDER [ARG...] --exec COMMAND runs a command beside it: an
X server without a screen (Xvfb) is started in this way. In the window `window_script.py` does what a user does and
notes what it sees; here it is judged.
"""

import os
import signal
from pathlib import Path

import render_checks
import view_checks
from blender_runs import SCENE, Blender, installs, try_zip
from window_visits import is_quiet, quits, start_screen, visit

#: For the first tile: Blender alone takes 0.4 s to evaluate the modifiers of still_life.
SMALL_SCENE = "sample_scenes/cornell_box.blend"


def with_window(blender: Blender, home: Path, zip_file: str) -> None:
    """All that needs a window."""
    installs(blender, zip_file)
    # The splash screen would take the keys.
    set_up = "import bpy; bpy.context.preferences.view.show_splash = False; bpy.ops.wm.save_userpref()"
    blender.succeed("--background", "--python-expr", set_up)
    server, display = start_screen(blender)
    try:
        blender.environment["DISPLAY"] = display
        # First, as long as there are no kernels.
        ended = visit(blender, home, "quits_compiling")
        is_quiet(ended)
        render_checks.escapes_compiling(ended)
        quits(ended)
        work = visit(blender, home, "at_work")
        is_quiet(work)
        for check in (*view_checks.CHECKS, *render_checks.CHECKS, quits):
            check(work)
        for story, scene in (("quits_viewing", SCENE), ("quits_rendering", SCENE), ("quits_rendered", SMALL_SCENE)):
            ended = visit(blender, home, story, scene)
            is_quiet(ended)
            quits(ended)
        render_checks.shows_soon(ended)
    finally:
        os.killpg(server.pid, signal.SIGTERM)
        server.wait()


if __name__ == "__main__":
    try_zip(with_window)
