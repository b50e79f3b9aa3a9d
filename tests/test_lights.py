"""Each lamp lights a floor as its closed form says, within four measured standard errors.

The probe is a white floor's radiance × π. A lamp of power P and area A has the radiance P / (π A).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy import integrate

from core import (
    AreaLight,
    Instance,
    Material,
    PointLight,
    RenderSettings,
    Scene,
    SceneError,
    SpotLight,
    SunLight,
    preparation,
    render,
)
from core.scene import VISIBLE_TO_CAMERA, VISIBLE_TO_SHADOWS, VISIBLE_TO_SURFACES
from core.shaders import AddShader, Diffuse, Emission
from tests.scenes import (
    WHITE,
    box,
    camera_down,
    camera_forward,
    emitter,
    estimate,
    floor,
    irradiance,
    lambertian,
    picture,
    pixel_centers,
    quad,
    rotation,
    scaling,
    sphere,
    translation,
)

POWER = (100.0, 100.0, 100.0)


def radiance(area: float) -> float:
    return POWER[0] / (math.pi * area)


def overhead(shape: str, width: float, height: float, at: Sequence[float]) -> AreaLight:
    """An area light that shines straight down."""
    return AreaLight(tuple(at), (width, 0, 0), (0, height, 0), POWER, shape)


def polygon_irradiance(corners: np.ndarray, light_radiance: float) -> float:
    """Lambert's formula (1760) for a polygon seen from the origin of a floor that faces +z, clipped at the horizon."""
    above = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if p[2] > 0:
            above.append(p)
        if (p[2] > 0) != (q[2] > 0):
            above.append(p + (q - p) * (p[2] / (p[2] - q[2])))
    total = 0.0
    for p, q in zip(above, above[1:] + above[:1], strict=True):
        p, q = p / np.linalg.norm(p), q / np.linalg.norm(q)
        across = np.cross(p, q)
        length = np.linalg.norm(across)
        if length > 0:
            total += math.atan2(length, p @ q) * across[2] / length
    return light_radiance / 2 * abs(total)


def corners_of(light: AreaLight) -> np.ndarray:
    c, u, v = (np.array(vector, float) for vector in (light.center, light.axis_u, light.axis_v))
    return np.array([c - u / 2 - v / 2, c + u / 2 - v / 2, c + u / 2 + v / 2, c - u / 2 + v / 2])


def tilted(shape: str, center: Sequence[float], tilt: float, turn: float, width: float, height: float) -> AreaLight:
    """An area light that shone down, turned about y by `tilt` and then about z by `turn`."""
    turned = (rotation(2, turn) @ rotation(1, tilt))[:3, :3]
    return AreaLight(tuple(center), tuple(turned[:, 0] * width), tuple(turned[:, 1] * height), POWER, shape)


# Area lights


@pytest.mark.parametrize(("radius", "height"), [(1.0, 2.0), (0.05, 1.0), (3.0, 1.0), (2e3, 5e3)])
def test_disk_above(radius, height):
    light = overhead("ellipse", 2 * radius, 2 * radius, (0, 0, height))
    expected = math.pi * radiance(math.pi * radius**2) * radius**2 / (radius**2 + height**2)
    assert irradiance([light]).agrees(expected)


@pytest.mark.parametrize(("width", "depth", "height"), [(1.0, 1.0, 1.0), (4.0, 0.5, 0.7), (0.01, 0.02, 3.0)])
def test_rectangle_above(width, depth, height):
    a, b, h = width / 2, depth / 2, height
    p, q = math.hypot(a, h), math.hypot(b, h)
    expected = 2 * radiance(width * depth) * (a / p * math.atan(b / p) + b / q * math.atan(a / q))
    assert irradiance([overhead("rectangle", width, depth, (0, 0, height))]).agrees(expected)


@pytest.mark.parametrize(
    ("center", "tilt", "turn"),
    [
        ((0, 0, 2), 0.5, 0.0),
        ((1.5, 0.3, 1.0), 0.9, 0.4),
        ((2, 0, 0.2), 1.3, 0.0),  # from here on the horizon cuts it
        ((2, 0, 0), math.pi / 2, 0.0),
        ((0, 1.5, -0.4), math.pi / 2, math.pi / 2),
        ((-1.2, -0.5, -0.3), 1.2, 3.5),
    ],
)
def test_rectangle_clipped_at_the_horizon(center, tilt, turn):
    light = tilted("rectangle", center, tilt, turn, 1.6, 1.0)
    normal = np.cross(light.axis_v, light.axis_u)
    assert normal @ np.array(center) < 0, "the lamp must face the probe"
    expected = polygon_irradiance(corners_of(light), radiance(1.6))
    assert expected > 0.1
    assert irradiance([light]).agrees(expected)


