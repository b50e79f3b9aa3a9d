"""Cameras: exact coverage of pixels, blur as the thin-lens formula has it, depths along the view axis, the filter.

Pictures of shapes that emit 1 are maps of coverage, and a shape's exact share of a pixel comes from clipping polygons.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate

from core import Instance, RenderSettings, Scene, SceneError, render
from core.filters import blackman_harris, offset_table
from tests.scenes import (
    camera_down,
    camera_forward,
    emitter,
    estimate,
    floor,
    picture,
    pixel_centers,
    polygon,
    quad,
    rotation,
    translation,
)

GLOW = (emitter(),)
CHANCE = ("random", "jittered", "n_rooks", "multi_jittered")


def clip(corners: np.ndarray, axis: int, bound: float, keep_above: bool) -> np.ndarray:
    """The part of a convex polygon (n, 2) on one side of an axis-aligned line (Sutherland and Hodgman 1974)."""
    side = (corners[:, axis] - bound) * (1 if keep_above else -1)
    kept = []
    for i in range(len(corners)):
        j = (i + 1) % len(corners)
        if side[i] >= 0:
            kept.append(corners[i])
        if (side[i] >= 0) != (side[j] >= 0):
            kept.append(corners[i] + (corners[j] - corners[i]) * side[i] / (side[i] - side[j]))
    return np.array(kept).reshape(-1, 2)


def area(corners: np.ndarray) -> float:
    x, y = corners.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def coverage(corners: np.ndarray, camera) -> np.ndarray:
    """The exact share of each pixel that a convex polygon covers; `corners` (n, 2) in the camera's window."""
    left, right, bottom, top = camera.window
    width, height = camera.resolution
    dx, dy = (right - left) / width, (top - bottom) / height
    shares = np.zeros((height, width))
    for j in range(height):
        row = clip(clip(corners, 1, bottom + j * dy, True), 1, bottom + (j + 1) * dy, False)
        for i in range(width):
            if len(row) > 2:
                cell = clip(clip(row, 0, left + i * dx, True), 0, left + (i + 1) * dx, False)
                shares[j, i] = area(cell) / (dx * dy) if len(cell) > 2 else 0
    return shares


HALF_PLANE = np.array([(-3.0, -3.0), (0.1, -3.0), (-0.25, 3.0), (-3.0, 3.0)])
DISK = np.stack([np.cos(np.arange(64) * np.pi / 32), np.sin(np.arange(64) * np.pi / 32)], -1) * 0.37 + (0.03, -0.02)
SHAPES = {"half-plane": HALF_PLANE, "disk": DISK}


def shape_before(camera, corners: np.ndarray, depth: float = 2.0) -> Scene:
    """The shape `depth` in front of the camera so that it fills `corners` of its window."""
    scale = 1.0 if camera.orthographic else depth
    local = np.column_stack([corners * scale, np.full(len(corners), -depth)])
    world = local @ camera.matrix[:3, :3].T + camera.matrix[:3, 3]
    return Scene(camera, (Instance(polygon(world), materials=GLOW),))


CAMERAS = {
    "orthographic": camera_down(1.0, (12, 8)),
    "perspective": camera_forward(0.5, (12, 8)),
    "shifted": camera_forward(0.5, (8, 12)).__class__(
        translation(3, -2, 1) @ rotation(2, 0.6) @ rotation(0, 0.8), (9, 7), (-0.45, 0.15, -0.2, 0.5), clip_end=1e9
    ),
}


@pytest.mark.parametrize(
    ("camera", "shape", "sampler"),
    [
        *((camera, shape, "multi_jittered") for camera in CAMERAS for shape in SHAPES),
        *(("perspective", "half-plane", sampler) for sampler in CHANCE),
    ],
)
def test_coverage_of_each_pixel_is_exact_on_average(camera, shape, sampler):
    camera, shape = CAMERAS[camera], SHAPES[shape]
    exact = coverage(shape, camera)
    samples, seeds = 16, 32
    scene = shape_before(camera, shape)
    pictures = [picture(scene, samples=samples, sampler=sampler, seed=seed) for seed in range(seeds)]
    mean = np.mean(pictures, axis=0)
    inside, outside = exact > 1 - 1e-9, exact < 1e-9
    assert inside.any()
    assert outside.any()
    assert (mean[inside] == 1).all()
    assert (mean[outside] == 0).all()
    # Stratified sets vary less than random ones at these counts, whose variance is known.
    edge = ~inside & ~outside
    share = exact[edge]
    z = (mean[edge] - share) / np.sqrt(share * (1 - share) / (samples * seeds))
    assert np.abs(z).max() < 4.5
    # The whole edge, in measured standard errors.
    assert estimate(lambda seed: pictures[seed].mean(), seeds).agrees(exact.mean())


