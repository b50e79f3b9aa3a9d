"""The camera of a 3-D view sees what Blender's own matrices say that it sees, within what its borders cut out."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Euler, Matrix, Vector  # noqa: E402

from addon.region_view import export_view  # noqa: E402
from core import SceneError  # noqa: E402
from tests.addon_helpers import add, empty_scene, lamp  # noqa: E402

WIDTH, HEIGHT = 200, 100
POINTS = (Vector((0.3, -0.2, -4)), Vector((-1, 0.5, -2)), Vector((0, 0, -9)))  # in the view's own space
PLACE = Matrix.Translation((1, 2, 3)) @ Euler((0.4, -0.2, 1.1)).to_matrix().to_4x4()


def perspective(left: float, right: float, bottom: float, top: float) -> Matrix:
    """OpenGL's projection of what a plane one metre away shows between these edges, clipped at 0.1 m and 100 m."""
    width, height, near, far = right - left, top - bottom, 0.1, 100.0
    return Matrix(
        (
            (2 / width, 0, (right + left) / width, 0),
            (0, 2 / height, (top + bottom) / height, 0),
            (0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)),
            (0, 0, -1, 0),
        )
    )


def parallel(left: float, right: float, bottom: float, top: float) -> Matrix:
    """The same for a parallel view of these edges in metres, from 100 m behind its middle to 100 m before it."""
    width, height = right - left, top - bottom
    return Matrix(
        (
            (2 / width, 0, 0, -(right + left) / width),
            (0, 2 / height, 0, -(top + bottom) / height),
            (0, 0, -0.01, 0),
            (0, 0, 0, 1),
        )
    )


def context(projection: Matrix, looks: str = "PERSP", is_perspective: bool = True, **space) -> SimpleNamespace:
    """What is drawn: a region with a 3-D view that stands at `PLACE`."""
    settings = {"camera": bpy.context.scene.camera, "use_local_camera": False, "clip_start": 0.1, "clip_end": 100.0}
    border = {"use_render_border": False, "render_border_min_x": 0.25, "render_border_max_x": 0.5}
    border |= {"render_border_min_y": 0.5, "render_border_max_y": 1.0}
    return SimpleNamespace(
        scene=bpy.context.scene,
        region=SimpleNamespace(width=WIDTH, height=HEIGHT),
        space_data=SimpleNamespace(**settings | border | space),
        region_data=SimpleNamespace(
            window_matrix=projection,
            view_matrix=PLACE.inverted(),
            is_perspective=is_perspective,
            view_perspective=looks,
        ),
    )


def view_of(*arguments, **options):
    return export_view(context(*arguments, **options), bpy.context.evaluated_depsgraph_get())


def place_in_region(camera, point: Vector) -> tuple[float, float]:
    """Where the renderer's camera sees a point of the view's own space, as shares of the region."""
    x, y, z, _one = np.linalg.inv(camera.matrix) @ np.array(PLACE @ point.to_4d())
    assert camera.clip_start < -z < camera.clip_end
    if not camera.orthographic:
        x, y = x / -z, y / -z
    left, right, bottom, top = camera.window
    return (x - left) / (right - left), (y - bottom) / (top - bottom)


@pytest.fixture(autouse=True)
def scene():
    return empty_scene()


@pytest.mark.parametrize(("project", "is_perspective"), [(perspective, True), (parallel, False)])
@pytest.mark.parametrize("edges", [(-1, 1, -0.5, 0.5), (-0.3, 0.9, 0.1, 0.7)])
def test_points_land_where_blender_draws_them(project, is_perspective, edges):
    projection = project(*edges)
    camera = view_of(projection, is_perspective=is_perspective).camera
    assert camera.resolution == (WIDTH, HEIGHT)
    for point in POINTS:
        drawn = projection @ point.to_4d()
        expected = (drawn.x / drawn.w + 1) / 2, (drawn.y / drawn.w + 1) / 2
        np.testing.assert_allclose(place_in_region(camera, point), expected, atol=1e-6)


def test_a_parallel_view_shows_what_is_behind_its_middle():
    camera = view_of(parallel(-2, 2, -1, 1), is_perspective=False).camera
    for depth in (-99.0, 0.0, 99.0):
        place_in_region(camera, Vector((0, 0, -depth)))  # which is not clipped


