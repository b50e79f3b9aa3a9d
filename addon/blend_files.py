"""Opening .blend files for a command, and choosing in them what it asks for.

It is the same on Blender's Python module and inside Blender (`blender FILE.blend --command rooks …`), where the engine
is registered and the file may be open already.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from . import is_registered, register, unregister
from ._core import core
from .scene_options import set_scene


@contextmanager
def engine_registered() -> Iterator[None]:
    """Load Blender where it is not running, and have the engine registered meanwhile."""
    try:
        import bpy  # noqa: F401
    except ImportError as error:
        raise core.errors.RooksError(
            f"Blender's Python module cannot be loaded ({error}): install bpy and the system libraries that it needs"
        ) from None
    if is_registered():
        yield
        return
    register()
    try:
        yield
    finally:
        unregister()


def check_blend(blend: Path) -> None:
    """Raise a SceneError for what is no .blend file at first sight. Needs no Blender."""
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


def open_scene(blend: Path, options: argparse.Namespace):
    """Open a file and return its active scene, or the one that is asked for, for Rooks to render as options say.

    A file that Blender has open stays as it is, with all that has been done to it.

    Raises:
        SceneError: it cannot be opened, or does not have what is asked for.
    """
    import bpy

    from .camera import no_camera_text

    if Path(bpy.data.filepath).resolve() != blend.resolve():
        try:
            bpy.ops.wm.open_mainfile(filepath=str(blend.resolve()), load_ui=False)
        except RuntimeError:
            raise core.errors.SceneError(f"{blend} is not a .blend file, or it is damaged") from None
    scene = bpy.context.scene
    if options.scene is not None:
        scene = _named(bpy.data.scenes, options.scene, f"{blend} has no scene")
    if options.view_layer is not None:
        _keep_layer(scene, _named(scene.view_layers, options.view_layer, f'{blend}: "{scene.name}" has no view layer'))
    if options.camera is not None:
        cameras = {obj.name: obj for obj in scene.objects if obj.type == "CAMERA"}
        _look_through(scene, _named(cameras, options.camera, f'{blend}: "{scene.name}" has no camera'))
    if scene.camera is None:
        # Blender finds that out by itself, but does not say what to do.
        raise core.errors.SceneError(f"{blend}: {no_camera_text(scene)}")
    _prepare(scene, options)
    return scene


def _named(things, name: str, missing: str):
    """One of Blender's things by its name; `missing` begins the error where there is none of this name."""
    if name not in things:
        names = ", ".join(f'"{known}"' for known in things.keys())  # noqa: SIM118 - may be a collection of Blender's
        raise core.errors.SceneError(f'{missing} "{name}": ' + (f"choose {names}" if names else "it has none"))
    return things[name]


def _keep_layer(scene, kept) -> None:
    for layer in scene.view_layers:
        layer.use = layer == kept


def _look_through(scene, camera) -> None:
    for marker in scene.timeline_markers:  # they choose the camera on their frames, and whenever one is changed
        marker.camera = None
    scene.camera = camera


def _prepare(scene, options: argparse.Namespace) -> None:
    """Make a scene one that Rooks renders, and nothing else."""
    from .engine import ENGINE_ID

    scene.render.engine = ENGINE_ID
    scene.render.use_sequencer = False
    scene.render.use_compositing = False  # its File Output nodes would write files that nobody asked for
    set_scene(scene, options)


def keep_first_layer(scene) -> list[str]:
    """Switch off all view layers but the first that is on. Returns a warning where that leaves any out."""
    layers = [layer for layer in scene.view_layers if layer.use]
    for layer in layers[1:]:
        layer.use = False
    if len(layers) < 2:
        return []
    return [f'only the first of {len(layers)} view layers, "{layers[0].name}", is rendered']
