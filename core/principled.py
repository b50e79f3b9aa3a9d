"""Blender's Principled BSDF as lobes: layers and shares, each taking its light from those below it.

From the top: what alpha lets pass; the coat; emission; the metallic share; of the rest the transmitting share; then the
specular reflection over the diffuse one. A layer of glossy reflection leaves to those below it 1 less its albedo in the
viewer's direction, a grey factor that the brightest channel decides. All as Cycles 4.5 has it, without sheen,
subsurface scattering, thin films and anisotropy. See `closures` for what functions have in common.

That albedo is the one without Fresnel times a mean reflectance (`make_albedo_tables.dielectric_share`). In a white
furnace a white surface has 1.000 to 1.003 up to 87 degrees from the normal, whatever its roughness, and 1.005 at 89.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .albedo_tables import AlbedoTables, dielectric_share, mirrors_albedo
from .closures import (
    CUTOFF,
    LARGEST_INDEX,
    View,
    append_dielectric,
    append_f82,
    append_lobe,
    append_transparent,
    brightening,
    clamp_index,
    mean_dielectric_reflectance,
    one_bounce,
    set_color,
    set_facets,
    specular_normal,
)
from .fresnel import f0_from_ior, ior_from_f0, transmitted_cosine
from .jit import device, subroutine
from .lobe_record import (
    ALPHA,
    DIELECTRIC,
    EXPONENT,
    F0,
    F90,
    GGX_REFLECTION,
    LAMBERT,
    OREN_NAYAR,
    REFLECTION_TINT,
    SCHLICK,
    TRANSMISSION_TINT,
)
from .warps import HALF, ONE, TWO, ZERO, clamp01

THREE = np.float32(3)
#: Keeps the way through the coat finite.
TINY = np.float32(1e-6)


class Inputs(NamedTuple):
    """The node's inputs, named as in `shaders.Principled`, of any value: see `_in_range`."""

    base_r: float
    base_g: float
    base_b: float
    metallic: float
    roughness: float
    ior: float
    alpha: float
    diffuse_roughness: float
    specular_level: float
    specular_r: float
    specular_g: float
    specular_b: float
    transmission: float
    coat: float
    coat_roughness: float
    coat_ior: float
    coat_r: float
    coat_g: float
    coat_b: float
    multiscatter: bool


@subroutine
def append_principled(
    lobes: np.ndarray,
    at: int,
    weight: float,
    inputs: Inputs,
    nx: float,
    ny: float,
    nz: float,
    coat_nx: float,
    coat_ny: float,
    coat_nz: float,
    view: View,
    tables: AlbedoTables,
) -> tuple[int, float, float, float]:
    """Append up to 6 lobes; (where the next record begins, red, green, blue): the factor of the node's emission."""
    inputs, weight = _in_range(inputs), max(weight, ZERO)
    alpha, metallic, transmission = inputs.alpha, inputs.metallic, inputs.transmission
    sx, sy, sz = specular_normal(view, nx, ny, nz)
    at = append_transparent(lobes, at, weight * (ONE - alpha), ONE, ONE, ONE)
    at, r, g, b = _coat(lobes, at, weight * alpha, inputs, coat_nx, coat_ny, coat_nz, view, tables)
    emitted_r, emitted_g, emitted_b = r, g, b
    at = _metal(lobes, at, metallic * r, metallic * g, metallic * b, inputs, sx, sy, sz, view, tables)
    r, g, b = (ONE - metallic) * r, (ONE - metallic) * g, (ONE - metallic) * b
    at = _glass(lobes, at, transmission * r, transmission * g, transmission * b, inputs, sx, sy, sz, view, tables)
    r, g, b = (ONE - transmission) * r, (ONE - transmission) * g, (ONE - transmission) * b
    at, left = _specular(lobes, at, r, g, b, inputs, sx, sy, sz, view, tables)
    set_color(lobes, at + REFLECTION_TINT, min(inputs.base_r, ONE), min(inputs.base_g, ONE), min(inputs.base_b, ONE))
    lobes[at + ALPHA] = inputs.diffuse_roughness
    kind = OREN_NAYAR if inputs.diffuse_roughness >= CUTOFF else LAMBERT
    r, g, b = left * r * inputs.base_r, left * g * inputs.base_g, left * b * inputs.base_b
    at = append_lobe(lobes, at, kind, r, g, b, ONE, nx, ny, nz)
    return at, emitted_r, emitted_g, emitted_b


@device
def _in_range(inputs: Inputs) -> Inputs:
    """The inputs clamped as Cycles 4.5 does: shares and roughnesses to 0 to 1; colours, the coat and the specular level
    only from below; the coat's index from 1 and the other from just above 0, both to what can be computed with. Metal
    and glass take colours above 1 as 1.
    """
    return Inputs(
        base_r=max(inputs.base_r, ZERO),
        base_g=max(inputs.base_g, ZERO),
        base_b=max(inputs.base_b, ZERO),
        metallic=clamp01(inputs.metallic),
        roughness=clamp01(inputs.roughness),
        ior=clamp_index(inputs.ior),
        alpha=clamp01(inputs.alpha),
        diffuse_roughness=clamp01(inputs.diffuse_roughness),
        specular_level=max(inputs.specular_level, ZERO),
        specular_r=max(inputs.specular_r, ZERO),
        specular_g=max(inputs.specular_g, ZERO),
        specular_b=max(inputs.specular_b, ZERO),
        transmission=clamp01(inputs.transmission),
        coat=max(inputs.coat, ZERO),
        coat_roughness=clamp01(inputs.coat_roughness),
        coat_ior=min(max(inputs.coat_ior, ONE), LARGEST_INDEX),
        coat_r=max(inputs.coat_r, ZERO),
        coat_g=max(inputs.coat_g, ZERO),
        coat_b=max(inputs.coat_b, ZERO),
        multiscatter=inputs.multiscatter,
    )


