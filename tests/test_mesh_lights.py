"""Glowing meshes light as the integral over them says, whether they are sampled as lights or only met by chance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from core import Instance, Material, Mesh, Scene
from core.mesh_lights import find_mesh_lights
from core.packing import pack_scene
from core.scene import VISIBLE_TO_ALL, VISIBLE_TO_DIFFUSE, VISIBLE_TO_SHADOWS, VISIBLE_TO_SURFACES
from core.shaders import AddShader, Diffuse, Emission, Glossy, MixShader, Principled
from core.values import OBJECT, UV, Checker, Component, ImageTexture, Math, Value
from tests.scenes import (
    Estimate,
    camera_down,
    estimate,
    floor,
    irradiance,
    picture,
    polygon,
    quad,
    rotation,
    scaling,
    translation,
)
from tests.test_lights import polygon_irradiance


def glow(radiance: Value = 1.0, sample_as_light: bool = True) -> Material:
    return Material("glow", Emission(radiance), sample_as_light)


def same(a: Estimate, b: Estimate) -> bool:
    """Whether two means agree within four standard errors of their difference."""
    return abs(a.mean - b.mean) < 4 * math.hypot(a.error, b.error)


POLYGONS = {
    "overhead": [(-0.5, -0.4, 1), (0.7, -0.4, 1), (0.7, 0.4, 1), (-0.5, 0.4, 1)],
    "wall": [(0.5, -0.5, 0.1), (0.5, 0.5, 0.1), (0.5, 0.5, 0.9), (0.5, -0.5, 0.9)],
    "through the horizon": [(0.4, -0.5, -0.5), (0.4, 0.6, -0.5), (0.9, 0.5, 1.0), (0.8, -0.5, 1.0)],
    "pentagon": [(math.cos(a) - 0.3, math.sin(a), 0.8 + 0.3 * math.cos(a)) for a in np.arange(5) * 0.4 * math.pi],
    "far off": [(30, 40, 50), (33, 40, 50), (31, 43, 50)],
    "sliver": [(-1, 0.3, 0.6), (1, 0.3, 0.6), (1, 0.301, 0.6), (-1, 0.301, 0.6)],
}


@pytest.mark.parametrize("turned", [False, True], ids=["", "turned"])
@pytest.mark.parametrize("name", POLYGONS)
def test_a_glowing_polygon_lights_as_lamberts_formula_says(name, turned):
    """From both sides alike."""
    corners = POLYGONS[name][::-1] if turned else POLYGONS[name]
    light = Instance(polygon(corners), materials=(glow(3.0),), visibility=VISIBLE_TO_SURFACES)
    expected = polygon_irradiance(np.array(corners, float), 3.0)
    assert irradiance([], instances=(light,), samples=64).agrees(expected)


@pytest.mark.parametrize(
    "matrix",
    [translation(0.2, 0.1, 0.9), translation(0, 0, 1) @ scaling(0.5, 2, 1), translation(0.3, 0, 1) @ rotation(0, 0.8)],
    ids=["moved", "stretched", "turned"],
)
@pytest.mark.parametrize("copies", [1, 2])
def test_each_instance_lights_by_its_own_size(matrix, copies):
    corners = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
    mesh, places = polygon(corners), (matrix, translation(0.1, 2.5, 0.1) @ matrix)[:copies]
    lights = tuple(Instance(mesh, place, (glow(2.0),), VISIBLE_TO_SURFACES) for place in places)
    expected = sum(polygon_irradiance(corners @ place[:3, :3].T + place[:3, 3], 2.0) for place in places)
    assert irradiance([], instances=lights, samples=64).agrees(expected)


def test_of_two_slots_each_glows_in_its_own_colour():
    mesh = quad((0, 0, 1), (1, 0, 0), (0, 1, 0), material_slots=np.array([0, 1], np.int16))
    light = Instance(mesh, materials=(glow(1.0), glow(5.0)), visibility=VISIBLE_TO_SURFACES)
    corners = mesh.vertices[mesh.triangles].astype(float)
    expected = polygon_irradiance(corners[0], 1.0) + polygon_irradiance(corners[1], 5.0)
    assert irradiance([], instances=(light,), samples=64).agrees(expected)


# Emission that varies


def gradient_irradiance(half: float, height: float) -> float:
    """Of a square overhead whose radiance is 1 + x + y² there, by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    x, y = np.meshgrid(nodes * half + 0.4, nodes * half)
    square = x**2 + y**2 + height**2
    return float(half**2 * weights @ ((1 + x + y**2) * height**2 / square**2) @ weights)


@pytest.mark.parametrize("sampled", [True, False], ids=["sampled", "met"])
@pytest.mark.parametrize("copies", [1, 2], ids=["baked", "instanced"])
def test_emission_that_varies_lights_as_its_integral(sampled, copies):
    x, y = Component(OBJECT, 0), Component(OBJECT, 1)
    radiance = Math("add", Math("add", 1.4, x), Math("multiply", y, y))
    mesh = quad((0, 0, 0), (0.8, 0, 0), (0, 0.8, 0))
    places = (translation(0.4, 0, 0.7), translation(0, 0, -9))[:copies]
    lights = tuple(Instance(mesh, place, (glow(radiance, sampled),), VISIBLE_TO_SURFACES) for place in places)
    seen = irradiance([], instances=lights, samples=256 if sampled else 2048)
    assert seen.agrees(gradient_irradiance(0.4, 0.7))


