"""What a 3-D view looks at: its region, turned view and zoom as a camera, and the part of it to be rendered."""

from __future__ import annotations

import bpy
import numpy as np

from ._core import core
from .camera import check_kind, export_lens
from .viewport_session import View

Bounds = tuple[int, int, int, int]


def export_view(context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> View:
    """The view of the region that is being drawn.

    Raises:
        SceneError: it looks through a camera of a kind that is not modelled.
    """
    region, space, view = context.region, context.space_data, context.region_data
    projection = np.array(view.window_matrix, dtype=np.float64)
    matrix = np.linalg.inv(np.array(view.view_matrix, dtype=np.float64))
    camera = _camera_object(space, view, depsgraph)
    lens = {}
    if camera is not None:
        check_kind(camera)
        lens = export_lens(camera.data, matrix, depsgraph)
    clip = space if camera is None else camera.data
    clip_start, clip_end = clip.clip_start, clip.clip_end
    if camera is None and not view.is_perspective:
        # A parallel view shows what is behind its middle as well, as far as its clip end.
        matrix[:3, 3] += matrix[:3, 2] * clip.clip_end
        clip_start, clip_end = 0.0, 2.0 * clip.clip_end
    exported = core.scene.Camera(
        matrix=matrix,
        resolution=(region.width, region.height),
        window=_window(projection, view.is_perspective),
        orthographic=not view.is_perspective,
        clip_start=clip_start,
        clip_end=clip_end,
        **lens,
    )
    return View(exported, _bounds(context, camera, projection))


def _camera_object(
    space: bpy.types.SpaceView3D, view: bpy.types.RegionView3D, depsgraph: bpy.types.Depsgraph
) -> bpy.types.Object | None:
    """The camera that is looked through."""
    if view.view_perspective != "CAMERA":
        return None
    camera = space.camera if space.use_local_camera else depsgraph.scene.camera
    return None if camera is None else camera.evaluated_get(depsgraph)


def _window(projection: np.ndarray, is_perspective: bool) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) of a projection matrix, as in `core.scene.Camera`."""
    edges = []
    for axis in (0, 1):
        shift = projection[axis, 2] if is_perspective else -projection[axis, 3]
        edges += [(side + shift) / projection[axis, axis] for side in (-1.0, 1.0)]
    return tuple(edges)


def _bounds(context: bpy.types.Context, camera: bpy.types.Object | None, projection: np.ndarray) -> Bounds:
    """The part to be rendered, in pixels of the region. A border with nothing of the region in it does not count."""
    region, space, render = context.region, context.space_data, context.scene.render
    size = np.array([region.width, region.height], dtype=np.float64)
    whole = 0, 0, region.width, region.height
    if camera is not None and render.use_border:
        frame = _camera_frame(camera, context.scene, projection)
        shares = render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y
    elif camera is None and space.use_render_border:
        frame = np.array([(0.0, 0.0), (1.0, 1.0)])
        shares = (
            space.render_border_min_x,
            space.render_border_min_y,
            space.render_border_max_x,
            space.render_border_max_y,
        )
    else:
        return whole
    edges = frame[0] + (frame[1] - frame[0]) * np.array(shares).reshape(2, 2)
    (left, bottom), (right, top) = np.clip(np.rint(edges * size), 0, size).astype(int).tolist()
    return (left, bottom, right, top) if left < right and bottom < top else whole


def _camera_frame(camera: bpy.types.Object, scene: bpy.types.Scene, projection: np.ndarray) -> np.ndarray:
    """(2, 2): the lower left and the upper right corner of the camera's frame, as shares of the region."""
    corners = np.array(camera.data.view_frame(scene=scene), dtype=np.float64)
    projected = np.column_stack([corners, np.ones(len(corners))]) @ projection.T
    shares = (projected[:, :2] / projected[:, 3:] + 1.0) / 2.0
    return np.array([shares.min(axis=0), shares.max(axis=0)])
