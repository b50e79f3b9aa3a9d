"""Materials as programs: instructions that compute, at a hit, the values of its material and then its lobes.

The graphs of `values` and `shaders` become flat lists of `instructions`. What is constant is done before rendering;
what is left is what has to be computed at each hit, each expression once however often it is used. Here the programs
of a scene are put together: `compile_values` and `compile_shaders` make the parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import shaders, values
from .compile_shaders import compile_surface, compile_world
from .compile_values import FIRST_OWN, Body, Instruction, Shared
from .errors import SceneError
from .instructions import END, NONE
from .value_arithmetic import CannotCompileError
from .values import Value


@dataclass(frozen=True)
class Material:
    """What is known of a program before it runs."""

    start: int  # in `Programs.code`, or NONE where all is constant
    albedo: int  # the register of a constant albedo, or NONE
    emission: int  # the register of a constant emission, or NONE
    has_lobes: bool  # it is more than Lambertian
    may_emit: bool  # its emission is not 0 for sure
    may_pass: bool  # light may go straight through it
    typical_emission: float  # a guess at the mean radiance, to choose lights by; > 0 where it may emit


@dataclass(frozen=True)
class Programs:
    """All programs of a scene: `code` is int64, `registers` (R, 3) float32 holds the constants.

    `prologue` is where the instructions begin that have to be run once, to fill the registers that depend on constants
    only. The world's program leaves its radiance as emission.
    """

    code: np.ndarray
    registers: np.ndarray
    prologue: int
    materials: tuple[Material, ...]
    world: Material
    lobes: int  # the most that a hit can have
    textures: tuple[values.ImageTexture | values.EnvironmentTexture, ...]
    ramps: np.ndarray  # (n, 3) float32: the tables of all color ramps
    attributes: tuple[str, ...]


def compile_programs(surfaces: Sequence[shaders.Shader | None], names: Sequence[str], world: Value) -> Programs:
    """Compile the materials' surfaces, whose `names` errors use, and the world's radiance.

    Raises:
        SceneError: a constant is not finite, a name is unknown, or a material has too many lobes.
    """
    shared = Shared()
    bodies = []
    for surface, name in zip(surfaces, names, strict=True):
        try:
            bodies.append(compile_surface(shared, surface))
        except CannotCompileError as error:
            raise SceneError(f"material {name!r}: {error}") from None
    try:
        sky = compile_world(shared, world)
    except CannotCompileError as error:
        raise SceneError(f"the world: {error}") from None
    return _link(shared, bodies, sky)


def _link(shared: Shared, bodies: list[Body], sky: Body) -> Programs:
    """Put all instructions into one array, and give the programs' own registers their places after the fixed ones."""
    fixed = len(shared.registers)

    def place(register: int) -> int:
        return register if register >= NONE else fixed + FIRST_OWN - register

    code: list[int] = []

    def append(instructions: list[Instruction]) -> int:
        start = len(code)
        for step in instructions:
            result = () if step.operation >= END else (place(step.result),)
            code.extend((step.operation, *result, *map(place, step.operands), *step.numbers))
        code.append(END)
        return start

    def material(body: Body) -> Material:
        return Material(
            start=append(body.instructions) if body.instructions else NONE,
            albedo=max(body.albedo, NONE),
            emission=max(body.emission, NONE),
            has_lobes=body.lobes > 0,
            may_emit=body.may_emit,
            may_pass=body.may_pass,
            typical_emission=body.typical_emission,
        )

    prologue = append(shared.prologue)
    materials = tuple(material(body) for body in bodies)
    world = material(sky)
    own = max([body.own for body in (*bodies, sky)])
    registers = np.array([*shared.registers, *[(0.0, 0.0, 0.0)] * own], np.float32).reshape(-1, 3)
    return Programs(
        code=np.array(code, np.int64),
        registers=registers,
        prologue=prologue,
        materials=materials,
        world=world,
        lobes=max([body.lobes for body in bodies], default=0),
        textures=tuple(shared.textures),
        ramps=np.concatenate([np.zeros((0, 3), np.float32), *shared.ramps]),
        attributes=tuple(shared.attributes),
    )