@pytest.mark.parametrize(
    ("center", "tilt", "width", "height"),
    [((0, 0, 1), 0.0, 2.0, 0.5), ((1, 0.5, 1), 0.6, 1.5, 0.8), ((1, 0, 0.1), 1.4, 1.0, 0.6)],
)
def test_ellipse_by_quadrature(center, tilt, width, height):
    light = tilted("ellipse", center, tilt, 0.0, width, height)
    c, u, v = (np.array(vector, float) for vector in (light.center, light.axis_u, light.axis_v))
    normal = np.cross(v, u) / np.linalg.norm(np.cross(v, u))

    def integrand(angle: float, r: float) -> float:
        d = c + u / 2 * r * math.cos(angle) + v / 2 * r * math.sin(angle)
        return r * max(d[2], 0) * max(-normal @ d, 0) / (d @ d) ** 2

    area = math.pi / 4 * width * height
    value, _ = integrate.dblquad(integrand, 0, 1, 0, 2 * math.pi, epsabs=1e-5, epsrel=1e-5)
    assert irradiance([light]).agrees(radiance(area) * area / math.pi * value, rounding=1e-4)


def test_area_lights_shine_to_one_side():
    down = overhead("rectangle", 1, 1, (0, 0, 1))
    up = AreaLight(down.center, down.axis_v, down.axis_u, POWER)
    assert irradiance([down], seeds=2).mean > 1
    assert irradiance([up], seeds=2).mean == 0


def test_each_channel_has_its_own_power():
    light = AreaLight((0, 0, 1), (1, 0, 0), (0, 1, 0), (1.0, 2.0, 0.5))
    scene = Scene(camera_down(1e-4, (4, 4)), (Instance(floor(0.01), materials=(WHITE,)),), (light,))
    red, green, blue, alpha = picture(scene, channel=None).mean(axis=(0, 1))
    assert (green / red, blue / red, alpha) == pytest.approx((2, 0.5, 1), rel=1e-6)


# Points and spheres


@pytest.mark.parametrize(
    ("radius", "place"), [(0.5, (0, 0, 1)), (1.0, (2, 1, 1.5)), (1e-3, (0.5, 0, 2)), (9, (0, 0, 10))]
)
def test_sphere_above_the_horizon(radius, place):
    """E = π L (R/d)² cos θ, and with L = P / (4 π² R²) that is a point light's: the sphere's size cancels."""
    distance = math.dist(place, (0, 0, 0))
    light_radiance = POWER[0] / (4 * math.pi**2 * radius**2)
    expected = math.pi * light_radiance * (radius / distance) ** 2 * place[2] / distance
    assert irradiance([PointLight(place, POWER, radius)]).agrees(expected, rounding=1e-4)


@pytest.mark.parametrize("height", [0.3, 0.0, -0.4])
def test_sphere_that_the_horizon_cuts(height):
    radius, place = 0.8, np.array((1.0, 0, height))
    distance = np.linalg.norm(place)
    light_radiance = POWER[0] / (4 * math.pi**2 * radius**2)
    elevation, cap = math.asin(height / distance), math.asin(radius / distance)
    theta = (np.arange(1000)[:, None] + 0.5) * cap / 1000
    angle = (np.arange(1000) + 0.5) * 2 * math.pi / 1000
    up = math.sin(elevation) * np.cos(theta) + math.cos(elevation) * np.sin(theta) * np.cos(angle)
    value = (np.sin(theta) * np.maximum(up, 0)).mean() * cap * 2 * math.pi
    assert irradiance([PointLight(tuple(place), POWER, radius)]).agrees(light_radiance * value, rounding=1e-4)


@pytest.mark.parametrize("place", [(0, 0, 0.5), (0.3, -0.2, -0.6), (0, 0, 0)])
def test_inside_a_sphere_light_the_whole_sky_shines(place):
    assert irradiance([PointLight(place, POWER, 1.0)]).agrees(POWER[0] / (4 * math.pi))


