"""Try the extension's zip in a real Blender: validate, install, render and compare samplers, fail as one should.

    .venv/bin/python .ci/real_blender.py ZIP BLENDER [ARG...]

BLENDER [ARG...] is the command that starts Blender, in this folder and with the temporary folder in its sight; it is to
take REAL_BLENDER_HOME as the user's home, so that nothing is left behind.
"""

import re
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
from blender_runs import EXTENSION, ONE_FRAME, ROOT, SCENE, Blender, CheckError, try_zip
from lifetime import comes_after_an_older_version, goes, keeps_its_kernels

ENABLING_MAY_TAKE_MS = 50
STARTS = 5
TWO_FRAMES = ("--frame-start", "1", "--frame-end", "2", "--render-anim")

#: Ways in which Rooks cannot render for want of something: what brings them about, and what it says.
FAILURES = {
    "no embreex": ("import sys; sys.modules['embreex'] = None", "embreex is not installed"),
    "no numba": ("import sys; sys.modules['numba'] = None", "numba"),
    "no place for kernels": (
        "import os, tempfile; os.environ['ROOKS_CACHE_DIR'] = tempfile.tempdir = '/proc/none'",
        "compiled kernels can be kept neither in",
    ),
    "an unfit processor": (
        f"import {EXTENSION}.core.embree as e; e.load_library().rtcNewDevice = lambda _: None",
        "Embree cannot start on this processor",
    ),
}

TIME_ENABLING = f"""
import addon_utils, sys, time
loaded, before = set(sys.modules), time.perf_counter()
assert addon_utils.enable("{EXTENSION}", default_set=False), "the extension cannot be enabled"
print("enabled in ms:", 1000 * (time.perf_counter() - before))
heavy = {{"numpy", "numba", "llvmlite", "embreex", "matplotlib", "PIL"}} & (set(sys.modules) - loaded)
assert not heavy, f"enabling the extension imports {{heavy}}, which can wait for the first render"
"""
SPEAK_GERMAN = f"""
import bpy
from {EXTENSION}.addon import progress, translations
from {EXTENSION}.core import RenderSettings
bpy.context.preferences.view.language = "de_DE"
settings = RenderSettings(samples=17, sampler="random")
error = bpy.app.translations.pgettext_iface("Sampling Error")
print("in German:", ", ".join((progress.sample_text(settings), progress.sampler_label("regular"), error)))
"""


def without_window(blender: Blender, home: Path, zip_file: str) -> None:
    """All that needs no window."""
    comes_after_an_older_version(blender, home, zip_file)
    renders(blender, home)
    keeps_its_kernels(home)
    refuses(blender, home)
    fails(blender, home)
    renders_by_command(blender, home)
    renders_frames_by_command(blender, home)
    compares(blender, home)
    speaks_german(blender)
    starts_quickly(blender)
    goes(blender, home)


def renders(blender: Blender, home: Path) -> None:
    """One frame and a range of frames become pictures; the kernels are kept for the second."""
    for name, frames, files in (
        ("frame", ONE_FRAME, ["frame_0001.exr"]),
        ("range", TWO_FRAMES, ["range_0001.exr", "range_0002.exr"]),
    ):
        code, printed = blender.render(home / f"{name}_", frames=frames)
        if code or "Traceback" in printed:
            raise CheckError(f"rendering {name} exited with {code}:\n{printed}")
        for file in files:
            if not (home / file).exists():
                raise CheckError(f"rendering {name} wrote no {file}:\n{printed}")
            check_picture(home / file)
    print("ok: renders a frame, and a range of frames", flush=True)


def check_picture(path: Path) -> None:
    """A picture has finite pixels that are not all the same."""
    with OpenEXR.File(str(path)) as exr:
        pixels = {name: channel.pixels for part in exr.parts for name, channel in part.channels.items()}
    colour = next((values for name, values in pixels.items() if name.endswith(("RGBA", "RGB"))), None)
    if colour is None:
        raise CheckError(f"{path.name} has no colour, only {', '.join(pixels)}")
    if not np.isfinite(colour).all():
        raise CheckError(f"{path.name} has pixels that are not finite")
    if np.ptp(colour[..., :3]) < 0.01:
        raise CheckError(f"{path.name} has one colour all over: {colour[0, 0]}")


