"""Shadows through panes: each multiplies the light by its transmittance, as many as the limit lets through."""

from __future__ import annotations

import math

import numpy as np
import pytest

from core import AreaLight, Instance, Material, PointLight, Scene, SunLight
from core.shaders import Diffuse, Emission, Glossy, MixShader, Principled, Transparent
from core.values import OBJECT, Checker, EnvironmentTexture
from tests.scenes import WHITE, Estimate, box, camera_down, estimate, floor, picture, quad, sphere, translation

TINT = (0.5, 0.8, 0.25)
#: The camera looks at the floor from below the panes; what lights it is above them.
PANES, EYE = 0.2, 0.1
CEILING = quad((0, 0, 3), (1, 0, 0), (0, 1, 0))
SKY = np.random.default_rng(1).uniform(0.5, 1, (8, 16, 3)).astype(np.float32)
LIGHTS = {
    "lamp": {"lights": (AreaLight((0, 0, 3), (1, 0, 0), (0, 1, 0), (300.0,) * 3),)},
    "point": {"lights": (PointLight((0, 0, 3), (300.0,) * 3),)},
    "sun": {"lights": (SunLight((0.1, 0.2, 1), (3.0,) * 3, 0.1),)},
    "mesh": {"instances": (Instance(CEILING, materials=(Material("glow", Emission(4.0)),), visibility=6),)},
    "met mesh": {"instances": (Instance(CEILING, materials=(Material("glow", Emission(4.0), False),), visibility=6),)},
    "world": {"world": (1.0, 1.0, 1.0)},
    "environment": {"world": EnvironmentTexture(SKY)},
}


def pane(transmittance=TINT, z: float = PANES) -> Instance:
    return Instance(floor(2000, (0, 0, z)), materials=(Material("pane", Transparent(transmittance)),))


def lit(*panes: Instance, lights: tuple = (), instances: tuple = (), world=0.0, samples=64, **settings) -> Estimate:
    """The floor's colour below the panes, (3,)."""
    ground = Instance(floor(1.0), materials=(WHITE,))
    camera = camera_down(1e-3, (4, 4), height=EYE)
    scene = Scene(camera, (ground, *panes, *instances), lights, world)
    return estimate(
        lambda seed: picture(scene, channel=None, samples=samples, seed=seed, **settings)[..., :3].mean(axis=(0, 1)), 8
    )


@pytest.mark.parametrize("count", [1, 3, 8])
@pytest.mark.parametrize("name", LIGHTS)
def test_n_panes_leave_the_nth_power_of_their_transmittance(name, count):
    bare = lit(**LIGHTS[name], samples=256)
    seen = lit(*(pane(z=PANES + 0.1 * k) for k in range(count)), **LIGHTS[name], samples=256)
    expected = np.array(TINT) ** count
    margin = 5 * np.hypot(seen.error, bare.error * expected) + 1e-5 * bare.mean * expected
    assert (bare.mean > 0.1).all()
    assert (np.abs(seen.mean - bare.mean * expected) <= margin).all()


@pytest.mark.parametrize("name", [name for name in LIGHTS if name not in ("met mesh", "world")])
def test_more_panes_than_the_limit_are_black(name):
    """As in Cycles: so many surfaces let the light of a sample through as there are transparent bounces."""
    panes = [pane(0.9, PANES + 0.1 * k) for k in range(3)]
    through, dimmed, blocked = (lit(*panes, **LIGHTS[name], transparent_bounces=limit).mean for limit in (3, 2, 1))
    assert (through > 0.05).all()
    assert (blocked == 0).all()
    if name in ("lamp", "point", "sun"):
        assert (dimmed == 0).all()
    else:
        # A ray that has used its limit up still sees what comes next: what is met by chance has its share left.
        assert (dimmed < through).all()


@pytest.mark.parametrize("name", ["point", "sun"])
def test_a_lamp_that_casts_no_shadows_is_not_tinted(name):
    (lamp,) = LIGHTS[name]["lights"]
    bright = type(lamp)(**{**vars(lamp), "cast_shadow": False})
    assert lit(pane(), lights=(bright,)).mean == pytest.approx(lit(lights=(bright,)).mean, rel=1e-5)


@pytest.mark.parametrize("name", ["lamp", "point", "sun"])
def test_what_is_opaque_blocks_among_panes(name):
    wall = Instance(floor(2000, (0, 0, 0.45)), materials=(Material("wall", Glossy()),))
    panes = [pane(0.9, PANES + 0.1 * k) for k in range(5)]
    assert (lit(*panes, wall, **LIGHTS[name]).mean == 0).all()


def test_panes_beyond_the_lamp_do_not_matter():
    lamp = LIGHTS["point"]
    assert lit(pane(z=3.5), **lamp).mean == pytest.approx(lit(**lamp).mean, rel=1e-5)


@pytest.mark.parametrize(
    "shader",
    [MixShader(0.4, Transparent(), Diffuse(0.0)), Principled(0.0, alpha=0.4), MixShader(0.6, None, Transparent())],
    ids=["mix", "alpha", "none"],
)
def test_a_share_of_transparency_lets_its_share_through(shader):
    half = Instance(floor(2000, (0, 0, PANES)), materials=(Material("half", shader),))
    sun = (SunLight((0, 0, 1), (math.pi,) * 3),)
    assert lit(half, lights=sun).mean == pytest.approx([0.6] * 3, rel=1e-4)


def test_a_checker_of_holes_casts_its_shadow():
    holes = Checker(1.0, 0.0, 1.0, OBJECT)
    screen = Instance(floor(20, (0, 0, PANES)), translation(0, 0, 0), (Material("holes", Transparent(holes)),))
    camera = camera_down(4.0, (16, 16), height=EYE)
    scene = Scene(camera, (Instance(floor(10), materials=(WHITE,)), screen), (SunLight((0, 0, 1), (math.pi,) * 3),))
    seen = picture(scene, samples=1, sampler="regular")
    parity = (np.floor((np.arange(16) + 0.5) / 4 - 2)[:, None] + np.floor((np.arange(16) + 0.5) / 4 - 2)[None, :]) % 2
    assert np.allclose(seen, parity, atol=1e-5)


def test_closed_bodies_are_two_panes():
    """A transparent ball and cube around the light's way: in and out."""
    for body in (box(0.4, (0, 0, 0.5)), sphere(0.2, (0, 0, 0.5))):
        solid = Instance(body, materials=(Material("body", Transparent(TINT)),))
        sun = (SunLight((0.013, 0.007, 1), (math.pi,) * 3),)
        expected = lit(lights=sun).mean * np.array(TINT) ** 2
        assert lit(solid, lights=sun).mean == pytest.approx(expected, rel=1e-4)
