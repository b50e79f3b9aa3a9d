"""Programs do no work that was done before, refuse what they cannot hold, and name the material that they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from core import SceneError, programs
from core.programs import MAX_LOBES, NONE, Programs, compile_programs
from core.shaders import AddShader, Diffuse, Emission, Glossy, Metallic, MixShader, Principled, Shader, Transparent
from core.values import GENERATED, UV, Bump, Checker, ColorRamp, ImageTexture, Math, Mix, NormalMap, Value

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
    assert prologue[0] == programs.MATH
    assert prologue[7] == programs.MIX
    # Half of this varies, and only that half is left for the hits.
    made = compiled(Diffuse(Mix(total, RED, IMAGE)))
    start = made.materials[0].start
    assert made.code[made.prologue] == programs.MATH
    assert made.code[start] == programs.UV
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
    assert size(apart) - size(across) == 2 * one_checker


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
