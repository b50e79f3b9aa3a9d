"""Blender's camera, its sensor, lens and depth of field, as the renderer's `Camera`.

A picture is fitted into the sensor along one of its sides: the wider one of the picture (fit AUTO, against the
sensor's width), the horizontal or the vertical. Shift moves the window by multiples of the fitted side. Depth of field
follows Cycles: the lens' radius is focal length / (2 f-stop) for a perspective camera and 1 m / (2 f-stop) for an
orthographic one, and a focus object counts by its distance along the view axis. Panoramic cameras are not modelled.
"""

from __future__ import annotations

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core

Window = tuple[float, float, float, float]


def export_camera(depsgraph: bpy.types.Depsgraph, resolution: tuple[int, int]) -> core.scene.Camera:
    """The active camera of a scene; `resolution` is the full frame's, in pixels.

    Raises:
        SceneError: there is no camera, or one of a kind that is not modelled.
    """
    scene = depsgraph.scene_eval
    if scene.camera is None:
        raise core.errors.SceneError(no_camera_text(scene))
    camera = scene.camera.evaluated_get(depsgraph)
    check_kind(camera)
    matrix = _without_scale(camera)
    aspect = scene.render.pixel_aspect_x, scene.render.pixel_aspect_y
    return core.scene.Camera(
        matrix=matrix,
        resolution=resolution,
        window=view_window(camera.data, resolution, aspect),
        orthographic=camera.data.type == "ORTHO",
        clip_start=camera.data.clip_start,
        clip_end=camera.data.clip_end,
        name=camera.name,
        **export_lens(camera.data, matrix, depsgraph),
    )


def frame_resolution(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """The full frame in pixels, percentage applied and rounded as Blender does."""
    percent = render.resolution_percentage
    return max(render.resolution_x * percent // 100, 1), max(render.resolution_y * percent // 100, 1)


def no_camera_text(scene: bpy.types.Scene) -> str:
    text = rpt_('the scene "{name}" has no camera: add one, or make one the active camera in the Scene properties')
    return text.format(name=scene.name)


def view_window(camera: bpy.types.Camera, resolution: tuple[int, int], pixel_aspect: tuple[float, float]) -> Window:
    """What the full frame sees, (left, right, bottom, top), one metre in front of a perspective camera or, in metres,
    across an orthographic one."""
    width, height = resolution[0] * pixel_aspect[0], resolution[1] * pixel_aspect[1]
    horizontal = camera.sensor_fit == "HORIZONTAL" or (camera.sensor_fit == "AUTO" and width > height)
    if camera.type == "ORTHO":
        fitted = camera.ortho_scale
    else:
        sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
        fitted = sensor / camera.lens
    size_x, size_y = (fitted, fitted * height / width) if horizontal else (fitted * width / height, fitted)
    center_x, center_y = fitted * camera.shift_x, fitted * camera.shift_y
    return center_x - size_x / 2, center_x + size_x / 2, center_y - size_y / 2, center_y + size_y / 2


def check_kind(camera: bpy.types.Object) -> None:
    if camera.type != "CAMERA":
        text = rpt_('the scene looks through "{name}", which is not a camera: make a camera object the active camera')
        raise core.errors.SceneError(text.format(name=camera.name))
    if camera.data.type not in ("PERSP", "ORTHO"):
        kind = {"PANO": rpt_("panoramic")}.get(camera.data.type, camera.data.type.lower())
        text = rpt_(
            'the camera "{name}" is {kind}, which Rooks cannot render: '
            "set its type to Perspective or Orthographic in the camera's Lens panel"
        )
        raise core.errors.SceneError(text.format(name=camera.name, kind=kind))


def _without_scale(camera: bpy.types.Object) -> np.ndarray:
    matrix = np.array(camera.matrix_world, dtype=np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.isfinite(matrix).all() or not lengths.all():
        text = rpt_('the camera "{name}" has a scale of 0 or a position that is not a number')
        raise core.errors.SceneError(text.format(name=camera.name))
    matrix[:3, :3] /= lengths
    return matrix


def export_lens(camera: bpy.types.Camera, matrix: np.ndarray, depsgraph: bpy.types.Depsgraph) -> dict:
    """The fields of the thin lens; none of them for a camera without depth of field."""
    dof = camera.dof
    if not dof.use_dof:
        return {}
    focal_length = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
    return {
        "lens_radius": focal_length / (2.0 * max(dof.aperture_fstop, 1e-5)),
        "focus_distance": max(_focus_distance(dof, matrix, depsgraph), 1e-5),
        "aperture_blades": dof.aperture_blades if dof.aperture_blades >= 3 else 0,
        "aperture_rotation": dof.aperture_rotation,
        "aperture_ratio": dof.aperture_ratio,
    }


def _focus_distance(dof: bpy.types.CameraDOFSettings, matrix: np.ndarray, depsgraph: bpy.types.Depsgraph) -> float:
    if dof.focus_object is None:
        return dof.focus_distance
    target = dof.focus_object.evaluated_get(depsgraph)
    place = target.matrix_world
    bone = target.pose.bones.get(dof.focus_subtarget) if target.pose else None
    if bone is not None:
        place = place @ bone.matrix
    return abs(float(matrix[:3, 2] @ (matrix[:3, 3] - np.array(place.translation, dtype=np.float64))))
