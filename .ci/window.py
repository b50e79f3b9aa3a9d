"""Try the extension's zip in the window of a real Blender: rendered view, F12, Escape, undo, other files, quitting.

    .venv/bin/python .ci/window.py ZIP BLENDER [ARG...]

BLENDER [ARG...] is a command as in `real_blender.py`, and BLENDER [ARG...] --exec COMMAND runs a command beside it: an
X server without a screen (Xvfb) is started in this way. In the window `window_script.py` does what a user does and
notes what it sees; here it is judged.
"""

import json
import os
import re
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from blender_runs import ROOT, SCENE, Blender, CheckError, installs, try_zip
from PIL import Image

SCRIPT = Path(__file__).with_name("window_script.py")
GEOMETRY = "1600x1000x24"

A_STORY_TAKES = 280.0  # seconds at most, with kernels to be compiled
ENDS_WITHIN = 5.0  # seconds, after Blender was told to quit
STOPS_WITHIN = 0.3  # seconds, after Escape was pressed
OPENS_WITHIN = 5.0  # seconds
RENDERS_WITHIN = 5.0  # seconds, 128 x 128 pixels with compiled kernels
FIRST_TILE = 1.0  # seconds after F12, in a new Blender: the aim
FIRST_TILE_WITHIN = 2.0  # on a busy machine, and with OpenGL in software
#: A small scene, for the first tile: Blender alone takes 0.4 s to evaluate the modifiers of still_life.
SMALL_SCENE = "sample_scenes/cornell_box.blend"
WINDOW_WAITS = 1.0  # seconds, the longest while that the main thread may be kept from its work
PICTURES_PER_SECOND = 10  # while the view is turned: the aim
AT_LEAST_PER_SECOND = 5  # with OpenGL in software, which takes a core of its own
EXTRA_THREADS = 2
EXTRA_MEGABYTES = 60

BAD_NEWS = re.compile(r"Traceback|\bError\b|Exception|crash\.txt|Segmentation fault", re.IGNORECASE)

Notes = list[dict]


@dataclass
class Visit:
    """One start of Blender: what the script noted, and how it ended."""

    notes: Notes
    printed: str
    code: int
    ended_after: float
    left: list[str]

    def all(self, name: str) -> Notes:
        found = [note for note in self.notes if note["name"] == name]
        if not found:
            raise CheckError(
                f"nothing was noted of {name!r}; Blender exited with {self.code} and printed:\n{self.printed}"
            )
        return found

    def one(self, name: str) -> dict:
        return self.all(name)[0]


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
        quits(ended)
        work = visit(blender, home, "at_work")
        is_quiet(work)
        is_on_screen(work, home)
        for check in (chooses, changes, looks, takes_back, comes_back, turns, renders, escapes, opens, quits):
            check(work)
        for story, scene in (("quits_viewing", SCENE), ("quits_rendering", SCENE), ("quits_rendered", SMALL_SCENE)):
            ended = visit(blender, home, story, scene)
            is_quiet(ended)
            quits(ended)
        shows_soon(ended)
    finally:
        os.killpg(server.pid, signal.SIGTERM)
        server.wait()