def refuses(blender: Blender, home: Path) -> None:
    """A scene that cannot be rendered exits with an error, names it and writes nothing."""
    for name, change, says in (
        ("no camera", "s.camera = None", "camera"),
        ("panoramic camera", "s.camera.data.type = 'PANO'", "panoramic"),
    ):
        code, printed = blender.render(home / f"{name}_", change)
        if code == 0:
            raise CheckError(f"a scene with {name} exited with 0:\n{printed}")
        if "Traceback" in printed or says not in printed.lower():
            raise CheckError(f"a scene with {name} does not say clearly what is wrong:\n{printed}")
        if written := [path.name for path in home.glob(f"{name}_*")]:
            raise CheckError(f"a scene with {name} wrote {', '.join(written)}:\n{printed}")
    print("ok: exits with an error and writes nothing without a camera, and with a panoramic one", flush=True)


def fails(blender: Blender, home: Path) -> None:
    """Without what it needs, Blender starts, and the render exits with an error, says what is wrong in a line, and
    writes nothing."""
    for name, (change, says) in FAILURES.items():
        code, printed = blender.render(home / f"{name}_", change)
        lines = [line for line in printed.splitlines() if says in line]
        if code == 0 or not lines or "Traceback" in printed:
            raise CheckError(f"with {name} Blender does not say clearly what is wrong, exit code {code}:\n{printed}")
        if written := [path.name for path in home.glob(f"{name}_*")]:
            raise CheckError(f"with {name} a render wrote {', '.join(written)}:\n{printed}")
    print(f"ok: says what is wrong with {', '.join(FAILURES)}", flush=True)


def renders_by_command(blender: Blender, home: Path) -> None:
    """The extension's own command renders the file that is open as the command without Blender does."""
    (home / "command").mkdir()
    options = ("render", "--resolution", "64x40", "--samples", "4", "--output")
    command = ("--command", "rooks", *options)
    printed = blender.succeed(SCENE, *command, f"{home / 'command'}/")
    written = sorted(path.name for path in (home / "command").iterdir())
    if written != ["still_life.exr", "still_life.png"] or "4 samples per pixel" not in printed:
        raise CheckError(f"the render command wrote {', '.join(written)}:\n{printed}")
    outside = home / "outside.exr"
    subprocess.run([sys.executable, "-m", "addon", *options, str(outside), SCENE], cwd=ROOT, check=True)
    check_alike(home / "command/still_life.exr", outside)
    for says, code, arguments in (
        ("has no camera", 1, ("--python-expr", "import bpy; bpy.context.scene.camera = None", *command)),
        ("nonsense", 2, (*command[:-1], "--sampler", "nonsense", "--output")),
    ):
        older = home / "command/older.exr"
        older.write_text("an older picture")
        status, printed = blender.start(SCENE, *arguments, str(older))
        lines = [line for line in printed.splitlines() if line.startswith("rooks:")]
        if status != code or len(lines) != 1 or says not in lines[0] or "Traceback" in printed:
            raise CheckError(f"the render command does not say clearly what is wrong, exit code {status}:\n{printed}")
        if older.read_text() != "an older picture":
            raise CheckError(f"the render command destroys a picture where {says}")
    print("ok: renders by its own command, and says what is wrong with exit codes 1 and 2", flush=True)


def renders_frames_by_command(blender: Blender, home: Path) -> None:
    """The extension's own command renders a range of frames, a region of each, as the command without Blender does."""
    region = ("--border", "0", "1", "0", "0.5", "--crop", "--transparent", "--filter", "blackman_harris")
    options = ("render", "--resolution", "64x40", "--samples", "4", *region, "--frames", "1", "2", "--output")
    blender.succeed(SCENE, "--command", "rooks", *options, str(home / "inside.exr"))
    subprocess.run([sys.executable, "-m", "addon", *options, str(home / "outside.exr"), SCENE], cwd=ROOT, check=True)
    for number in ("0001", "0002"):
        check_alike(home / f"inside_{number}.exr", home / f"outside_{number}.exr")
    print("ok: renders frames and a region of them by its own command", flush=True)