@pytest.mark.parametrize("place", [(0, 0, 2), (1, -2, 0.5), (300, 0, 400)])
def test_point(place):
    distance = math.dist(place, (0, 0, 0))
    expected = POWER[0] / (4 * math.pi) * place[2] / distance**3
    assert irradiance([PointLight(place, POWER)], seeds=2).mean == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(("radius", "place"), [(0.5, (0, 0, 1)), (1.0, (0.5, 0.4, 2.0)), (2.0, (0, 0, 0.1))])
def test_disk_that_faces_the_surface(radius, place):
    """With soft falloff: E = I cos θ / (R² + d²) while the whole disk is above the horizon."""
    distance = math.dist(place, (0, 0, 0))
    expected = POWER[0] / (4 * math.pi) / (radius**2 + distance**2) * place[2] / distance
    assert irradiance([PointLight(place, POWER, radius, soft_falloff=True)]).agrees(expected)


@pytest.mark.parametrize("soft_falloff", [False, True])
@pytest.mark.parametrize("place", [(0, 0, 0.5001), (0.3, -0.2, 0.7), (0.9, 0.5, 0.8)])
@pytest.mark.parametrize("others", [0, 9])
def test_a_round_lamp_that_is_near_lights_a_matt_floor_without_noise(place, soft_falloff, others):
    """All points of it count the same, also where one of many lamps is chosen (of which the others are behind)."""
    radius, square = 0.5, float(np.dot(place, place))
    expected = POWER[0] / (4 * math.pi) * place[2] / math.sqrt(square) / (square + radius**2 * soft_falloff)
    lamp = PointLight(place, POWER, radius, soft_falloff)
    behind = [PointLight((k, 0, -3.0), POWER, radius) for k in range(others)]
    lit = irradiance([lamp, *behind], samples=16, seeds=4, sampler="random")
    assert lit.mean == pytest.approx(expected, rel=1e-5)
    assert lit.error < 1e-5 * lit.mean


# Spots


def spot_profile(x: np.ndarray, y: np.ndarray, height: float, light: SpotLight, stretch: float = 1.0) -> np.ndarray:
    """The irradiance at (x, y) of a floor `height` below a spot that looks down and is `stretch` times wider in x."""
    falloff = height / (x**2 + y**2 + height**2) ** 1.5
    cosine = height / np.sqrt((x / stretch) ** 2 + y**2 + height**2)
    edge = math.cos(light.spot_size / 2)
    width = (1 - edge) * light.blend
    t = np.clip((cosine - edge) / width, 0, 1) if width > 0 else (cosine > edge).astype(float)
    return POWER[0] / (4 * math.pi) * falloff * t * t * (3 - 2 * t)


@pytest.mark.parametrize(
    ("size", "blend", "stretch"), [(1.2, 0.0, 1), (1.2, 1.0, 1), (0.8, 0.15, 1), (1.0, 0.5, 2), (1.4, 0.3, 0.5)]
)
def test_spot_cone_and_blend(size, blend, stretch):
    height = 2.0
    matrix = translation(0, 0, height) @ scaling(stretch, 1, 1)
    light = SpotLight((0, 0, height), POWER, matrix=matrix, spot_size=size, blend=blend)
    camera = camera_down(6, (60, 40), height=1.5)
    x, y = pixel_centers(camera)
    expected = spot_profile(x, y, height, light, stretch)
    scene = Scene(camera, (Instance(floor(), materials=(WHITE,)),), (light,))
    seen = np.pi * picture(scene, sampler="regular", samples=1)
    cosine = height / np.sqrt((x / stretch) ** 2 + y**2 + height**2)
    clear = np.abs(cosine - math.cos(size / 2)) > 1e-4
    assert 0.05 < (expected > 0).mean() < 0.95
    assert np.allclose(seen[clear], expected[clear], rtol=1e-3, atol=1e-4)


def test_within_the_cone_a_spot_with_radius_is_a_sphere_light():
    place = (0.0, 0.0, 2.0)
    spot = SpotLight(place, POWER, 0.3, matrix=translation(*place), spot_size=2.0, blend=0.0)
    assert irradiance([spot]).agrees(POWER[0] / (4 * math.pi) / 4)


def test_a_spot_turned_away_is_dark():
    place = (0.0, 0.0, 2.0)
    spot = SpotLight(place, POWER, 0.3, matrix=translation(*place) @ rotation(0, math.pi), spot_size=3.0)
    assert irradiance([spot], seeds=2).mean == 0


# Suns