def start_screen(blender: Blender, geometry: str = GEOMETRY) -> tuple[subprocess.Popen, str]:
    """A virtual screen, and the name of its display."""
    server = subprocess.Popen(
        [*blender.command, "--exec", "Xvfb", "-displayfd", "1", "-screen", "0", geometry],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    number = server.stdout.readline().strip()
    if not number:
        raise CheckError(f"no virtual screen: {' '.join(blender.command)} --exec Xvfb does not start")
    return server, f":{number}"


def visit(blender: Blender, home: Path, story: str, *files: str) -> Visit:
    """Start Blender in the window, let the script do a story, and wait for Blender's end."""
    notes_file, printed_file = home / f"{story}.json", home / f"{story}.txt"
    notes_file.touch()
    script = ("--python", str(SCRIPT), "--", story, str(notes_file), str(home))
    with printed_file.open("w") as output:
        process = subprocess.Popen(
            [*blender.command, "--window-geometry", "0", "0", "1000", "800", *files, *script],
            cwd=ROOT,
            env=blender.environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        limit = time.time() + A_STORY_TAKES
        while process.poll() is None and time.time() < limit:
            time.sleep(0.05)
            if quitting := re.search(r'"quits", "clock": ([\d.]+)', notes_file.read_text()):
                limit = min(limit, float(quitting[1]) + ENDS_WITHIN + 1.0)
        ended = time.time()
        is_stuck = process.poll() is None
        if is_stuck:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        left = [] if is_stuck else processes_of(home)
    notes = [json.loads(line) for line in notes_file.read_text().splitlines()]
    told = next((note["clock"] for note in notes if note["name"] == "quits"), ended)
    return Visit(notes, printed_file.read_text(), process.returncode, ended - told, left)


def processes_of(home: Path) -> list[str]:
    """The commands of the processes whose home is this."""
    commands = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if f"HOME={home}\0" in (entry / "environ").read_text(errors="replace"):
                    commands.append((entry / "cmdline").read_text(errors="replace").replace("\0", " ")[:200])
            except OSError:
                pass  # it has ended, or is not ours
    return commands


def is_quiet(visit: Visit) -> None:
    """The script came to its end, and Blender printed neither an error nor a traceback, and did not crash."""
    for note in visit.notes:
        if note["name"] == "failure":
            noted = "\n".join(map(str, visit.notes))
            raise CheckError(f"in {note['step']}: {note['text']}\n{noted}\nBlender printed:\n{visit.printed}")
    bad = [line for line in visit.printed.splitlines() if BAD_NEWS.search(line)]
    if bad:
        raise CheckError(f"Blender printed bad news, {bad[0]!r}, in:\n{visit.printed}")


def chooses(visit: Visit) -> None:
    """With the engine chosen, the rendered view gets coarse pictures and then fine ones, up to the full count."""
    note = visit.one("chooses")
    check_refinement("choosing the engine", note["pictures"])
    if not note["announced"]:
        raise CheckError("the first view of all does not say that kernels are being compiled")
    print(
        f"ok: compiles kernels, says so, and shows the view, which is complete after {note['seconds']:.1f} s",
        flush=True,
    )


def is_on_screen(visit: Visit, home: Path) -> None:
    """What the X server shows is the picture, the right way up and at its place."""
    note = visit.one("photograph")
    picture = np.load(home / "view.npy")[::-1, :, :3].mean(axis=-1)
    height, width = picture.shape
    left, top = note["left"], note["top"]
    shown = read(home / "view.png")[top : top + height, left : left + width, :3].mean(axis=-1)
    middle = slice(height // 4, -height // 4), slice(width // 4, -width // 4)  # away from headers and tools
    likeness = np.corrcoef(shown[middle].ravel(), picture[middle].ravel())[0, 1]
    if not likeness > 0.9:
        raise CheckError(f"the screen does not show the picture: their correlation is {likeness:.2f}")
    print(f"ok: the screen shows the picture, correlation {likeness:.3f}", flush=True)


def check_refinement(what: str, pictures: list[list[int]]) -> None:
    """Pixels get smaller, samples more, and the last picture has all of them."""
    sizes = [size for size, _, _ in pictures]
    counts = [done for _, done, _ in pictures]
    if sizes != sorted(sizes, reverse=True) or counts != sorted(counts):
        raise CheckError(f"after {what} the pictures do not get better and better: {pictures}")
    if len(pictures) < 2 or counts[0] == counts[-1]:
        raise CheckError(f"after {what} there is no coarse picture before the last: {pictures}")
    if sizes[-1] != 1 or counts[-1] != pictures[-1][2]:
        raise CheckError(f"after {what} the last picture does not have all samples: {pictures}")


def changes(visit: Visit) -> None:
    """After a change of whatever kind the view gets coarse, and then fine and different."""
    for note in visit.all("changes"):
        check_refinement(f"a change of {note['what']}", note["pictures"])
        if not note["differs"]:
            raise CheckError(f"a change of {note['what']} does not change the view")
    print(f"ok: {len(visit.all('changes'))} kinds of changes are seen in the view", flush=True)


def looks(visit: Visit) -> None:
    """The view through the camera fills it, and borders cut out the part that they should."""
    notes = {note["what"]: note for note in visit.all("looks")}
    for what in ("camera", "all"):
        if notes[what]["place"] != [0, 0] or notes[what]["size"] != notes[what]["view"]:
            raise CheckError(f"the picture of {what} does not fill the view: {notes[what]}")
    width, height = notes["border of the view"]["view"]
    place, size = np.array(notes["border of the view"]["place"]), np.array(notes["border of the view"]["size"])
    if abs(place - (width * 0.25, height * 0.5)).max() > 1 or abs(size - (width * 0.25, height * 0.5)).max() > 1:
        raise CheckError(f"the border of the view is not at its place: {notes['border of the view']}")
    place, size = np.array(notes["border of the camera"]["place"]), np.array(notes["border of the camera"]["size"])
    if abs(place + size / 2 - (width / 2, height / 2)).max() > 2 or size[0] >= width / 2 or abs(size[0] - size[1]) > 1:
        raise CheckError(f"the border of the camera is not at its place: {notes['border of the camera']}")
    print("ok: looks through the camera, and at what borders cut out", flush=True)


def takes_back(visit: Visit) -> None:
    """Undo and redo give the very pictures that were there before."""
    note = visit.one("takes_back")
    for what in ("moves", "undoes", "redoes"):
        if not note[what]:
            raise CheckError(f"the view is not what it should be when it {what} what was done: {note}")
    print("ok: undoes and redoes", flush=True)


def comes_back(visit: Visit) -> None:
    """Leaving the rendered view and coming back leaves no threads behind, and little memory."""
    note = visit.one("comes_back")
    threads, megabytes = note["threads"], note["megabytes"]
    growth = megabytes[1] - megabytes[0]
    counted = f"{growth:+.1f} MB, threads {threads[0]} -> {threads[1]}"
    print(f"{note['times']} times out of the rendered view and back: {counted}", flush=True)
    if note["new_names"] or threads[1] > threads[0] + EXTRA_THREADS:
        raise CheckError(f"threads are left behind: {threads[0]} before, {threads[1]} after, new: {note['new_names']}")
    if growth > EXTRA_MEGABYTES:
        raise CheckError(f"memory grows by {growth:.0f} MB, from {megabytes[0]:.0f} to {megabytes[1]:.0f}")
    print("ok: the rendered view leaves nothing behind", flush=True)


def turns(visit: Visit) -> None:
    """While the view of a sample scene is turned, new pictures keep coming, and the window stays alive."""
    for note in visit.all("turns"):
        width, height = note["view"]
        print(
            f"turning {note['scene']}, {width} x {height}: {note['rate']:.1f} pictures/s (the aim is "
            f"{PICTURES_PER_SECOND}), pixels of {note['sizes']}, the window waited {1000 * note['gap']:.0f} ms at most",
            flush=True,
        )
    for note in visit.all("turns"):
        if note["rate"] < AT_LEAST_PER_SECOND:
            raise CheckError(f"turning {note['scene']} shows {note['rate']:.1f} pictures a second only")
        if note["gap"] > WINDOW_WAITS:
            raise CheckError(f"turning {note['scene']} keeps the window waiting for {note['gap']:.2f} s")
    print("ok: views are turned", flush=True)


def renders(visit: Visit) -> None:
    """F12 renders a whole picture into Blender's render result, with the kernels that are there."""
    note = visit.one("renders")
    pixels = read(note["picture"])
    if pixels.shape != (128, 128, 4) or (pixels[..., 3] < 255).any() or np.ptp(pixels[..., :3]) < 100:
        raise CheckError(f"F12 does not render a whole picture: {pixels.shape}, {pixels.min()} … {pixels.max()}")
    if note["seconds"] > RENDERS_WITHIN:
        seconds = f"{note['seconds']:.1f} s"
        raise CheckError(f"the first F12 takes {seconds} for a small picture: were its kernels not compiled before?")
    print(f"ok: F12 renders, in {note['seconds']:.1f} s", flush=True)


def shows_soon(visit: Visit) -> None:
    """In a new Blender, with kernels that were compiled before, F12 soon shows a first tile."""
    seconds = visit.one("quits")["first_tile"]
    print(f"F12 in a new Blender shows the first tile after {seconds:.2f} s (the aim is {FIRST_TILE:g})", flush=True)
    if seconds > FIRST_TILE_WITHIN:
        raise CheckError(f"the first tile comes {seconds:.2f} s after F12 in a new Blender")


def escapes(visit: Visit) -> None:
    """Escape stops a render soon, and what is done is kept."""
    note = visit.one("escapes")
    pixels = read(note["picture"])
    kept = (pixels[..., 3] > 0).mean()
    print(f"Escape stops F12 after {1000 * note['seconds']:.0f} ms, with {kept:.0%} of the picture kept", flush=True)
    if note["seconds"] > STOPS_WITHIN:
        raise CheckError(f"Escape stops F12 after {note['seconds']:.2f} s only")
    if not 0.0 < kept < 1.0 or np.ptp(pixels[..., :3]) < 50:
        raise CheckError(f"after Escape the render result is {kept:.0%} full, with values to {pixels.max()}")
    print("ok: Escape stops a render, and keeps what is done", flush=True)


def read(path: str | Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGBA"))


def opens(visit: Visit) -> None:
    """Another file is opened while the view renders, and while F12 does; nothing goes on rendering the old one."""
    for note in visit.all("opens"):
        print(f"opening a file during a {note['during']} takes {note['seconds']:.1f} s", flush=True)
        if note["threads"]:
            raise CheckError(
                f"after a file was opened during a {note['during']} these threads go on: {note['threads']}"
            )
        if note["seconds"] > OPENS_WITHIN:
            raise CheckError(f"opening a file during a {note['during']} takes {note['seconds']:.1f} s")
    print("ok: opens another file while it renders", flush=True)


def quits(visit: Visit) -> None:
    """Blender ends soon when it is told to, with exit code 0, and leaves no process behind."""
    if visit.ended_after > ENDS_WITHIN:
        raise CheckError(f"Blender has not ended {ENDS_WITHIN:g} s after it was told to")
    if visit.code:
        raise CheckError(f"Blender exits with {visit.code}, and has printed:\n{visit.printed}")
    if visit.left:
        raise CheckError(f"Blender leaves processes behind: {', '.join(visit.left)}")
    print(f"ok: ends {visit.ended_after:.1f} s after it was told to, and leaves no process behind", flush=True)


if __name__ == "__main__":
    try_zip(with_window)
