"""Comparing samplers on a .blend file without a window: `python -m addon compare FILE.blend --output FOLDER`."""

from __future__ import annotations

import argparse

from . import comparing
from ._core import core
from .blend_files import check_blend, engine_registered, open_scene
from .console import Console, progress_bar, quiet_blender


def compare_file(options: argparse.Namespace) -> int:
    """Measure, and save, what a `compare` command asks for.

    Raises:
        RooksError: a package is missing, or the file, the folder or the scene is not as it should be.
    """
    check_blend(options.file)
    comparing.load_comparison()
    comparing.check_folder(options.output)
    with quiet_blender() as console, engine_registered():
        plan, warnings = _plan(options, console)
        for warning in warnings:
            print(f"rooks: warning: {warning}", file=console.err)
        width, height = plan.scene.camera.resolution
        size = f"{width} × {height} pixels, {plan.seeds} seeds, samples: {' '.join(map(str, plan.counts))}"
        print(f"{options.file.name}: comparing {len(plan.samplers)} samplers, {size}", file=console.out)
        with progress_bar(console) as on_progress:
            outcome = comparing.compare(plan, on_progress, core.command_line.was_interrupted)
        if outcome is None:
            raise core.command_line.Ended
        print(outcome.recommendation, file=console.out)
        for path in outcome.files:
            print(f"  saved {path}", file=console.out)
    return 0


def _plan(options: argparse.Namespace, console: Console) -> tuple[comparing.Plan, tuple[str, ...]]:
    scene = open_scene(options.file, options)
    # These load bpy.
    from .camera import frame_resolution
    from .handover import hand_over, size_within

    try:
        size = size_within(scene.render, comparing.DEFAULT_SIZE)
        if options.resolution is not None:
            size = frame_resolution(scene.render)
        handed = hand_over(scene, size, console.err)
    except core.errors.SceneError as error:
        raise core.errors.SceneError(f"{options.file}: {error}") from None
    plan = comparing.Plan(
        scene=handed.scene,
        settings=handed.settings,
        samplers=tuple(dict.fromkeys(options.samplers)),
        counts=tuple(sorted(set(options.counts))),
        seeds=options.seeds,
        folder=options.output,
        name=comparing.sheet_name(options.file),
    )
    return plan, handed.warnings
