"""A real Blender, run from outside with a user folder of its own: what `real_blender.py` and `window.py` share."""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCENE = "sample_scenes/still_life.blend"
EXTENSION = "bl_ext.user_default.rooks"
ONE_FRAME = ("--render-frame", "1")
QUICK = "s = bpy.context.scene; s.render.resolution_percentage = 25; s.rooks.samples = 4"


class CheckError(Exception):
    """A check that did not hold: its text says which."""


class Blender:
    """A Blender that is started anew for every call, with a user folder of its own."""

    def __init__(self, command: list[str], home: Path) -> None:
        self.command = command
        self.environment = os.environ | {"REAL_BLENDER_HOME": str(home)}
        # Kernels are kept where the extension keeps them for any user.
        self.environment.pop("ROOKS_CACHE_DIR", None)

    def start(self, *arguments: str) -> tuple[int, str]:
        """Run Blender to its end, and return its exit code and all that it printed."""
        result = subprocess.run(
            [*self.command, *arguments],
            cwd=ROOT,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=600,
        )
        return result.returncode, result.stdout

    def succeed(self, *arguments: str) -> str:
        """Run Blender, which must exit with 0, and return all that it printed."""
        code, printed = self.start(*arguments)
        if code:
            raise CheckError(f"blender {' '.join(arguments)}\nexited with {code}:\n{printed}")
        return printed

    def render(self, output: Path, change: str = "", frames: tuple[str, ...] = ONE_FRAME) -> tuple[int, str]:
        """Render the sample scene, small, after running `change` on the scene `s`."""
        prepare = ("--python-exit-code", "9", "--python-expr", f"import bpy; {QUICK}; {change}")
        place = ("--render-output", str(output), "--render-format", "OPEN_EXR")
        return self.start("--background", SCENE, "--engine", "ROOKS", *prepare, *place, *frames)


def try_zip(check: Callable[[Blender, Path, str], None]) -> None:
    """Check the zip that the command line names, for a new user; exit with 1 and a text where a check fails."""
    zip_file, *command = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="rooks-") as folder:
        home = Path(folder)
        try:
            check(Blender(command, home), home, zip_file)
        except CheckError as failure:
            sys.exit(f"FAILED: {failure}")


def installs(blender: Blender, zip_file: str) -> None:
    """The zip is valid, and can be installed and enabled."""
    blender.succeed("--command", "extension", "validate", zip_file)
    blender.succeed("--command", "extension", "install-file", "--repo", "user_default", "--enable", zip_file)
    listed = blender.succeed("--command", "extension", "list")
    if not re.search(r"^\s*rooks\b.*\[installed\]", listed, re.MULTILINE):
        raise CheckError(f"the extension was installed, but is not listed:\n{listed}")
    print("ok: valid, installed, enabled", flush=True)
