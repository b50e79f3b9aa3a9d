"""Whole paths: white furnaces, clamping, and one picture to the bit in a scene that uses everything."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from core import AreaLight, Camera, Instance, Material, Mesh, PointLight, RenderSettings, Scene, SunLight, render
from core.film import PASSES, Film
from core.scene import VISIBLE_TO_CAMERA, VISIBLE_TO_DIFFUSE, VISIBLE_TO_SHADOWS
from core.shaders import (
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Metallic,
    MixShader,
    Principled,
    Refraction,
    Shader,
    Translucent,
    Transparent,
)
from core.values import (
    OBJECT,
    Attribute,
    Bump,
    Checker,
    EnvironmentTexture,
    Fresnel,
    ImageTexture,
    LayerWeight,
    Math,
    NormalMap,
    Value,
)
from tests.scenes import (
    Estimate,
    box,
    camera_down,
    estimate,
    floor,
    picture,
    quad,
    rotation,
    scaling,
    sphere,
    translation,
)

WHITE_FLOOR = Material("white", Diffuse(1.0))
WHITE_SKY = EnvironmentTexture(np.ones((8, 16, 3), np.float32))

# The white furnace

ROUGHNESSES = (0.05, 0.2, 0.5, 1.0)
WHITE: dict[str, Shader] = {
    "diffuse": Diffuse(1.0),
    "translucent": Translucent(1.0),
    "transparent": Transparent(1.0),
    **{f"oren-nayar {r}": Diffuse(1.0, r) for r in ROUGHNESSES},
    **{f"glossy {r}": Glossy(1.0, r) for r in (0.0, *ROUGHNESSES)},
    **{f"metallic {r}": Metallic(1.0, 1.0, roughness=r) for r in (0.0, *ROUGHNESSES)},
    **{f"glass {r}": Glass(1.0, r) for r in (0.0, *ROUGHNESSES)},
    "refraction": Refraction(1.0),
    **{f"principled {r}": Principled(1.0, roughness=r) for r in (0.05, 0.2, 0.3, 0.4, 0.5, 1.0)},
    **{f"principled metal {r}": Principled(1.0, metallic=1.0, roughness=r) for r in ROUGHNESSES},
    **{f"principled glass {r}": Principled(1.0, transmission=1.0, roughness=r) for r in ROUGHNESSES},
    **{f"coat {r}": Principled(1.0, metallic=1.0, roughness=0.3, coat=1.0, coat_roughness=r) for r in ROUGHNESSES},
    "mixed": MixShader(0.3, Principled(1.0, metallic=0.5, alpha=0.5), MixShader(0.5, Diffuse(1.0), Glass(1.0, 0.3))),
}


def furnace(shader: Shader, degrees: float, world: Value, back: bool = False) -> Estimate:
    """The radiance of a sheet in a world of 1, seen by so many degrees off its normal."""
    turn = rotation(1, math.radians(degrees) + (math.pi if back else 0))
    sheet = Instance(floor(100), turn, (Material("white", shader),))
    scene = Scene(camera_down(0.01, (16, 16), height=200), (sheet,), world=world)
    # A ray that leaves the sheet meets nothing again.
    return estimate(lambda seed: picture(scene, samples=64, seed=seed).mean(), 8)


@pytest.mark.parametrize("degrees", [0, 60, 78, 85])
@pytest.mark.parametrize("name", WHITE)
def test_what_absorbs_nothing_cannot_be_seen_in_a_white_furnace(name, degrees):
    mean = furnace(WHITE[name], degrees, (1.0, 1.0, 1.0))
    assert mean.error < 2e-3
    assert abs(mean.mean - 1) < 0.005 + 4 * mean.error


@pytest.mark.parametrize("name", WHITE)
def test_nor_where_the_furnace_is_a_picture_that_light_samples_look_at(name):
    mean, bare = furnace(WHITE[name], 60, WHITE_SKY), furnace(WHITE[name], 60, (1.0, 1.0, 1.0))
    assert mean.error < 5e-3
    assert abs(mean.mean - bare.mean) < 5 * math.hypot(mean.error, bare.error) + 1e-5


@pytest.mark.parametrize("name", ["glass 0.0", "glass 0.5", "principled glass 0.2", "translucent"])
def test_nor_from_behind(name):
    mean = furnace(WHITE[name], 60, (1.0, 1.0, 1.0), back=True)
    assert abs(mean.mean - 1) < 0.005 + 4 * mean.error


@pytest.mark.parametrize("shader", [Glass(1.0, 0.0), Glass(1.0, 0.3), Principled(1.0, transmission=1.0, roughness=0.2)])
def test_a_white_glass_ball_cannot_be_seen_in_a_furnace(shader):
    """Through both of its sides, with as many reflections inside as light makes."""
    ball = Instance(sphere(1.0, rings=16), materials=(Material("glass", shader),))
    scene = Scene(camera_down(1.2, (8, 8), height=3), (ball,), world=(1.0,) * 3)
    limits = {"max_bounces": 64, "glossy_bounces": 64, "transmission_bounces": 64}
    mean = estimate(lambda seed: picture(scene, samples=16, seed=seed, **limits).mean(), 12)
    assert abs(mean.mean - 1) < 0.005 + 4 * mean.error


# Light that is no number


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_bad_pixel_of_a_light_costs_the_samples_that_meet_it_and_no_others(bad):
    """A glowing picture over a floor."""

    def film(pixels: np.ndarray) -> Film:
        glow = Emission(ImageTexture(pixels, interpolation="closest"))
        light = quad(
            (0, 0, 1.5), (3, 0, 0), (0, -3, 0), uvs=np.float32([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
        )
        instances = (
            Instance(floor(10), materials=(WHITE_FLOOR,)),
            Instance(light, materials=(Material("glow", glow),)),
        )
        return render(Scene(camera_down(0.5, (8, 8), height=0.2), instances), replace(SETTINGS, samples=64))

    good = film(np.full((8, 8, 3), 2.0, np.float32))
    broken = np.full((8, 8, 3), 2.0, np.float32)
    broken[4, 4] = bad
    found = film(broken)
    assert good.dropped_samples == 0
    assert 0 < found.dropped_samples < 0.2 * 64 * 64
    assert np.isfinite(found.passes["Combined"]).all()
    assert found.passes["Combined"][..., :3].mean() == pytest.approx(good.passes["Combined"][..., :3].mean(), rel=0.1)


# Everything


def everything(resolution: tuple[int, int] = (37, 26)) -> Scene:
    """Each kind of surface, value, light and placement."""
    aspect = resolution[1] / resolution[0]
    aim = rotation(0, 1.0) @ translation(0, 0, 6)
    camera = Camera(aim, resolution, (-0.4, 0.4, -0.4 * aspect, 0.4 * aspect), lens_radius=0.05, focus_distance=6)
    rng = np.random.default_rng(1)
    image = ImageTexture(rng.integers(0, 256, (4, 4, 3), dtype=np.uint8))
    plane = floor(8)
    uvs = plane.vertices[plane.triangles, :2] / 4
    paint = rng.random((2, 3, 3)).astype(np.float32)
    tangents = np.broadcast_to(np.float32([1, 0, 0, 1]), (2, 3, 4)).copy()
    ground = Mesh("ground", plane.vertices, plane.triangles, uvs=uvs, tangents=tangents, attributes={"Paint": paint})
    waves = Bump(Math("sine", Math("multiply", Checker(0.2, 0.7, 2.0, OBJECT), 9.0)), 0.4, 0.1)
    shaders = (
        MixShader(Fresnel(1.5), Diffuse(image, normal=NormalMap(Attribute("Paint"), 0.2)), Glossy(0.8, 0.2)),
        Principled(image, roughness=0.3, coat=0.5, normal=waves),
        Glass(roughness=0.1),
        MixShader(LayerWeight(0.4), Transparent((0.8, 0.4, 0.4)), Metallic(roughness=0.2)),
        Emission(Checker(0.0, (2.0, 3.0, 4.0), 4.0, OBJECT)),
        Principled(0.8, transmission=1.0, alpha=0.7, emission_color=(0.1, 0.0, 0.2), emission_strength=1.0),
        Translucent((0.5, 0.9, 0.5)),
    )
    materials = [Material(str(k), shader) for k, shader in enumerate(shaders)]
    ball, cube = sphere(0.5, rings=12, smooth=True), box(0.6)
    instances = (
        Instance(ground, translation(0, 0, -0.5), (materials[0],)),
        Instance(ball, translation(-0.8, 0, 0), (materials[1],)),
        Instance(ball, translation(0.9, 0.4, 0.2) @ scaling(0.6, -0.6, 1), (materials[2],)),
        Instance(cube, translation(0, 0.3, -0.1) @ rotation(2, 0.5), (materials[3],)),
        Instance(cube, translation(0.3, -0.9, -0.3) @ scaling(0.3, 0.3, 0.3), (materials[4],)),
        Instance(ball, translation(0, 1.2, 0.3), (materials[5],)),
        Instance(quad((-1.5, 0.9, 0), (1, 0, 0), (0, 0, 1)), materials=(materials[6],)),
        Instance(cube, translation(1.7, -0.6, 0), visibility=VISIBLE_TO_DIFFUSE | VISIBLE_TO_SHADOWS),
        Instance(cube, translation(-1.7, -0.6, 0), visibility=VISIBLE_TO_CAMERA),
    )
    lights = (
        AreaLight((0, 0, 3), (1.5, 0, 0), (0, 1, 0), (80.0, 70.0, 60.0)),
        PointLight((2, -2, 1), (20.0, 20.0, 20.0), 0.2),
        SunLight((1, -1, 2), (0.3, 0.3, 0.2), 0.05),
    )
    return Scene(camera, instances, lights, EnvironmentTexture(rng.random((8, 16, 3)).astype(np.float32)))


SETTINGS = RenderSettings(samples=5, seed=3, max_bounces=4, threads=1)


@pytest.fixture(scope="module")
def reference():
    return render(everything(), SETTINGS)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"threads": 2, "tile_size": 8},
        {"tile_size": 13},
        {"batch_packets": 1},
        {"batch_packets": 7, "tile_size": 16, "threads": 2},
        {"clamp_indirect": 1e30},
    ],
    ids=str,
)
def test_a_path_is_the_same_to_the_bit_however_the_picture_is_cut(changes, reference):
    film = render(everything(), replace(SETTINGS, **changes))
    for name in PASSES:
        assert np.array_equal(film.passes[name], reference.passes[name])


def test_nothing_is_dropped_and_nothing_below_black(reference):
    film = render(everything(), replace(SETTINGS, samples=64, max_bounces=8))
    assert reference.dropped_samples == film.dropped_samples == 0
    assert film.negative_pixels == 0
    assert film.passes["Combined"].min() >= 0


def combined(scene: Scene, **changes) -> np.ndarray:
    return render(scene, replace(SETTINGS, **changes)).passes["Combined"][..., :3]


def test_clamping_only_darkens_and_leaves_direct_light_alone():
    """Path by path: the same points are looked up with and without it."""
    scene = everything()
    free, tight, tighter = (combined(scene, clamp_indirect=limit) for limit in (0.0, 0.5, 0.1))
    assert (tight <= free * (1 + 1e-5)).all()
    assert (tighter <= tight * (1 + 1e-5)).all()
    assert tight.mean() < 0.999 * free.mean()
    assert np.array_equal(combined(scene, max_bounces=0, clamp_indirect=0.1), combined(scene, max_bounces=0))


def test_more_bounces_only_brighten_on_average():
    scene = everything()
    means = [combined(scene, samples=64, max_bounces=bounces).mean() for bounces in (0, 1, 4)]
    assert means[0] < means[1] < means[2]
