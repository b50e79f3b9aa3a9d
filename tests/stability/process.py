"""Processes: renders that are cancelled, killed, forked, run at once and a thousand times, and disks that are full."""

from __future__ import annotations

import gc
import multiprocessing
import os
import resource
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from core import (
    AreaLight,
    Camera,
    Film,
    Instance,
    Material,
    OutputError,
    RenderSettings,
    Scene,
    compiling,
    kernel_cache,
    render,
    write_exr,
)
from core.command_line import ENDED_BY
from core.film import PASSES
from core.preparation import prepare
from core.progressive import Progressive
from core.shaders import Glass, Principled
from core.values import OBJECT, Checker
from tests.disks import read_only
from tests.scenes import emitter, floor, sphere, translation

from .case import Record, case

SETTINGS = RenderSettings(samples=9, seed=1, max_bounces=4, threads=2, tile_size=8)
MOMENTS = 100
THE_DEFAULT = "Tried with the default, Multi-Jittered. Where points lie has no part in what happens."
ROOT = Path(__file__).parents[2]


def lit_scene(at: float = 0.0) -> Scene:
    """A lamp over a checkered floor with a ball of glass and a glowing one, which share their mesh."""
    camera = Camera(translation(0, 0, 5), (24, 18), (-0.4, 0.4, -0.3, 0.3))
    paint = Material("paint", Principled(Checker((0.8, 0.8, 0.8), (0.2, 0.3, 0.4), 3.0, OBJECT)))
    ball = sphere(0.5, rings=12, smooth=True)
    instances = (
        Instance(floor(6), translation(0, 0, -0.5), (paint,)),
        Instance(ball, translation(at - 0.6, 0, 0), (Material("glass", Glass()),)),
        Instance(ball, translation(at + 0.6, 0.2, 0), (emitter(0.5),)),
    )
    return Scene(camera, instances, (AreaLight((0, 0, 3), (1, 0, 0), (0, 1, 0), (60.0, 60.0, 60.0)),), (0.1, 0.1, 0.2))


def pixels_that_differ(film: Film, other: Film) -> int:
    """Those in which any pass differs by any bit."""
    return int(np.any([(film.passes[name] != other.passes[name]).any(axis=2) for name in PASSES], axis=0).sum())


def threads_of_renders() -> int:
    return sum(thread.name.startswith("rooks") for thread in threading.enumerate())


@case(
    "A render that is cancelled at any moment",
    happens="After Escape the next render is another picture, waits for ever, or crashes.",
    why="Threads are in the middle of tiles, and use the scene that the caller gives back.",
    rooks="Threads look between batches whether they should stop; the scene is given back by the last who uses it.",
    samplers=THE_DEFAULT,
)
def cancelled_at_any_moment(record: Record) -> None:
    scene = lit_scene()
    expected = render(scene, SETTINGS)
    start = time.perf_counter()
    render(scene, SETTINGS)
    duration = time.perf_counter() - start
    cancelled = other_tiles = other_renders = 0
    for moment in np.random.default_rng(0).uniform(0, duration, MOMENTS):
        until = time.perf_counter() + moment
        film = render(scene, SETTINGS, None, lambda until=until: time.perf_counter() > until)
        is_done = film.passes["Combined"][..., 3] > 0
        cancelled += film.cancelled
        other_tiles += int((film.passes["Combined"] != expected.passes["Combined"])[is_done].any(axis=1).sum())
        other_renders += pixels_that_differ(render(scene, SETTINGS), expected)
    record.claim("renders that were cancelled half-way", cancelled, at_least=MOMENTS / 10)
    record.claim("pixels of their finished tiles that are others", other_tiles, at_most=0)
    record.claim("pixels of the renders after them that are others", other_renders, at_most=0)
    record.claim("threads that stayed", threads_of_renders(), at_most=0)


@case(
    "A picture in passes that is interrupted",
    happens="Turning the view while it renders leaves half a pass in the picture.",
    why="A pass that was stopped has been added to some pixels, and comes again.",
    rooks="Adds a pass when all of it is there: after any interruptions the picture is that of one render, to the bit.",
)
def interrupted_passes(record: Record) -> None:
    scene, rng = lit_scene(), np.random.default_rng(0)
    prepared = prepare(scene, SETTINGS)
    interrupted = 0
    try:
        progressive, stop = Progressive(prepared, scene.camera), np.zeros(1, np.uint8)
        with ThreadPoolExecutor(2) as pool:
            while progressive.done < progressive.total:
                start = time.perf_counter()
                progressive.add_pass(pool, stop)
                alarm = threading.Timer(rng.uniform(0, time.perf_counter() - start), lambda: stop.fill(1))
                if progressive.done < progressive.total:
                    alarm.start()
                    interrupted += not progressive.add_pass(pool, stop)
                    alarm.join()
                    stop[0] = 0
    finally:
        prepared.let_go()
    expected = render(scene, SETTINGS).passes["Combined"]
    record.claim("interrupted passes", interrupted, at_least=1)
    record.claim("numbers of the picture that are others", (progressive.pixels() != expected).sum(), at_most=0)


