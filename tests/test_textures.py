"""Textures: the checker by its definition, image lookups against a naive twin, through pictures of a textured floor.

A floor under a constant world of radiance 1 shows its albedo exactly, so a picture is the texture, looked up where the
pixels' centres are.
"""

from __future__ import annotations

import numpy as np
import pytest

from core import (
    Instance,
    Material,
    Mesh,
    RenderSettings,
    Scene,
    SceneError,
    SunLight,
    render,
)
from core.shaders import Diffuse, Emission
from core.values import OBJECT, UV, Checker, ImageTexture
from tests import naive
from tests.scenes import camera_down, picture, pixel_centers, polygon, rotation, scaling, translation

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
EXTENSIONS = ("repeat", "mirror", "extend", "clip")


def textured_floor(texture, size: float = 6.0, slope: float = 0.0, uv=(1.0, 1.0, 0.0, 0.0)) -> Mesh:
    """A floor whose uv are (su x + tu, sv y + tv), given as (su, sv, tu, tv); `slope` lifts it along x."""
    half = size / 2
    corners = np.array([(x, y, slope * x) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))])
    flat = (corners[:, :2] * uv[:2] + uv[2:]).astype(np.float32)
    mesh = polygon(corners)
    return Mesh("floor", mesh.vertices, mesh.triangles, uvs=flat[mesh.triangles])


def shown(texture, *, pixels=(24, 16), width=4.0, mesh=None, matrix=None, emission=False, **uv) -> np.ndarray:
    """The picture's colours (height, width, 3): one sample at each pixel's centre."""
    material = Material("emits", Emission(texture)) if emission else Material("reflects", Diffuse(texture))
    instance = Instance(mesh or textured_floor(texture, **uv), matrix if matrix is not None else np.eye(4), (material,))
    world = (0.0,) * 3 if emission else (1.0,) * 3
    scene = Scene(camera_down(width, pixels, height=10), (instance,), world=world)
    return picture(scene, channel=None, samples=1, sampler="regular")[..., :3]


def checker_expected(x: np.ndarray, y: np.ndarray, z: np.ndarray | float) -> np.ndarray:
    first = np.vectorize(naive.checker_is_first_color)(*np.broadcast_arrays(x, y, z))
    return np.where(first[..., None], RED, BLUE)


# Checker


@pytest.mark.parametrize("emission", [False, True])
@pytest.mark.parametrize("scale", [1.0, 2.7, 0.3])
def test_checker_in_object_space_is_the_parity_of_floors(scale, emission):
    camera = camera_down(4.0, (24, 16))
    x, y = pixel_centers(camera)
    seen = shown(Checker(RED, BLUE, scale, OBJECT), slope=0.9, emission=emission)
    off_edges = np.ones((16, 24), bool)
    for coordinate in (x * scale, y * scale, 0.9 * x * scale):
        off_edges &= np.abs(coordinate - np.round(coordinate)) > 1e-4
    assert off_edges.mean() > 0.8
    expected = checker_expected(x * scale, y * scale, 0.9 * x * scale)
    assert np.allclose(seen[off_edges], expected[off_edges], atol=1e-6)


def test_a_face_that_lies_on_an_edge_falls_into_one_cell():
    """z = 0 is the edge between two layers of cells; rounding must not speckle it. Blender: the upper cell."""
    camera = camera_down(4.0, (32, 32))
    x, y = pixel_centers(camera)
    for size in (6.0, 100.0):
        seen = shown(Checker(RED, BLUE, 1.0, OBJECT), pixels=(32, 32), size=size)
        assert np.allclose(seen, checker_expected(x, y, 0.5), atol=1e-6)


def test_at_the_origin_a_checker_has_its_second_color():
    camera_sees = shown(Checker(RED, BLUE, 1.0, UV), width=0.5, pixels=(4, 4), uv=(1, 1, 0.5, 0.5))
    assert np.allclose(camera_sees, BLUE, atol=1e-6)


