"""Values over a surface, through pictures of a floor that emits them, against the naive evaluation where each pixel
sees the floor; and normals and reflectances against closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from core import Instance, Material, Mesh, RenderSettings, Scene, materials, render
from core.film import Film
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
    GENERATED,
    OBJECT,
    UV,
    WORLD,
    Affine,
    Attribute,
    Average,
    Bump,
    Checker,
    Color,
    ColorRamp,
    Combine,
    Component,
    Expression,
    Fresnel,
    Gray,
    ImageTexture,
    LayerWeight,
    MapRange,
    Math,
    Mix,
    Normalized,
    NormalMap,
    Value,
)
from tests.naive_values import Hits, evaluate
from tests.scenes import camera_down, picture, pixel_centers, polygon, rotation, scaling, translation

PIXELS = (12, 8)
FAR_BELOW = translation(0, 0, -80)
#: Where the floor stands: mirrored, stretched, turned, and off the origin.
PLACE = translation(10.3, -20.4, 5.2) @ rotation(2, 0.5) @ scaling(1.5, -0.7, 1.2)
HALF, SLOPE = 8.0, 0.3
TEXTURE_SPACE = ((0.4, -0.3, 0.2), (3.0, 2.0, 1.5))
both_stores = pytest.mark.parametrize("instanced", [False, True], ids=["baked", "instanced"])


def uv_of(p: np.ndarray) -> np.ndarray:
    return np.stack([0.4 * p[:, 0] + 0.1, 0.6 - 0.3 * p[:, 1], np.zeros(len(p))], 1)


def paint_of(p: np.ndarray) -> np.ndarray:
    return np.stack([1 + 0.1 * p[:, 0], 1.5 - 0.1 * p[:, 1], 1 + 0.05 * (p[:, 0] + p[:, 1])], 1)


def sloping_floor() -> Mesh:
    corners = np.array([(x, y, SLOPE * x) for x, y in ((-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF))])
    mesh = polygon(corners)
    return Mesh(
        "floor",
        mesh.vertices,
        mesh.triangles,
        uvs=uv_of(corners)[:, :2].astype(np.float32)[mesh.triangles],
        texture_space=TEXTURE_SPACE,
        attributes={"Paint": paint_of(corners).astype(np.float32)[mesh.triangles]},
    )


def seen_by(camera, mesh: Mesh, place: np.ndarray, material: Material, instanced: bool) -> np.ndarray:
    """(height × width, 3), one sample at each pixel's centre; a second copy makes the mesh an instance."""
    copies = (place, FAR_BELOW @ place)[: 1 + instanced]
    scene = Scene(camera, tuple(Instance(mesh, copy, (material,)) for copy in copies))
    return picture(scene, channel=None, samples=1, sampler="regular")[..., :3].reshape(-1, 3)


def glow(value: Value) -> Material:
    return Material("glow", Emission(value), sample_as_light=False)


def hits_beside(camera, dx: float, dy: float) -> Hits:
    """Where the pixels' centres, moved by (dx, dy) metres, see the floor."""
    x, y = (a.ravel() for a in np.broadcast_arrays(*pixel_centers(camera)))
    x, y = x + camera.matrix[0, 3] + dx, y + camera.matrix[1, 3] + dy
    # The floor's points are PLACE @ (a, b, SLOPE a).
    columns = PLACE[:3, :3] @ np.array([(1, 0, SLOPE), (0, 1, 0)]).T
    a, b = np.linalg.solve(columns[:2], np.stack([x, y]) - PLACE[:2, 3:])
    local = np.stack([a, b, SLOPE * a], 1)
    location, size = TEXTURE_SPACE
    return Hits(
        {
            "uv": uv_of(local),
            "generated": (local - location) / (2 * np.array(size)) + 0.5,
            "object": local,
            "world": local @ PLACE[:3, :3].T + PLACE[:3, 3],
        },
        {"Paint": paint_of(local), "Nothing": np.zeros((len(a), 3))},
    )


