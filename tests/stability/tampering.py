"""`python -m tests.stability.tampering FOLDER NUMBER…`: make tampered .blend files by number, and render each.

Prints a line for each: "picture", "error", or "unclear error". Where the process dies of one, FOLDER/crash says where.
"""

from __future__ import annotations

import faulthandler
import os
import resource
import sys
from pathlib import Path
from typing import TextIO

import bpy
import numpy as np

from addon.cli import main

from .broken_files import PATIENCE

ROOT = Path(__file__).parents[2]
BLENDS = sorted((ROOT / "sample_scenes").glob("*.blend"))
#: Every fourth file is tampered with as it is, compressed: nearly all of those Blender refuses by their checksum.
COMPRESSED_EVERY = 4
MEMORY = 12 << 30  # a count that has become huge is refused, instead of filling the machine


def render_all(folder: Path, numbers: list[int]) -> None:
    crash, errors = (folder / "crash").open("w"), (folder / "errors").open("w+")
    faulthandler.enable(crash)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(errors.fileno(), 2)
    plain = {blend: _uncompressed(blend, folder) for blend in BLENDS}
    _fate(BLENDS[0], folder / "picture.exr", errors)  # loads the kernels
    for number in numbers:
        faulthandler.dump_traceback_later(PATIENCE, exit=True, file=crash)
        tampered = folder / f"{number}.blend"  # a file that is open already would not be opened again
        blend = BLENDS[number % len(BLENDS)]
        source = blend if number % COMPRESSED_EVERY == 0 else plain[blend]
        tampered.write_bytes(_tampered(source.read_bytes(), np.random.default_rng(number)))
        print(_fate(tampered, folder / "picture.exr", errors), file=out)
        faulthandler.cancel_dump_traceback_later()
        tampered.unlink()
    out.close()
    os._exit(0)  # what Blender does at its end with broken data is of no interest


def _uncompressed(blend: Path, folder: Path) -> Path:
    path = folder / blend.name
    if not path.exists():
        bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False)
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False, copy=True)
    return path


def _tampered(data: bytes, rng: np.random.Generator) -> bytes:
    """1 to 1,000 single bytes, or a run of 100, changed."""
    changed = np.frombuffer(data, np.uint8).copy()
    # Changed anywhere, Blender mostly refuses a file; where blocks are where they were it believes what they say.
    allowed = _contents(data) if data.startswith(b"BLENDER-v") and rng.random() < 0.8 else np.arange(12, len(data))
    places = rng.choice(allowed[:-100], 10 ** int(rng.integers(0, 4)))
    if rng.random() < 0.3:
        places = places[0] + np.arange(100)
    changed[places] ^= rng.integers(1, 256, len(places), np.uint8)
    return changed.tobytes()


def _contents(data: bytes) -> np.ndarray:
    """Where the bytes are that blocks hold, but for those that say what the blocks mean.

    A block is its code, its length, the address that it had, its type, a count (4, 4, 8, 4, 4 bytes), and its contents.
    """
    places, at = [], 12
    while at < len(data):
        code, (length,) = data[at : at + 4], np.frombuffer(data, np.int32, 1, at + 4)
        if code not in (b"DNA1", b"ENDB"):
            places.append(np.arange(at + 24, at + 24 + length))
        at += 24 + length
    return np.concatenate(places)


def _fate(blend: Path, picture: Path, errors: TextIO) -> str:
    """What comes of rendering a file by the command line, which writes to `errors`."""
    picture.unlink(missing_ok=True)
    errors.seek(0)
    errors.truncate()
    options = ["--samples", "1", "--resolution", "16x12", "--threads", "1", "--max-bounces", "2"]
    status = main(["render", str(blend), "--output", str(picture), *options])
    sys.stderr.flush()
    errors.seek(0)
    lines = [line for line in errors.read().splitlines() if not line.startswith("rooks: warning:")]
    if status == 0:
        return "picture" if picture.exists() and not lines else "unclear error"
    is_clear = len(lines) == 1 and lines[0].startswith("rooks: ") and "internal error" not in lines[0]
    if is_clear and not picture.exists():
        return "error"
    print(blend, *lines, sep="\n", file=(picture.parent / "unclear").open("a"))
    return "unclear error"


if __name__ == "__main__":
    render_all(Path(sys.argv[1]), [int(number) for number in sys.argv[2:]])