def test_checker_by_uv_and_by_generated_coordinates():
    x, y = pixel_centers(camera_down(4.0, (24, 16)))
    by_uv = shown(Checker(RED, BLUE, 3.0, UV), uv=(0.5, 2.0, 0.123, 0.456))
    assert np.allclose(by_uv, checker_expected(3 * (0.5 * x + 0.123), 3 * (2 * y + 0.456), 0.5), atol=1e-6)
    mesh = textured_floor(None)
    mesh = Mesh("floor", mesh.vertices, mesh.triangles, texture_space=((0.1, 0.2, 0.0), (3.0, 2.0, 0.0)))
    generated = shown(Checker(RED, BLUE, 5.0), mesh=mesh)
    expected = checker_expected(5 * ((x - 0.1) / 6 + 0.5), 5 * ((y - 0.2) / 4 + 0.5), 2.5)
    assert np.allclose(generated, expected, atol=1e-6)


@pytest.mark.parametrize("copies", [1, 2])
def test_object_space_moves_with_the_object(copies):
    """Whether the mesh is stored in world space (one copy) or in its own (two)."""
    matrix = translation(0.3, -0.4, 0.2) @ rotation(2, 0.5) @ scaling(1.5, -0.7, 1)
    material = Material("checker", Diffuse(Checker(RED, BLUE, 2.0, OBJECT)))
    mesh = textured_floor(None)
    places = (matrix, translation(0, 0, -5))[:copies]
    camera = camera_down(4.0, (24, 16), height=10)
    instances = tuple(Instance(mesh, place, (material,)) for place in places)
    seen = picture(Scene(camera, instances, world=(1.0,) * 3), channel=None, samples=1, sampler="regular")[..., :3]
    x, y = pixel_centers(camera)
    inverse = np.linalg.inv(matrix)
    local = inverse[:3, :3] @ np.stack([*(a.ravel() for a in np.broadcast_arrays(x, y, 0.2))]) + inverse[:3, 3:]
    inside = (np.abs(local[:2]) < 2.99).all(axis=0)
    clear = inside & (np.abs(2 * local[:2] - np.round(2 * local[:2])) > 1e-4).all(axis=0)
    assert clear.mean() > 0.5
    expected = checker_expected(2 * local[0], 2 * local[1], 0.5)
    assert np.allclose(seen.reshape(-1, 3)[clear], expected[clear], atol=1e-6)


# Images


def image(dtype: type, height: int = 3, width: int = 5) -> np.ndarray:
    rng = np.random.default_rng(1)
    if dtype == np.uint8:
        return rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    return rng.uniform(0, 2, (height, width, 3)).astype(np.float32)


@pytest.mark.parametrize("dtype", [np.float32, np.uint8])
@pytest.mark.parametrize("interpolation", ["linear", "closest"])
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_images_are_looked_up_as_their_naive_twin(extension, interpolation, dtype):
    texture = ImageTexture(image(dtype), extension, interpolation)
    u, v = pixel_centers(camera_down(4.0, (24, 16)))
    u, v = 0.93 * u + 0.217, 1.1 * v - 0.139
    assert u.min() < -1.2
    assert u.max() > 1.9
    seen = shown(texture, uv=(0.93, 1.1, 0.217, -0.139), emission=True)
    for j in range(16):
        for i in range(24):
            expected = naive.image_color(texture.pixels, u[0, i], v[j, 0], extension, interpolation)
            assert np.allclose(seen[j, i], expected, atol=2e-5), (i, j)


@pytest.mark.parametrize("interpolation", ["linear", "closest"])
def test_pixel_centers_show_the_pixels_and_the_bottom_row_lies_at_v_0(interpolation):
    pixels = image(np.float32, 4, 6)
    seen = shown(ImageTexture(pixels, "extend", interpolation), pixels=(6, 4), width=3.0,
                 uv=(1 / 3, 1 / 2, 0.5, 0.5), emission=True)  # fmt: skip
    assert np.allclose(seen, pixels, atol=1e-4)