RED, BLUE = (1.0, 0.25, 0.0), (0.0, 0.5, 1.0)
PICTURE = np.random.default_rng(3).uniform(0, 2, (3, 5, 3)).astype(np.float32)
BYTES = np.random.default_rng(4).integers(0, 256, (4, 3, 3), dtype=np.uint8)
TABLE = np.random.default_rng(5).uniform(0, 1, (9, 3)).astype(np.float32)
MATRIX = np.array([(0.5, 0.2, 0, 0.3), (0, -0.7, 0.1, 0.6), (0.2, 0, 0.9, 1.0)])
HEIGHT = Component(OBJECT, 0)


def positive(value: Value) -> Value:
    """So that a coordinate below 0, which no picture shows, can be seen."""
    return Affine(value, np.array([(1.0, 0, 0, 100), (0, 1, 0, 100), (0, 0, 1, 100)]))


EXPRESSIONS: dict[str, Expression] = {
    "uv": positive(UV),
    "generated": positive(GENERATED),
    "object": positive(OBJECT),
    "world": positive(WORLD),
    "attribute": Attribute("Paint"),
    "affine": positive(Affine(OBJECT, MATRIX)),
    "normalized": positive(Normalized(WORLD)),
    "checker": Checker(RED, BLUE, 1.3, OBJECT),
    "checker of checkers": Checker(Checker(RED, BLUE, 5.0, UV), Attribute("Paint"), 2.0, GENERATED),
    "checker of a varying scale": Checker(RED, BLUE, MapRange(HEIGHT, -3, 3, 0.5, 1.5), OBJECT),
    **{
        f"image {extension} {interpolation}": ImageTexture(PICTURE, extension, interpolation)
        for extension in ("repeat", "mirror", "extend", "clip")
        for interpolation in ("linear", "closest")
    },
    "image of bytes": ImageTexture(BYTES, "mirror", vector=Affine(GENERATED, 2 * MATRIX)),
    "ramp": ColorRamp(Component(GENERATED, 1), TABLE),
    "ramp in steps": ColorRamp(Component(GENERATED, 0), TABLE, smooth=False),
    "mix": Mix(Component(UV, 0), Attribute("Paint"), RED),
    "mix that clamps": Mix(HEIGHT, Attribute("Paint"), BLUE, "multiply", clamp_result=True),
    "mix that overshoots": Mix(Math("maximum", HEIGHT, 0.5), 2.0, Attribute("Paint"), "add", clamp_factor=False),
    "math": Math("multiply_add", Component(UV, 1), 0.5, 3.0),
    "math that clamps": Math("add", HEIGHT, 0.5, clamp=True),
    "map range": MapRange(HEIGHT, -1.0, 2.0, 0.5, 3.0, "smoothstep"),
    "map range that extrapolates": MapRange(HEIGHT, -1.0, 2.0, 5.0, 7.0, clamp=False),
    "gray": Gray(Attribute("Paint")),
    "average": Average(Attribute("Paint")),
    "component": Component(Attribute("Paint"), 1),
    "combine": Combine(Component(Attribute("Paint"), 2), 0.5, Math("add", 1.0, 1.0)),
    "an attribute that is not there": Math("add", Attribute("Nothing"), 0.5),
}


@both_stores
@pytest.mark.parametrize("name", EXPRESSIONS)
def test_a_value_is_what_it_is_by_definition(name, instanced):
    value = EXPRESSIONS[name]
    camera = camera_down(3.0, PIXELS, PLACE[:3, 3], height=20)
    expected = evaluated(value, camera)
    # Near an edge, rounding decides on which side a pixel lies.
    beside = [evaluated(value, camera, *step) for step in ((1e-4, 0), (-1e-4, 0), (0, 1e-4), (0, -1e-4))]
    clear = np.all([np.abs(other - expected).max(axis=1) < 0.02 for other in beside], axis=0)
    assert clear.mean() > 0.8
    seen = seen_by(camera, sloping_floor(), PLACE, glow(value), instanced)
    assert np.ptp(expected, axis=0).max() > 1e-3 or "not there" in name
    assert np.allclose(seen[clear], expected[clear], rtol=1e-5, atol=5e-5)


def evaluated(value: Value, camera, dx: float = 0.0, dy: float = 0.0) -> np.ndarray:
    return evaluate(value, hits_beside(camera, dx, dy))