@pytest.mark.parametrize("name", ["regular", "hammersley"])
def test_deterministic_sets_cover_to_within_their_discrepancy(name):
    camera = CAMERAS["perspective"]
    seen = picture(shape_before(camera, DISK), samples=1024, sampler=name)
    assert np.abs(seen - coverage(DISK, camera)).max() < 0.03


@pytest.mark.parametrize("filled", range(5))
@pytest.mark.parametrize(
    "camera", [camera_down(1.0, (8, 8)), camera_forward(0.5, (8, 8))], ids=["ortho", "perspective"]
)
def test_regular_samples_measure_an_axis_aligned_edge_exactly(camera, filled):
    """Of 4×4 samples the columns left of the edge, which lies between two of them, are all hit and no other."""
    edge = -0.5 + (3 + filled / 4) / 8
    corners = np.array([(-2, -2), (edge, -2), (edge, 2), (-2, 2)])
    seen = picture(shape_before(camera, corners), samples=16, sampler="regular")
    expected = np.where(np.arange(8) < 3, 1, np.where(np.arange(8) == 3, filled / 4, 0))
    assert np.array_equal(seen, np.broadcast_to(expected, seen.shape))


def test_the_bottom_row_comes_first_and_x_grows_to_the_right():
    camera = camera_forward(0.5, (8, 8))
    lower_left = np.array([(-0.5, -0.5), (-0.25, -0.5), (-0.25, -0.375), (-0.5, -0.375)])
    expected = np.zeros((8, 8))
    expected[0, :2] = 1
    assert np.array_equal(picture(shape_before(camera, lower_left), sampler="regular"), expected)


# The thin lens