def test_bytes_are_srgb_and_floats_are_linear():
    grey = np.full((2, 2, 3), 128, np.uint8)
    same = naive.linear_of_srgb(128 / 255)
    assert shown(ImageTexture(grey), emission=True)[0, 0] == pytest.approx([same] * 3, rel=1e-5)
    linear = np.full((2, 2, 3), 0.25, np.float32)
    assert shown(ImageTexture(linear), emission=True)[0, 0] == pytest.approx([0.25] * 3, rel=1e-6)
    for value in (0, 1, 10, 11, 255):  # both branches of the curve, and its ends
        seen = shown(ImageTexture(np.full((1, 1, 3), value, np.uint8)), pixels=(4, 4), emission=True)
        assert seen == pytest.approx(naive.linear_of_srgb(value / 255), rel=1e-5, abs=1e-9)


def test_two_images_of_each_kind_do_not_mix():
    colors = [(0.1, 0.2, 0.3), (0.4, 0.5, 0.6)]
    images = [np.full((2, 3, 3), color, np.float32) for color in colors]
    images += [np.full((3, 2, 3), value, np.uint8) for value in (60, 200)]
    expected = [*colors, *((naive.linear_of_srgb(value / 255),) * 3 for value in (60, 200))]
    instances = tuple(
        Instance(textured_floor(None, 1.0), translation(k - 1.5, 0, 0), (Material(str(k), Emission(ImageTexture(i))),))
        for k, i in enumerate(images)
    )
    scene = Scene(camera_down(4.0, (4, 1)), instances)
    seen = picture(scene, channel=None, samples=1, sampler="regular")[0, :, :3]
    assert np.allclose(seen, expected, rtol=1e-5)


def test_a_texture_multiplies_the_emission_strength():
    texture = ImageTexture(np.full((1, 1, 3), 0.5, np.float32))
    material = Material("lamp", Emission(texture, 6.0))
    scene = Scene(camera_down(1.0, (4, 4)), (Instance(textured_floor(None), materials=(material,)),))
    assert picture(scene) == pytest.approx(np.full((4, 4), 3.0), rel=1e-6)


def test_without_uvs_an_image_shows_its_corner_and_nothing_breaks():
    pixels = image(np.float32)
    mesh = polygon([(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)])
    seen = shown(ImageTexture(pixels, interpolation="closest"), mesh=mesh, emission=True)
    assert np.allclose(seen, pixels[0, 0])


@pytest.mark.parametrize("shape", [(4, 4), (0, 4, 3), (4, 4, 4)])
def test_pixels_of_the_wrong_shape_are_refused(shape):
    with pytest.raises(SceneError, match=r"image.*shape"):
        shown(ImageTexture(np.zeros(shape, np.float32)))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("batch_packets", [1, 64])
@pytest.mark.parametrize("lights", [(), (SunLight((0, 0, 1), (1.0,) * 3),)], ids=["world", "sun"])
def test_a_bad_texel_spoils_no_other_pixel(bad, batch_packets, lights):
    """Its own samples are dropped and counted; the background beside it, in the same lanes later, keeps its light."""
    material = Material("bad", Diffuse(ImageTexture(np.full((1, 1, 3), bad, np.float32))))
    left_half = Instance(polygon([(-4, -4, 0), (0, -4, 0), (0, 4, 0), (-4, 4, 0)]), materials=(material,))
    scene = Scene(camera_down(4.0, (16, 16)), (left_half,), lights, world=(1.0, 1.0, 1.0))
    film = render(scene, RenderSettings(samples=16, threads=1, batch_packets=batch_packets))
    seen = film.passes["Combined"][..., 0]
    assert (seen[:, 8:] == 1).all()
    assert (seen[:, :8] == 0).all()
    assert film.dropped_samples == 8 * 16 * 16
