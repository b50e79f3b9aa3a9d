"""What Blender's shader nodes put on a surface at one hit: each function appends a node's lobes to a list of them.

`lobes` is a flat float32 array and `at` where its next record (`lobe_record`) begins; what is returned is where the one
after that does: `at` itself if there is nothing to reflect. The record at `at` may be written to all the same. `weight`
is the node's share of the surface, colours (r, g, b) are the node's own, without that share: the light between the
facets of a rough surface is tinted by the colour alone. Both are taken as 0 where they are negative.

n is the lobe's unit normal in world space, on the viewer's side, as it comes from interpolation or a normal map; for
mirrors it is bent where it has to be, see `specular_normal`.

Everything is as Cycles 4.5 has it, except that the tables are closer to what they stand for (`albedo_tables`), that
conductors follow Fresnel's equations, which Cycles approximates, and that colours above 1 do not make the light between
the facets grow from bounce to bounce. With `multiscatter` the light that single scattering loses is given back by
brightening what it leaves (Turquin 2019), tinted as it would be by the bounces that are missing (Kulla and Conty 2017):
an approximation, but without colour or Fresnel it loses nothing in any direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import limits
from .albedo_tables import AlbedoTables, dielectric_share, glass_albedo, mirrors_albedo, schlick_share
from .fresnel import SCHLICK_AT_82, conductor_reflectance, dielectric_reflectance, f0_from_ior, f82_coefficient
from .jit import device, subroutine
from .lobe_record import (
    ALPHA,
    CHANCE,
    CONDUCTOR,
    COSINE_POWER,
    ETA,
    EXPONENT,
    F0,
    F82_TINT,
    F90,
    FRESNEL,
    GGX_GLASS,
    GGX_REFLECTION,
    GGX_REFRACTION,
    KIND,
    LAMBERT,
    LOBE_SIZE,
    NO_FRESNEL,
    NORMAL,
    OREN_NAYAR,
    REFLECTION_TINT,
    SCHLICK,
    TRANSLUCENT,
    TRANSMISSION_TINT,
    TRANSPARENT,
    WEIGHT,
)
from .warps import ONE, TWO, ZERO, clamp01

THREE = np.float32(3)
#: Lobes of less weight than this, and roughnesses of matt surfaces, are left out.
CUTOFF = np.float32(1e-5)
INFINITY = np.float32(np.inf)
LEAST_INDEX, LARGEST_INDEX = np.float32(limits.LEAST_INDEX), np.float32(limits.LARGEST_INDEX)
#: Of less light than this that glass lets pass, tables do not tell how much is lost between its facets.
LEAST_PASSING = np.float32(0.05)
#: How steep a mirrored ray has to leave the triangle at least: this, or the share of the viewer's own steepness.
LEAST_RISE, SHARE_OF_RISE = np.float32(0.01), np.float32(0.9)
#: Sharper than this a cosine-power lobe is a perfect mirror.
LARGEST_EXPONENT = np.float32(1e6)
#: Schlick's (1 - cosine)⁵ and the F82 model's cosine (1 - cosine)⁶ on average, weighted with 2 cosine.
MEAN_SCHLICK, MEAN_DIP = np.float32(1 / 21), np.float32(1 / 126)
#: The cosine of the F82 model's second angle.
COSINE_AT_82 = np.float32(1 / 7)


class View(NamedTuple):
    """How a surface is looked at. Unit vectors in world space."""

    x: float  # (3) to the viewer
    y: float
    z: float
    gx: float  # (3) the triangle's normal, on the viewer's side
    gy: float
    gz: float
    front: bool  # whether that is the triangle's front: else the viewer is inside of what it bounds


# Without facets


@device
def append_diffuse(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    roughness: float,
    nx: float,
    ny: float,
    nz: float,
) -> int:
    """Diffuse BSDF: Lambert's lobe, or above a roughness of 0 Oren and Nayar's."""
    rough = roughness >= CUTOFF
    lobes[at + ALPHA] = clamp01(roughness)
    set_color(lobes, at + REFLECTION_TINT, clamp01(r), clamp01(g), clamp01(b))
    r, g, b = weight * r, weight * g, weight * b
    return append_lobe(lobes, at, OREN_NAYAR if rough else LAMBERT, r, g, b, ONE, nx, ny, nz)


@device
def append_translucent(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    nx: float,
    ny: float,
    nz: float,
    view: View,
) -> int:
    """Translucent BSDF."""
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    return append_lobe(lobes, at, TRANSLUCENT, weight * r, weight * g, weight * b, ONE, nx, ny, nz)


@device
def append_transparent(lobes: np.ndarray, at: int, weight: float, r: float, g: float, b: float) -> int:
    """Transparent BSDF."""
    return append_lobe(lobes, at, TRANSPARENT, weight * r, weight * g, weight * b, ONE, ZERO, ZERO, ONE)


# With facets


@subroutine
def append_glossy(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    roughness: float,
    multiscatter: bool,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Glossy BSDF: facets that mirror everything, tinted."""
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    roughness = clamp01(roughness)
    single, mean = one_bounce(tables, multiscatter, roughness, view.x * nx + view.y * ny + view.z * nz)
    set_facets(lobes, at, roughness, ONE, NO_FRESNEL)
    r *= weight * brightening(single, mean, r)
    g *= weight * brightening(single, mean, g)
    b *= weight * brightening(single, mean, b)
    return append_lobe(lobes, at, GGX_REFLECTION, r, g, b, single, nx, ny, nz)


