"""Rendering .blend files on Blender's Python module, through the same engine that Blender's window uses."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from . import register, unregister
from ._core import core
from .outputs import DISPLAY_FORMATS, plan_outputs
from .watch import Watch, watching

ENGINE_ID = "ROOKS"


@dataclass(frozen=True)
class Console:
    """Where people read, while Blender's own chatter goes elsewhere."""

    out: TextIO
    err: TextIO


def render_files(options: argparse.Namespace) -> int:
    """Render each file of a `render` command and save it.

    Raises:
        RooksError: a file, an output or a scene is not as it should be. Files before it are done.
    """
    plans = {blend: plan_outputs(blend, options.output, len(options.files)) for blend in options.files}
    for blend in plans:
        _check_blend(blend)
    paths = [path for planned in plans.values() for path in planned]
    for path in paths:
        if paths.count(path) > 1:
            raise core.errors.OutputError(f"two pictures would be saved as {path}: give one file another folder")
    with quiet_blender() as console:
        _start_blender()
        try:
            for blend, paths in plans.items():
                _render_file(blend, paths, options, console)
        finally:
            unregister()
    return 0


@contextmanager
def quiet_blender() -> Iterator[Console]:
    """Send what Blender's own code prints, to stdout and stderr, to nowhere.

    Blender writes to the file descriptors 1 and 2, and operators' reports to Python's streams. All are pointed
    elsewhere meanwhile; `Console` is the real ones.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    python_streams = sys.stdout, sys.stderr
    with (
        tempfile.TemporaryFile("w", errors="replace") as sink,
        os.fdopen(os.dup(saved[0]), "w", buffering=1) as out,
        os.fdopen(os.dup(saved[1]), "w", buffering=1) as err,
    ):
        os.dup2(sink.fileno(), 1)
        os.dup2(sink.fileno(), 2)
        sys.stdout = sys.stderr = sink
        try:
            yield Console(out, err)
        finally:
            sys.stdout, sys.stderr = python_streams
            for number, original in enumerate(saved, start=1):
                os.dup2(original, number)
                os.close(original)


def _start_blender() -> None:
    try:
        import bpy  # noqa: F401
    except ImportError as error:
        raise core.errors.RooksError(
            f"Blender's Python module cannot be loaded ({error}): install bpy and the system libraries that it needs"
        ) from None
    register()


def _check_blend(blend: Path) -> None:
    if not blend.is_file():
        kind = "is a folder" if blend.is_dir() else "does not exist"
        raise core.errors.SceneError(f"{blend} {kind}: give a .blend file")
    try:
        with blend.open("rb") as file:
            start = file.read(7)
    except OSError as error:
        raise core.errors.SceneError(f"cannot read {blend}: {error.strerror}") from None
    # Plain, gzip and Zstandard, the three ways in which Blender writes files.
    if start != b"BLENDER" and start[:2] != b"\x1f\x8b" and start[:4] != b"\x28\xb5\x2f\xfd":
        raise core.errors.SceneError(f"{blend} is not a .blend file, or it is damaged")


def _render_file(blend: Path, paths: list[Path], options: argparse.Namespace, console: Console) -> None:
    import bpy

    from .camera import no_camera_text

    try:
        bpy.ops.wm.open_mainfile(filepath=str(blend.resolve()), load_ui=False)
    except RuntimeError:
        raise core.errors.SceneError(f"{blend} is not a .blend file, or it is damaged") from None
    scene = bpy.context.scene
    if scene.camera is None:
        # Blender finds that out by itself, but does not say what to do.
        raise core.errors.SceneError(f"{blend}: {no_camera_text(scene)}")
    _prepare(scene, options)
    watch = _render(scene, blend, console)
    for warning in watch.warnings:
        print(f"rooks: warning: {warning}", file=console.err)
    film, settings = watch.films[0], watch.settings[0]
    print(_summary(blend, film, settings), file=console.out)
    metadata = _metadata(scene, film, settings)
    for path in paths:
        if path.suffix.lower() == ".exr":
            core.write_exr(path, film, metadata)
        else:
            _save_display(scene, path)
        print(f"  saved {path}", file=console.out)


def _prepare(scene, options: argparse.Namespace) -> None:
    """Set what the command asks for, in memory only."""
    scene.render.engine = ENGINE_ID
    scene.render.use_sequencer = False
    scene.render.use_compositing = False  # its File Output nodes would write files that nobody asked for
    # Blender would keep the path of the .blend, the date and more in the picture.
    for name in scene.render.bl_rna.properties.keys():  # noqa: SIM118 - a collection of Blender's, not a dict
        if name.startswith("use_stamp"):
            setattr(scene.render, name, False)
    if options.frame is not None:
        scene.frame_set(options.frame)
    if options.resolution is not None:
        scene.render.resolution_x, scene.render.resolution_y = options.resolution
        scene.render.resolution_percentage = 100
    if options.threads is not None:
        scene.render.threads_mode = "FIXED" if options.threads else "AUTO"
        scene.render.threads = options.threads or scene.render.threads
    rooks = scene.rooks
    for name in ("samples", "seed", "max_bounces"):
        if getattr(options, name) is not None:
            setattr(rooks, name, getattr(options, name))
    _choose_samplers(rooks, options)


def _choose_samplers(rooks, options: argparse.Namespace) -> None:
    """`--sampler` is for all domains, whatever the file says; a domain's own option overrides it there."""
    domains = ("pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler")
    chosen = {domain: getattr(options, domain) for domain in domains}
    if options.sampler is not None:
        rooks.sampler = options.sampler.upper()
        rooks.use_separate_samplers = False
    if not any(chosen.values()):
        return
    for domain, name in chosen.items():
        if name is not None:
            setattr(rooks, domain, name.upper())
        elif not rooks.use_separate_samplers:
            setattr(rooks, domain, rooks.sampler)
    rooks.use_separate_samplers = True


