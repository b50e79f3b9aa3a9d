"""Take the screenshots of docs/blender.md in a real Blender's window, on a virtual screen.

    .venv/bin/python docs/screenshots.py FOLDER ZIP BLENDER [ARG...]

BLENDER [ARG...] is a command as `.ci/window.py` wants it, and FOLDER, in docs/images/window, is where the pictures go.
What is done in the window is in `screenshots_script.py`.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / "docs" / "images" / "window"
SCRIPT = Path(__file__).with_name("screenshots_script.py")
sys.path.insert(0, str(ROOT / ".ci"))

import blender_runs  # noqa: E402
import window_visits  # noqa: E402

GEOMETRY = "1600x1400x24"  # room for a window in which all panels are seen
TAKES = 580.0  # seconds at most, with kernels to be compiled
QUALITY = 88  # of JPEG: a palette of 256 colours is no smaller, and takes the red out of the pawns


def main() -> None:
    """Install the extension for a user of its own, and take all screenshots."""
    folder, zip_file, *command = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="rooks-") as home:
        blender = blender_runs.Blender(command, Path(home))
        blender_runs.installs(blender, zip_file)
        take(blender, Path(home), PLACE / folder)


def take(blender: blender_runs.Blender, home: Path, place: Path) -> None:
    """Let the script take its pictures, and keep of each what it marks."""
    set_up = "import bpy; bpy.context.preferences.view.show_splash = False; bpy.ops.wm.save_userpref()"
    blender.succeed("--background", "--python-expr", set_up)
    notes_file = home / "screenshots.json"
    notes_file.write_text("")
    server, blender.environment["DISPLAY"] = window_visits.start_screen(blender, GEOMETRY)
    try:
        subprocess.run(
            [*blender.command, "--python", str(SCRIPT), "--", str(notes_file), str(home)],
            cwd=ROOT,
            env=blender.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            timeout=TAKES,
            check=True,
        )
    finally:
        os.killpg(server.pid, signal.SIGTERM)
        server.wait()
    place.mkdir(parents=True, exist_ok=True)
    for note in map(json.loads, notes_file.read_text().splitlines()):
        if note["name"] == "failure":
            sys.exit(f"in {note['step']}: {note['text']}")
        with Image.open(home / f"{note['shot']}.png") as picture:
            shown = picture.convert("RGB").crop(note["box"])
            shown.save(place / f"{note['shot']}.jpg", quality=QUALITY, subsampling=0, optimize=True)


if __name__ == "__main__":
    main()
