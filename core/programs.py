"""Materials as programs: instructions that compute, at a hit, the values of its material and then its lobes.

The trees of `values` and `shaders` become flat lists of integers: an operation, the register that it fills, the
registers that it reads, and numbers that belong to it. Every constant is a register that is filled before rendering.
So is the result of every instruction that reads nothing but constants: those stand in a prologue that is run once. What
is left is what has to be computed at each hit, each tree once however often it is used; a Lambertian surface of
constant colour, and a share of 0 of a shader, leave nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from . import shaders, values
from .errors import SceneError
from .values import Expression, Value

#: A hit has at most this many lobes.
MAX_LOBES = 16
#: "There is none", where an index is expected.
NONE = -1

# Operations that fill a register.
(
    UV,
    GENERATED,
    OBJECT,
    WORLD,
    DIRECTION,
    ATTRIBUTE,
    SHADING_NORMAL,
    AFFINE,
    NORMALIZE,
    CHECKER,
    IMAGE,
    PANORAMA,
    RAMP,
    MIX,
    MATH,
    MAP_RANGE,
    GRAY,
    AVERAGE,
    COMPONENT,
    COMBINE,
    FRESNEL,
    LAYER_FRESNEL,
    FACING,
    NORMAL_MAP,
    BUMP,
) = range(25)
# Operations on the surface.
(
    END,
    ALBEDO,
    EMIT,
    DIFFUSE,
    TRANSLUCENT,
    TRANSPARENT,
    GLOSSY,
    COSINE_POWER,
    METAL,
    CONDUCTOR,
    GLASS,
    REFRACTION,
    PRINCIPLED,
) = range(32, 45)

BLENDS = (
    "mix", "darken", "multiply", "burn", "lighten", "screen", "dodge", "add", "overlay", "soft_light", "linear_light",
    "difference", "exclusion", "subtract", "divide", "hue", "saturation", "color", "value",
)  # fmt: skip
MATHS = (
    "add", "subtract", "multiply", "divide", "multiply_add", "power", "logarithm", "sqrt", "inverse_sqrt", "absolute",
    "exponent", "minimum", "maximum", "less_than", "greater_than", "sign", "compare", "smooth_min", "smooth_max",
    "round", "floor", "ceil", "trunc", "fract", "modulo", "floored_modulo", "wrap", "snap", "pingpong", "sine",
    "cosine", "tangent", "arcsine", "arccosine", "arctangent", "arctan2", "sinh", "cosh", "tanh", "radians", "degrees",
)  # fmt: skip
INTERPOLATIONS = ("linear", "smoothstep", "smootherstep")
NORMAL_SPACES = ("tangent", "object", "world")
_SPACES = {"uv": UV, "generated": GENERATED, "object": OBJECT, "world": WORLD}

#: Where a bump's height is looked up: at the hit, and a small step beside it in either direction of the surface.
HERE, ASIDE_U, ASIDE_V = 0, 1, 2


@dataclass(frozen=True)
class Material:
    """What is known of a program before it runs."""

    start: int  # in `Programs.code`, or NONE where all is constant
    albedo: int  # the register of a constant albedo, or NONE
    emission: int  # the register of a constant emission, or NONE
    has_lobes: bool  # it is more than Lambertian
    may_emit: bool
    may_pass: bool  # light may go straight through it
    typical_emission: float  # a guess at the mean radiance, to choose lights by


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
        SceneError: a constant is not finite, or a material has more than MAX_LOBES lobes.
    """
    shared = _Shared()
    bodies = []
    for surface, name in zip(surfaces, names, strict=True):
        try:
            bodies.append(_compile_surface(shared, surface))
        except _CannotCompileError as error:
            raise SceneError(f"material {name!r}: {error}") from None
    try:
        sky = _compile_world(shared, world)
    except _CannotCompileError as error:
        raise SceneError(f"the world: {error}") from None
    return _link(shared, bodies, sky)


class _CannotCompileError(Exception):
    """Why a program cannot be made; the text goes on after the material's name."""


