"""Programs do no work that was done before, refuse what they cannot hold, and name the material that they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from core import SceneError, instructions
from core.compile_shaders import MAX_LOBES
from core.instructions import NONE
from core.programs import Programs, compile_programs
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
    Transparent,
)
from core.values import (
    GENERATED,
    UV,
    Attribute,
    Bump,
    Checker,
    ColorRamp,
    Component,
    Coordinates,
    EnvironmentTexture,
    Expression,
    Fresnel,
    ImageTexture,
    LayerWeight,
    MapRange,
    Math,
    Mix,
    NormalMap,
    Value,
)

IMAGE = ImageTexture(np.ones((2, 2, 3), np.float32))
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def compiled(*surfaces: Shader | None, world: Value = 0.0) -> Programs:
    return compile_programs(surfaces, [f"Paint.{i}" for i in range(len(surfaces))], world)


def size(surface: Shader | None) -> int:
    """How many integers the program of one material takes, beside the prologue's and the world's ends."""
    return len(compiled(surface).code) - len(compiled(None).code)


def constant(made: Programs, register: int) -> list[float]:
    return made.registers[register].tolist()


# What is constant


@pytest.mark.parametrize(
    ("surface", "albedo"),
    [
        (None, (0, 0, 0)),
        (Diffuse((0.5, 0.25, 1.0)), (0.5, 0.25, 1)),
        (Diffuse(0.5), (0.5, 0.5, 0.5)),
        (MixShader(0.25, Diffuse(1.0), Diffuse(0.0)), (0.75, 0.75, 0.75)),
        (MixShader(0.5, Diffuse(1.0), None), (0.5, 0.5, 0.5)),
        (AddShader(Diffuse(RED), Diffuse(BLUE)), (1, 0, 1)),
        (Principled(0.5, specular_level=0.0), (0.5, 0.5, 0.5)),
    ],
    ids=["none", "colour", "number", "mixed", "halved", "added", "principled"],
)
def test_a_constant_lambertian_surface_leaves_no_program(surface, albedo):
    made = compiled(surface)
    (material,) = made.materials
    assert material.start == NONE
    assert not material.has_lobes
    assert constant(made, material.albedo) == pytest.approx(albedo)
    assert material.emission == NONE
    assert not material.may_emit


def test_a_constant_emission_leaves_no_program():
    made = compiled(AddShader(Emission((1.0, 0.5, 0.0), 4.0), Diffuse(0.5)), world=(0.1, 0.2, 0.3))
    (material,) = made.materials
    assert material.start == NONE
    assert constant(made, material.emission) == [4, 2, 0]
    assert material.typical_emission == pytest.approx(2)
    assert made.world.start == NONE
    assert constant(made, made.world.emission) == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize("emission", [Emission(0.0, 3.0), Emission(1.0, 0.0), Emission(IMAGE, 0.0)])
def test_what_emits_nothing_is_no_light(emission):
    (material,) = compiled(emission).materials
    assert material.start == NONE
    assert not material.may_emit


def picture(*pixels: float) -> ImageTexture:
    return ImageTexture(np.repeat(np.float32(pixels), 3).reshape(1, -1, 3))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("make", [Emission, lambda value: Principled(emission_color=value, emission_strength=1.0)])
def test_a_bad_pixel_does_not_turn_a_light_off(make, bad):
    """What is known of the light is known of the good ones."""
    (material,) = compiled(make(picture(2.0, bad, 4.0, 0.0))).materials
    assert material.may_emit
    assert material.typical_emission == pytest.approx(2)


def test_emission_is_as_large_as_it_is_on_average():
    assert compiled(Emission(picture(-3.0, 1.0))).materials[0].typical_emission == pytest.approx(2)
    bytes_ = ImageTexture(np.full((2, 2, 3), 51, np.uint8))
    assert compiled(Emission(bytes_, 10.0)).materials[0].typical_emission == pytest.approx(2)


@pytest.mark.parametrize("pixels", [(math.nan,), (math.nan, 0.0), (1e-45,), (3e38,), (-1.0,)])
def test_what_may_emit_can_be_chosen_as_a_light(pixels):
    tiny = Mix(1.0, picture(*pixels), picture(*pixels), "multiply", clamp_factor=False)
    for _ in range(10):
        tiny = Mix(1.0, tiny, tiny, "multiply", clamp_factor=False)
    (material,) = compiled(Emission(tiny)).materials
    assert material.may_emit
    assert 0 < material.typical_emission < math.inf


def test_a_black_picture_emits_nothing():
    assert not compiled(Emission(picture(0.0, 0.0))).materials[0].may_emit
    assert not compiled(Emission(Mix(1.0, picture(1.0), (0.0, 0.0, 0.0), "multiply"))).materials[0].may_emit


def test_a_negative_colour_takes_nothing_from_another():
    made = compiled(AddShader(Diffuse(-0.5), Diffuse((0.5, 0.25, -1.0))))
    assert constant(made, made.materials[0].albedo) == [0.5, 0.25, 0]


@pytest.mark.parametrize("factor", [0.0, 1.0, -3.0, 7.0])
def test_a_share_of_0_leaves_nothing(factor):
    """Also where the factor lies beyond 0 … 1, which is clamped."""
    kept, gone = Glossy(0.5), Principled(IMAGE, emission_strength=1.0, alpha=0.5)
    mixed = MixShader(factor, kept, gone) if factor <= 0 else MixShader(factor, gone, kept)
    made, alone = compiled(mixed), compiled(kept)
    assert np.array_equal(made.code, alone.code)
    assert np.array_equal(made.registers, alone.registers)
    assert made.materials == alone.materials
    assert made.textures == ()


def test_what_reads_constants_only_stands_in_the_prologue():
    total = Math("add", 0.25, 0.5)
    made = compiled(Diffuse(Mix(total, RED, BLUE)))
    (material,) = made.materials
    assert material.start == NONE
    assert material.albedo != NONE
    prologue = made.code[made.prologue :]
    assert prologue[0] == instructions.MATH
    assert prologue[7] == instructions.MIX
    # Half of this varies, and only that half is left for the hits.
    made = compiled(Diffuse(Mix(total, RED, IMAGE)))
    start = made.materials[0].start
    assert made.code[made.prologue] == instructions.MATH
    assert made.code[start] == instructions.UV
    assert len(made.code) - len(compiled(Diffuse(Mix(0.75, RED, IMAGE))).code) == 7, "the sum, in the prologue alone"


def test_a_shared_node_is_computed_once():
    def twice(first: Value, second: Value) -> Diffuse:
        return Diffuse(Mix(0.5, Math("sine", first), Math("cosine", second)))

    checker, same = (Checker(RED, BLUE, 3.0, GENERATED) for _ in range(2))
    one_checker = size(Diffuse(checker)) - size(Diffuse(GENERATED))
    assert size(twice(checker, same)) - size(twice(checker, checker)) == one_checker
    # Also across the inputs of a shader, and of all shaders of the material.
    across = MixShader(checker, Glossy(checker), Metallic(checker))
    apart = MixShader(Checker(RED, BLUE, 3.0, GENERATED), Glossy(checker), Metallic(Checker(RED, BLUE, 3.0, GENERATED)))
    requirement = 2
    assert size(apart) - size(across) == 2 * one_checker + requirement


def test_a_constant_node_is_computed_once_for_all_materials():
    number = Math("sqrt", 0.5)
    assert len(compiled(Diffuse(number), Glossy(number)).registers) == len(compiled(Glossy(number)).registers)


def test_equal_constants_share_a_register():
    made = compiled(Glossy((0.5, 0.5, 0.5), 0.5), Glossy(0.5, 0.5))
    assert len({tuple(row) for row in made.registers.tolist()}) == len(made.registers)


def test_a_bump_looks_at_its_height_in_three_places():
    plain, bumped = (len(compiled(Glossy(normal=Bump(height))).registers) for height in (1.0, IMAGE))
    assert bumped - plain == 3 * 2, "the UV and the image, each thrice"


def test_textures_tables_and_attributes_are_kept_once():
    table = np.linspace(0, 1, 6, dtype=np.float32).reshape(2, 3)
    ramps = [ColorRamp(UV, table), ColorRamp(GENERATED, 2 * table)]
    made = compiled(Diffuse(IMAGE), Glossy(IMAGE), Diffuse(ramps[0]), Diffuse(ramps[1]))
    assert made.textures == (IMAGE,)
    assert np.array_equal(made.ramps, np.concatenate([table, 2 * table]))


# What light can do


@pytest.mark.parametrize(
    ("surface", "passes"),
    [
        (Transparent(), True),
        (MixShader(0.5, Diffuse(), Transparent()), True),
        (MixShader(IMAGE, Diffuse(), Transparent()), True),
        (Principled(alpha=0.5), True),
        (Principled(alpha=IMAGE), True),
        (Principled(alpha=1.0), False),
        (MixShader(0.0, Diffuse(), Transparent()), False),
        (Glossy(), False),
    ],
)
def test_light_passes_straight_only_where_something_is_transparent(surface, passes):
    assert compiled(surface).materials[0].may_pass == passes


def test_a_lambertian_surface_is_one_lobe_beside_others_however_many_make_it():
    many = AddShader(Diffuse(RED), AddShader(Diffuse(BLUE), Glossy()))
    assert compiled(many).lobes == 2
    assert compiled(Diffuse(), many, Principled(coat=0.5, alpha=0.5)).lobes == 4
    assert compiled(Diffuse(normal=NormalMap(IMAGE))).lobes == 1
    assert compiled(Diffuse(IMAGE)).lobes == 0


# Large graphs


def test_a_long_chain_is_compiled():
    """Longer than Python's stack; so are a chain of shares and a chain of normals."""
    chain: Value = UV
    for _ in range(3000):
        chain = Math("add", chain, 1.0)
    assert size(Diffuse(chain)) - size(Diffuse(UV)) == 3000 * 7
    normal, shader = None, Glossy(0.5)
    for _ in range(3000):
        normal, shader = Bump(UV, normal=normal), MixShader(Component(UV, 0), None, shader)
    assert compiled(shader, Diffuse(normal=normal)).lobes == 1


