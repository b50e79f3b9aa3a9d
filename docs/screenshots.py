"""Take the screenshots of docs/blender.md in a real Blender's window, on a virtual screen.

    .venv/bin/python docs/screenshots.py ZIP BLENDER VERSION

BLENDER VERSION is a command that opens a window when it gets `--window SECONDS SHOT.png` first, and takes
REAL_BLENDER_HOME as the user's home: as `.ci/real_blender.py` wants it, and has it here.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / "docs" / "images" / "window"

#: Each screenshot: its scene, what is done to the window `w` with the 3-D view `view` and the properties `properties`,
#: and how long to wait, in seconds.
SHOTS = {
    "viewport": ("still_life", "view.region_3d.view_perspective = 'CAMERA'", 25),
    "turned": ("glossy", "view.region_3d.view_perspective = 'PERSP'", 25),
    "error": ("still_life", "w.scene.camera.data.type = 'PANO'; view.region_3d.view_perspective = 'CAMERA'", 12),
}
#: Runs in Blender, once its window is there.
SCRIPT = """
import bpy
def show():
    w = bpy.context.window_manager.windows[0]
    spaces = {{area.type: area.spaces.active for area in w.screen.areas}}
    view, properties = spaces["VIEW_3D"], spaces["PROPERTIES"]
    w.scene.render.engine = "ROOKS"
    properties.context = "RENDER"
    {do}
    view.shading.type = "RENDERED"
bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(show, first_interval=2)
"""


def main() -> None:
    """Install the extension for a user of its own, compile its kernels, and take all screenshots."""
    zip_file, *command = sys.argv[1:]
    PLACE.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="rooks-") as home:
        environment = os.environ | {"REAL_BLENDER_HOME": home}

        def blender(*arguments: str) -> None:
            subprocess.run([*command, *arguments], cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)

        blender("--command", "extension", "install-file", "--repo", "user_default", "--enable", zip_file)
        scene = "sample_scenes/still_life.blend"
        blender("--background", scene, "--engine", "ROOKS", "--render-output", f"{home}/frame_", "--render-frame", "1")
        for name, (scene, do, seconds) in SHOTS.items():
            shot, script = Path(home) / f"{name}.png", Path(home) / f"{name}.py"
            script.write_text(SCRIPT.format(do=do))
            blender("--window", str(seconds), str(shot), f"sample_scenes/{scene}.blend", "--python", str(script))
            with Image.open(shot) as picture:
                picture.convert("RGB").quantize(256).save(PLACE / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