@pytest.mark.parametrize("angle", [0.0, 1e-4, 1e-3, 0.01, 0.2, 1.0])
@pytest.mark.parametrize("slant", [0.0, 0.9])
def test_a_suns_irradiance_does_not_depend_on_its_angle(angle, slant):
    direction = (math.sin(slant), 0, math.cos(slant))
    assert irradiance([SunLight(direction, (3.0, 3.0, 3.0), angle)]).agrees(3 * math.cos(slant))


def test_a_sun_of_half_the_sky_is_a_constant_world():
    assert irradiance([SunLight((0, 0, 1), (math.pi,) * 3, math.pi)]).agrees(math.pi)


@pytest.mark.parametrize(("angle", "distance"), [(0.2, 2.0), (1e-3, 10.0), (1e-4, 100.0)])
def test_a_suns_penumbra_is_as_wide_as_its_angle_says(angle, distance):
    """2 d tan(α/2) wide behind a half-plane, and the share of the disk that is seen across it."""
    half = distance * math.tan(angle / 2)
    blocker = quad((4 * half, 0, distance), (8 * half, 0, 0), (0, 8 * half, 0))  # covers x > 0
    camera = camera_down(4 * half, (64, 16), height=distance / 2)
    instances = (
        Instance(floor(16 * half), materials=(WHITE,)),
        Instance(blocker, visibility=VISIBLE_TO_SHADOWS),
    )
    scene = Scene(camera, instances, (SunLight((0, 0, 1), (1.0, 1.0, 1.0), angle),))
    columns = estimate(lambda seed: np.pi * picture(scene, samples=64, seed=seed).mean(axis=0))
    x = pixel_centers(camera)[0][0]
    nodes, weights = np.polynomial.legendre.leggauss(8)
    t = np.clip((x[:, None] + nodes * (x[1] - x[0]) / 2) / half, -1, 1)
    share = 0.5 - (np.arcsin(t) + t * np.sqrt(1 - t * t)) / np.pi
    # The disk is round in the sines of the directions, the edge straight in their tangents.
    assert columns.agrees(share @ weights / 2, rounding=2e-5 + angle**2 / 4)
    lit, dark = x < -1.05 * half, x > 1.05 * half
    assert columns.mean[lit] == pytest.approx(1, rel=1e-5)
    assert (columns.mean[dark] == 0).all()


# What all lamps share

LAMPS = {
    "rectangle": AreaLight((0, 0, 1), (1, 0, 0), (0, 1, 0), POWER),
    "ellipse": AreaLight((0, 0, 1), (1, 0, 0), (0, 1, 0), POWER, "ellipse"),
    "point": PointLight((0, 0, 1), POWER),
    "sphere": PointLight((0, 0, 1), POWER, 0.2),
    "facing disk": PointLight((0, 0, 1), POWER, 0.2, soft_falloff=True),
    "spot": SpotLight((0, 0, 1), POWER, 0.1, matrix=translation(0, 0, 1)),
    "sun": SunLight((0, 0, 1), POWER, 0.1),
}
every_lamp = pytest.mark.parametrize("lamp", LAMPS.values(), ids=LAMPS.keys())


def changed(lamp, **values):
    return type(lamp)(**(vars(lamp) | values))


@every_lamp
def test_a_lamp_is_blocked_unless_it_casts_no_shadow(lamp):
    lid = Instance(floor(2, (0, 0, 0.5)), visibility=VISIBLE_TO_SHADOWS)
    free = irradiance([lamp], seeds=2).mean
    assert free > 1
    assert irradiance([lamp], instances=(lid,), seeds=2).mean == 0
    unblockable = changed(lamp, cast_shadow=False)
    assert irradiance([unblockable], instances=(lid,), seeds=2).mean == pytest.approx(free, rel=1e-5)


@every_lamp
def test_what_stands_beyond_the_lamp_does_not_block_it(lamp):
    beyond = Instance(floor(2, (0, 0, 1.5)), visibility=VISIBLE_TO_SHADOWS)
    seen = irradiance([lamp], instances=(beyond,), seeds=2).mean
    assert seen == (0 if isinstance(lamp, SunLight) else pytest.approx(irradiance([lamp], seeds=2).mean, rel=1e-5))