def check_alike(inside: Path, outside: Path) -> None:
    """Blender's EXR of a picture has the passes, and the words on how it was made, of the EXR made without Blender."""
    with OpenEXR.File(str(inside), separate_channels=True) as exr:
        told = dict(exr.header())
        ours = {name.split(".", 1)[1]: c.pixels for part in exr.parts for name, c in part.channels.items()}
    with OpenEXR.File(str(outside), separate_channels=True) as exr:
        wanted = {name: value for name, value in exr.header().items() if name.startswith("rooks:")}
        channels = {name if "." in name else f"Combined.{name}": c.pixels for name, c in exr.channels().items()}
    for name, value in wanted.items():
        # Times and versions differ.
        if name not in told or (name in ("rooks:samples", "rooks:light_sampler") and told[name] != str(value)):
            raise CheckError(f"{inside.name} says of {name}: {told.get(name)!r}, not {value!r}")
    for name, pixels in channels.items():
        if name not in ours or not np.allclose(ours[name], pixels, rtol=1e-4, atol=1e-4):
            raise CheckError(f"{name} of {inside.name} is not that of the picture made without Blender")


def compares(blender: Blender, home: Path) -> None:
    """The extension's own command compares samplers on the file that is open, and its exit code reaches the shell."""
    command = (SCENE, "--command", "rooks", "compare", "--resolution", "64x40", "--seeds", "2", "--output")
    samplers = ("--counts", "1", "4", "--samplers", "random")
    printed = blender.succeed(*command, str(home / "comparison"), *samplers, "multi_jittered")
    written = sorted(path.name.removeprefix("still_life_samplers") for path in (home / "comparison").iterdir())
    if written != [".csv", ".json", ".png", ".svg", "_chart.png", "_chart.svg"]:
        raise CheckError(f"the comparison wrote {', '.join(written)}:\n{printed}")
    if "for this scene" not in printed:
        raise CheckError(f"the comparison recommends nothing:\n{printed}")
    if strays := [path for path in (home / ".cache/matplotlib", home / ".config/matplotlib") if path.exists()]:
        raise CheckError(f"comparing writes outside of the extension's own folder: {', '.join(map(str, strays))}")
    code, printed = blender.start(*command, str(home / "refused"), *samplers, "nonsense")
    if code != 2 or "unknown sampler 'nonsense'" not in printed or (home / "refused").exists():
        raise CheckError(f"a sampler that does not exist is not refused, exit code {code}:\n{printed}")
    print("ok: compares samplers, and refuses an unknown one with exit code 2", flush=True)


def speaks_german(blender: Blender) -> None:
    """In German, status lines and the names of settings are German, and German for what Rooks means by them."""
    script = ("--background", "--python-exit-code", "9", "--python-expr", SPEAK_GERMAN)
    said = re.search(r"in German: (.*)", blender.succeed(*script))[1]
    if said != "17 Abtastwerte pro Pixel, Regelmäßig, Abtastfehler":
        raise CheckError(f"in German it says: {said}")
    print("ok: speaks German", flush=True)


def starts_quickly(blender: Blender) -> None:
    """Enabling the extension costs Blender's start next to nothing, and leaves the heavy imports for later."""
    script = ("--background", "--factory-startup", "--python-exit-code", "9", "--python-expr", TIME_ENABLING)
    printed = [blender.succeed(*script) for _ in range(STARTS)]
    times = [float(re.search(r"enabled in ms: ([\d.]+)", text)[1]) for text in printed]
    median = statistics.median(times)
    if median >= ENABLING_MAY_TAKE_MS:
        raise CheckError(f"enabling takes {median:.0f} ms (median of {STARTS}), more than {ENABLING_MAY_TAKE_MS}")
    print(f"ok: enabling takes {median:.0f} ms (median of {STARTS}; {ENABLING_MAY_TAKE_MS} allowed)", flush=True)


if __name__ == "__main__":
    try_zip(without_window)