@case(
    "Two renders at once",
    happens="The viewport and F12 render at the same time, and one shows parts of the other.",
    why="Kernels that keep their working memory in one place would share it.",
    rooks="Each thread of each render has its own memory; the pictures are those of renders alone, to the bit.",
)
def two_renders_at_once(record: Record) -> None:
    tasks = [
        (lit_scene(0.1 * k), replace(SETTINGS, seed=k, sampler=name)) for k, name in enumerate(("random", "sobol_owen"))
    ]
    expected = [render(*task) for task in tasks]
    with ThreadPoolExecutor(2) as pool:
        films = [pool.submit(render, *tasks[k % 2]) for k in range(8)]
        others = sum(pixels_that_differ(film.result(), expected[k % 2]) for k, film in enumerate(films))
    record.claim("pixels that are others in 8 renders, two at a time", others, at_most=0)


@case(
    "A thousand renders in a row",
    happens="An animation takes more and more memory until the system kills it.",
    why="What is made outside of Python, as Embree's structures are, is not collected when it is forgotten.",
    rooks="Gives everything back: the smallest thing that a render could keep is some 10 kB, 10 MB in a thousand.",
    samplers=THE_DEFAULT,
    is_slow=True,
)
def a_thousand_renders(record: Record) -> None:
    settings = replace(SETTINGS, samples=1, border=(8, 4, 16, 12))

    def render_some(count: int) -> tuple[float, int, int]:
        for k in range(count):
            # Every tenth is cancelled at once.
            render(lit_scene(0.01 * (k % 7)), settings, None, lambda k=k: k % 10 == 0)
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize(), len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))

    before, after = render_some(200), render_some(1000)
    record.claim("MB more after 1,000 renders", (after[0] - before[0]) / 1e6, at_most=5)
    record.claim("threads more", after[1] - before[1], at_most=0)
    record.claim("open files more", after[2] - before[2], at_most=0)


@case(
    "A process that is forked after a render, or spawned",
    happens="Scripts that render in several processes wait for ever.",
    why="A fork copies the memory but only one thread: locks and pools of the others never answer.",
    rooks="Makes threads and Embree's device for each render anew: both children render the parent's picture.",
    samplers=THE_DEFAULT,
    is_slow=True,  # not among tests: what they compile beside the renderer is linked into it, and can round otherwise
)
def forked_after_a_render(record: Record) -> None:
    expected = render(lit_scene(), SETTINGS)
    for method in ("fork", "spawn"):
        context = multiprocessing.get_context(method)
        receiver, sender = context.Pipe(duplex=False)
        child = context.Process(target=_render_in_child, args=(sender,), daemon=True)
        child.start()
        film = receiver.recv() if receiver.poll(60) else None
        child.join(10)
        others = pixels_that_differ(film, expected) if film else expected.width * expected.height
        record.claim(f"pixels of a child by {method} that are others", others, at_most=0)
        record.claim(f"children by {method} that ended well", child.exitcode == 0, at_least=1)
        child.kill()


def _render_in_child(sender) -> None:
    sender.send(render(lit_scene(), SETTINGS))


@case(
    "A disk that is full",
    happens="A picture that was there is lost, and half a new one stands in its place.",
    why="Files are opened for writing before it is known whether they fit.",
    rooks="Writes beside the old file, puts the new one in its place when it is whole, and says so where it is not.",
    samplers="None has a part in it: the picture is there already.",
)
def full_disk(record: Record) -> None:
    film = render(lit_scene(), SETTINGS)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        write_exr(path, film, {})
        before = path.read_bytes()
        child = multiprocessing.get_context("fork").Process(target=_write_on_full_disk, args=(path, film))
        child.start()
        child.join()
        record.claim("exit status of who wrote, 1 after a clear error", child.exitcode, at_least=1, at_most=1)
        record.claim("files left beside the old one", len(os.listdir(folder)) - 1, at_most=0)
        record.claim("bytes of the old one that are others", path.read_bytes() != before, at_most=0)


def _write_on_full_disk(path: Path, film: Film) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
    try:
        write_exr(path, film, {"note": "too much"})
    except OutputError as error:
        raise SystemExit(1 if "\n" not in str(error) else 2) from None


@case(
    "A folder of kernels that can only be read",
    happens="Each start compiles for a minute and leaves a folder behind, or nothing renders at all.",
    why="What compiles when it is needed asks first for a place to write to, needed or not.",
    rooks="Loads what is there. Where there is nothing yet it compiles into a temporary folder, which goes at the end.",
    samplers="None has a part in it: kernels are the same for all.",
)
def read_only_kernels(record: Record) -> None:
    compiling.compile_kernels()
    kernels = kernel_cache.cache_folder()
    with TemporaryDirectory() as folder:
        filled, empty = Path(folder) / "filled", Path(folder) / "empty"
        shutil.copytree(kernels, filled / kernels.name)
        empty.mkdir()
        hits, misses = _said_with_kernels_in(filled, _LOAD)
        record.claim("times that the kernels there were loaded", int(hits), at_least=1)
        record.claim("times that they were compiled", int(misses), at_most=0)
        (used,) = _said_with_kernels_in(empty, "from core import kernel_cache; print(kernel_cache.cache_folder())")
        record.claim("temporary folders in place of an empty one", "rooks-cache-" in used, at_least=1)
        record.claim("folders left", len(list(Path(folder).glob("rooks-cache-*"))), at_most=0)


