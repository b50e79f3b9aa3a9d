"""From values to instructions: each expression once, however often it is used, and constants before rendering.

Every constant is a register that is filled before rendering. So is the result of every instruction that reads nothing
but constants: those stand in a prologue that is run once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from . import values
from .graph_walk import children_first
from .instructions import (
    AFFINE,
    ASIDE_U,
    ASIDE_V,
    ATTRIBUTE,
    AVERAGE,
    BUMP,
    CHECKER,
    COMBINE,
    COMPONENT,
    DIRECTION,
    FACING,
    FRESNEL,
    GENERATED,
    GRAY,
    HERE,
    IMAGE,
    LAYER_FRESNEL,
    MAP_RANGE,
    MATH,
    MIX,
    NONE,
    NORMAL_MAP,
    NORMALIZE,
    OBJECT,
    PANORAMA,
    RAMP,
    REQUIRE_FINITE,
    UV,
    WORLD,
)
from .value_arithmetic import CannotCompileError, color_of
from .values import Expression, Value

_SPACES = {"uv": UV, "generated": GENERATED, "object": OBJECT, "world": WORLD}

#: A register's number while programs are compiled: from 0 those that are filled before rendering, from this down those
#: of the program itself, which all programs share and which get their places when the number of the others is known.
FIRST_OWN = -2


@dataclass(frozen=True)
class Instruction:
    operation: int
    result: int
    operands: tuple[int, ...]
    numbers: tuple[int, ...]


@dataclass
class Shared:
    """What all programs of a scene share."""

    registers: list[tuple[float, float, float]] = field(default_factory=list)
    constants: dict[tuple[float, float, float], int] = field(default_factory=dict)
    prologue: list[Instruction] = field(default_factory=list)
    computed: set[int] = field(default_factory=set)  # the registers that the prologue fills
    known: dict[tuple[int, int], int] = field(default_factory=dict)
    textures: list[values.ImageTexture | values.EnvironmentTexture] = field(default_factory=list)
    ramps: list[np.ndarray] = field(default_factory=list)
    attributes: list[str] = field(default_factory=list)
    #: What has been compiled: an object that is gone could leave its identity to another one.
    kept: list[Expression] = field(default_factory=list)

    def constant(self, value: float | values.Color) -> int:
        color = color_of(value)
        if not np.isfinite(color).all():
            raise CannotCompileError("a colour or a number of it is not finite")
        if color not in self.constants:
            self.constants[color] = len(self.registers)
            self.registers.append(color)
        return self.constants[color]

    def texture(self, texture: values.ImageTexture | values.EnvironmentTexture) -> int:
        for index, other in enumerate(self.textures):
            if other is texture:
                return index
        self.textures.append(texture)
        return len(self.textures) - 1

    def ramp(self, table: np.ndarray) -> int:
        """Where the table begins among all tables."""
        first = sum(map(len, self.ramps))
        self.ramps.append(np.asarray(table, np.float32))
        return first

    def attribute(self, name: str) -> int:
        if name not in self.attributes:
            self.attributes.append(name)
        return self.attributes.index(name)


@dataclass
class Body:
    """One program while it is compiled. `of_world`: coordinates are the direction looked in."""

    shared: Shared
    of_world: bool = False
    instructions: list[Instruction] = field(default_factory=list)
    known: dict[tuple[int, int], int] = field(default_factory=dict)
    required: set[int] = field(default_factory=set)
    own: int = 0
    albedo: int = NONE
    emission: int = NONE
    lobes: int = 0
    may_emit: bool = False
    may_pass: bool = False
    typical_emission: float = 0.0

    def value(self, value: Value, where: int = HERE) -> int:
        """The register of a value, looked up at the hit or beside it."""
        if not isinstance(value, Expression):
            return self.shared.constant(value)
        missing = children_first((value, where), self._missing_parts, lambda node: (id(node[0]), node[1]))
        for part, at in missing:
            if self._known(part, at) is None:
                self._compile(part, at)
        return self._known(value, where)

    def _known(self, value: Expression, where: int) -> int | None:
        of_all = self.shared.known.get((id(value), HERE))
        return self.known.get((id(value), where)) if of_all is None else of_all

    def _missing_parts(self, node: tuple[Expression, int]) -> list[tuple[Expression, int]]:
        value, where = node
        if self._known(value, where) is not None:
            return []
        if isinstance(value, values.Bump):
            parts = [(value.height, at) for at in (HERE, ASIDE_U, ASIDE_V)]
            parts += [(value.strength, HERE), (value.distance, HERE), (value.normal, HERE)]
        else:
            parts = [(getattr(value, part.name), where) for part in fields(value)]
        return [(part, at) for part, at in parts if isinstance(part, Expression)]

    def _compile(self, value: Expression, where: int) -> None:
        """Add the instructions of an expression whose parts are known."""
        if type(value) not in _EXPRESSIONS:
            raise CannotCompileError(f"{type(value).__name__} is no value that can be computed")
        if self.of_world and isinstance(value, _OF_SURFACES):
            raise CannotCompileError(f"{type(value).__name__} is read off a surface, and it has none")
        register = _EXPRESSIONS[type(value)](self, value, where)
        if register >= 0:
            self.shared.known[id(value), HERE] = register
        else:
            self.known[id(value), where] = register
        self.shared.kept.append(value)

    def normal(self, normal: Expression | None, where: int = HERE) -> int:
        """The register of a normal; NONE is the shading normal."""
        return NONE if normal is None else self.value(normal, where)

    def compute(
        self, operation: int, operands: Sequence[int], numbers: Sequence[int] = (), varies: bool = False
    ) -> int:
        """Add an instruction that fills a register. It `varies` where it reads more than its operands."""
        if not varies and all(operand >= 0 for operand in operands):
            result = len(self.shared.registers)
            self.shared.registers.append((0.0, 0.0, 0.0))
            self.shared.computed.add(result)
            self.shared.prologue.append(Instruction(operation, result, tuple(operands), tuple(numbers)))
            return result
        result = FIRST_OWN - self.own
        self.own += 1
        self.instructions.append(Instruction(operation, result, tuple(operands), tuple(numbers)))
        return result

    def act(self, operation: int, operands: Sequence[int], numbers: Sequence[int] = ()) -> None:
        """Add an instruction on the surface."""
        self.instructions.append(Instruction(operation, NONE, tuple(operands), tuple(numbers)))

    def require_finite(self, operands: Sequence[int]) -> None:
        """Let the film know where one of these registers is not finite; what is given as a constant always is."""
        for register in operands:
            uncertain = register <= FIRST_OWN or register in self.shared.computed
            if uncertain and register not in self.required:
                self.required.add(register)
                self.act(REQUIRE_FINITE, (register,))


_OF_SURFACES = (values.Attribute, values.Fresnel, values.LayerWeight, values.NormalMap, values.Bump)


def number_of(name: str, names: Sequence[str], what: str) -> int:
    """The place of a name in `names`."""
    if name not in names:
        raise CannotCompileError(f"{name!r} is no {what}: there are {', '.join(names)}")
    return names.index(name)


# One function for each class of expression: the register of its value.


def _coordinates(body: Body, value: values.Coordinates, where: int) -> int:
    if body.of_world:
        return body.compute(DIRECTION, (), varies=True)
    number_of(value.space, tuple(_SPACES), "space of coordinates")
    return body.compute(_SPACES[value.space], (), (where,), varies=True)


def _attribute(body: Body, value: values.Attribute, where: int) -> int:
    return body.compute(ATTRIBUTE, (), (body.shared.attribute(value.name), where), varies=True)


def _affine(body: Body, value: values.Affine, where: int) -> int:
    columns = np.asarray(value.matrix, np.float64).T
    constants = [body.shared.constant(tuple(column)) for column in columns]
    return body.compute(AFFINE, (body.value(value.vector, where), *constants))


def _image(body: Body, value: values.ImageTexture, where: int) -> int:
    number_of(value.extension, values.EXTENSIONS, "extension of an image texture")
    return body.compute(IMAGE, (body.value(value.vector, where),), (_texture(body, value),))


def _panorama(body: Body, value: values.EnvironmentTexture, where: int) -> int:
    return body.compute(PANORAMA, (body.value(value.vector, where),), (_texture(body, value),))


def _texture(body: Body, value: values.ImageTexture | values.EnvironmentTexture) -> int:
    number_of(value.interpolation, values.TEXTURE_INTERPOLATIONS, "interpolation of an image texture")
    shape = np.shape(value.pixels)
    if len(shape) != 3 or shape[2] != 3 or 0 in shape:
        raise CannotCompileError(f"an image texture's pixels have the shape {shape}, not (height, width, 3)")
    return body.shared.texture(value)


def _ramp(body: Body, value: values.ColorRamp, where: int) -> int:
    numbers = (body.shared.ramp(value.table), len(value.table), int(value.smooth))
    return body.compute(RAMP, (body.value(value.factor, where),), numbers)


def _mix(body: Body, value: values.Mix, where: int) -> int:
    operands = [body.value(part, where) for part in (value.factor, value.a, value.b)]
    blend = number_of(value.blend, values.BLENDS, "blend mode")
    return body.compute(MIX, operands, (blend, int(value.clamp_factor), int(value.clamp_result)))


def _math(body: Body, value: values.Math, where: int) -> int:
    operands = [body.value(part, where) for part in (value.a, value.b, value.c)]
    return body.compute(MATH, operands, (number_of(value.operation, values.MATHS, "operation"), int(value.clamp)))


def _map_range(body: Body, value: values.MapRange, where: int) -> int:
    parts = (value.value, value.from_min, value.from_max, value.to_min, value.to_max)
    interpolation = number_of(value.interpolation, values.INTERPOLATIONS, "interpolation of a range")
    return body.compute(MAP_RANGE, [body.value(part, where) for part in parts], (interpolation, int(value.clamp)))


def _component(body: Body, value: values.Component, where: int) -> int:
    if value.index not in (0, 1, 2):
        raise CannotCompileError(f"a value has no component {value.index!r}: there are 0, 1 and 2")
    return body.compute(COMPONENT, (body.value(value.value, where),), (int(value.index),))


def _fresnel(body: Body, value: values.Fresnel, where: int) -> int:
    return body.compute(FRESNEL, (body.value(value.ior, where), body.normal(value.normal, where)), varies=True)


def _layer_weight(body: Body, value: values.LayerWeight, where: int) -> int:
    kind = number_of(value.kind, values.LAYER_WEIGHTS, "kind of layer weight")
    operation = (LAYER_FRESNEL, FACING)[kind]
    return body.compute(operation, (body.value(value.blend, where), body.normal(value.normal, where)), varies=True)


def _normal_map(body: Body, value: values.NormalMap, where: int) -> int:
    operands = (body.value(value.color, where), body.value(value.strength, where))
    space = number_of(value.space, values.NORMAL_SPACES, "space of a normal map")
    return body.compute(NORMAL_MAP, operands, (space,), varies=True)


def _bump(body: Body, value: values.Bump, where: int) -> int:
    heights = [body.value(value.height, at) for at in (HERE, ASIDE_U, ASIDE_V)]
    operands = (*heights, body.value(value.strength), body.value(value.distance), body.normal(value.normal))
    return body.compute(BUMP, operands, (int(value.invert),), varies=True)


_EXPRESSIONS = {
    values.Coordinates: _coordinates,
    values.Attribute: _attribute,
    values.Affine: _affine,
    values.Normalized: lambda body, value, where: body.compute(NORMALIZE, (body.value(value.vector, where),)),
    values.Checker: lambda body, value, where: body.compute(
        CHECKER, [body.value(part, where) for part in (value.color1, value.color2, value.scale, value.vector)]
    ),
    values.ImageTexture: _image,
    values.EnvironmentTexture: _panorama,
    values.ColorRamp: _ramp,
    values.Mix: _mix,
    values.Math: _math,
    values.MapRange: _map_range,
    values.Gray: lambda body, value, where: body.compute(GRAY, (body.value(value.color, where),)),
    values.Average: lambda body, value, where: body.compute(AVERAGE, (body.value(value.vector, where),)),
    values.Component: _component,
    values.Combine: lambda body, value, where: body.compute(
        COMBINE, [body.value(part, where) for part in (value.x, value.y, value.z)]
    ),
    values.Fresnel: _fresnel,
    values.LayerWeight: _layer_weight,
    values.NormalMap: _normal_map,
    values.Bump: _bump,
}