# A register's number while programs are compiled: from 0 those that are filled before rendering, from -2 down those of
# the program itself, which all programs share and which get their places when the number of the others is known.
_FIRST_OWN = -2


@dataclass(frozen=True)
class _Instruction:
    operation: int
    result: int
    operands: tuple[int, ...]
    numbers: tuple[int, ...]


@dataclass
class _Shared:
    """What all programs of a scene share."""

    registers: list[tuple[float, float, float]] = field(default_factory=list)
    constants: dict[tuple[float, float, float], int] = field(default_factory=dict)
    prologue: list[_Instruction] = field(default_factory=list)
    known: dict[tuple[int, int], int] = field(default_factory=dict)
    textures: list[values.ImageTexture | values.EnvironmentTexture] = field(default_factory=list)
    ramps: list[np.ndarray] = field(default_factory=list)
    attributes: list[str] = field(default_factory=list)
    #: What has been compiled: an object that is gone could leave its identity to another one.
    kept: list[Expression] = field(default_factory=list)

    def constant(self, value: float | values.Color) -> int:
        color = _color(value)
        if not np.isfinite(color).all():
            raise _CannotCompileError("a colour or a number of it is not finite")
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
class _Body:
    """One program while it is compiled. `of_world`: coordinates are the direction looked in."""

    shared: _Shared
    of_world: bool = False
    instructions: list[_Instruction] = field(default_factory=list)
    known: dict[tuple[int, int], int] = field(default_factory=dict)
    own: int = 0
    albedo: int = NONE
    emission: int = NONE
    lobes: int = 0
    may_pass: bool = False
    typical_emission: float = 0.0

    def value(self, value: Value, where: int = HERE) -> int:
        """The register of a value, looked up at the hit or beside it."""
        if not isinstance(value, Expression):
            return self.shared.constant(value)
        for known, key in ((self.shared.known, (id(value), HERE)), (self.known, (id(value), where))):
            if key in known:
                return known[key]
        register = _EXPRESSIONS[type(value)](self, value, where)
        if register >= 0:
            self.shared.known[id(value), HERE] = register
        else:
            self.known[id(value), where] = register
        self.shared.kept.append(value)
        return register

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
            self.shared.prologue.append(_Instruction(operation, result, tuple(operands), tuple(numbers)))
            return result
        result = _FIRST_OWN - self.own
        self.own += 1
        self.instructions.append(_Instruction(operation, result, tuple(operands), tuple(numbers)))
        return result

    def act(self, operation: int, operands: Sequence[int], numbers: Sequence[int] = ()) -> None:
        """Add an instruction on the surface."""
        self.instructions.append(_Instruction(operation, NONE, tuple(operands), tuple(numbers)))


# Values


def _coordinates(body: _Body, value: values.Coordinates, where: int) -> int:
    if body.of_world:
        return body.compute(DIRECTION, (), varies=True)
    return body.compute(_SPACES[value.space], (), (where,), varies=True)


def _attribute(body: _Body, value: values.Attribute, where: int) -> int:
    return body.compute(ATTRIBUTE, (), (body.shared.attribute(value.name), where), varies=True)


def _affine(body: _Body, value: values.Affine, where: int) -> int:
    columns = np.asarray(value.matrix, np.float64).T
    constants = [body.shared.constant(tuple(column)) for column in columns]
    return body.compute(AFFINE, (body.value(value.vector, where), *constants))


def _image(body: _Body, value: values.ImageTexture, where: int) -> int:
    return body.compute(IMAGE, (body.value(value.vector, where),), (body.shared.texture(value),))


def _panorama(body: _Body, value: values.EnvironmentTexture, where: int) -> int:
    return body.compute(PANORAMA, (body.value(value.vector, where),), (body.shared.texture(value),))


def _ramp(body: _Body, value: values.ColorRamp, where: int) -> int:
    numbers = (body.shared.ramp(value.table), len(value.table), int(value.smooth))
    return body.compute(RAMP, (body.value(value.factor, where),), numbers)


