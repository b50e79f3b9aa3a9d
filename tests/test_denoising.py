"""The Denoising Albedo pass is the surfaces' own colour, from 0 to 1, and asking for it changes nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core import Instance, Material, RenderSettings, Scene, render
from core.shaders import (
    AddShader,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Metallic,
    MixShader,
    Principled,
    Shader,
    Translucent,
    Transparent,
)
from core.values import Checker, ImageTexture
from tests.scenes import WHITE, camera_down, camera_forward, floor, rotation, translation
from tests.test_integrator import everything

ALBEDO = "Denoising Albedo"
SETTINGS = RenderSettings(samples=4, seed=3, threads=1, denoising_albedo=True)


def albedo_of(scene: Scene, **changes) -> np.ndarray:
    """(height, width, 3)."""
    return render(scene, replace(SETTINGS, **changes)).passes[ALBEDO]


def floor_of(shader: Shader | None) -> Scene:
    return Scene(camera_down(2.0), (Instance(floor(), materials=(Material("floor", shader),)),))


@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_of_a_diffuse_surface_it_is_the_colour(roughness):
    pixels = albedo_of(floor_of(Diffuse((0.8, 0.3, 0.05), roughness)))
    assert np.allclose(pixels, (0.8, 0.3, 0.05), rtol=1e-6)


def test_of_a_texture_it_is_the_texture_seen_through_the_same_pixels():
    """The same points in the pixels look up a glowing texture, whose picture is known to be right."""
    checks = Checker((0.9, 0.5, 0.1), (0.2, 0.2, 0.7), 3.3)
    glowing = render(floor_of(Emission(checks)), SETTINGS)
    assert np.allclose(albedo_of(floor_of(Diffuse(checks))), glowing.passes["Combined"][..., :3], atol=1e-6)


def test_where_nothing_reflects_it_is_black():
    assert not albedo_of(floor_of(None)).any()


@pytest.mark.parametrize(
    ("shader", "tolerance"),
    [
        (Principled((0.8, 0.3, 0.05)), 0.01),
        (Principled((0.8, 0.3, 0.05), roughness=0.2, coat=1.0, coat_tint=(0.9, 0.8, 0.7)), 0.01),
        (Principled((0.8, 0.3, 0.05), metallic=1.0, roughness=0.8), 0.02),
        (Principled((0.8, 0.3, 0.05), transmission=1.0, roughness=0.3), 0.02),
        (Principled((0.8, 0.3, 0.05), alpha=0.4), 0.01),
        (Glossy((0.8, 0.3, 0.05), 0.7), 0.02),
        (Glossy((0.8, 0.3, 0.05), 0.0), 1e-5),
        # Its facets are tilted all ways, and are taken to divide the light among the channels like one that is not.
        (Metallic((0.9, 0.6, 0.2), roughness=0.5), 0.03),
        (Glass((0.9, 0.6, 0.2)), 1e-5),
        (AddShader(Translucent((0.2, 0.4, 0.6)), Transparent((0.5, 0.3, 0.1))), 0.01),
    ],
    ids=str,
)
@pytest.mark.parametrize("tilt", [0.2, 1.0])
def test_in_a_white_furnace_it_is_the_picture(shader, tolerance, tilt):
    """A plane that alone stands in a white world shows the share of the light that it reflects or lets pass."""
    plane = Instance(floor(1e3), translation(0, 0, -1) @ rotation(0, tilt), (Material("plane", shader),))
    scene = Scene(camera_forward(0.01, (4, 4)), (plane,), world=(1.0, 1.0, 1.0))
    film = render(scene, replace(SETTINGS, samples=4096, sampler="sobol_owen"))
    picture, albedo = (film.passes[name][..., :3].mean(axis=(0, 1)) for name in ("Combined", ALBEDO))
    assert albedo == pytest.approx(picture, abs=tolerance)


def test_what_shines_is_in_it_up_to_one():
    glowing = MixShader(0.5, Diffuse((0.8, 0.4, 0.2)), Emission((0.1, 0.4, 5.0)))
    assert np.allclose(albedo_of(floor_of(glowing)), (0.45, 0.4, 1.0), atol=1e-6)


@pytest.mark.parametrize(("transparent", "expected"), [(False, (0.25, 0.5, 1.0)), (True, (0.0, 0.0, 0.0))])
def test_the_world_is_in_it_where_the_camera_sees_it(transparent, expected):
    scene = Scene(camera_down(2.0), world=(0.25, 0.5, 2.0))
    assert np.allclose(albedo_of(scene, film_transparent=transparent), expected)


def test_light_and_shadow_are_not_in_it():
    lit = everything()
    assert np.array_equal(albedo_of(replace(lit, lights=())), albedo_of(lit))


@pytest.mark.parametrize("scene", [everything(), floor_of(Diffuse(0.5))], ids=["everything", "diffuse"])
def test_the_other_passes_are_the_same_to_the_bit_with_and_without_it(scene):
    settings = replace(SETTINGS, max_bounces=2)
    bare = render(scene, replace(settings, denoising_albedo=False))
    film = render(scene, settings)
    assert set(film.passes) - set(bare.passes) == {ALBEDO}
    for name, values in bare.passes.items():
        assert np.array_equal(film.passes[name], values)


@pytest.mark.parametrize(
    "changes",
    [{"threads": 2, "tile_size": 8}, {"batch_packets": 1}, {"batch_packets": 7, "tile_size": 16}, {"max_bounces": 3}],
    ids=str,
)
def test_it_is_the_same_to_the_bit_however_the_picture_is_cut(changes):
    assert np.array_equal(albedo_of(everything(), **changes), albedo_of(everything()))


def test_in_tiles_and_in_a_border_it_is_that_part_of_the_full_one():
    tiles = []
    scene = everything()
    part = render(scene, replace(SETTINGS, border=(5, 6, 30, 20), tile_size=8), tiles.append)
    assert np.array_equal(part.passes[ALBEDO], albedo_of(scene)[6:20, 5:30])
    for tile in tiles:
        rows, columns = slice(tile.y - 6, tile.y - 6 + tile.height), slice(tile.x - 5, tile.x - 5 + tile.width)
        assert np.array_equal(tile.passes[ALBEDO], part.passes[ALBEDO][rows, columns])


@pytest.mark.parametrize("kind", [Diffuse, Emission, Glossy])
def test_what_is_no_number_is_black_in_it(kind):
    nowhere = kind(ImageTexture(np.full((1, 1, 3), np.nan, np.float32)))
    assert not albedo_of(floor_of(nowhere)).any()


def test_white_is_white():
    assert (albedo_of(Scene(camera_down(2.0), (Instance(floor(), materials=(WHITE,)),))) == 1).all()
