"""Broken files: .blend files with bytes changed at random, rendered by the command line."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

from .case import Record, case

ROOT = Path(__file__).parents[2]
#: What `make stability` has the time for.
FILES = 300
QUICK_FILES = 6
PATIENCE = 60  # seconds for a file, on a busy machine too
PROCESSES = 2
_WORDS = {
    "happens": "A file that a disk or a network has damaged crashes Blender.",
    "why": "Blender believes what a file says: offsets, counts and pointers lead to memory that is not there.",
    "rooks": "Renders what Blender makes of the file, or says in one line what is wrong. Blender itself crashes on "
    "some files, while it opens them or gives out their data; Rooks' own code on none.",
    "samplers": "That which the file names, multi-jittered, where that is not damaged.",
}


@case("A few tampered files", **_WORDS)
def a_few_tampered_files(record: Record) -> None:
    _try_files(record, QUICK_FILES)


@case("Hundreds of tampered files", is_slow=True, **_WORDS)
def hundreds_of_tampered_files(record: Record) -> None:
    _try_files(record, FILES)


def _try_files(record: Record, count: int) -> None:
    with TemporaryDirectory() as folder:
        workers = [_Worker(Path(folder) / str(k), range(k, count, PROCESSES)) for k in range(PROCESSES)]
        while sum(worker.goes_on() for worker in workers):
            time.sleep(0.1)
        for unclear in Path(folder).glob("*/unclear"):
            print(unclear.read_text(), file=sys.stderr)
    fates = sum((worker.fates for worker in workers), Counter())
    record.claim("files", fates.total(), at_least=count, at_most=count)
    record.claim("pictures", fates["picture"], at_least=count / 5)
    record.claim("clear errors", fates["error"])
    record.claim("crashes of Blender's while it opens one", fates["Blender crashed opening it"])
    record.claim("crashes of Blender's while it gives out or evaluates data", fates["Blender crashed giving it out"])
    record.claim("crashes of Rooks' own", fates["Rooks crashed"], at_most=0)
    record.claim(f"files that took more than {PATIENCE} s", fates["took too long"], at_most=0)
    record.claim("files that the process ended of without a trace", fates["ended without a trace"], at_most=0)
    record.claim("errors that are not one clear line", fates["unclear error"], at_most=0)


class _Worker:
    """A process that takes numbers of files from a list, and is started again after each that it dies of."""

    def __init__(self, folder: Path, numbers: range) -> None:
        folder.mkdir()
        self.fates: Counter[str] = Counter()
        self._folder, self._numbers = folder, list(numbers)
        self._process: subprocess.Popen | None = None

    def goes_on(self) -> bool:
        """Look after the process; False when all numbers are done."""
        if self._process is not None and self._process.poll() is None:
            return True
        if self._process is not None:
            self._take_in()
        if not self._numbers:
            return False
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.stability.tampering", self._folder, *map(str, self._numbers)],
            cwd=ROOT,
            stdout=(self._folder / "fates").open("w"),
            stderr=subprocess.DEVNULL,
        )
        return True

    def _take_in(self) -> None:
        """What the process says became of its files, and of the one that it died of."""
        lines = (self._folder / "fates").read_text().splitlines()
        for line in lines:
            self.fates[line] += 1
        done = len(lines)
        if self._process.returncode != 0:
            self.fates[_whose_crash((self._folder / "crash").read_text())] += 1
            done += 1
        del self._numbers[:done]
        self._process = None


def _whose_crash(trace: str) -> str:
    """Whose code a process died in: the innermost frame of this repository that faulthandler saw says it.

    Below a frame of the add-on only Blender's own code can crash, which is asked for its data there.
    """
    if trace.startswith("Timeout"):
        return "took too long"
    threads = re.findall(
        r"^(Current thread|Thread) (.*?)(?=^Thread|^Current|^\s*$|\Z)", trace, re.DOTALL | re.MULTILINE
    )
    crashed = [text for kind, text in threads if kind == "Current thread"] or [text for _, text in threads]
    files = [Path(file) for file in re.findall(r'File "(.*?)", line', crashed[-1] if crashed else "")]
    if not files:
        return "ended without a trace"
    inner = next((file for file in files if file.is_relative_to(ROOT)), ROOT)
    if inner.is_relative_to(ROOT / "core"):
        return "Rooks crashed"
    is_giving = inner.parent == ROOT / "addon" and inner.name != "blend_files.py"
    return "Blender crashed giving it out" if is_giving else "Blender crashed opening it"