def test_shared_shaders_and_factors_are_flattened_once():
    """The number of ways through this graph has 18 digits."""
    shared, product = Diffuse(0.5), UV
    for _ in range(60):
        shared, product = MixShader(0.5, shared, shared), Mix(1.0, product, product, "multiply", clamp_factor=False)
    made = compiled(shared, Emission(product))
    assert constant(made, made.materials[0].albedo) == pytest.approx([0.5] * 3)
    twice = Glossy()
    assert compiled(AddShader(twice, MixShader(0.5, twice, None))).lobes == 1


def test_shares_of_a_shared_shader_add_up():
    white, factor = Diffuse(1.0), 0.25
    made = compiled(MixShader(factor, white, MixShader(factor, Diffuse(0.0), white)))
    assert constant(made, made.materials[0].albedo) == pytest.approx([0.75 + 0.25 * 0.25] * 3)


# Limits


def mixture(count: int) -> Shader:
    shader = Glossy()
    for i in range(count - 1):
        shader = MixShader(1 / (i + 2), shader, Glossy(roughness=i / count))
    return shader


def test_a_hit_has_as_many_lobes_as_the_limit_says():
    assert compiled(mixture(MAX_LOBES)).lobes == MAX_LOBES
    with pytest.raises(SceneError, match=rf"material 'Paint.1'.*mixes {MAX_LOBES + 1} reflections.*{MAX_LOBES}"):
        compiled(Diffuse(), mixture(MAX_LOBES + 1))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, (1.0, math.nan, 0.0)])
