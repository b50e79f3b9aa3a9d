"""What the stories of `view_stories.py` noted is judged."""

import numpy as np
from blender_runs import CheckError
from window_visits import Visit, read

WINDOW_WAITS = 1.0  # seconds, the longest while that the main thread may be kept from its work
PICTURES_PER_SECOND = 10  # while the view is turned: the aim
AT_LEAST_PER_SECOND = 5  # with OpenGL in software, which takes a core of its own
DRAGGED_PER_SECOND = 2  # pictures: each is of a scene that was exported and built again
COLORS_OFF = 4  # of 255: half-precision floats in the view, and view transforms on the GPU and the CPU differ
EXTRA_THREADS = 2
EXTRA_MEGABYTES = 60


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


def is_on_screen(visit: Visit) -> None:
    """What the X server shows is the picture, at its place, with the colours that Blender saves it with."""
    note = visit.one("photograph")
    picture = read(note["picture"])[..., :3].astype(int)
    height, width, _ = picture.shape
    left, top = note["left"], note["top"]
    shown = read(note["shown"])[top : top + height, left : left + width, :3].astype(int)
    middle = slice(height // 4, -height // 4), slice(width // 4, -width // 4)  # away from headers and tools
    if np.ptp(picture[middle]) < 50:
        raise CheckError("the picture in the view is too even to tell that it is on the screen")
    off = np.abs(shown[middle] - picture[middle])
    told = f"{off.max()} of 255 at most, {off.mean():.2f} on average"
    if off.max() > COLORS_OFF:
        raise CheckError(f"the screen does not show the picture: colours are off by {told}")
    print(f"ok: the screen shows the picture, its colours off by {told}", flush=True)


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
    leaves_nothing("out of the rendered view and back", visit.one("comes_back"))


def restarts(visit: Visit) -> None:
    """So do changes one after the other."""
    leaves_nothing("begun anew", visit.one("restarts"))


def leaves_nothing(what: str, note: dict) -> None:
    threads, megabytes = note["threads"], note["megabytes"]
    growth = megabytes[1] - megabytes[0]
    print(f"{note['times']} times {what}: {growth:+.1f} MB, threads {threads[0]} -> {threads[1]}", flush=True)
    if note["new_names"] or threads[1] > threads[0] + EXTRA_THREADS:
        raise CheckError(f"threads are left behind: {threads[0]} before, {threads[1]} after, new: {note['new_names']}")
    if growth > EXTRA_MEGABYTES:
        raise CheckError(f"memory grows by {growth:.0f} MB, from {megabytes[0]:.0f} to {megabytes[1]:.0f}")
    print(f"ok: the view leaves nothing behind when it is {what} {note['times']} times", flush=True)


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


def drags(visit: Visit) -> None:
    """While an object is dragged, pictures keep coming, too."""
    note = visit.one("drags")
    waited = f"the window waited {1000 * note['gap']:.0f} ms at most"
    print(f"dragging {note['what']}: {note['rate']:.1f} pictures/s, {waited}", flush=True)
    if note["rate"] < DRAGGED_PER_SECOND or note["gap"] > WINDOW_WAITS:
        raise CheckError(f"dragging an object shows {note['rate']:.1f} pictures a second, and {waited}")
    print("ok: an object is dragged", flush=True)


CHECKS = is_on_screen, chooses, changes, looks, takes_back, comes_back, restarts, turns, drags