def _mix(body: _Body, value: values.Mix, where: int) -> int:
    operands = [body.value(part, where) for part in (value.factor, value.a, value.b)]
    return body.compute(MIX, operands, (BLENDS.index(value.blend), int(value.clamp_factor), int(value.clamp_result)))


def _math(body: _Body, value: values.Math, where: int) -> int:
    operands = [body.value(part, where) for part in (value.a, value.b, value.c)]
    return body.compute(MATH, operands, (MATHS.index(value.operation), int(value.clamp)))


def _map_range(body: _Body, value: values.MapRange, where: int) -> int:
    parts = (value.value, value.from_min, value.from_max, value.to_min, value.to_max)
    numbers = (INTERPOLATIONS.index(value.interpolation), int(value.clamp))
    return body.compute(MAP_RANGE, [body.value(part, where) for part in parts], numbers)


def _fresnel(body: _Body, value: values.Fresnel, where: int) -> int:
    return body.compute(FRESNEL, (body.value(value.ior, where), body.normal(value.normal, where)), varies=True)


def _layer_weight(body: _Body, value: values.LayerWeight, where: int) -> int:
    operation = FACING if value.kind == "facing" else LAYER_FRESNEL
    return body.compute(operation, (body.value(value.blend, where), body.normal(value.normal, where)), varies=True)


def _normal_map(body: _Body, value: values.NormalMap, where: int) -> int:
    operands = (body.value(value.color, where), body.value(value.strength, where))
    return body.compute(NORMAL_MAP, operands, (NORMAL_SPACES.index(value.space),), varies=True)


def _bump(body: _Body, value: values.Bump, where: int) -> int:
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
    values.Component: lambda body, value, where: body.compute(
        COMPONENT, (body.value(value.value, where),), (value.index,)
    ),
    values.Combine: lambda body, value, where: body.compute(
        COMBINE, [body.value(part, where) for part in (value.x, value.y, value.z)]
    ),
    values.Fresnel: _fresnel,
    values.LayerWeight: _layer_weight,
    values.NormalMap: _normal_map,
    values.Bump: _bump,
}


# Shaders


def _compile_surface(shared: _Shared, surface: shaders.Shader | None) -> _Body:
    body = _Body(shared)
    parts = _flatten(surface, 1.0)
    emissions = [(shader, weight) for shader, weight in parts if isinstance(shader, shaders.Emission)]
    lobes = [(shader, weight) for shader, weight in parts if not isinstance(shader, shaders.Emission)]
    _add_emission(body, emissions)
    flat = [(shader, weight) for shader, weight in lobes if _is_plain_lambert(shader)]
    albedo = _sum([_product(weight, shader.color) for shader, weight in flat])
    if len(flat) == len(lobes):
        body.albedo = body.value(albedo)
        if body.albedo < 0 or body.instructions:
            body.act(ALBEDO, (body.albedo,))
        return body
    if flat:
        _diffuse(body, shaders.Diffuse(albedo), 1.0)
    for shader, weight in lobes:
        if not _is_plain_lambert(shader):
            _LOBES[type(shader)](body, shader, weight)
    if body.lobes > MAX_LOBES:
        raise _CannotCompileError(f"it mixes {body.lobes} reflections, at most {MAX_LOBES} are possible: simplify it")
    return body


def _compile_world(shared: _Shared, world: Value) -> _Body:
    body = _Body(shared, of_world=True)
    _add_emission(body, [(shaders.Emission(world, 1.0), 1.0)])
    return body


def _flatten(shader: shaders.Shader | None, weight: Value) -> list[tuple[shaders.Shader, Value]]:
    """The shaders that a tree mixes, each with its share; those without a share left out."""
    if shader is None or _is_constant(weight, 0.0):
        return []
    if isinstance(shader, shaders.AddShader):
        return _flatten(shader.a, weight) + _flatten(shader.b, weight)
    if isinstance(shader, shaders.MixShader):
        factor = _clamped(shader.factor)
        return _flatten(shader.a, _product(weight, _rest(factor))) + _flatten(shader.b, _product(weight, factor))
    if isinstance(shader, shaders.Principled) and _is_only_diffuse(shader):
        shader = shaders.Diffuse(shader.base_color, shader.diffuse_roughness, shader.normal)
    return [(shader, weight)]