@device
def _coat(
    lobes: np.ndarray,
    at: int,
    weight: float,
    inputs: Inputs,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> tuple[int, float, float, float]:
    """A clear dielectric, which tints what is below; (the next record, the weight that is left to the layers below).

    Light bounces between its facets whichever distribution is chosen.
    """
    if inputs.coat <= CUTOFF or weight < CUTOFF:
        return at, weight, weight, weight
    coat, roughness, index = inputs.coat, inputs.coat_roughness, inputs.coat_ior
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    cosine = clamp01(view.x * nx + view.y * ny + view.z * nz)
    single, mean = mirrors_albedo(tables, roughness, cosine)
    bright = brightening(single, mean, mean_dielectric_reflectance(index))
    albedo = single * _toward_one(f0_from_ior(index), dielectric_share(tables, roughness, cosine, index))
    set_facets(lobes, at, roughness, index, DIELECTRIC)
    over = coat * weight * bright
    at = append_lobe(lobes, at, GGX_REFLECTION, over, over, over, albedo, nx, ny, nz)
    left = weight * clamp01(ONE - coat * bright * albedo)
    # Beer's law: the tint is that of the way straight through the coat, and slanted ways are longer.
    length = ONE / max(transmitted_cosine(cosine, index), TINY)
    # A coat of more than 1 takes more than there is.
    return (
        at,
        left * max(ONE - coat * (ONE - inputs.coat_r**length), ZERO),
        left * max(ONE - coat * (ONE - inputs.coat_g**length), ZERO),
        left * max(ONE - coat * (ONE - inputs.coat_b**length), ZERO),
    )


@device
def _metal(
    lobes: np.ndarray,
    at: int,
    r: float,
    g: float,
    b: float,
    inputs: Inputs,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """The base colour head on; the specular tint is that of the edge."""
    if inputs.metallic <= CUTOFF:
        return at
    set_color(lobes, at + F0, min(inputs.base_r, ONE), min(inputs.base_g, ONE), min(inputs.base_b, ONE))
    set_color(lobes, at + F90, min(inputs.specular_r, ONE), min(inputs.specular_g, ONE), min(inputs.specular_b, ONE))
    return append_f82(lobes, at, r, g, b, inputs.roughness, inputs.multiscatter, nx, ny, nz, view, tables)


@device
def _glass(
    lobes: np.ndarray,
    at: int,
    r: float,
    g: float,
    b: float,
    inputs: Inputs,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Light that passes two surfaces takes the base colour, so one gives its root."""
    if inputs.transmission <= CUTOFF:
        return at
    set_color(lobes, at + F0, inputs.specular_r, inputs.specular_g, inputs.specular_b)
    set_color(lobes, at + REFLECTION_TINT, ONE, ONE, ONE)
    set_color(
        lobes,
        at + TRANSMISSION_TINT,
        np.sqrt(min(inputs.base_r, ONE)),
        np.sqrt(min(inputs.base_g, ONE)),
        np.sqrt(min(inputs.base_b, ONE)),
    )
    roughness, multiscatter = inputs.roughness, inputs.multiscatter
    return append_dielectric(lobes, at, r, g, b, roughness, inputs.ior, multiscatter, nx, ny, nz, view, tables)


@device
def _specular(
    lobes: np.ndarray,
    at: int,
    r: float,
    g: float,
    b: float,
    inputs: Inputs,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> tuple[int, float]:
    """(the next record, the share of light left to the diffuse layer).

    The specular level scales the reflectance head on, and with it the index of refraction that the curve follows.
    """
    index, level = inputs.ior, inputs.specular_level
    f0 = TWO * level * f0_from_ior(index)
    adjusted = ior_from_f0(f0)
    eta = index if level == HALF else (adjusted if index >= ONE else ONE / adjusted)
    if eta == ONE or r + g + b < THREE * CUTOFF:
        return at, ONE
    f0_r, f0_g, f0_b = clamp01(f0 * inputs.specular_r), clamp01(f0 * inputs.specular_g), clamp01(f0 * inputs.specular_b)
    roughness = inputs.roughness
    cosine = clamp01(view.x * nx + view.y * ny + view.z * nz)
    single, mean = one_bounce(tables, inputs.multiscatter, roughness, cosine)
    # How far the reflectance has gone from f0 to 1 on average over all directions, and over the facets in this one.
    head_on = f0_from_ior(eta)
    share = clamp01((mean_dielectric_reflectance(eta) - head_on) / (ONE - head_on))
    bright_r = brightening(single, mean, _toward_one(f0_r, share))
    bright_g = brightening(single, mean, _toward_one(f0_g, share))
    bright_b = brightening(single, mean, _toward_one(f0_b, share))
    share = dielectric_share(tables, roughness, cosine, eta)
    albedo_r, albedo_g, albedo_b = _toward_one(f0_r, share), _toward_one(f0_g, share), _toward_one(f0_b, share)
    set_color(lobes, at + F0, f0_r, f0_g, f0_b)
    set_color(lobes, at + F90, ONE, ONE, ONE)
    lobes[at + EXPONENT] = -eta
    set_facets(lobes, at, roughness, eta, SCHLICK)
    seen = single * (albedo_r + albedo_g + albedo_b) / THREE
    at = append_lobe(lobes, at, GGX_REFLECTION, r * bright_r, g * bright_g, b * bright_b, seen, nx, ny, nz)
    return at, clamp01(ONE - single * max(bright_r * albedo_r, bright_g * albedo_g, bright_b * albedo_b))


@device
def _toward_one(f0: float, share: float) -> float:
    return f0 + share * (ONE - f0)