@every_lamp
def test_a_lamp_without_power_changes_nothing(lamp):
    name = "irradiance" if isinstance(lamp, SunLight) else "power"
    dark = changed(lamp, **{name: (0.0, 0.0, 0.0)})
    assert irradiance([dark], seeds=2).mean == 0
    assert irradiance([dark, LAMPS["sphere"]], seeds=2).mean == irradiance([LAMPS["sphere"]], seeds=2).mean


@every_lamp
def test_a_lamp_behind_the_surface_does_not_light_it(lamp):
    if isinstance(lamp, SunLight):
        below = changed(lamp, direction=(0, 0, -1))
    elif isinstance(lamp, AreaLight):
        below = changed(lamp, center=(0, 0, -1), axis_u=lamp.axis_v, axis_v=lamp.axis_u)
    else:
        below = changed(lamp, position=(0, 0, -1))
    assert irradiance([below], seeds=2).mean == 0


@every_lamp
@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_lamp_with_a_number_that_is_not_finite_is_named(lamp, number):
    place = "direction" if isinstance(lamp, SunLight) else "center" if isinstance(lamp, AreaLight) else "position"
    strength = "irradiance" if isinstance(lamp, SunLight) else "power"
    for field, value in ((strength, (1.0, number, 1.0)), (place, (0, number, 1))):
        with pytest.raises(SceneError, match=r"lamp 'Key'.*finite"):
            irradiance([changed(lamp, name="Key", **{field: value})], seeds=1)


@pytest.mark.parametrize(
    "lamp",
    [
        AreaLight((0, 0, 1), (1e30, 0, 0), (0, 1, 0), (1.0, 1.0, 1.0), name="Key"),
        AreaLight((0, 0, 1e30), (1, 0, 0), (0, 1, 0), (1.0, 1.0, 1.0), name="Key"),
        PointLight((0, 0, 1), (1.0, 1.0, 1.0), 1e30, name="Key"),
        SpotLight((0, 0, 1), (1.0, 1.0, 1.0), matrix=np.diag([1e-60, 1e-60, 1e-60, 1]), name="Key"),
    ],
    ids=["size", "place", "radius", "scale"],
)
def test_a_lamp_that_float32_cannot_hold_is_named(lamp):
    with pytest.raises(SceneError, match="lamp 'Key'"):
        irradiance([lamp], seeds=1)


@pytest.mark.parametrize("angle", [-0.1, 3.2, math.nan])
def test_a_sun_wider_than_the_sky_is_refused(angle):
    with pytest.raises(SceneError, match=r"lamp 'Sol'.*angle"):
        irradiance([SunLight((0, 0, 1), (1, 1, 1), angle, name="Sol")], seeds=1)


def test_only_lamps_with_a_size_have_points_sampled(monkeypatch):
    """Of a point there is nothing to choose: a scene of such lamps alone has no table made, and is free of noise."""
    points = (
        PointLight((0, 0, 2), POWER),
        SpotLight((0, 0, 2), POWER, matrix=translation(0, 0, 2), spot_size=2.0),
        SunLight((0, 0, 1), POWER),
    )
    sized = (
        AreaLight((0, 0, 2), (1, 0, 0), (0, 1, 0), POWER),
        PointLight((0, 0, 2), POWER, 0.1),
        PointLight((0, 0, 2), POWER, 0.1, soft_falloff=True),
        SpotLight((0, 0, 2), POWER, 0.1, matrix=translation(0, 0, 2), spot_size=2.0),
        SunLight((0, 0, 1), POWER, 0.1),
    )
    made = {}
    make_table = preparation.make_table

    def spy(domain, settings, dimensions, pixels):
        made[domain] = dimensions
        return make_table(domain, settings, dimensions, pixels)

    monkeypatch.setattr(preparation, "make_table", spy)
    for lights, dimensions in ((points, 0), *(((lamp,), 1) for lamp in sized), ((*points, sized[0]), 4)):
        lit = irradiance(lights, samples=4, seeds=4)
        assert lit.mean > 1
        assert made["light"] == dimensions
        assert (lit.error < 1e-6 * lit.mean) == (dimensions == 0)


def test_lamps_add_up():
    lamps = list(LAMPS.values())
    parts = [irradiance([lamp], samples=64) for lamp in lamps]
    together = irradiance(lamps, samples=64)
    error = math.hypot(together.error, *(part.error for part in parts))
    assert abs(together.mean - sum(part.mean for part in parts)) < 4 * error + 1e-5 * together.mean


# The world, and surfaces that shine


