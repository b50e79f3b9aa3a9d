"""The world as a light: Blender's panoramas, and directions that follow a picture's brightness as their pdf says.

The χ² tests compare a histogram with the integrated pdf. Seeds are fixed; all of them together reject a right density
with a probability of at most 1e-3 (Šidák).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from core.environment import (
    EVEN_SHARE,
    EnvironmentMap,
    build_environment,
    direction_to_mirror_ball,
    direction_to_panorama,
    environment_pdf,
    panorama_to_direction,
    sample_environment,
)
from core.jit import kernel
from tests.jit_helpers import compiled_return_type

F = np.float32
LARGEST = F(1 - 2**-24)

unit = st.floats(0, float(LARGEST), width=32)
component = st.floats(-1, 1, width=32)


@st.composite
def directions(draw) -> np.ndarray:
    """Unit vectors in float32, often next to an axis, where x and y may be tiny."""
    scales = st.sampled_from((1, 1e-3, 1e-6))
    vector = np.array([draw(component) * draw(scales) for _ in range(3)])
    length = np.linalg.norm(vector)
    return (vector / length if length > 1e-12 else np.array((0, 0, 1))).astype(F)


@kernel
def sample_all(environment, points, directions, pdfs):
    for k in range(len(points)):
        x, y, z, pdf = sample_environment(environment, points[k, 0], points[k, 1])
        directions[k, 0], directions[k, 1], directions[k, 2], pdfs[k] = x, y, z, pdf


@kernel
def pdf_of_all(environment, directions, pdfs):
    for k in range(len(pdfs)):
        pdfs[k] = environment_pdf(environment, directions[k, 0], directions[k, 1], directions[k, 2])


def sampled(environment: EnvironmentMap, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) and densities (n,), float32, of points (n, 2)."""
    places, pdfs = np.empty((len(points), 3), F), np.empty(len(points), F)
    sample_all(environment, points, places, pdfs)
    return places, pdfs