@pytest.mark.parametrize(
    "make",
    [
        Diffuse,
        Emission,
        lambda bad: Emission(1.0, bad),
        lambda bad: Glossy(roughness=bad),
        lambda bad: Diffuse(Checker(RED, BLUE, bad)),
        lambda bad: Diffuse(Math("add", UV, bad)),
        lambda bad: Principled(coat=bad),
        lambda bad: MixShader(IMAGE, Diffuse(bad), None),
    ],
    ids=["colour", "emission", "strength", "roughness", "scale", "operand", "coat", "mixed"],
)
def test_a_constant_that_is_not_finite_is_refused_by_the_materials_name(make, bad):
    with pytest.raises(SceneError, match=r"material 'Paint.1'.*not finite"):
        compiled(Diffuse(), make(bad))


def test_a_world_that_is_not_finite_is_refused():
    with pytest.raises(SceneError, match=r"the world.*not finite"):
        compiled(world=(0.0, math.inf, 0.0))


@pytest.mark.parametrize(
    ("surface", "why"),
    [
        (Diffuse(Mix(0.5, UV, 0.5, "foo")), "'foo' is no blend mode: there are mix, "),
        (Diffuse(Math("foo", UV)), "'foo' is no operation: there are add, "),
        (Diffuse(MapRange(UV, interpolation="foo")), "'foo' is no interpolation of a range"),
        (Diffuse(ImageTexture(IMAGE.pixels, "foo")), "'foo' is no extension of an image texture: there are repeat, "),
        (Diffuse(ImageTexture(IMAGE.pixels, interpolation="foo")), "'foo' is no interpolation of an image texture"),
        (Diffuse(EnvironmentTexture(np.ones((2, 2)))), "pixels have the shape (2, 2), not (height, width, 3)"),
        (Diffuse(Component(UV, 3)), "no component 3"),
        (Diffuse(Coordinates("foo")), "'foo' is no space of coordinates"),
        (Diffuse(LayerWeight(0.5, "foo")), "'foo' is no kind of layer weight"),
        (Diffuse(normal=NormalMap(0.5, space="foo")), "'foo' is no space of a normal map"),
        (Glossy(distribution="foo"), "'foo' is no distribution: there are ggx, "),
        (Glass(distribution="cosine_power"), "'cosine_power' is no distribution of facets"),
        (Diffuse((1.0, 2.0)), "(1.0, 2.0) is neither a number nor a colour"),
        (Diffuse("red"), "'red' is neither a number nor a colour"),
        (Diffuse(Expression()), "Expression is no value"),
        (Shader(), "Shader is no shader"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_has_no_meaning_is_refused_by_the_materials_name(surface, why):
    with pytest.raises(SceneError, match=r"^material 'Paint.1': ") as error:
        compiled(Diffuse(), surface)
    assert why in str(error.value)
    assert "\n" not in str(error.value)


def test_a_world_of_two_components_is_refused():
    with pytest.raises(SceneError, match=r"^the world: \(1.0, 1.0\) is neither a number nor a colour"):
        compiled(world=(1.0, 1.0))


@pytest.mark.parametrize(
    "value", [Attribute("Col"), Fresnel(), LayerWeight(), NormalMap((0.5, 0.5, 1.0)), Bump(0.5)], ids=repr
)
def test_a_world_that_asks_for_a_surface_is_refused(value):
    """There is no triangle to look at: it was read from memory that belongs to something else."""
    with pytest.raises(SceneError, match=rf"^the world: {type(value).__name__} is read off a surface"):
        compiled(world=Mix(0.5, (1.0, 1.0, 1.0), value))