def test_what_is_emitted_is_added_by_shares():
    """MixShader by a varying factor, clamped to 0 … 1."""
    camera = camera_down(3.0, PIXELS, PLACE[:3, 3], height=20)
    material = Material("mixed", MixShader(HEIGHT, Emission(RED), Emission(BLUE, 2.0)), sample_as_light=False)
    share = evaluated(HEIGHT, camera)[:, :1].clip(0, 1)
    assert share.min() == 0
    assert share.max() == 1
    expected = (1 - share) * RED + share * 2 * np.array(BLUE)
    assert np.allclose(seen_by(camera, sloping_floor(), PLACE, material, False), expected, atol=5e-5)


def test_an_albedo_is_the_sum_of_its_shares():
    camera = camera_down(3.0, PIXELS, PLACE[:3, 3], height=20)
    material = Material("mixed", MixShader(HEIGHT, Diffuse(RED), Diffuse(Attribute("Paint"))))
    share = evaluated(HEIGHT, camera)[:, :1].clip(0, 1)
    expected = (1 - share) * RED + share * evaluated(Attribute("Paint"), camera)
    scene = Scene(camera, (Instance(sloping_floor(), PLACE, (material,)),), world=(1.0,) * 3)
    seen = picture(scene, channel=None, samples=1, sampler="regular")[..., :3].reshape(-1, 3)
    assert np.allclose(seen, expected, atol=5e-5)


def test_what_is_no_number_is_at_the_foot_of_a_ramp():
    look_up = getattr(materials._ramp, "py_func", materials._ramp)
    assert look_up(TABLE, 0, len(TABLE), 1, np.float32(np.nan)) == pytest.approx(TABLE[0])


# Colours that are none


def lit(shader: Shader, **settings) -> Film:
    """A floor in a white world."""
    scene = Scene(
        camera_down(1.0, (4, 4)), (Instance(sheet(), materials=(Material("bad", shader),)),), world=(1.0,) * 3
    )
    return render(scene, RenderSettings(samples=4, **settings))


@pytest.mark.parametrize(
    "shader",
    [
        Diffuse(-0.5),
        Diffuse(Math("subtract", 0.25, 0.75)),
        Diffuse(ImageTexture(np.full((2, 2, 3), -0.5, np.float32))),
        Diffuse(-0.5, 0.3),
    ],
    ids=["constant", "computed", "image", "rough"],
)
def test_negative_colours_are_black(shader):
    film = lit(shader)
    assert (film.passes["Combined"][..., :3] == 0).all()
    assert film.negative_pixels == film.dropped_samples == 0


#: 10¹⁰⁰ is infinite in float32, and a product of it with 0 no number.
INFINITE = Math("power", 10.0, 100.0)
NO_NUMBER = Math("multiply", INFINITE, Math("multiply", Component(OBJECT, 0), 0.0))


@pytest.mark.parametrize(
    "shader",
    [
        Diffuse(NO_NUMBER),
        Diffuse(INFINITE),
        Diffuse(roughness=NO_NUMBER),
        Diffuse(normal=NormalMap(NO_NUMBER)),
        Translucent(INFINITE),
        Transparent(NO_NUMBER),
        Glossy(roughness=NO_NUMBER),
        Glossy(roughness=Math("subtract", INFINITE, INFINITE)),
        Glossy(NO_NUMBER, distribution="cosine_power"),
        Metallic(edge_tint=NO_NUMBER),
        Glass(roughness=0.3, ior=NO_NUMBER),
        Refraction(ior=INFINITE),
        Principled(roughness=NO_NUMBER),
        Principled(coat=0.5, coat_ior=NO_NUMBER),
        MixShader(NO_NUMBER, Diffuse(), Glossy()),
        MixShader(NO_NUMBER, Diffuse(), Diffuse(0.1)),
    ],
    ids=lambda shader: type(shader).__name__,
)
def test_a_surface_that_is_no_number_is_dropped_and_counted(shader):
    assert lit(shader).dropped_samples == 16 * 4