def edge_profile(x: np.ndarray, width: float, blur: float) -> np.ndarray:
    """The mean over pixels about `x`, `width` wide, of ½ + (asin t + t √(1 - t²)) / π with t = x / blur."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    t = np.clip((x[:, None] + nodes * width / 2) / blur, -1, 1)
    return (0.5 + (np.arcsin(t) + t * np.sqrt(1 - t * t)) / np.pi) @ weights / 2


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("depth", [1.0, 9.0])
def test_an_edge_out_of_focus_blurs_as_the_thin_lens_formula_says(orthographic, depth):
    """Its blur on the plane in focus has the diameter A |z - z_f| / z, before a perspective camera."""
    focus, lens = 3.0, 0.1
    at_focus = lens * abs(depth - focus) / depth
    blur = lens * abs(1 - depth / focus) if orthographic else at_focus / focus
    more = {"lens_radius": lens, "focus_distance": focus}
    camera = camera_down(4 * blur, (32, 8), **more) if orthographic else camera_forward(2 * blur, (32, 8), **more)
    far = 100 * blur
    scene = shape_before(camera, np.array([(0, -far), (far, -far), (far, far), (0, far)]), depth)
    columns = estimate(lambda seed: picture(scene, samples=64, seed=seed).mean(axis=0))
    x = pixel_centers(camera)[0][0]
    assert columns.agrees(edge_profile(x, x[1] - x[0], blur), rounding=1e-4)
    assert (columns.mean[x < -1.05 * blur] == 0).all()
    assert (columns.mean[x > 1.05 * blur] == 1).all()


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("blades", [0, 5])
def test_what_is_in_focus_stays_sharp(orthographic, blades):
    more = {"lens_radius": 0.5, "focus_distance": 3.0, "aperture_blades": blades}
    camera = camera_down(1.0, (8, 8), **more) if orthographic else camera_forward(0.5, (8, 8), **more)
    corners = np.array([(-2, -2), (0.125, -2), (0.125, 2), (-2, 2)])
    seen = picture(shape_before(camera, corners, depth=3.0), samples=64, sampler="jittered")
    assert np.array_equal(seen, np.broadcast_to(np.arange(8) < 5, (8, 8)))


@pytest.mark.parametrize(
    ("blades", "turn", "ratio"), [(0, 0.0, 1.0), (3, 0.0, 1.0), (6, 0.3, 1.0), (5, 0.0, 2.0), (0, 0.0, 0.5)]
)
def test_a_bright_spot_out_of_focus_shows_the_aperture(blades, turn, ratio):
    """A small light beyond the focus paints the lens's shape: a disk, or a polygon in it, 1 / `ratio` as wide.

    As in Cycles the middle of a polygon's side, not a corner, lies at the angle of rotation.
    """
    lens, focus, depth, spot = 0.5, 1.0, 2.0, 0.05
    camera = camera_forward(0.25 * 2.2, (28, 28), lens_radius=lens, focus_distance=focus,
                            aperture_blades=blades, aperture_rotation=turn, aperture_ratio=ratio)  # fmt: skip
    scene = Scene(camera, (Instance(quad((0, 0, -depth), (spot, 0, 0), (0, spot, 0)), materials=GLOW),))
    seen = estimate(lambda seed: picture(scene, samples=1024, seed=seed), seeds=2).mean
    # A lens point l sees the spot, which is at 0, in the window at l (1 / focus - 1 / depth).
    sides = blades or 200
    angles = turn + (2 * np.arange(sides) + 1) * np.pi / sides
    aperture = lens * np.stack([np.cos(angles) / ratio, np.sin(angles)], -1)
    image = aperture * (1 / focus - 1 / depth)
    x, y = pixel_centers(camera)
    margin = 0.5 * (x[0, 1] - x[0, 0]) + spot / 2 / depth
    grown, shrunk = ((half_space(image, x, y) < sign * margin * 1.5).all(axis=0) for sign in (1, -1))
    assert shrunk.sum() > 8
    assert (seen[~grown] == 0).all()
    # The spot seen from the window covers (spot / depth)² of it; the lens's image spreads that over its own area.
    density = (spot / depth) ** 2 / area(image)
    assert seen[shrunk].mean() == pytest.approx(density, rel=4 / math.sqrt(density * shrunk.sum() * 2048))


def half_space(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The signed distance of each point to each side of a convex polygon, negative inside."""
    following = np.roll(corners, -1, axis=0)
    normal = np.stack([following[:, 1] - corners[:, 1], corners[:, 0] - following[:, 0]], -1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    offset = (normal * corners).sum(axis=1)
    return normal[:, 0, None, None] * x + normal[:, 1, None, None] * y - offset[:, None, None]


# Depths


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize(
    ("start", "end", "seen"), [(0.0, 2.01, 1), (0.0, 1.99, 0), (1.99, 9.0, 1), (2.01, 9.0, 0), (1.9, 2.1, 1)]
)
def test_clipping_counts_depth_along_the_axis(orthographic, start, end, seen):
    """Also in the corners of a wide picture, where a plane at depth 2 is more than 3 m away."""
    more = {"clip_start": start, "clip_end": end}
    camera = camera_down(1.0, (8, 8), **more) if orthographic else camera_forward(1.0, (8, 8), **more)
    assert (picture(shape_before(camera, HALF_PLANE * 10 + (20, 0))) == seen).all()


def test_depth_is_measured_along_the_axis():
    camera = camera_forward(1.0, (8, 8))
    x, _ = pixel_centers(camera)
    flat = quad((0, 0, -3), (20, 0, 0), (0, 20, 0))
    tilted = quad((0, 0, -3), (4, 0, 2), (0, 20, 0))  # z = -3 + x/2
    settings = RenderSettings(samples=1, sampler="regular", threads=1)
    for mesh, expected in ((flat, 3.0), (tilted, 3 / (1 + x / 2))):
        depth = render(Scene(camera, (Instance(mesh),)), settings).passes["Depth"][..., 0]
        hit = depth < 1e9
        assert hit.mean() > 0.4
        assert np.allclose(depth[hit], np.broadcast_to(expected, depth.shape)[hit], rtol=1e-5)
    empty = render(Scene(camera), settings).passes["Depth"]
    assert (empty == 1e10).all()


# The pixel filter


def test_the_box_filter_stays_inside_the_pixel():
    camera = camera_down(1.0, (8, 8))
    one_pixel = np.array([(0.0, 0.0), (0.125, 0.0), (0.125, 0.125), (0.0, 0.125)])
    expected = np.zeros((8, 8))
    expected[4, 4] = 1
    for sampler in CHANCE:
        assert np.array_equal(picture(shape_before(camera, one_pixel), sampler=sampler), expected)


@pytest.mark.parametrize("width", [0.5, 1.5, 3.0])
@pytest.mark.parametrize(("low", "high"), [(-9.0, 0.3), (0.42, 0.48)])
def test_the_filtered_picture_is_the_integral_of_the_window(width, low, high):
    """A half-plane or a thin line, given in pixels from the centre of pixel 4, over that pixel and its neighbours."""
    camera = camera_down(8.0, (8, 8))
    edges = [low + 0.5, high + 0.5]  # the centre of pixel 4 lies at x = 0.5
    corners = np.array([(edges[0], -9), (edges[1], -9), (edges[1], 9), (edges[0], 9)])
    total = integrate.quad(blackman_harris, -0.5, 0.5)[0]
    expected = []
    for pixel in range(8):
        a, b = (np.clip((edge - (pixel - 3.5)) / width, -0.5, 0.5) for edge in edges)
        expected.append(integrate.quad(blackman_harris, a, b)[0] / total)
    scene = shape_before(camera, corners)
    seen = estimate(
        lambda seed: picture(scene, samples=256, seed=seed, pixel_filter="blackman_harris", filter_width=width).mean(
            axis=0
        )
    )
    assert (np.abs(seen.mean - expected) < 4 * seen.error + 1e-4).all()


def test_the_filters_inverse_distribution_is_exact():
    """To 1e-4 pixels at width 1.5, but for the far ends, where 3 samples in 1000 fall, and to 0.05 pixels there."""
    width = 1.5
    offsets = offset_table(RenderSettings(pixel_filter="blackman_harris", filter_width=width))
    x = np.linspace(-0.5, 0.5, 1_000_001)
    cumulative = integrate.cumulative_simpson(blackman_harris(x), x=x, initial=0)
    u = (np.arange(100_000) + 0.5) / 100_000
    error = np.abs(np.interp(u * (len(offsets) - 1), np.arange(len(offsets)), offsets)
                   - (0.5 + width * np.interp(u, cumulative / cumulative[-1], x)))  # fmt: skip
    assert (error > 1e-4).mean() < 3e-3
    assert error.max() < 0.05
    assert np.all(np.diff(offsets) > 0)
    assert (offsets[0], offsets[-1]) == pytest.approx((-0.25, 1.25))


# What makes no picture


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"resolution": (0, 8)}, "no pixels"),
        ({"matrix": np.full((4, 4), np.nan)}, "not finite"),
        ({"window": (0.0, math.inf, 0.0, 1.0)}, "not finite"),
        ({"window": (0.0, 1e30, 0.0, 1.0)}, "too large"),
        ({"clip_start": 5.0, "clip_end": 5.0}, "clip start"),
        ({"clip_start": -1.0}, "clip start"),
        ({"clip_end": math.nan}, "clip"),
        ({"lens_radius": 0.1, "focus_distance": 0.0}, "focus"),
        ({"lens_radius": 0.1, "focus_distance": math.nan}, "focus"),
        ({"lens_radius": math.nan}, "lens"),
        ({"lens_radius": -0.1}, "radius"),
        ({"window": (0.0, 0.0, 0.0, 0.0)}, "too small"),
        ({"window": (1e6, 1e6 + 1.0, 0.0, 1.0)}, "shift"),
        ({"name": "Left eye", "clip_end": 0.0}, "camera 'Left eye' .* clip start"),
        ({"lens_radius": 0.1, "aperture_ratio": 0.0}, "ratio"),
    ],
)
def test_a_camera_that_makes_no_picture_is_refused(values, message):
    good = camera_forward(0.5, (8, 8))
    with pytest.raises(SceneError, match=message):
        render(Scene(type(good)(**(vars(good) | values)), (Instance(floor()),)), RenderSettings(samples=1))