@pytest.mark.parametrize("max_bounces", [0, 2])
def test_under_a_constant_world_a_floor_shows_its_albedo(max_bounces):
    seen = irradiance([], world=(0.7, 0.2, 0.2), seeds=2, max_bounces=max_bounces)
    assert seen.mean == pytest.approx(np.pi * 0.7, rel=1e-5)


@pytest.mark.parametrize("max_bounces", [0, 3])
def test_a_convex_body_in_a_furnace_shows_its_albedo(max_bounces):
    ball = Instance(sphere(rings=16), materials=(lambertian(0.6),))
    scene = Scene(camera_down(2.4, (24, 24), height=3), (ball,), world=(1.0, 1.0, 1.0))
    film = render(scene, RenderSettings(samples=16, max_bounces=max_bounces, film_transparent=True, threads=1))
    color, alpha = film.passes["Combined"][..., 0], film.passes["Combined"][..., 3]
    assert (alpha == 1).mean() > 0.4
    assert np.allclose(color, 0.6 * alpha, atol=1e-6)


def glowing_box(albedo: float, sample_as_light: bool) -> Scene:
    surface = AddShader(Diffuse((albedo,) * 3), Emission((1.0, 1.0, 1.0)))
    material = Material("glow", surface, sample_as_light)
    return Scene(camera_forward(pixels=(8, 8)), (Instance(box(4), materials=(material,)),))


@pytest.mark.parametrize("max_bounces", [0, 1, 2])
def test_a_closed_box_that_glows_gathers_the_geometric_series(max_bounces):
    """1 + ρ + ρ² + … up to the light that came over `max_bounces` + 1 surfaces: each path meets just that."""
    seen = picture(glowing_box(0.5, sample_as_light=False), samples=16, max_bounces=max_bounces)
    assert np.allclose(seen, sum(0.5**k for k in range(max_bounces + 2)), rtol=1e-6)


@pytest.mark.parametrize("sample_as_light", [False, True])
@pytest.mark.parametrize(("albedo", "max_bounces"), [(0.5, 4), (0.5, 24), (0.8, 64)])
def test_light_samples_and_russian_roulette_leave_the_series_as_it_is(albedo, max_bounces, sample_as_light):
    """With 64 bounces all but 1e-6 of it is there: 1 / (1 - ρ)."""
    scene = glowing_box(albedo, sample_as_light)
    settings = {"samples": 64, "max_bounces": max_bounces, "diffuse_bounces": 64}
    seen = estimate(lambda seed: picture(scene, seed=seed, **settings).mean())
    assert seen.agrees(sum(albedo**k for k in range(max_bounces + 2)), rounding=1e-4)
    assert seen.error < 0.01 * seen.mean


def test_a_glowing_mesh_lights_like_an_area_light_of_its_size():
    light = overhead("rectangle", 1.5, 1.0, (0.2, 0, 0.8))
    mesh = quad((0.2, 0, 0.8), (1.5, 0, 0), (0, 1.0, 0))
    glowing = Instance(mesh, materials=(emitter(radiance(1.5)),), visibility=VISIBLE_TO_SURFACES)
    expected = polygon_irradiance(corners_of(light), radiance(1.5))
    assert irradiance([light]).agrees(expected)
    assert irradiance([], instances=(glowing,), samples=1024).agrees(expected)


def test_a_lamp_lights_what_another_surface_reflects():
    """One bounce: a small lit wall acts as an area light whose radiance is albedo × irradiance / π."""
    wall = Instance(floor(0.4, (0, 0, 1)), materials=(WHITE,), visibility=VISIBLE_TO_SURFACES)
    sun = SunLight((0.3, 0, -1), (1.0, 1.0, 1.0), 0.0)  # from below: it lights the wall, not the probe
    wall_radiance = 1 / math.hypot(0.3, 1) / math.pi
    corners = np.array([(x, y, 1.0) for x, y in ((-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2))])
    expected = polygon_irradiance(corners, wall_radiance)
    # The probe's own patch would stand in the sun's way.
    patch = Instance(floor(0.01), materials=(WHITE,), visibility=VISIBLE_TO_CAMERA)
    scene = Scene(camera_down(1e-4, (4, 4), height=0.5), (patch, wall), (sun,))
    assert estimate(lambda seed: np.pi * picture(scene, samples=4096, max_bounces=1, seed=seed).mean()).agrees(expected)
    assert picture(scene, samples=64, max_bounces=0).max() == 0
