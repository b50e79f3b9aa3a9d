"""Rendering .blend files on Blender's Python module, through the same engine that Blender's window uses."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from ._core import core
from .blend_files import check_blend, engine_registered, keep_first_layer, open_scene
from .console import Console, progress_bar, quiet_blender
from .outputs import DISPLAY_FORMATS, plan_outputs
from .scene_options import set_property
from .watch import Watch, watched_render

#: How files end in the formats of which Blender does not say that it could not write all.
_ENDS = {".png": b"IEND\xaeB`\x82", ".tga": b"TRUEVISION-XFILE.\0"}


def render_files(options: argparse.Namespace) -> int:
    """Render each file of a `render` command and save it.

    Raises:
        RooksError: a file, an output or a scene is not as it should be. Files before it are done.
    """
    frames = None if options.frames is None else range(options.frames[0], options.frames[1] + 1)
    plans = {blend: plan_outputs(blend, options.output, len(options.files), frames) for blend in options.files}
    for blend in plans:
        check_blend(blend)
    times = Counter(path for plan in plans.values() for paths in plan.values() for path in paths)
    for path, count in times.items():
        if count > 1:
            raise core.errors.OutputError(f"two pictures would be saved as {path}: give one file another folder")
    with quiet_blender() as console, engine_registered():
        for blend, plan in plans.items():
            _render_file(blend, plan, options, console)
    return 0


def _render_file(
    blend: Path, plan: dict[int | None, list[Path]], options: argparse.Namespace, console: Console
) -> None:
    scene = open_scene(blend, options)
    _prepare(scene, options)
    told: set[str] = set()
    _warn(keep_first_layer(scene), told, console)
    for frame, paths in plan.items():
        suffix = ""
        if frame is not None:
            scene.frame_set(frame)
            suffix = f", frame {frame}"
        _render_frame(scene, blend, suffix, paths, told, console)


def _prepare(scene, options: argparse.Namespace) -> None:
    for layer in scene.view_layers:  # Blender keeps of a film what its layers ask for
        layer.use_pass_z = layer.use_pass_normal = layer.rooks.use_pass_sampling_error = True
        if options.denoising_data is not None:
            layer.rooks.use_pass_denoising_data = options.denoising_data
    # Blender would keep the path of the .blend, the date and more in the picture.
    for name in scene.render.bl_rna.properties.keys():  # noqa: SIM118 - a collection of Blender's, not a dict
        if name.startswith("use_stamp"):
            setattr(scene.render, name, False)
    _choose_samplers(scene, options)


def _choose_samplers(scene, options: argparse.Namespace) -> None:
    """`--sampler` is for all domains, whatever the file says; a domain's own option overrides it there."""
    rooks = scene.rooks
    domains = ("pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler")
    chosen = {domain: getattr(options, domain) for domain in domains}
    if options.sampler is not None:
        set_property(scene, "rooks.sampler", options.sampler.upper())
        set_property(scene, "rooks.use_separate_samplers", False)
    if not any(chosen.values()):
        return
    for domain, name in chosen.items():
        if name is not None:
            set_property(scene, f"rooks.{domain}", name.upper())
        elif not rooks.use_separate_samplers:
            set_property(scene, f"rooks.{domain}", rooks.sampler)
    set_property(scene, "rooks.use_separate_samplers", True)


def _render_frame(scene, blend: Path, suffix: str, paths: list[Path], told: set[str], console: Console) -> None:
    """Render a scene as it is on its current frame, and save it; `suffix` follows the file's name where that is said.

    Warnings in `told` are not told again.
    """
    # These load bpy.
    from .camera import frame_resolution
    from .settings import render_border

    with progress_bar(console) as on_progress:
        watch = Watch(lambda done, total: on_progress(done / total, blend.name + suffix), err=console.err)
        try:
            render_border(scene.render, frame_resolution(scene.render))  # Blender would only say "Image too small"
            watched_render(watch, scene=scene.name)
        except (core.errors.SceneError, core.errors.SettingsError) as error:
            raise core.errors.SceneError(f"{blend}{suffix}: {error}") from None
    if not watch.films:
        raise core.errors.SceneError(f"{blend}{suffix}: Blender rendered nothing")
    _warn(watch.warnings, told, console)
    film, settings = watch.films[0], watch.settings[0]
    print(_summary(blend.name + suffix, film, settings), file=console.out)
    for path in paths:
        if path.suffix.lower() == ".exr":
            _save_passes(scene, path, film, settings)
        else:
            _save_display(scene, path)
        print(f"  saved {path}", file=console.out)


def _warn(warnings: list[str], told: set[str], console: Console) -> None:
    for warning in warnings:
        if warning not in told:
            print(f"rooks: warning: {warning}", file=console.err)
    told.update(warnings)


def _summary(title: str, film: core.Film, settings: core.settings.RenderSettings) -> str:
    from .progress import losses, sample_text, sampler_text, speed_text

    text = (
        f"{title}: {sampler_text(settings)}, {sample_text(settings)}, {film.width} × {film.height} pixels, "
        f"{film.seconds:.2f} s and {film.setup_seconds:.2f} s to set up, {speed_text(film.samples_per_second)}"
    )
    return "; ".join([text, *losses(film)])


def _save_passes(scene, path: Path, film: core.Film, settings: core.settings.RenderSettings) -> None:
    """Save all passes, linear and unclamped."""
    import bpy

    from .metadata import metadata
    from .versions import choose_multilayer_format

    if not bpy.app.binary_path:  # Blender as a Python module
        core.write_exr(path, film, metadata(scene, film, settings))
        return
    # Blender has an OpenEXR library of its own, beside which another one crashes 4.3.
    choose_multilayer_format(scene.render.image_settings)
    _save_render(scene, path)


def _save_render(scene, path: Path) -> None:
    import bpy

    with core.files.replacing(path) as temporary:
        try:
            bpy.data.images["Render Result"].save_render(str(temporary), scene=scene)
        except RuntimeError as error:
            reason = str(error).partition("\n")[0]  # the second line names the temporary file
            raise RuntimeError(reason.removeprefix("Error: ")) from None
        end = _ENDS.get(path.suffix.lower())
        if end is not None and not temporary.read_bytes().endswith(end):
            raise RuntimeError("it was cut off, as happens where the disk is full")


def _save_display(scene, path: Path) -> None:
    """Save what Blender's render window shows: the scene's view transform applied, in 8 bits."""
    from .versions import choose_file_format

    image_format = scene.render.image_settings
    file_format = DISPLAY_FORMATS[path.suffix.lower()]
    choose_file_format(image_format, file_format)
    image_format.color_depth = "8" if file_format != "HDR" else image_format.color_depth
    has_alpha = scene.render.film_transparent and file_format not in ("JPEG", "BMP", "HDR")
    image_format.color_mode = "RGBA" if has_alpha else "RGB"
    _save_render(scene, path)
