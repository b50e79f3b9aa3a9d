"""A Blender in a window on a virtual screen, in which `window_script.py` does a story; and how such a visit ends."""

import json
import os
import re
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from blender_runs import ROOT, Blender, CheckError
from PIL import Image

SCRIPT = Path(__file__).with_name("window_script.py")
GEOMETRY = "1600x1000x24"

A_STORY_TAKES = 600.0  # seconds at most, with kernels to be compiled
ENDS_WITHIN = 5.0  # seconds, after Blender was told to quit

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


def quits(visit: Visit) -> None:
    """Blender ends soon when it is told to, with exit code 0, and leaves no process behind."""
    if visit.ended_after > ENDS_WITHIN:
        raise CheckError(f"Blender has not ended {ENDS_WITHIN:g} s after it was told to")
    if visit.code:
        raise CheckError(f"Blender exits with {visit.code}, and has printed:\n{visit.printed}")
    if visit.left:
        raise CheckError(f"Blender leaves processes behind: {', '.join(visit.left)}")
    print(f"ok: ends {visit.ended_after:.1f} s after it was told to, and leaves no process behind", flush=True)


def read(path: str | Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGBA"))