def test_only_samples_that_see_it_are_dropped():
    """Where the parameter is finite, the surface is as it would be without the rest."""
    left = Math("less_than", Component(OBJECT, 0), 0.0)
    infinite_there = Math("power", 10.0, Math("multiply", 100.0, left))
    film = lit(Glossy(0.5, Math("multiply", 0.3, infinite_there)), sampler="regular")
    assert film.dropped_samples == 8 * 4
    good = lit(Glossy(0.5, 0.3), sampler="regular")
    assert np.array_equal(film.passes["Combined"][:, 2:], good.passes["Combined"][:, 2:])


# Normals


def unit(vector) -> np.ndarray:
    return np.asarray(vector) / np.linalg.norm(vector)


def seen_normal(normal: Expression, place: np.ndarray, instanced: bool = False, turned: bool = False) -> np.ndarray:
    """The normal that a floor at `place` (without slope) shows in the middle, from above or `turned` from below."""
    corners = np.array([(-HALF, -HALF, 0), (HALF, -HALF, 0), (HALF, HALF, 0), (-HALF, HALF, 0)])
    mesh = polygon(corners)
    tangents = np.broadcast_to(np.float32([1, 0, 0, 1]), (2, 3, 4)).copy()
    mesh = Mesh("floor", mesh.vertices, mesh.triangles, uvs=corners[mesh.triangles, :2].astype(np.float32),
                tangents=tangents)  # fmt: skip
    camera = camera_down(1e-3, (4, 4), height=20)
    if turned:
        camera = type(camera)(**{**vars(camera), "matrix": rotation(0, math.pi) @ camera.matrix})
    half = np.hstack([np.eye(3) / 2, np.full((3, 1), 0.5)])
    seen = seen_by(camera, mesh, place, glow(Affine(normal, half)), instanced)
    return 2 * seen.mean(axis=0) - 1


TILTS = {"flat": np.eye(4), "turned": rotation(2, 0.7), "tilted": rotation(0, 0.5) @ rotation(2, 0.7)}


@both_stores
@pytest.mark.parametrize("mirror", [1, -1], ids=["", "mirrored"])
@pytest.mark.parametrize("place", TILTS.values(), ids=TILTS)
def test_a_tangent_space_normal_leans_along_growing_u_and_v(place, mirror, instanced):
    """Also on a mirrored object, where u, v and the normal are left-handed."""
    place = place @ scaling(1.3, 1.3 * mirror, 1.3)
    x, y, z = 0.3, -0.5, math.sqrt(1 - 0.34)
    color: Color = ((x + 1) / 2, (y + 1) / 2, (z + 1) / 2)
    along_u, along_v, up = (unit(place[:3, axis]) for axis in range(3))
    expected = unit(x * along_u + y * along_v + z * up)
    assert seen_normal(NormalMap(color), place, instanced) == pytest.approx(expected, abs=2e-5)


@pytest.mark.parametrize("strength", [0.0, 0.4, 1.0, 2.5])
def test_a_normal_maps_strength_scales_its_lean(strength):
    """From 1 on the height stays as it is, and only the lean grows."""
    x, y, z = 0.3, -0.5, math.sqrt(1 - 0.34)
    color: Color = ((x + 1) / 2, (y + 1) / 2, (z + 1) / 2)
    share = min(strength, 1)
    expected = unit([strength * x, strength * y, 1 + share * (z - 1)])
    assert seen_normal(NormalMap(color, strength), np.eye(4)) == pytest.approx(expected, abs=2e-5)


@both_stores
@pytest.mark.parametrize("space", ["object", "world"])
def test_a_normal_map_in_a_space_is_a_vector_of_that_space(space, instanced):
    vector = unit([0.2, -0.4, 0.7])
    place = rotation(0, 0.4) @ rotation(2, 0.7)
    expected = place[:3, :3] @ vector if space == "object" else vector
    value = NormalMap(tuple((vector + 1) / 2), space=space)
    assert seen_normal(value, place, instanced) == pytest.approx(expected, abs=2e-5)


