"""Lamps bring the same light however they are found: all of them or one chosen, sampled or met by rays that scatter."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from core import AreaLight, Camera, Instance, Material, PointLight, Scene, SpotLight
from core.scene import (
    VISIBLE_TO_ALL,
    VISIBLE_TO_CAMERA,
    VISIBLE_TO_DIFFUSE,
    VISIBLE_TO_GLOSSY,
    VISIBLE_TO_TRANSMISSION,
)
from core.shaders import Diffuse, Emission, Glossy, MixShader, Translucent
from tests.scenes import (
    BLACK,
    WHITE,
    Estimate,
    camera_down,
    estimate,
    floor,
    picture,
    polygon,
    quad,
    rotation,
    translation,
)

GLOSSY = Material("glossy", Glossy((0.8, 0.8, 0.8), roughness=0.4))
ROUGH = Material("rough", Diffuse((0.8, 0.8, 0.8), roughness=1.0))
MIXED = Material("mixed", MixShader(0.5, Diffuse((0.8, 0.8, 0.8)), Glossy((0.8, 0.8, 0.8), roughness=0.6)))
#: By the camera.
UNSEEN = VISIBLE_TO_ALL & ~VISIBLE_TO_CAMERA
#: A camera that looks at a floor aslant.
ASLANT = Camera(translation(0, 0, 0.2) @ rotation(0, 0.6), (8, 8), (-0.3, 0.3, -0.3, 0.3))


def seen(
    material: Material, lamps: tuple, others: tuple = (), camera: Camera = ASLANT, seeds: int = 8, **more
) -> Estimate:
    """The mean radiance of a floor of `material` under lamps."""
    scene = Scene(camera, (Instance(floor(10), materials=(material,)), *others), lamps)
    settings = {"samples": 256, "sampler": "random"} | more
    return estimate(lambda seed: picture(scene, seed=seed, **settings).mean(), seeds)


def same(a: Estimate, b: Estimate) -> bool:
    return abs(a.mean - b.mean) <= 4.5 * math.hypot(a.error, b.error) + 1e-5 * abs(b.mean)


def points(count: int, radius: float, **more) -> tuple[PointLight, ...]:
    rng = np.random.default_rng(3)
    places = rng.uniform((-1, -1, 0.5), (1, 1, 2), (count, 3)).tolist()
    return tuple(PointLight(tuple(place), (1.0, 1.0, 1.0), radius, **more) for place in places)


@pytest.mark.parametrize("material", [WHITE, GLOSSY], ids=["matt", "glossy"])
@pytest.mark.parametrize("count", [9, 40])
def test_many_lamps_without_a_size_bring_what_they_bring_alone(count, material):
    """One of them is chosen: that takes a number, though none of them has a point to be chosen."""
    lamps = points(count, 0.0)
    alone = sum(seen(material, (lamp,), samples=1, sampler="regular", seeds=2).mean for lamp in lamps)
    together = seen(material, lamps, sampler="multi_jittered")
    assert together.mean == pytest.approx(alone, rel=0.05)
    assert abs(together.mean - alone) < 4.5 * together.error + 0.01 * alone


@pytest.mark.parametrize("tilted", [np.eye(4), rotation(0, 0.3) @ rotation(1, 0.4) @ translation(1, 2, 0)])
def test_many_lamps_that_cast_no_shadow_are_not_shadowed_by_what_they_light(tilted):
    with_shadows, without = points(16, 0.01), points(16, 0.01, cast_shadow=False)
    scenes = [
        Scene(camera_down(0.5, (8, 8), height=0.2), (Instance(floor(30), tilted, (WHITE,)),), lamps)
        for lamps in (with_shadows, without)
    ]
    both = [estimate(lambda seed, s=s: picture(s, samples=64, seed=seed).mean(), 8) for s in scenes]
    assert same(*both)


@pytest.mark.parametrize("material", [GLOSSY, ROUGH], ids=["glossy", "rough"])
@pytest.mark.parametrize("far_lamps", [0, 9], ids=["few", "many"])
def test_a_lamp_that_casts_no_shadow_shines_through_whatever_the_surface(material, far_lamps):
    lamp = AreaLight((0, 0, 1.5), (2, 0, 0), (0, 2, 0), (100.0,) * 3, cast_shadow=False)
    dark = tuple(PointLight((1e3 + i, 0, 1e3), (1e-6,) * 3, 0.1) for i in range(far_lamps))
    blocker = Instance(quad((0, 0, 1), (9, 0, 0), (0, 9, 0)), materials=(BLACK,))
    free, blocked = (seen(material, (lamp, *dark), others) for others in ((), (blocker,)))
    assert free.mean > 0.1
    assert same(free, blocked)


@pytest.mark.parametrize("roughness", [0.2, 0.4])
def test_a_lamp_that_lies_in_a_ceiling_shines_as_one_just_below(roughness):
    glossy = Material("glossy", Glossy((0.8, 0.8, 0.8), roughness=roughness))
    lamp = AreaLight((0, 0, 1.5), (2, 0, 0), (0, 2, 0), (100.0,) * 3)
    ceilings = (Instance(quad((0, 0, z), (7.3, 0, 0), (0, 7.1, 0)), materials=(BLACK,)) for z in (1.5, 1.6))
    inside, below = (seen(glossy, (lamp,), (ceiling,)) for ceiling in ceilings)
    assert same(inside, below)


@pytest.mark.parametrize("roughness", [0.4, 0.9])
@pytest.mark.parametrize(("height", "aside"), [(0.7, 0.0), (0.3, 0.3), (0.1, 0.0), (0.1, 1.0)])
def test_a_disk_lights_gloss_like_a_glowing_polygon_of_its_area(height, aside, roughness):
    """From close before the disk and from elsewhere it is sampled in other ways, and rays that scatter know which."""
    glossy = Material("glossy", Glossy((0.8, 0.8, 0.8), roughness=roughness))
    disk = AreaLight((aside, 0, height), (1, 0, 0), (0, 1, 0), (math.pi**2 / 4,) * 3, "ellipse")
    sides = 96
    radius = 0.5 * math.sqrt(2 * math.pi / sides / math.sin(2 * math.pi / sides))
    angles = np.arange(sides) * (-2 * math.pi / sides)
    corners = np.column_stack([aside + radius * np.cos(angles), radius * np.sin(angles), np.full(sides, height)])
    glow = Instance(polygon(corners), materials=(Material("glow", Emission((1.0, 1.0, 1.0))),), visibility=UNSEEN)
    camera = camera_down(0.02, (8, 8), height=0.05)
    assert same(seen(glossy, (disk,), camera=camera), seen(glossy, (), (glow,), camera=camera))


@pytest.mark.parametrize("count", [1, 12])
def test_lamps_that_diffuse_rays_do_not_see_leave_what_is_matt_dark(count):
    lamps = points(count, 0.1, visibility=VISIBLE_TO_GLOSSY)
    assert seen(WHITE, lamps, seeds=2).mean == 0
    assert seen(GLOSSY, lamps, seeds=2).mean > 0


def test_a_sheared_spot_among_many_lamps_is_as_bright_as_alone():
    sheared = np.array([[1, 0.8, 0, 0], [0, 0.6, 0, 0], [0, 0, 1, 1.5], [0, 0, 0, 1]])
    spot = SpotLight((0.1, 0.1, 1.5), (1.0,) * 3, 0.05, matrix=sheared, spot_size=1.0)
    dark = tuple(PointLight((100.0, 100 + i, -50.0), (1e-9,) * 3, 0.1) for i in range(8))
    camera = camera_down(3, (8, 8), height=0.2)
    alone, among = (seen(WHITE, lamps, camera=camera) for lamps in ((spot,), (spot, *dark)))
    assert same(alone, among)


@pytest.mark.parametrize("material", [GLOSSY, ROUGH], ids=["glossy", "rough"])
def test_many_lamps_are_met_as_few_are(material):
    """A tree finds the lamps on a ray: with others that do not matter each brings what it brings alone."""
    lamp = AreaLight((0, 0.5, 1.0), (1, 0, 0), (0, 1, 0), (10.0,) * 3)
    rng = np.random.default_rng(5)
    dark = tuple(
        replace(lamp, center=tuple(at), power=(1e-9,) * 3) for at in rng.uniform((-3, -3, 1.1), (3, 3, 4), (40, 3))
    )
    assert same(seen(material, (lamp,)), seen(material, (*dark[:20], lamp, *dark[20:])))


@pytest.mark.parametrize("hidden_from", [0, VISIBLE_TO_DIFFUSE, VISIBLE_TO_GLOSSY], ids=["none", "diffuse", "glossy"])
def test_what_one_kind_of_ray_does_not_see_lights_the_other_kinds_half(hidden_from):
    """A mixture sees a glowing mesh by the lobes that may, sampled as a light or met, and by nothing else."""

    def lit(material: Material, is_sampled: bool, visibility: int = VISIBLE_TO_ALL) -> Estimate:
        glow = Material("glow", Emission((1.0, 1.0, 1.0)), is_sampled)
        mesh = Instance(quad((0, 0, 1.5), (3, 0, 0), (0, -3, 0)), materials=(glow,), visibility=visibility)
        return seen(material, (), (mesh,), samples=1024)

    halves = {
        VISIBLE_TO_GLOSSY: Material("half", MixShader(0.5, Diffuse((0.8, 0.8, 0.8)), None)),
        VISIBLE_TO_DIFFUSE: Material("half", MixShader(0.5, None, Glossy((0.8, 0.8, 0.8), roughness=0.6))),
    }
    sampled, met = (lit(MIXED, is_sampled, VISIBLE_TO_ALL & ~hidden_from) for is_sampled in (True, False))
    assert same(sampled, met)
    assert same(sampled, lit(halves.get(hidden_from, MIXED), True))


@pytest.mark.parametrize("hidden_from", [VISIBLE_TO_DIFFUSE, VISIBLE_TO_TRANSMISSION])
def test_what_comes_through_a_translucent_surface_is_diffuse(hidden_from):
    through = Material("through", Translucent((0.8, 0.8, 0.8)))

    def lit(is_sampled: bool) -> Estimate:
        glow = Material("glow", Emission((1.0, 1.0, 1.0)), is_sampled)
        mesh = quad((0, 0, -1.5), (3, 0, 0), (0, 3, 0))
        below = Instance(mesh, materials=(glow,), visibility=VISIBLE_TO_ALL & ~hidden_from)
        return seen(through, (), (below,), camera=camera_down(0.5, (8, 8)))

    sampled, met = lit(True), lit(False)
    assert (sampled.mean > 0.01) == (met.mean > 0.01) == (hidden_from != VISIBLE_TO_DIFFUSE)
    assert same(sampled, met)