def _is_only_diffuse(shader: shaders.Principled) -> bool:
    """Whether nothing but its diffuse part can be seen of a Principled surface."""
    zeros = (shader.metallic, shader.transmission, shader.coat, shader.specular_level)
    dark = _is_constant(shader.emission_strength, 0.0) or _is_constant(shader.emission_color, 0.0)
    return dark and _is_constant(shader.alpha, 1.0) and all(_is_constant(value, 0.0) for value in zeros)


def _is_plain_lambert(shader: shaders.Shader) -> bool:
    return isinstance(shader, shaders.Diffuse) and shader.normal is None and _is_constant(shader.roughness, 0.0)


def _add_emission(body: _Body, emissions: list[tuple[shaders.Emission, Value]]) -> None:
    radiance = _sum([_product(weight, _product(shader.color, shader.strength)) for shader, weight in emissions])
    if _is_constant(radiance, 0.0):
        return
    body.typical_emission += float(np.mean(np.abs(_typical(radiance))))
    body.emission = body.value(radiance)
    if body.emission < 0:
        body.act(EMIT, (body.emission,))


def _add_lobe(
    body: _Body, operation: int, operands: Sequence[int], numbers: Sequence[int] = (), lobes: int = 1
) -> None:
    body.act(operation, operands, numbers)
    body.lobes += lobes


def _diffuse(body: _Body, shader: shaders.Diffuse, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness)
    _add_lobe(body, DIFFUSE, (*map(body.value, parts), body.normal(shader.normal)))


def _translucent(body: _Body, shader: shaders.Translucent, weight: Value) -> None:
    _add_lobe(body, TRANSLUCENT, (body.value(weight), body.value(shader.color), body.normal(shader.normal)))


def _transparent(body: _Body, shader: shaders.Transparent, weight: Value) -> None:
    body.may_pass = True
    _add_lobe(body, TRANSPARENT, (body.value(weight), body.value(shader.color)))


def _glossy(body: _Body, shader: shaders.Glossy, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness)
    operands = (*map(body.value, parts), body.normal(shader.normal))
    if shader.distribution == "cosine_power":
        _add_lobe(body, COSINE_POWER, operands)
    else:
        _add_lobe(body, GLOSSY, operands, (_multiscatter(shader),))


def _metallic(body: _Body, shader: shaders.Metallic, weight: Value) -> None:
    parts = (weight, shader.base, shader.edge_tint, shader.roughness)
    operation = CONDUCTOR if shader.physical else METAL
    _add_lobe(body, operation, (*map(body.value, parts), body.normal(shader.normal)), (_multiscatter(shader),))


def _glass(body: _Body, shader: shaders.Glass, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness, shader.ior)
    _add_lobe(body, GLASS, (*map(body.value, parts), body.normal(shader.normal)), (_multiscatter(shader),))


def _refraction(body: _Body, shader: shaders.Refraction, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness, shader.ior)
    _add_lobe(body, REFRACTION, (*map(body.value, parts), body.normal(shader.normal)))


def _multiscatter(shader: shaders.Glossy | shaders.Metallic | shaders.Glass | shaders.Principled) -> int:
    return int(shader.distribution == "multiscatter_ggx")


def _principled(body: _Body, shader: shaders.Principled, weight: Value) -> None:
    parts = (
        weight, shader.base_color, shader.metallic, shader.roughness, shader.ior, shader.alpha,
        shader.diffuse_roughness, shader.specular_level, shader.specular_tint, shader.transmission,
        shader.coat, shader.coat_roughness, shader.coat_ior, shader.coat_tint,
    )  # fmt: skip
    emission = _product(shader.emission_color, shader.emission_strength)
    operands = (
        *map(body.value, parts),
        body.value(emission),
        body.normal(shader.normal),
        body.normal(shader.coat_normal),
    )
    if not _is_constant(shader.alpha, 1.0):
        body.may_pass = True
    body.typical_emission += float(np.mean(np.abs(_typical(_product(weight, emission)))))
    # The specular and the diffuse part are always there; the others where they are not 0 for sure.
    optional = (shader.metallic, shader.transmission, shader.coat, _rest(shader.alpha))
    lobes = 2 + sum(not _is_constant(value, 0.0) for value in optional)
    _add_lobe(body, PRINCIPLED, operands, (_multiscatter(shader),), lobes)