@device
def append_cosine_power(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    roughness: float,
    nx: float,
    ny: float,
    nz: float,
    view: View,
) -> int:
    """Glossy BSDF with the textbook's lobe, as wide as that of facets of this roughness.

    Facets at the angle θ to the normal mirror to 2θ. Their density falls like exp(-θ² / alpha²) (Walter et al. 2007),
    and cosᵉ like exp(-e (2θ)² / 2): the exponent is 1 / (2 alpha²), less 1/2 so that it is 0 for a roughness of 1.

    A lobe that is too sharp for that is a perfect mirror, which reflects all light: from the side that is a jump, for
    the sharpest lobes reflect but the cosine (`cosine_power`).
    """
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    alpha = clamp01(roughness) * clamp01(roughness)
    sharp = TWO * alpha * alpha < ONE / LARGEST_EXPONENT
    exponent = (ONE - alpha * alpha) / max(TWO * alpha * alpha, ONE / LARGEST_EXPONENT)
    set_facets(lobes, at, ZERO, ONE, NO_FRESNEL)
    lobes[at + ALPHA] = ZERO if sharp else exponent
    kind = GGX_REFLECTION if sharp else COSINE_POWER
    return append_lobe(lobes, at, kind, weight * r, weight * g, weight * b, ONE, nx, ny, nz)


