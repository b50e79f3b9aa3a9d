"""The exported camera sees what Blender's own camera functions say that it sees."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Euler, Vector  # noqa: E402

from core.errors import SceneError  # noqa: E402
from tests.addon_helpers import add, empty_scene, export, lamp  # noqa: E402

VIEWS = list(
    itertools.product(["AUTO", "HORIZONTAL", "VERTICAL"], [(48, 27), (27, 48), (32, 32)], [(1, 1), (2, 1), (1, 1.5)])
)


def frame_position(camera, point: Vector) -> tuple[float, float]:
    """Where a world point is in the frame by the exported camera, (0, 0) lower left to (1, 1) upper right."""
    x, y, z, _one = np.linalg.inv(camera.matrix) @ (*point, 1.0)
    if not camera.orthographic:
        x, y = x / -z, y / -z
    left, right, bottom, top = camera.window
    return (x - left) / (right - left), (y - bottom) / (top - bottom)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize(("fit", "resolution", "aspect"), VIEWS)
def test_points_land_where_blender_projects_them(kind, fit, resolution, aspect):
    scene = empty_scene(*resolution)
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    lens = scene.camera.data
    lens.type, lens.sensor_fit, lens.lens, lens.ortho_scale = kind, fit, 35, 7
    lens.sensor_width, lens.sensor_height = 30, 25
    lens.shift_x, lens.shift_y = 0.13, -0.21
    scene.camera.rotation_euler = Euler((0.2, -0.1, 0.4))
    scene.camera.scale = (2, 2, 2)
    camera = export()[0].camera
    bpy.context.view_layer.update()
    for point in (Vector((0, 0, 0)), Vector((1, -2, 3)), Vector((-2, 1, -1))):
        expected = world_to_camera_view(scene, scene.camera, point)
        np.testing.assert_allclose(frame_position(camera, point), expected[:2], atol=2e-6)


def test_resolution_follows_the_percentage():
    scene = empty_scene(101, 51)
    scene.render.resolution_percentage = 50
    assert export()[0].camera.resolution == (50, 25)


def test_scale_of_the_camera_object_is_ignored():
    scene = empty_scene()
    scene.camera.scale = (3, 0.5, 2)
    np.testing.assert_allclose(export()[0].camera.matrix[:3, :3], np.eye(3), atol=1e-7)


def test_clip_distances():
    scene = empty_scene()
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.25, 75
    camera = export()[0].camera
    assert (camera.clip_start, camera.clip_end) == (0.25, 75)


@pytest.mark.parametrize(("kind", "radius"), [("PERSP", 0.05 / 2 / 1.4), ("ORTHO", 1 / 2 / 1.4)])
def test_lens_radius_is_focal_length_over_twice_the_f_stop(kind, radius):
    scene = empty_scene()
    lens = scene.camera.data
    lens.type, lens.lens = kind, 50
    lens.dof.use_dof, lens.dof.aperture_fstop, lens.dof.focus_distance = True, 1.4, 3
    lens.dof.aperture_blades, lens.dof.aperture_rotation, lens.dof.aperture_ratio = 6, 0.3, 2
    camera = export()[0].camera
    assert camera.lens_radius == pytest.approx(radius)
    assert camera.focus_distance == 3
    assert (camera.aperture_blades, camera.aperture_ratio) == (6, 2)
    assert camera.aperture_rotation == pytest.approx(0.3)


def test_no_depth_of_field_is_a_pinhole():
    empty_scene()
    assert export()[0].camera.lens_radius == 0


def test_a_focus_object_counts_by_its_distance_along_the_view_axis():
    scene = empty_scene()
    dof = scene.camera.data.dof
    dof.use_dof, dof.focus_distance = True, 1
    dof.focus_object = add("Focus", None, location=(5, -3, 2))
    assert export()[0].camera.focus_distance == pytest.approx(8)


def test_no_camera_says_so():
    scene = empty_scene()
    scene.camera = None
    with pytest.raises(SceneError, match='scene "Scene" has no camera: add one'):
        export()


def test_a_panoramic_camera_says_what_to_do():
    scene = empty_scene()
    scene.camera.data.type = "PANO"
    with pytest.raises(SceneError, match=r'camera "Camera" is panoramic.*Perspective'):
        export()


def test_looking_through_something_else_names_it():
    scene = empty_scene()
    scene.camera = lamp("SPOT", name="Torch")
    with pytest.raises(SceneError, match='"Torch", which is not a camera'):
        export()


def test_a_camera_without_size_is_an_error():
    scene = empty_scene()
    scene.camera.scale = (0, 1, 1)
    with pytest.raises(SceneError, match="scale of 0"):
        export()


def test_field_of_view_of_a_square_picture():
    scene = empty_scene(32, 32)
    scene.camera.data.angle = math.radians(90)
    assert export()[0].camera.window == pytest.approx((-1, 1, -1, 1), abs=1e-6)
