"""From shaders to instructions: a graph of shaders becomes what a surface emits, and lobes with their shares.

A Lambertian surface of constant colour, and a share of 0 of a shader, leave nothing to be done at a hit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from . import shaders
from .compile_values import Body, Shared, number_of
from .graph_walk import children_first
from .instructions import (
    ALBEDO,
    CONDUCTOR,
    COSINE_POWER,
    DIFFUSE,
    EMIT,
    GLASS,
    GLOSSY,
    METAL,
    PRINCIPLED,
    REFRACTION,
    TRANSLUCENT,
    TRANSPARENT,
)
from .typical_values import can_differ_from_0, typical
from .value_arithmetic import CannotCompileError, clamped, is_constant, not_negative, product, rest, total
from .values import Value

#: A hit has at most this many lobes.
MAX_LOBES = 16

_FACETS = ("ggx", "multiscatter_ggx")
_GLOSSY = (*_FACETS, "cosine_power")


def compile_surface(shared: Shared, surface: shaders.Shader | None) -> Body:
    body = Body(shared)
    parts = _flatten(surface)
    emissions = [(shader, weight) for shader, weight in parts if isinstance(shader, shaders.Emission)]
    lobes = [(shader, weight) for shader, weight in parts if not isinstance(shader, shaders.Emission)]
    _add_emission(body, emissions)
    flat = [(shader.color, weight) for shader, weight in lobes if _is_plain_lambert(shader)]
    # Alone, a colour is raised to black where it is used; in a sum it would take from the others before.
    albedo = total(product(weight, color if len(flat) == 1 else not_negative(color)) for color, weight in flat)
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
        raise CannotCompileError(f"it mixes {body.lobes} reflections, at most {MAX_LOBES} are possible: simplify it")
    return body


def compile_world(shared: Shared, world: Value) -> Body:
    body = Body(shared, of_world=True)
    _add_emission(body, [(shaders.Emission(world, 1.0), 1.0)])
    return body


def _flatten(surface: shaders.Shader | None) -> list[tuple[shaders.Shader, Value]]:
    """The shaders that a graph mixes, each with its share of all ways to it; those without a share left out."""
    if surface is None:
        return []
    shares: dict[int, list[Value]] = {id(surface): [1.0]}
    leaves = []
    for shader in reversed(children_first(surface, _mixed)):
        weight = total(shares.pop(id(shader)))
        if isinstance(shader, shaders.AddShader):
            parts = ((shader.a, weight), (shader.b, weight))
        elif isinstance(shader, shaders.MixShader):
            factor = clamped(shader.factor)
            parts = ((shader.a, product(weight, rest(factor))), (shader.b, product(weight, factor)))
        else:
            parts = ()
            if not is_constant(weight, 0.0):
                leaves.append((_simplified(shader), weight))
        for part, share in parts:
            if part is not None:
                shares.setdefault(id(part), []).append(share)
    return leaves


def _mixed(shader: shaders.Shader) -> list[shaders.Shader]:
    """What a shader is made of, the last first."""
    if isinstance(shader, shaders.AddShader | shaders.MixShader):
        return [part for part in (shader.b, shader.a) if part is not None]
    return []


def _simplified(shader: shaders.Shader) -> shaders.Shader:
    if type(shader) not in _LOBES and not isinstance(shader, shaders.Emission):
        raise CannotCompileError(f"{type(shader).__name__} is no shader that a surface can have")
    if isinstance(shader, shaders.Principled) and _is_only_diffuse(shader):
        return shaders.Diffuse(shader.base_color, shader.diffuse_roughness, shader.normal)
    return shader


def _is_only_diffuse(shader: shaders.Principled) -> bool:
    """Whether nothing but its diffuse part can be seen of a Principled surface."""
    zeros = (shader.metallic, shader.transmission, shader.coat, shader.specular_level)
    dark = is_constant(shader.emission_strength, 0.0) or is_constant(shader.emission_color, 0.0)
    return dark and is_constant(shader.alpha, 1.0) and all(is_constant(value, 0.0) for value in zeros)


def _is_plain_lambert(shader: shaders.Shader) -> bool:
    return isinstance(shader, shaders.Diffuse) and shader.normal is None and is_constant(shader.roughness, 0.0)


def _add_emission(body: Body, emissions: list[tuple[shaders.Emission, Value]]) -> None:
    radiance = total(product(weight, product(shader.color, shader.strength)) for shader, weight in emissions)
    if is_constant(radiance, 0.0):
        return
    body.emission = body.value(radiance)
    _expect_emission(body, radiance)
    if body.emission < 0:
        body.act(EMIT, (body.emission,))


def _expect_emission(body: Body, radiance: Value) -> None:
    body.may_emit |= bool(can_differ_from_0(radiance).any())
    body.typical_emission += float(np.mean(typical(radiance)))


# One function for each class of shader.


def _add_lobe(body: Body, operation: int, operands: Sequence[int], numbers: Sequence[int] = (), lobes: int = 1) -> None:
    body.require_finite(operands)
    body.act(operation, operands, numbers)
    body.lobes += lobes


def _diffuse(body: Body, shader: shaders.Diffuse, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness)
    _add_lobe(body, DIFFUSE, (*map(body.value, parts), body.normal(shader.normal)))


def _translucent(body: Body, shader: shaders.Translucent, weight: Value) -> None:
    _add_lobe(body, TRANSLUCENT, (body.value(weight), body.value(shader.color), body.normal(shader.normal)))


def _transparent(body: Body, shader: shaders.Transparent, weight: Value) -> None:
    body.may_pass = True
    _add_lobe(body, TRANSPARENT, (body.value(weight), body.value(shader.color)))


def _glossy(body: Body, shader: shaders.Glossy, weight: Value) -> None:
    number_of(shader.distribution, _GLOSSY, "distribution")
    parts = (weight, shader.color, shader.roughness)
    operands = (*map(body.value, parts), body.normal(shader.normal))
    if shader.distribution == "cosine_power":
        _add_lobe(body, COSINE_POWER, operands)
    else:
        _add_lobe(body, GLOSSY, operands, (_multiscatter(shader),))


def _metallic(body: Body, shader: shaders.Metallic, weight: Value) -> None:
    parts = (weight, shader.base, shader.edge_tint, shader.roughness)
    operation = CONDUCTOR if shader.physical else METAL
    _add_lobe(body, operation, (*map(body.value, parts), body.normal(shader.normal)), (_multiscatter(shader),))


def _glass(body: Body, shader: shaders.Glass, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness, shader.ior)
    _add_lobe(body, GLASS, (*map(body.value, parts), body.normal(shader.normal)), (_multiscatter(shader),))


def _refraction(body: Body, shader: shaders.Refraction, weight: Value) -> None:
    parts = (weight, shader.color, shader.roughness, shader.ior)
    _add_lobe(body, REFRACTION, (*map(body.value, parts), body.normal(shader.normal)))


def _multiscatter(shader: shaders.Glossy | shaders.Metallic | shaders.Glass | shaders.Principled) -> int:
    return number_of(shader.distribution, _FACETS, "distribution of facets")


def _principled(body: Body, shader: shaders.Principled, weight: Value) -> None:
    parts = (
        weight, shader.base_color, shader.metallic, shader.roughness, shader.ior, shader.alpha,
        shader.diffuse_roughness, shader.specular_level, shader.specular_tint, shader.transmission,
        shader.coat, shader.coat_roughness, shader.coat_ior, shader.coat_tint,
    )  # fmt: skip
    emission = product(shader.emission_color, shader.emission_strength)
    operands = (
        *map(body.value, parts),
        body.value(emission),
        body.normal(shader.normal),
        body.normal(shader.coat_normal),
    )
    if not is_constant(shader.alpha, 1.0):
        body.may_pass = True
    _expect_emission(body, product(weight, emission))
    # The specular and the diffuse part are always there; the others where they are not 0 for sure.
    optional = (shader.metallic, shader.transmission, shader.coat, rest(shader.alpha))
    lobes = 2 + sum(not is_constant(value, 0.0) for value in optional)
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