def _render(scene, blend: Path, console: Console) -> Watch:
    """Render the first view layer that is switched on."""
    import bpy

    layers = [layer for layer in scene.view_layers if layer.use]
    for layer in layers[1:]:
        layer.use = False
    with _progress(blend.name, console) as on_progress, watching(Watch(on_progress, console.err)) as watch:
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            watch.error = watch.error or str(error).splitlines()[0].removeprefix("Error: ")
    if watch.interrupted:
        raise KeyboardInterrupt
    if watch.error or not watch.films:
        raise core.errors.SceneError(f"{blend}: {watch.error or 'Blender rendered nothing'}")
    if len(layers) > 1:
        watch.warnings.append(f'only the first of {len(layers)} view layers, "{layers[0].name}", is rendered')
    return watch


@contextmanager
def _progress(name: str, console: Console):
    """A progress bar on a terminal, nothing elsewhere: a function of tiles done and tiles in all."""
    from rich.console import Console as RichConsole
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    times = (TimeElapsedColumn(), TimeRemainingColumn())
    screen = RichConsole(file=console.err)
    progress = Progress(
        *(*columns, *times),
        console=screen,
        transient=True,
        disable=not screen.is_terminal,
        # What is printed elsewhere is Blender's chatter.
        redirect_stdout=False,
        redirect_stderr=False,
    )
    with progress:
        task = progress.add_task(name, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


def _summary(blend: Path, film: core.Film, settings: core.settings.RenderSettings) -> str:
    from .engine import sample_text, sampler_text

    return (
        f"{blend.name}: {sampler_text(settings)}, {sample_text(settings)}, {film.width} × {film.height} pixels, "
        f"{film.seconds:.2f} s and {film.setup_seconds:.2f} s to set up, "
        f"{film.samples_per_second / 1e6:.2f} million samples/s"
    )


def _metadata(scene, film: core.Film, settings: core.settings.RenderSettings) -> dict[str, str | int | float]:
    """What an EXR says of itself: how it was sampled, from what, and how long it took."""
    import bpy

    return {
        **{f"{domain}_sampler": name for domain, name in settings.samplers.items()},
        "samples_requested": settings.samples,
        "samples": film.samples,
        "seed": settings.seed,
        "max_bounces": settings.max_bounces,
        "pixel_filter": settings.pixel_filter,
        "seconds": film.seconds,
        "million_samples_per_second": film.samples_per_second / 1e6,
        "blender": bpy.app.version_string,
        "scene": scene.name,
        "frame": scene.frame_current,
    }


def _save_display(scene, path: Path) -> None:
    """Save what Blender's render window shows: the scene's view transform applied, in 8 bits."""
    import bpy

    from .versions import choose_file_format

    image_format = scene.render.image_settings
    file_format = DISPLAY_FORMATS[path.suffix.lower()]
    choose_file_format(image_format, file_format)
    image_format.color_depth = "8" if file_format != "HDR" else image_format.color_depth
    has_alpha = scene.render.film_transparent and file_format not in ("JPEG", "BMP", "HDR")
    image_format.color_mode = "RGBA" if has_alpha else "RGB"
    with core.files.replacing(path) as temporary:
        bpy.data.images["Render Result"].save_render(str(temporary), scene=scene)