_LOBES = {
    shaders.Diffuse: _diffuse,
    shaders.Translucent: _translucent,
    shaders.Transparent: _transparent,
    shaders.Glossy: _glossy,
    shaders.Metallic: _metallic,
    shaders.Glass: _glass,
    shaders.Refraction: _refraction,
    shaders.Principled: _principled,
}


# Arithmetic on values that may be constants


def _color(value: float | values.Color) -> tuple[float, float, float]:
    red, green, blue = np.broadcast_to(np.asarray(value, np.float32), 3)
    return float(red), float(green), float(blue)


def _is_constant(value: Value, number: float) -> bool:
    return not isinstance(value, Expression) and _color(value) == (number, number, number)


def _product(a: Value, b: Value) -> Value:
    if _is_constant(a, 0.0) or _is_constant(b, 0.0):
        return 0.0
    if _is_constant(a, 1.0):
        return b
    if _is_constant(b, 1.0):
        return a
    if isinstance(a, Expression) or isinstance(b, Expression):
        return values.Mix(1.0, a, b, "multiply", clamp_factor=False)
    return tuple(np.multiply(_color(a), _color(b)))


def _sum(parts: list[Value]) -> Value:
    total: Value = 0.0
    for part in parts:
        if _is_constant(total, 0.0):
            total = part
        elif isinstance(total, Expression) or isinstance(part, Expression):
            total = values.Mix(1.0, total, part, "add", clamp_factor=False)
        else:
            total = tuple(np.add(_color(total), _color(part)))
    return total


def _clamped(factor: Value) -> Value:
    if isinstance(factor, Expression):
        return values.Math("add", factor, 0.0, clamp=True)
    return min(max(_color(factor)[0], 0.0), 1.0)


def _rest(factor: Value) -> Value:
    """1 - factor."""
    if isinstance(factor, Expression):
        return values.Math("subtract", 1.0, factor)
    return 1.0 - _color(factor)[0]


def _typical(value: Value) -> np.ndarray:
    """A guess at the mean of a value over a surface: right for constants, images and their products."""
    if not isinstance(value, Expression):
        return np.array(_color(value))
    if isinstance(value, values.ImageTexture | values.EnvironmentTexture):
        scale = 1 / 255 if value.pixels.dtype == np.uint8 else 1
        return value.pixels.mean(axis=(0, 1), dtype=np.float64) * scale
    if isinstance(value, values.Mix) and value.blend == "multiply" and _is_constant(value.factor, 1.0):
        return _typical(value.a) * _typical(value.b)
    return np.full(3, 0.5)


# Linking


def _link(shared: _Shared, bodies: list[_Body], sky: _Body) -> Programs:
    """Put all instructions into one array, and give the programs' own registers their places after the fixed ones."""
    fixed = len(shared.registers)

    def place(register: int) -> int:
        return register if register >= NONE else fixed + _FIRST_OWN - register

    code: list[int] = []

    def append(instructions: list[_Instruction]) -> int:
        start = len(code)
        for step in instructions:
            result = () if step.operation >= END else (place(step.result),)
            code.extend((step.operation, *result, *map(place, step.operands), *step.numbers))
        code.append(END)
        return start

    def material(body: _Body) -> Material:
        return Material(
            start=append(body.instructions) if body.instructions else NONE,
            albedo=max(body.albedo, NONE),
            emission=max(body.emission, NONE),
            has_lobes=body.lobes > 0,
            may_emit=body.typical_emission > 0,
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