def uniform(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((count, 2), dtype=F)


def gray(values: np.ndarray) -> np.ndarray:
    return np.repeat(np.asarray(values, F)[..., None], 3, axis=2)


def from_world(world: Callable, height: int, width: int) -> np.ndarray:
    """A picture of a world: its radiance, a function of z and of the angle φ from +X to +Y, in the cells' middles."""
    z = -np.cos(np.pi * (np.arange(height) + 0.5) / height)[:, None]
    phi = np.pi * (1 - 2 * (np.arange(width) + 0.5) / width)[None]
    return gray(np.broadcast_to(world(z, phi), (height, width)))


# Panoramas


@pytest.mark.parametrize(
    ("direction", "place"),
    [
        ((1, 0, 0), (0.5, 0.5)),
        ((0, 1, 0), (0.25, 0.5)),
        ((0, -1, 0), (0.75, 0.5)),
        ((0, 0, 1), (0.5, 1)),
        ((0, 0, -1), (0.5, 0)),
        ((-1, 1e-6, 0), (0, 0.5)),
        ((-1, -1e-6, 0), (1, 0.5)),
        ((1, 0, 1), (0.5, 0.75)),
    ],
)
def test_the_axes_of_a_panorama_are_blenders(direction, place):
    assert direction_to_panorama(*map(F, direction)) == pytest.approx(place, abs=3e-7)


@given(directions())
def test_a_direction_comes_back_from_the_panorama(direction):
    back = panorama_to_direction(*direction_to_panorama(*direction))
    assert back == pytest.approx(tuple(direction), abs=1e-6)


@given(unit, unit)
def test_a_place_comes_back_from_its_direction(u, v):
    direction = panorama_to_direction(F(u), F(v))
    assert math.hypot(*direction) == pytest.approx(1, abs=3e-7)
    u_back, v_back = direction_to_panorama(*direction)
    assert v_back == pytest.approx(v, abs=3e-7)
    sine = math.sin(math.pi * v)
    if sine > 1e-6:
        # Round and round: 0 is 1.
        assert abs((u_back - u + 0.5) % 1 - 0.5) < 5e-7


@given(st.floats(2.0**-40, 2.0**-10, width=32), unit)
def test_next_to_straight_down_places_keep_their_digits(v, u):
    x, y, z = panorama_to_direction(F(u), F(v))
    assert math.hypot(x, y) == pytest.approx(math.sin(math.pi * v), rel=1e-6)
    assert direction_to_panorama(x, y, z)[1] == pytest.approx(v, rel=1e-6)


@pytest.mark.parametrize("up", [-1, 1])
def test_next_to_the_poles_the_angle_round_them_is_exact(up):
    for phi in np.linspace(-3, 3, 50):
        u, _ = direction_to_panorama(F(1e-6 * math.cos(phi)), F(1e-6 * math.sin(phi)), F(up))
        assert u == pytest.approx(0.5 - phi / (2 * np.pi), abs=2e-7)


@given(directions())
def test_the_mirror_ball_shows_what_it_reflects(direction):
    """The ball's normal halves the angle between the direction and the viewer, who is at -Y."""
    u, v = direction_to_mirror_ball(*direction)
    x, y, z = direction.astype(float)
    if y > 1 - 1e-9:
        return
    half = np.array((x, y - 1, z)) if y < 0 else np.array((x, -(x * x + z * z) / (1 + y), z))
    half /= np.linalg.norm(half)
    assert (u, v) == pytest.approx((0.5 + half[0] / 2, 0.5 + half[2] / 2), abs=1e-6)


@pytest.mark.parametrize(
    ("projection", "look_up"),
    [("EQUIRECTANGULAR", direction_to_panorama), ("MIRROR_BALL", direction_to_mirror_ball)],
)
def test_places_are_those_of_cycles(projection, look_up, tmp_path):
    """A picture whose colours are its own coordinates, as the world of a scene without anything else."""
    bpy = pytest.importorskip("bpy")
    openexr = pytest.importorskip("OpenEXR")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, size, side = bpy.context.scene, 512, 24
    image = bpy.data.images.new("coordinates", size, size, float_buffer=True, is_data=True)
    ramp = (np.arange(size, dtype=F) + F(0.5)) / size
    pixels = np.zeros((size, size, 4), F)
    pixels[..., 0], pixels[..., 1], pixels[..., 3] = ramp, ramp[:, None], 1
    image.pixels.foreach_set(pixels.ravel())
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    nodes = scene.world.node_tree.nodes
    scene.world.cycles.sampling_method = "NONE"
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.projection = image, projection
    scene.world.node_tree.links.new(nodes["Background"].inputs["Color"], texture.outputs["Color"])

    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.angle = math.radians(100)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(tmp_path / "seen.exr")
    across = (2 * (np.arange(side) + 0.5) / side - 1) * math.tan(camera.data.angle / 2)
    local = np.stack(np.broadcast_arrays(across, -across[:, None], -1.0), axis=-1)
    local /= np.linalg.norm(local, axis=-1, keepdims=True)

    for rotation in ((0, 0, 0), (math.pi / 2, 0, 0.3), (math.pi / 2, 0, 2.0), (2.6, 0.4, 4.5)):
        camera.rotation_euler = rotation
        bpy.ops.render.render(write_still=True)
        with openexr.File(scene.render.filepath) as file:
            channels = file.channels()
            seen = (channels.get("RGBA") or channels["RGB"]).pixels[..., :2]
        world = (local @ np.array(camera.matrix_world.to_3x3()).T).astype(F)
        expected = np.array([look_up(*direction) for direction in world.reshape(-1, 3)]).reshape(side, side, 2)
        # The pixel's own blur is magnified next to the poles and the ball's rim, and at the picture's edges its
        # opposite edge is mixed in.
        x, y, _ = np.moveaxis(world, -1, 0)
        clear = ((expected > 1 / size) & (expected < 1 - 1 / size)).all(axis=-1)
        clear &= (np.hypot(x, y) > 0.2) if projection == "EQUIRECTANGULAR" else (y < 0.8)
        assert clear.mean() > 0.5
        assert np.abs(seen - expected)[clear].max() < 2e-3


# The density

MAPS = {
    "one cell": gray([[1]]),
    "two cells": gray([[1, 3]]),
    "five rows": np.random.default_rng(1).random((5, 4, 3), dtype=F),
    "noise": np.random.default_rng(2).random((12, 20, 3), dtype=F) ** 6,
    "a sun": gray(np.where(np.arange(128).reshape(8, 16) == 77, 1e6, 1)),
    "dark but for one cell": gray(np.arange(128).reshape(8, 16) == 40),
    "half": from_world(lambda z, phi: (z > 0) + 0 * phi, 9, 4),
    "black": gray(np.zeros((4, 8))),
}
every_map = pytest.mark.parametrize("radiance", MAPS.values(), ids=MAPS.keys())


def solid_angles(height: int, width: int) -> np.ndarray:
    """(h, 1) of a cell in each row."""
    borders = -np.cos(np.pi * np.arange(height + 1) / height)
    return (2 * np.pi / width * np.diff(borders))[:, None]


@every_map
def test_the_pdf_integrates_to_one(radiance):
    environment = build_environment(radiance)
    assert (environment.density * solid_angles(*radiance.shape[:2])).sum() == pytest.approx(1, rel=1e-6)


@every_map
def test_directions_have_the_density_that_the_pdf_states(radiance):
    """Each cell is cut into 2 × 3 parts of equal solid angle."""
    environment = build_environment(radiance)
    places, _ = sampled(environment, uniform(200_000, 3))
    height, width = radiance.shape[:2]
    x, y, z = places.T.astype(float)
    borders = -np.cos(np.pi * np.arange(height + 1) / height)
    middles = (borders[1:] + borders[:-1]) / 2
    rows = np.sort(np.concatenate((borders, middles)))
    # 1 less than 1 by rounding is still inside.
    u = (0.5 - np.arctan2(y, x) / (2 * np.pi)) % 1
    counts = np.histogram2d(z.clip(-1, 1), u, bins=(rows, np.linspace(0, 1, 3 * width + 1)))[0].ravel()
    parts = (environment.density * solid_angles(height, width)).repeat(2, axis=0).repeat(3, axis=1).ravel() / 6
    expected = parts * len(places)
    rare = expected < 5
    if rare.any():
        counts = np.append(counts[~rare], counts[rare].sum())
        expected = np.append(expected[~rare], expected[rare].sum())
    assert counts.sum() == len(places)
    p = stats.chisquare(counts, expected * (counts.sum() / expected.sum())).pvalue
    assert p > 1 - (1 - 1e-3) ** (1 / len(MAPS))


@pytest.mark.parametrize(("height", "width"), [(1, 1), (5, 3), (64, 128), (2, 4096), (4096, 2), (1024, 2048)])
def test_a_direction_has_one_pdf_even_at_a_cells_border(height, width):
    """What is sampled and what is looked up are the same to the bit, wherever in its cell a direction lies."""
    rng = np.random.default_rng(height)
    environment = build_environment(rng.random((height, width, 3), dtype=F))
    points = uniform(400_000, 4)
    # The square's own edges, and the edges of cells as near as float32 comes to them.
    points[:1000, 0], points[500:1500, 1], points[1500:2000] = LARGEST, LARGEST, 0
    edges = rng.choice(environment.row_sums[:-1], 20_000)
    points[2000:22_000, 1] = F(EVEN_SHARE) + F(1 - EVEN_SHARE) * edges
    points[22_000:42_000, 0] = rng.choice(environment.column_sums[:, :-1].ravel(), 20_000)
    places, pdfs = sampled(environment, points)
    looked_up = np.empty_like(pdfs)
    pdf_of_all(environment, places, looked_up)
    assert np.array_equal(pdfs, looked_up)
    assert np.linalg.norm(places.astype(float), axis=1) == pytest.approx(1, abs=3e-7)


@given(
    st.lists(st.sampled_from((0, 1, 1e6, 1e-6, -3, math.nan, math.inf, -math.inf)), min_size=8, max_size=8),
    directions(),
    unit,
    unit,
)
def test_no_direction_is_impossible(values, direction, u, v):
    environment = build_environment(gray(np.array(values).reshape(2, 4)))
    floor = EVEN_SHARE / (4 * np.pi)
    assert floor * 0.999 < environment_pdf(environment, *direction) < np.inf
    *place, pdf = sample_environment(environment, F(u), F(v))
    assert math.hypot(*place) == pytest.approx(1, abs=3e-7)
    assert floor * 0.999 < pdf < np.inf


def test_a_black_world_is_sampled_evenly():
    environment = build_environment(MAPS["black"])
    _, pdfs = sampled(environment, uniform(1000, 5))
    assert pdfs == pytest.approx(np.full(1000, 1 / (4 * np.pi)), rel=1e-6)


def test_a_world_that_is_almost_black_is_sampled_by_what_there_is():
    """Its power is so small that the factor to a density of 1 is beyond float32."""
    radiance = np.full((4, 8, 3), 1e-45, np.float32)
    radiance[2, 3] = 1e-43
    density = build_environment(radiance).density
    assert np.isfinite(density).all()
    assert density.argmax() == 2 * 8 + 3


def test_a_single_bright_cell_is_found():
    radiance = gray(np.full((256, 512), 0.01))
    radiance[200, 100] = 1e6
    environment = build_environment(radiance)
    places, pdfs = sampled(environment, uniform(20_000, 6))
    towards = np.array(panorama_to_direction(F(100.5 / 512), F(200.5 / 256)))
    # The neighbours take part, because the world is taken to fade into them.
    near = places @ towards > math.cos(1.5 * math.sqrt(2) * np.pi / 256)
    assert near.mean() > 0.98 * (1 - EVEN_SHARE)
    # The world is a disk in that cell, sharply cut. Uniform directions would have a deviation of 160 times its power.
    inside = (places @ towards > math.cos(0.5 * np.pi / 256)) * 1e6
    estimate = inside / pdfs
    power = 1e6 * 2 * np.pi * (1 - math.cos(0.5 * np.pi / 256))
    assert estimate.mean() == pytest.approx(power, abs=4 * estimate.std() / math.sqrt(len(places)))
    assert estimate.std() < 2 * power


def test_what_lies_beside_a_sun_is_not_taken_to_be_dark():
    """The pdf is in proportion to the mean over the cell of the picture interpolated bilinearly."""
    values = np.zeros((9, 9))
    values[4, 4] = 1
    density = build_environment(gray(values)).density
    floor = EVEN_SHARE / (4 * np.pi)
    sun, beside, corner = (density[place] - floor for place in ((4, 4), (4, 5), (5, 5)))
    assert (beside / sun, corner / sun) == pytest.approx((1 / 6, 1 / 36), rel=1e-3)
    # In u the picture closes.
    values = np.roll(values, 4, axis=1)
    density = build_environment(gray(values)).density
    assert (density[4, 0] - floor) / (density[4, 8] - floor) == pytest.approx(1 / 6, rel=1e-3)


# Irradiance of a floor under known worlds. The estimate divides the world itself, not its picture, by the pdf.

SUN_ANGLE, SUN_Z = 0.05, 0.8
WORLDS = {
    "constant": (lambda z, phi: 1 + 0 * z, math.pi),
    "brighter upwards": (lambda z, phi: (1 + z) / 2, math.pi / 2 + math.pi / 3),
    "only below the horizon": (lambda z, phi: (z < 0) * 1.0, 0),
    "bright to one side": (lambda z, phi: 1 + np.sqrt(1 - z**2) * np.cos(phi), math.pi),
    "a sun": (
        lambda z, phi: (z * SUN_Z + np.sqrt(1 - z**2) * 0.6 * np.cos(phi) > math.cos(SUN_ANGLE)) * 1000.0,
        1000 * math.pi * math.sin(SUN_ANGLE) ** 2 * SUN_Z,
    ),
}


@pytest.mark.parametrize(("world", "irradiance"), WORLDS.values(), ids=WORLDS.keys())
def test_the_irradiance_of_a_known_world(world, irradiance):
    environment = build_environment(from_world(world, 128, 256))
    places, pdfs = sampled(environment, uniform(50_000, 7))
    x, y, z = places.T.astype(float)
    values = np.where(z > 0, z * world(z.clip(-1, 1), np.arctan2(y, x)), 0) / pdfs
    assert values.mean() == pytest.approx(irradiance, abs=4 * values.std() / math.sqrt(len(values)) + 1e-9)
    # Uniform directions would need to be over 100 times as many under the sun.
    assert irradiance == 0 or values.std() / irradiance < 1.6


def test_neighbours_in_the_square_stay_neighbours():
    """Under a world without dark parts the map is continuous but for the cut at -X and between the two shares."""
    environment = build_environment(from_world(lambda z, phi: 2 + z + np.cos(phi), 64, 128))
    axis = np.linspace(0.02, 0.999, 200, dtype=F)
    points = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    places = sampled(environment, points)[0].reshape(200, 200, 3)
    step = 0.979 / 199
    for axis in (0, 1):
        moved = np.linalg.norm(np.diff(places, axis=axis), axis=-1)
        # A quarter of a turn per unit of u if all is even; the darkest parts are passed 8 times as fast.
        assert moved.max() < 16 * np.pi * step


def test_kernels_stay_in_float32():
    environment = build_environment(MAPS["noise"])
    assert "float64" not in compiled_return_type(sample_environment, environment, F(0.3), F(0.6))
    assert "float64" not in compiled_return_type(environment_pdf, environment, F(0.6), F(0), F(0.8))