IMAGE = ImageTexture(np.random.default_rng(1).uniform(0, 4, (4, 4, 3)).astype(np.float32), interpolation="closest")
GLOWING = {
    "image": Emission(IMAGE),
    "checker": Emission(Checker(0.0, 5.0, 5.0, OBJECT)),
    "mix": MixShader(Component(UV, 0), Emission(4.0), Diffuse(0.5)),
    "add": AddShader(Emission(IMAGE, 2.0), Glossy(0.5)),
    "principled": Principled(0.2, emission_color=IMAGE, emission_strength=3.0, alpha=0.6),
}


@pytest.mark.parametrize("name", GLOWING)
def test_sampled_or_met_by_chance_the_mean_is_the_same(name):
    mesh = quad((0.2, 0, 0.8), (1.2, 0, 0.4), (0, 1, 0))
    uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)[mesh.triangles]
    mesh = Mesh("lamp", mesh.vertices, mesh.triangles, uvs=uvs)

    def lit(sampled: bool, samples: int) -> Estimate:
        light = Instance(mesh, materials=(Material("glow", GLOWING[name], sampled),), visibility=VISIBLE_TO_SURFACES)
        return irradiance([], instances=(light,), samples=samples)

    sampled, met = lit(True, 256), lit(False, 2048)
    assert sampled.error < 0.01 * sampled.mean
    assert same(sampled, met)


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.5, 1.0])
def test_off_a_glossy_floor_both_ways_have_the_same_mean(roughness):
    """Multiple importance sampling by the power heuristic: no share is lost, and none counts twice."""
    shiny = Instance(floor(0.01), materials=(Material("shiny", Glossy(1.0, roughness, "ggx")),))
    mesh = quad((0.1, 0, 0.3), (0.4, 0, 0.1), (0, 0.5, 0))

    def seen(sampled: bool, samples: int) -> Estimate:
        light = Instance(mesh, materials=(glow(2.0, sampled),), visibility=VISIBLE_TO_SURFACES)
        scene = Scene(camera_down(1e-4, (4, 4)), (shiny, light))
        return estimate(lambda seed: picture(scene, samples=samples, seed=seed).mean())

    sampled, met = seen(True, 256), seen(False, 1024)
    assert sampled.mean > 0.05
    if roughness == 0:
        assert sampled.mean == pytest.approx(2, rel=1e-5)
    assert abs(sampled.mean - met.mean) <= 4 * math.hypot(sampled.error, met.error) + 1e-5


# Which triangles are lights


def emitter_count(*instances: Instance) -> int:
    scene = Scene(camera_down(1.0), instances)
    packed = pack_scene(scene, 1)
    packed.structure.let_go()
    return len(find_mesh_lights(scene, packed.arrays.geometry, packed.programs).area)


def test_only_what_glows_and_may_be_sampled_is_a_light():
    mesh, dark = quad((0, 0, 1), (1, 0, 0), (0, 1, 0)), Material("dark", Diffuse(0.5))
    assert emitter_count(Instance(mesh, materials=(glow(),))) == 2
    assert emitter_count(Instance(mesh, materials=(glow(0.0),))) == 0
    assert emitter_count(Instance(mesh, materials=(glow(1.0, False),))) == 0
    assert emitter_count(Instance(mesh), Instance(mesh, materials=(dark,))) == 0
    assert emitter_count(Instance(mesh), *(Instance(mesh, materials=(glow(),)) for _ in range(3))) == 6
    half = Mesh("half", mesh.vertices, mesh.triangles, material_slots=np.array([0, 1], np.int16))
    assert emitter_count(Instance(half, materials=(dark, glow()))) == 1
    assert emitter_count(Instance(half, materials=(glow(),))) == 2, "a slot beyond the last uses the last"


@pytest.mark.parametrize(
    ("visibility", "shines"),
    [(VISIBLE_TO_ALL, True), (VISIBLE_TO_DIFFUSE, True), (VISIBLE_TO_ALL & ~VISIBLE_TO_DIFFUSE, False),
     (VISIBLE_TO_SHADOWS, False)],
)  # fmt: skip
@pytest.mark.parametrize("sampled", [True, False], ids=["sampled", "met"])
def test_a_mesh_that_diffuse_rays_do_not_see_does_not_light_what_is_diffuse(visibility, shines, sampled):
    mesh = quad((0, 0, 2), (1, 0, 0), (0, 1, 0))
    light = Instance(mesh, materials=(glow(1.0, sampled),), visibility=visibility & ~1)
    assert (irradiance([], instances=(light,), samples=64, seeds=4).mean > 0.1) == shines
