"""What the stories of `render_stories.py` noted is judged."""

import numpy as np
from blender_runs import CheckError
from window_visits import Visit, read

STOPS_WITHIN = 0.3  # seconds, after Escape was pressed
OPENS_WITHIN = 5.0  # seconds
RENDERS_WITHIN = 5.0  # seconds, 128 x 128 pixels with compiled kernels
FIRST_TILE = 1.0  # seconds after F12, in a new Blender: the aim
FIRST_TILE_WITHIN = 2.0  # on a busy machine, and with OpenGL in software


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


def renders_to_slots(visit: Visit) -> None:
    """A render to another slot keeps the picture in the first."""
    second, first = map(read, visit.one("renders_to_slots")["pictures"])
    if not np.array_equal(first, read(visit.one("renders")["picture"])):
        raise CheckError("a render to the second slot changes the picture in the first")
    if first.shape != second.shape or np.array_equal(first, second):
        raise CheckError("a render to the second slot does not put its picture there")
    print("ok: renders to another slot", flush=True)


def animates(visit: Visit) -> None:
    """Ctrl+F12 writes a picture for each frame."""
    written = visit.one("animates")["written"]
    if written != [f"frame_{frame:04}.png" for frame in (1, 2, 3)]:
        raise CheckError(f"the animation's three frames are: {', '.join(written) or 'not there'}")
    print("ok: renders an animation", flush=True)


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


def escapes_compiling(visit: Visit) -> None:
    """Escape ends a render that waits for its kernels."""
    seconds = visit.one("escapes_compiling")["seconds"]
    print(f"Escape ends F12 after {1000 * seconds:.0f} ms while kernels are being compiled", flush=True)
    if seconds > STOPS_WITHIN:
        raise CheckError(f"Escape ends F12 after {seconds:.2f} s only while kernels are being compiled")


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


CHECKS = renders, renders_to_slots, animates, escapes, opens