@both_stores
@pytest.mark.parametrize("place", TILTS.values(), ids=TILTS)
@pytest.mark.parametrize(("strength", "distance", "invert"), [(1, 1, False), (1, 0.3, False), (0.4, 1, True)])
def test_a_bump_tilts_the_normal_against_the_slope(strength, distance, invert, place, instanced):
    """A height that grows by 0.7 per metre along x: the relief's own normal is (-0.7 × distance, 0, 1)."""
    lean = -0.7 * distance * (-1 if invert else 1)
    tilted = (1 - strength) * np.array([0, 0, 1]) + strength * unit([lean, 0, 1])
    expected = unit(place[:3, :3] @ tilted)
    height = Math("multiply", Component(OBJECT, 0), 0.7)
    seen = seen_normal(Bump(height, strength, distance, invert), place, instanced)
    # The height is looked up half a pixel beside the hit, in float32.
    assert seen == pytest.approx(expected, abs=2e-3)


def test_a_relief_rises_towards_the_viewer_from_either_side_as_in_cycles():
    height = Math("multiply", Component(OBJECT, 0), 0.7)
    assert seen_normal(Bump(height), np.eye(4)) == pytest.approx(unit([-0.7, 0, 1]), abs=2e-3)
    assert seen_normal(Bump(height), np.eye(4), turned=True) == pytest.approx(unit([-0.7, 0, -1]), abs=2e-3)


def test_a_bump_goes_on_from_another_normal():
    first = NormalMap(((0.6 + 1) / 2, 0.5, (0.8 + 1) / 2))
    assert seen_normal(Bump(0.5, normal=first), np.eye(4)) == pytest.approx([0.6, 0, 0.8], abs=2e-5)


# What depends on the view


def reflectance(cosine: float, eta: float) -> float:
    """Fresnel (1823): the mean of both polarisations."""
    sine = math.sqrt(1 - cosine**2) / eta
    if sine >= 1:
        return 1.0
    inside = math.sqrt(1 - sine**2)
    parallel = (eta * cosine - inside) / (eta * cosine + inside)
    across = (cosine - eta * inside) / (cosine + eta * inside)
    return (parallel**2 + across**2) / 2


def facing(cosine: float, blend: float) -> float:
    return 1 - cosine ** (2 * blend if blend < 0.5 else 0.5 / (1 - blend))


VIEW_DEPENDENT: dict[str, tuple[Expression, Callable[[float, bool], float]]] = {
    **{
        f"fresnel {ior}": (Fresnel(ior), lambda c, back, ior=ior: reflectance(c, 1 / ior if back else ior))
        for ior in (1.45, 0.7, 3.0)
    },
    **{
        f"layer fresnel {b}": (
            LayerWeight(b, "fresnel"),
            lambda c, back, b=b: reflectance(c, 1 - b if back else 1 / (1 - b)),
        )
        for b in (0.1, 0.5, 0.8)
    },
    **{f"facing {b}": (LayerWeight(b), lambda c, back, b=b: facing(c, b)) for b in (0.2, 0.5, 0.9)},
}


@pytest.mark.parametrize("back", [False, True], ids=["front", "back"])
@pytest.mark.parametrize("name", VIEW_DEPENDENT)
def test_what_depends_on_the_view_is_its_formula(name, back):
    value, formula = VIEW_DEPENDENT[name]
    for degrees in (0, 30, 60, 85):
        place = rotation(1, math.radians(degrees) + (math.pi if back else 0))
        camera = camera_down(1e-3, (4, 4), height=20)
        seen = seen_by(camera, sheet(), place, glow(value), False)
        assert seen == pytest.approx(np.full((16, 3), formula(math.cos(math.radians(degrees)), back)), abs=1e-4)


def sheet() -> Mesh:
    return polygon([(-HALF, -HALF, 0), (HALF, -HALF, 0), (HALF, HALF, 0), (-HALF, HALF, 0)])


def test_fresnel_asks_the_normal_that_it_is_given():
    leaning = NormalMap(((0.6 + 1) / 2, 0.5, (0.8 + 1) / 2), space="world")
    seen = seen_by(camera_down(1e-3, (4, 4)), sheet(), np.eye(4), glow(Fresnel(1.5, leaning)), False)
    assert seen == pytest.approx(np.full((16, 3), reflectance(0.8, 1.5)), abs=1e-5)
