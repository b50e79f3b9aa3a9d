"""Where paths end: limits of bounces by kind, Russian roulette, and surfaces that a ray passes straight through."""

from __future__ import annotations

import numpy as np
import pytest

from core import Instance, Material, Scene
from core.scene import VISIBLE_TO_CAMERA
from core.shaders import (
    AddShader,
    Diffuse,
    Emission,
    Glossy,
    MixShader,
    Principled,
    Refraction,
    Shader,
    Translucent,
    Transparent,
)
from core.values import Bump
from tests.scenes import box, camera_down, camera_forward, estimate, floor, picture

TINT = (0.5, 0.8, 0.25)
#: A normal that is the surface's own, but makes the material a program and its surface a lobe.
OWN_NORMAL = Bump(0.5)


def series(albedo: float, bounces: int) -> float:
    """1 + ρ + ρ² + …: light that came over up to `bounces` + 1 surfaces."""
    return sum(albedo**k for k in range(bounces + 2))


def glowing_box(shader: Shader, sample_as_light: bool = True) -> Scene:
    """From inside of a closed box that emits 1 and reflects by `shader`."""
    material = Material("walls", AddShader(shader, Emission()), sample_as_light)
    return Scene(camera_forward(pixels=(8, 8)), (Instance(box(4), materials=(material,)),))


# Russian roulette and the limit of all bounces


@pytest.mark.parametrize("sampled", [True, False], ids=["sampled", "met"])
@pytest.mark.parametrize("normal", [None, OWN_NORMAL], ids=["lambertian", "lobe"])
@pytest.mark.parametrize("albedo", [0.3, 0.8])
@pytest.mark.parametrize("bounces", [8, 0])
def test_in_a_closed_grey_box_roulette_leaves_the_mean(bounces, albedo, normal, sampled):
    scene = glowing_box(Diffuse(albedo, normal=normal), sampled)
    limits = {"max_bounces": bounces, "diffuse_bounces": 64}
    mean = estimate(lambda seed: picture(scene, samples=64, seed=seed, **limits).mean())
    assert mean.agrees(series(albedo, bounces))


@pytest.mark.parametrize("normal", [None, OWN_NORMAL], ids=["lambertian", "lobe"])
def test_without_a_limit_a_closed_box_gathers_the_whole_series(normal):
    """1 / (1 - ρ); what 64 bounces leave out is less than float32 sees."""
    scene = glowing_box(Diffuse(0.7, normal=normal))
    mean = estimate(lambda seed: picture(scene, samples=64, seed=seed, max_bounces=64, diffuse_bounces=64).mean())
    assert mean.agrees(1 / (1 - 0.7))
    assert mean.error < 0.01


def test_roulette_does_not_tint():
    """Each channel has its own series, though one throughput decides for all."""
    color = (0.9, 0.5, 0.1)
    scene = glowing_box(Diffuse(color))
    limits = {"max_bounces": 8, "diffuse_bounces": 8}
    mean = estimate(
        lambda seed: picture(scene, channel=None, samples=64, seed=seed, **limits)[..., :3].mean(axis=(0, 1))
    )
    assert mean.agrees(np.array([series(albedo, 8) for albedo in color]))


# Limits by kind


@pytest.mark.parametrize("normal", [None, OWN_NORMAL], ids=["lambertian", "lobe"])
@pytest.mark.parametrize("limit", [0, 1, 2])
def test_diffuse_bounces_are_limited(limit, normal):
    scene = glowing_box(Diffuse(0.5, normal=normal))
    limits = {"max_bounces": 3, "diffuse_bounces": limit, "glossy_bounces": 0, "transmission_bounces": 0}
    assert np.allclose(picture(scene, samples=64, **limits).mean(), series(0.5, limit), rtol=2e-3)


@pytest.mark.parametrize(("bounces", "limit"), [(5, 0), (5, 1), (5, 4), (3, 12)])
def test_glossy_bounces_are_limited(bounces, limit):
    """In a box of mirrors, which leave nothing to chance before roulette begins."""
    scene = glowing_box(Glossy(0.5, roughness=0.0))
    limits = {"max_bounces": bounces, "diffuse_bounces": 0, "glossy_bounces": limit, "transmission_bounces": 0}
    mean = estimate(lambda seed: picture(scene, samples=16, seed=seed, **limits).mean(), 8)
    assert mean.agrees(series(0.5, min(bounces, limit)))


def through(panes: list[Shader], channel: int | None = None, instances: tuple = (), **settings) -> np.ndarray:
    """What a camera sees of a glowing floor below panes, (4,) or one channel."""
    below = Instance(floor(4, (0, 0, -1)), materials=(Material("glow", Emission()),))
    stack = tuple(
        Instance(floor(4, (0, 0, -0.1 * k)), materials=(Material("pane", shader),)) for k, shader in enumerate(panes)
    )
    scene = Scene(camera_down(0.1, (4, 4)), (*stack, *(instances or (below,))))
    return picture(scene, channel=channel, samples=16, **settings).mean(axis=(0, 1))