@subroutine
def append_tinted_metal(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    edge_r: float,
    edge_g: float,
    edge_b: float,
    roughness: float,
    multiscatter: bool,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Metallic BSDF, F82 tint: (r, g, b) head on, tinted by the edge's colour near 82 degrees."""
    set_color(lobes, at + F0, clamp01(r), clamp01(g), clamp01(b))
    set_color(lobes, at + F90, clamp01(edge_r), clamp01(edge_g), clamp01(edge_b))
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    return append_f82(lobes, at, weight, weight, weight, clamp01(roughness), multiscatter, nx, ny, nz, view, tables)


@subroutine
def append_f82(
    lobes: np.ndarray,
    at: int,
    r: float,
    g: float,
    b: float,
    roughness: float,
    multiscatter: bool,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Metal whose record has the colour head on in F0 and the edge's tint in F90; (r, g, b) is its weight."""
    cosine = clamp01(view.x * nx + view.y * ny + view.z * nz)
    single, mean = one_bounce(tables, multiscatter, roughness, cosine)
    share = schlick_share(tables, roughness, cosine)
    f0_r, f0_g, f0_b = lobes[at + F0], lobes[at + F0 + 1], lobes[at + F0 + 2]
    dip_r = f82_coefficient(f0_r, lobes[at + F90])
    dip_g = f82_coefficient(f0_g, lobes[at + F90 + 1])
    dip_b = f82_coefficient(f0_b, lobes[at + F90 + 2])
    set_color(lobes, at + F90, dip_r, dip_g, dip_b)
    set_facets(lobes, at, roughness, ONE, F82_TINT)
    r *= brightening(single, mean, mean_f82_reflectance(f0_r, dip_r))
    g *= brightening(single, mean, mean_f82_reflectance(f0_g, dip_g))
    b *= brightening(single, mean, mean_f82_reflectance(f0_b, dip_b))
    seen = single * (share + (ONE - share) * (f0_r + f0_g + f0_b) / THREE)
    return append_lobe(lobes, at, GGX_REFLECTION, r, g, b, seen, nx, ny, nz)


@subroutine
def append_conductor(
    lobes: np.ndarray,
    at: int,
    weight: float,
    n_r: float,
    n_g: float,
    n_b: float,
    k_r: float,
    k_g: float,
    k_b: float,
    roughness: float,
    multiscatter: bool,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Metallic BSDF, physical conductor: index of refraction n and extinction k of each channel."""
    n_r, n_g, n_b = max(n_r, ZERO), max(n_g, ZERO), max(n_b, ZERO)
    k_r, k_g, k_b = max(k_r, ZERO), max(k_g, ZERO), max(k_b, ZERO)
    roughness = clamp01(roughness)
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    cosine = clamp01(view.x * nx + view.y * ny + view.z * nz)
    single, mean = one_bounce(tables, multiscatter, roughness, cosine)
    set_color(lobes, at + F0, n_r, n_g, n_b)
    set_color(lobes, at + F90, k_r, k_g, k_b)
    set_facets(lobes, at, roughness, ONE, CONDUCTOR)
    r = weight * brightening(single, mean, mean_conductor_reflectance(n_r, k_r))
    g = weight * brightening(single, mean, mean_conductor_reflectance(n_g, k_g))
    b = weight * brightening(single, mean, mean_conductor_reflectance(n_b, k_b))
    reflectance = conductor_reflectance(cosine, n_r, k_r) + conductor_reflectance(cosine, n_g, k_g)
    seen = single * (reflectance + conductor_reflectance(cosine, n_b, k_b)) / THREE
    return append_lobe(lobes, at, GGX_REFLECTION, r, g, b, seen, nx, ny, nz)


@subroutine
def append_glass(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    roughness: float,
    ior: float,
    multiscatter: bool,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Glass BSDF: tinted whether it reflects or transmits."""
    r, g, b = max(r, ZERO), max(g, ZERO), max(b, ZERO)
    set_color(lobes, at + F0, ONE, ONE, ONE)
    set_color(lobes, at + REFLECTION_TINT, r, g, b)
    set_color(lobes, at + TRANSMISSION_TINT, r, g, b)
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    return append_dielectric(
        lobes, at, weight, weight, weight, clamp01(roughness), ior, multiscatter, nx, ny, nz, view, tables
    )


@subroutine
def append_dielectric(
    lobes: np.ndarray,
    at: int,
    r: float,
    g: float,
    b: float,
    roughness: float,
    ior: float,
    multiscatter: bool,
    nx: float,
    ny: float,
    nz: float,
    view: View,
    tables: AlbedoTables,
) -> int:
    """Glass whose record has both tints, and in F0 the tint of what is reflected head on; its weight is (r, g, b).

    Most of the light that bounces between the facets goes through in the end, so it takes the transmitted light's tint.
    """
    index = clamp_index(ior)
    eta = index if view.front else ONE / index
    cosine = clamp01(view.x * nx + view.y * ny + view.z * nz)
    single, mean = glass_albedo(tables, roughness, cosine, eta) if multiscatter else (ONE, ONE)
    seen, head_on = ZERO, f0_from_ior(index)
    reflectance = dielectric_reflectance(cosine, eta)
    for channel in range(3):
        tint = lobes[at + TRANSMISSION_TINT + channel]
        seen += (reflectance * lobes[at + REFLECTION_TINT + channel] + (ONE - reflectance) * tint) / THREE
        lobes[at + F0 + channel] = clamp01(head_on * lobes[at + F0 + channel])
        lobes[at + F90 + channel] = ONE
    lobes[at + EXPONENT] = -eta
    set_facets(lobes, at, roughness, eta, SCHLICK)
    single_r = single_g = single_b = single
    if multiscatter and not (lobes[at + F0] == lobes[at + F0 + 1] == lobes[at + F0 + 2] == head_on):
        single_r = tinted_glass_albedo(tables, roughness, cosine, eta, single, lobes[at + F0])
        single_g = tinted_glass_albedo(tables, roughness, cosine, eta, single, lobes[at + F0 + 1])
        single_b = tinted_glass_albedo(tables, roughness, cosine, eta, single, lobes[at + F0 + 2])
    r *= brightening(single_r, mean, lobes[at + TRANSMISSION_TINT])
    g *= brightening(single_g, mean, lobes[at + TRANSMISSION_TINT + 1])
    b *= brightening(single_b, mean, lobes[at + TRANSMISSION_TINT + 2])
    return append_lobe(lobes, at, GGX_GLASS, r, g, b, single * seen, nx, ny, nz)


@device
def tinted_glass_albedo(
    tables: AlbedoTables, roughness: float, cosine: float, eta: float, single: float, f0: float
) -> float:
    """`single`, the albedo of glass after one bounce, where it reflects f0 head on and not what its eta does.

    Facets leave less of what they reflect than of what they let pass. With s the share of the way from f0 to 1 that
    the reflectance R has gone, the albedo is R × that of mirrors + (1 - R) × that of panes, which therefore is known.
    """
    mirrors, _ = mirrors_albedo(tables, roughness, cosine)
    head_on, share = f0_from_ior(eta), dielectric_share(tables, roughness, cosine, eta)
    passes = (ONE - head_on) * (ONE - share)
    panes = (single - (ONE - passes) * mirrors) / passes if passes > LEAST_PASSING else ONE
    return single + (head_on - f0) * (ONE - share) * (min(max(panes, mirrors), ONE) - mirrors)


@device
def clamp_index(ior: float) -> float:
    """The nearest index of refraction that can be computed with."""
    return min(max(ior, LEAST_INDEX), LARGEST_INDEX)


@subroutine
def append_refraction(
    lobes: np.ndarray,
    at: int,
    weight: float,
    r: float,
    g: float,
    b: float,
    roughness: float,
    ior: float,
    nx: float,
    ny: float,
    nz: float,
    view: View,
) -> int:
    """Refraction BSDF."""
    index = clamp_index(ior)
    nx, ny, nz = specular_normal(view, nx, ny, nz)
    set_facets(lobes, at, clamp01(roughness), index if view.front else ONE / index, NO_FRESNEL)
    return append_lobe(lobes, at, GGX_REFRACTION, weight * r, weight * g, weight * b, ONE, nx, ny, nz)


# What they share


@device
def append_lobe(
    lobes: np.ndarray,
    at: int,
    kind: int,
    r: float,
    g: float,
    b: float,
    share: float,
    nx: float,
    ny: float,
    nz: float,
) -> int:
    """Fill in what all lobes have: their weight (r, g, b), and the chance from the share of light that they reflect.

    Weights that are too large to be added up, or not numbers, leave no lobe; `instructions.REQUIRE_FINITE` tells of
    them.
    """
    r, g, b = max(r, ZERO), max(g, ZERO), max(b, ZERO)
    mean = (r + g + b) / THREE
    chance = mean * share
    lobes[at + KIND] = np.float32(kind)
    set_color(lobes, at + WEIGHT, r, g, b)
    lobes[at + CHANCE] = chance
    set_color(lobes, at + NORMAL, nx, ny, nz)
    return at + LOBE_SIZE if mean >= CUTOFF and ZERO < chance < INFINITY else at


@device
def specular_normal(view: View, nx: float, ny: float, nz: float) -> tuple[float, float, float]:
    """The normal nearest to n for which the triangle does not block what a mirror reflects to the viewer.

    Interpolated and mapped normals can ask for light from below the triangle, which would be black. n is turned towards
    the triangle's normal g, in the plane of both, until v is mirrored to just above the triangle: to LEAST_RISE, or if
    the viewer is lower than that, to nearly the viewer's height. Whatever the part of v out of that plane is, its
    mirror image rises as that of the part within: so the normal wanted is halfway between that part and the lowest
    direction allowed, both one long.
    """
    rise = view.x * view.gx + view.y * view.gy + view.z * view.gz
    facing = nx * view.x + ny * view.y + nz * view.z
    upright = nx * view.gx + ny * view.gy + nz * view.gz
    least = min(SHARE_OF_RISE * rise, LEAST_RISE)
    if TWO * facing * upright - rise >= least or rise <= ZERO:
        return nx, ny, nz
    x, y, z = nx - upright * view.gx, ny - upright * view.gy, nz - upright * view.gz
    length = np.sqrt(x * x + y * y + z * z)
    if length == ZERO:
        return nx, ny, nz
    x, y, z = x / length, y / length, z / length
    aside = view.x * x + view.y * y + view.z * z
    within = np.sqrt(aside * aside + rise * rise)
    least /= within
    across, up = aside / within + np.sqrt(max(ONE - least * least, ZERO)), rise / within + least
    scale = ONE / np.sqrt(across * across + up * up)
    across, up = scale * across, scale * up
    return across * x + up * view.gx, across * y + up * view.gy, across * z + up * view.gz


@device
def brightening(single: float, mean: float, fresnel: float) -> float:
    """What light after one bounce is multiplied with for that after more.

    `single` is the share that one bounce leaves in the viewer's direction, `mean` on average, of facets without
    Fresnel; `fresnel` is what the facets reflect on average (Kulla and Conty 2017, appendix).
    """
    share = clamp01(fresnel)
    return ONE + share * mean / (ONE - share * (ONE - mean)) * (ONE - single) / single


@device
def mean_dielectric_reflectance(eta: float) -> float:
    """Fresnel's reflectance averaged over the hemisphere, weighted with 2 cosine: a fit (Kulla and Conty 2017)."""
    if eta < ONE:
        return np.float32(0.997118) + eta * (
            np.float32(0.1014) - eta * (np.float32(0.965241) + eta * np.float32(0.130607))
        )
    return (eta - ONE) / (np.float32(4.08567) + np.float32(1.00071) * eta)


@device
def mean_f82_reflectance(f0: float, dip: float) -> float:
    """The same of `f82_reflectance`, exactly."""
    return f0 + (ONE - f0) * MEAN_SCHLICK - dip * MEAN_DIP


@device
def mean_conductor_reflectance(n: float, k: float) -> float:
    """The same of a conductor: that of the F82 curve which has its values head on and near 82 degrees."""
    f0 = conductor_reflectance(ONE, n, k)
    tint = conductor_reflectance(COSINE_AT_82, n, k) / (f0 + (ONE - f0) * SCHLICK_AT_82)
    return mean_f82_reflectance(f0, f82_coefficient(f0, tint))


@device
def one_bounce(tables: AlbedoTables, multiscatter: bool, roughness: float, cosine: float) -> tuple[float, float]:
    """What `brightening` needs to know of mirrors: nothing is missing where nothing is to be given back."""
    return mirrors_albedo(tables, roughness, clamp01(cosine)) if multiscatter else (ONE, ONE)


@device
def set_facets(lobes: np.ndarray, at: int, roughness: float, eta: float, fresnel: int) -> None:
    lobes[at + ALPHA] = roughness * roughness
    lobes[at + ETA] = eta
    lobes[at + FRESNEL] = np.float32(fresnel)


@device
def set_color(lobes: np.ndarray, at: int, r: float, g: float, b: float) -> None:
    lobes[at], lobes[at + 1], lobes[at + 2] = r, g, b