_LOAD = """
from core import compiling
compiling.load_kernels()
from core.integrator import render_blocks
print(sum(render_blocks.stats.cache_hits.values()), sum(render_blocks.stats.cache_misses.values()))
"""


def _said_with_kernels_in(folder: Path, script: str) -> list[str]:
    """The words that a Python script prints whose kernels are to be in a folder that it can only read."""
    environment = os.environ | {"ROOKS_CACHE_DIR": str(folder), "TMPDIR": str(folder.parent)}
    with read_only(folder) as before:
        command = [*before, sys.executable, "-c", script]
        return subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True
        ).stdout.split()


@case(
    "A render that is told to end by a signal",
    happens="kill or Ctrl-C leaves half a picture in the place of a whole one, or a core dump.",
    why="A signal comes in the middle of anything; at the end of a process libraries are torn down in any order.",
    rooks="Stops the threads, gives everything back, says one line, and ends with the status that shells expect.",
    samplers=THE_DEFAULT,
    is_slow=True,
)
def ended_by_a_signal(record: Record) -> None:
    wrong = dict.fromkeys(("exit statuses", "texts that are not one line", "old pictures harmed", "files left"), 0)
    finished = went_on = 0
    # Before that Python and Blender are loading, and print what a signal interrupts in there.
    for seconds in np.random.default_rng(0).uniform(3.0, 9.0, 5):
        with TemporaryDirectory() as folder:
            commands = {number: _Command(Path(folder) / number.name) for number in ENDED_BY}
            time.sleep(seconds)
            for number, command in commands.items():
                command.process.send_signal(number)
            for number, command in commands.items():
                errors = command.errors_within(30)
                if errors is None:
                    went_on += 1
                    continue
                status = command.process.returncode
                if status == 0:
                    finished += 1
                    continue
                wrong["exit statuses"] += status != 128 + number
                wrong["texts that are not one line"] += errors != [f"rooks: {ENDED_BY[number]}"]
                wrong["old pictures harmed"] += command.picture.read_text() != "an older picture"
                wrong["files left"] += len(os.listdir(command.picture.parent)) - 1
    record.claim("renders that were ended", 10 - finished - went_on, at_least=1)
    record.claim("renders that went on for 30 s", went_on, at_most=0)
    for what, count in wrong.items():
        record.claim(f"wrong {what}" if what == "exit statuses" else what, count, at_most=0)


class _Command:
    """A render on the command line that takes long, in the place of an older picture."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self.picture = folder / "x.exr"
        self.picture.write_text("an older picture")
        options = ["--output", self.picture, "--samples", "4096", "--threads", "1"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "addon", "render", ROOT / "sample_scenes" / "still_life.blend", *options],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def errors_within(self, seconds: float) -> list[str] | None:
        """The lines that it printed; None where it had to be killed because it did not end in time."""
        try:
            return self.process.communicate(timeout=seconds)[1].splitlines()
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
            return None


@case(
    "A scene that is changed while it renders",
    happens="Editing during F12 gives a picture of which the upper half shows another scene than the lower.",
    why="A renderer that reads Blender's data as it goes sees the old and the new state.",
    rooks="Copies all that a picture needs before the first ray: what happens later does not reach it.",
)
def changed_while_it_renders(record: Record) -> None:
    import bpy

    from addon.watch import Watch, watched_render
    from tests import addon_helpers

    scene = addon_helpers.empty_scene(160, 130)
    scene.rooks.samples = 2
    paint, _ = addon_helpers.shader("ShaderNodeBsdfDiffuse")
    floor_object, lamp = addon_helpers.quad(size=8), addon_helpers.lamp("AREA", 200, size=2)
    floor_object.data.materials.append(paint)
    image = addon_helpers.image()
    node = paint.node_tree.nodes["Diffuse BSDF"]
    addon_helpers.feed(node.inputs["Color"], "ShaderNodeTexImage", image=image)

    def change(done: int, _total: int) -> None:
        if done == 1:
            floor_object.data.vertices[0].co.z += 3
            floor_object.location.x += 2
            lamp.data.energy *= 3
            image.pixels.foreach_set(np.zeros(len(image.pixels), np.float32))
            node.inputs["Roughness"].default_value = 1
            scene.camera.location.z += 5
            bpy.context.view_layer.update()

    films = []
    for on_progress in (lambda *_: None, change, lambda *_: None):
        watch = Watch(on_progress)
        watched_render(watch)
        films += watch.films
    undisturbed, disturbed, changed = films
    record.claim("pixels that the changes reach", pixels_that_differ(disturbed, undisturbed), at_most=0)
    record.claim("pixels of the next render, which shows them", pixels_that_differ(changed, undisturbed), at_least=1)