@pytest.mark.parametrize("looks", ["PERSP", "CAMERA"])
def test_the_lens_and_the_clipping_are_the_cameras_where_one_looks_through_it(scene, looks):
    lens = scene.camera.data
    lens.dof.use_dof, lens.dof.aperture_fstop, lens.lens, lens.clip_end = True, 1.0, 50, 30.0
    camera = view_of(perspective(-1, 1, -0.5, 0.5), looks).camera
    assert (camera.lens_radius, camera.clip_end) == ((0.025, 30.0) if looks == "CAMERA" else (0.0, 100.0))


def test_a_view_may_have_a_camera_of_its_own(scene):
    own = add("Own", bpy.data.cameras.new("Own"))
    own.data.clip_end = 7.0
    projection = perspective(-1, 1, -0.5, 0.5)
    assert view_of(projection, "CAMERA", camera=own).camera.clip_end == pytest.approx(scene.camera.data.clip_end)
    assert view_of(projection, "CAMERA", camera=own, use_local_camera=True).camera.clip_end == 7.0


def test_without_a_camera_the_view_through_it_is_the_views_own(scene):
    scene.camera = None
    assert view_of(perspective(-1, 1, -0.5, 0.5), "CAMERA").camera.clip_end == 100.0


def test_looking_through_a_panorama_or_a_lamp_says_so(scene):
    scene.camera.data.type = "PANO"
    with pytest.raises(SceneError, match='camera "Camera" is panoramic'):
        view_of(perspective(-1, 1, -1, 1), "CAMERA")
    view_of(perspective(-1, 1, -1, 1), "PERSP")
    scene.camera = lamp("SPOT", name="Torch")
    with pytest.raises(SceneError, match='"Torch", which is not a camera'):
        view_of(perspective(-1, 1, -1, 1), "CAMERA")


def test_the_border_of_a_view_is_a_part_of_its_region():
    projection = perspective(-1, 1, -0.5, 0.5)
    assert view_of(projection).bounds == (0, 0, WIDTH, HEIGHT)
    assert view_of(projection, use_render_border=True).bounds == (50, 50, 100, 100)
    assert view_of(projection, use_render_border=True, render_border_max_x=0.251).bounds == (0, 0, WIDTH, HEIGHT)


def bordered(scene, left: float, bottom: float, right: float, top: float) -> None:
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_min_y = left, bottom
    scene.render.border_max_x, scene.render.border_max_y = right, top


def through_the_camera(scene, zoom: float, pan: tuple[float, float]):
    """A view whose region shows the camera's frame `zoom` times as large as itself, moved by `pan` of half its size."""
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    matrix = scene.camera.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=WIDTH, y=HEIGHT)
    zoomed = Matrix.Translation((*pan, 0)) @ Matrix.Diagonal((zoom, zoom, 1, 1)) @ matrix
    return view_of(zoomed, "CAMERA", scene.camera.data.type == "PERSP")


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize(("zoom", "pan"), [(1.0, (0, 0)), (0.5, (0.1, -0.2)), (2.0, (0.5, 0.5))])
def test_the_border_of_a_camera_is_a_part_of_its_frame(scene, kind, zoom, pan):
    scene.camera.data.type, scene.camera.data.shift_x = kind, 0.13
    bordered(scene, 0.25, 0.5, 0.75, 0.75)
    shares = np.array([[0.25, 0.5], [0.75, 0.75]])
    drawn = ((2 * shares - 1) * zoom + pan + 1) / 2 * (WIDTH, HEIGHT)
    left, bottom, right, top = np.clip(drawn, 0, (WIDTH, HEIGHT)).ravel()
    assert through_the_camera(scene, zoom, pan).bounds == pytest.approx((left, bottom, right, top), abs=0.51)


def test_a_border_out_of_sight_does_not_count(scene):
    bordered(scene, 0.0, 0.0, 0.25, 0.25)
    assert through_the_camera(scene, 4.0, (0, 0)).bounds == (0, 0, WIDTH, HEIGHT)


def test_the_cameras_border_counts_for_the_view_through_it_only(scene):
    bordered(scene, 0.25, 0.25, 0.5, 0.5)
    assert view_of(perspective(-1, 1, -0.5, 0.5)).bounds == (0, 0, WIDTH, HEIGHT)