@pytest.mark.parametrize(("count", "limit", "bounces"), [(3, 12, 12), (3, 2, 12), (3, 1, 12), (3, 12, 2), (3, 12, 1)])
def test_transmission_bounces_are_limited(count, limit, bounces):
    """Each refraction is a bounce; the ray whose bounces are used up still sees what the next surface emits."""
    settings = {"max_bounces": bounces, "transmission_bounces": limit, "diffuse_bounces": 0, "glossy_bounces": 0}
    seen = through([Refraction(TINT)] * count, **settings)[:3]
    visible = count <= min(limit, bounces) + 1
    assert seen == pytest.approx(np.array(TINT) ** count * visible, rel=1e-5)


@pytest.mark.parametrize(("limit", "seen"), [(0, 0.25), (1, 0.25)])
def test_a_translucent_bounce_counts_as_transmission(limit, seen):
    """Half of the light through a sheet, from a glowing floor as wide as the hemisphere."""
    sheet = Instance(floor(4), materials=(Material("sheet", Translucent(0.25)),))
    glow = Instance(floor(4e4, (0, 0, -1)), materials=(Material("glow", Emission(), False),))
    scene = Scene(camera_down(0.1, (4, 4)), (sheet, glow))
    mean = picture(scene, samples=64, max_bounces=2, diffuse_bounces=0, transmission_bounces=limit).mean()
    assert mean == pytest.approx(seen, rel=1e-3)


# Straight through


@pytest.mark.parametrize("bounces", [0, 2])
@pytest.mark.parametrize("count", [1, 2, 5, 9])
def test_a_camera_sees_through_n_panes_by_the_nth_power(count, bounces):
    """Of n + 1 surfaces the limit is n: the ray that has used it up still sees what the next surface emits."""
    seen = through([Transparent(TINT)] * count, max_bounces=bounces, transparent_bounces=8)
    assert seen[:3] == pytest.approx(np.array(TINT) ** count, rel=1e-5)


@pytest.mark.parametrize("limit", [0, 1, 3])
def test_behind_more_panes_than_the_limit_it_is_black(limit):
    at, beyond = (through([Transparent(TINT)] * (limit + k), transparent_bounces=limit)[0] for k in (1, 2))
    assert at == pytest.approx(0.5 ** (limit + 1), rel=1e-5)
    assert beyond == 0


def test_a_pane_is_no_bounce():
    """What is seen through it is lit as if it were not there."""
    ground = Instance(floor(4, (0, 0, -1)), materials=(Material("matte", Diffuse(0.5)),))
    pane = Instance(floor(4), visibility=VISIBLE_TO_CAMERA, materials=(Material("pane", Transparent(0.8)),))
    bare, behind = (
        picture(Scene(camera_down(0.1, (4, 4)), (*panes, ground), world=(1.0,) * 3)).mean() for panes in ((), (pane,))
    )
    assert bare == pytest.approx(0.5, rel=1e-5)
    assert behind == pytest.approx(0.8 * bare, rel=1e-5)


@pytest.mark.parametrize(
    "shader",
    [
        MixShader(0.4, Transparent(), None),
        MixShader(0.6, Diffuse(0.0), Transparent()),
        Principled(0.0, alpha=0.4, specular_level=0.0),
    ],
    ids=["none", "mix", "alpha"],
)
def test_a_share_of_transparency_shows_its_share(shader):
    mean = estimate(lambda seed: through([shader] * 2, channel=0, seed=seed, transparent_bounces=8), 24)
    assert mean.agrees(0.36)


# The film's alpha


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("transmittance", [1.0, 0.5])
def test_a_transparent_film_is_as_opaque_as_the_panes(count, transmittance):
    """Alpha is what the panes take of the world behind, which itself is not seen."""
    panes = tuple(
        Instance(floor(4, (0, 0, -0.1 * k)), materials=(Material("pane", Transparent(transmittance)),))
        for k in range(count)
    )
    scene = Scene(camera_down(0.1, (4, 4)), panes, world=(1.0,) * 3)
    seen = picture(scene, channel=None, film_transparent=True).mean(axis=(0, 1))
    assert seen == pytest.approx([0, 0, 0, 1 - transmittance**count], abs=1e-6)
    opaque = picture(scene, channel=None).mean(axis=(0, 1))
    assert opaque == pytest.approx([*[transmittance**count] * 3, 1], rel=1e-5)


# The camera's clip end


@pytest.mark.parametrize("panes", [0, 1, 2])
def test_a_pane_does_not_let_the_camera_see_beyond_its_clip_end(panes):
    clear = Material("clear", Transparent((1.0, 1.0, 1.0)))
    before = [Instance(floor(9, (0, 0, z)), materials=(clear,)) for z in (-1.0, -1.5)[:panes]]
    for depth, seen in ((-2.5, 1.0), (-3.5, 0.0)):
        wall = Instance(floor(9, (0, 0, depth)), materials=(Material("wall", Emission()),))
        scene = Scene(camera_forward(pixels=(8, 8), clip_end=3.0), (*before, wall))
        assert (picture(scene, samples=4) == seen).all()
