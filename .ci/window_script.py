"""Inside Blender's window: do what a user does, and note what is to be seen. `window.py` starts this, and judges.

blender … --python .ci/window_script.py -- STORY NOTES FOLDER
"""

import sys
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import driven_window as window
import render_stories as rendering
import view_stories as view
from driven_window import Steps

VIEW_STEPS = (
    *(view.chooses, view.changes, view.looks, view.takes_back),
    *(view.comes_back, view.restarts, view.turns, view.drags),
)
RENDER_STEPS = rendering.renders, rendering.renders_to_slots, rendering.animates, rendering.escapes, rendering.opens


def at_work() -> Steps:
    """A user at work in the window: one thing after the other, in one Blender."""
    yield from window.enter()
    for step in (*VIEW_STEPS, *RENDER_STEPS):
        try:
            yield from step()
        except Exception:
            window.note("failure", step=step.__name__, text=traceback.format_exc())
            break
    window.note("quits")
    bpy.ops.wm.quit_blender()


if __name__ == "__main__":
    name, notes_file, folder_name = sys.argv[sys.argv.index("--") + 1 :]
    window.notes, window.folder = Path(notes_file), Path(folder_name)
    quits = rendering.quits_viewing, rendering.quits_rendering, rendering.quits_rendered, rendering.quits_compiling
    window.begin({story.__name__: story for story in (at_work, *quits)}[name])
