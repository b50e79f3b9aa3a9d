"""A surface's BSDF at one hit: the sum of its lobes, evaluated and sampled.

All directions are unit vectors in world space and point away from the surface: v to the viewer, l to the light (or to
where a path goes on), g is the triangle's own normal on the viewer's side. What a lobe reflects is 0 unless l lies
before the triangle and before the lobe's own normal, and what it transmits is 0 unless l lies behind both. Microfacets
and the cosine-power lobe are black to a viewer behind their normal.

Lobes of smooth mirrors and panes, and of transparency, are *deltas*: they have no density, so `evaluate_lobes` leaves
them out, and only `sample_lobes` finds their one direction.

Radiance that passes into a denser medium is not squeezed (multiplied with eta², Veach 1997, section 5.2), as in Cycles:
on the way out of the medium the factor would cancel.
"""

from __future__ import annotations

import numpy as np

from .batch import LANES, PACKET
from .cosine_power import cosine_power, cosine_power_brdf, cosine_power_pdf, square_to_cosine_power
from .diffuse import bump_share, oren_nayar, oren_nayar_tint
from .frames import tangents, to_world
from .fresnel import (
    conductor_reflectance,
    dielectric_reflectance,
    f82_reflectance,
    schlick_share,
    transmitted_cosine,
)
from .jit import device, subroutine
from .lobe_record import (
    ALPHA,
    CHANCE,
    CONDUCTOR,
    COSINE_POWER,
    DIELECTRIC,
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
    NORMAL,
    OREN_NAYAR,
    REFLECTION_TINT,
    SCHLICK,
    SMOOTH_NORMAL,
    TILT,
    TRANSLUCENT,
    TRANSMISSION_TINT,
    TRANSPARENT,
    WEIGHT,
)
from .microfacet import (
    bends_nothing,
    ggx_density,
    is_smooth,
    square_to_visible_facet,
    visible_and_lit_share,
    visible_share,
)
from .warps import BELOW_ONE, HALF, INV_PI, ONE, QUARTER, TWO, ZERO, clamp01, square_to_cosine_hemisphere

#: Directions of a density below this are given up: no sample in 10²⁰ has one, and it would be divided by.
RAREST = np.float32(1e-20)

#: What became of a sample: nothing, or the kind of lobe that its direction is from. STRAIGHT passes a transparent
#: surface as if it were not there.
ABSORBED, DIFFUSE_REFLECTION, GLOSSY_REFLECTION, DIFFUSE_TRANSMISSION, TRANSMISSION, STRAIGHT = range(6)

_THREE = np.float32(3)
_BLACK = (ZERO, ZERO, ZERO, ZERO)
_NOTHING = (ZERO, ZERO, ZERO, ZERO, ZERO, ZERO, ZERO, ABSORBED)
_NO_FACET = (ZERO, ZERO, ZERO, ZERO, ZERO, ZERO, ABSORBED, False)


@device
def first_lobe(i: int, lobe_stride: int) -> int:
    """Where the lobes of lane i begin in `Batch.lobes`, which has room for `lobe_stride` of each lane."""
    return (i // PACKET * LANES + i % PACKET) * lobe_stride * LOBE_SIZE


@subroutine
def evaluate_lobes(
    lobes: np.ndarray,
    first: int,
    count: int,
    vx: float,
    vy: float,
    vz: float,
    lx: float,
    ly: float,
    lz: float,
    gx: float,
    gy: float,
    gz: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Σ weight × BSDF × |cosine of l| over `count` lobes from `first` of `lobes` on, and the density of sampling l.

    (red, green, blue, density) of the diffuse lobes, and the same of all others. Rays of the two kinds are told apart,
    because things may be visible to one of them only: `sample_lobes` gives l by a diffuse lobe with the first density,
    per steradian, by another with the second. Translucency is diffuse, as in Cycles.
    """
    red = green = blue = density = chances = ZERO
    other_red = other_green = other_blue = other_density = ZERO
    before = gx * lx + gy * ly + gz * lz
    for k in range(count):
        at = first + k * LOBE_SIZE
        r, g, b, lobe_density = _evaluate_lobe(lobes, at, vx, vy, vz, lx, ly, lz, before)
        r, g, b = lobes[at + WEIGHT] * r, lobes[at + WEIGHT + 1] * g, lobes[at + WEIGHT + 2] * b
        chance = lobes[at + CHANCE]
        chances += chance
        kind = np.int64(lobes[at + KIND])
        if kind in (LAMBERT, OREN_NAYAR, TRANSLUCENT):
            red, green, blue, density = red + r, green + g, blue + b, density + chance * lobe_density
        else:
            other_red, other_green, other_blue = other_red + r, other_green + g, other_blue + b
            other_density += chance * lobe_density
    scale = ONE / chances if chances > ZERO else ZERO
    return red, green, blue, density * scale, other_red, other_green, other_blue, other_density * scale


@device
def _evaluate_lobe(
    lobes: np.ndarray,
    at: int,
    vx: float,
    vy: float,
    vz: float,
    lx: float,
    ly: float,
    lz: float,
    before: float,
) -> tuple[float, float, float, float]:
    """BSDF × |cosine of l| without the lobe's weight, and the density of l when this lobe is sampled."""
    kind = np.int64(lobes[at + KIND])
    nx, ny, nz = lobes[at + NORMAL], lobes[at + NORMAL + 1], lobes[at + NORMAL + 2]
    cosine_v, cosine_l = nx * vx + ny * vy + nz * vz, nx * lx + ny * ly + nz * lz
    if cosine_l > ZERO and before > ZERO:
        if kind in (LAMBERT, OREN_NAYAR):
            share = _share_past_bump(lobes, at, lx, ly, lz)
            if kind == LAMBERT:
                value = INV_PI * cosine_l
                return share * value, share * value, share * value, value
            v_dot_l = vx * lx + vy * ly + vz * lz
            return _evaluate_oren_nayar(lobes, at, share, max(cosine_v, ZERO), cosine_l, v_dot_l)
        if kind == COSINE_POWER and cosine_v > ZERO:
            twice = TWO * cosine_v
            x, y, z = twice * nx - vx - lx, twice * ny - vy - ly, twice * nz - vz - lz
            return _evaluate_cosine_power(lobes[at + ALPHA], cosine_l, x * x + y * y + z * z)
        if kind in (GGX_REFLECTION, GGX_GLASS) and cosine_v > ZERO:
            return _evaluate_reflection(lobes, at, kind, vx + lx, vy + ly, vz + lz, cosine_v, cosine_l)
    elif cosine_l < ZERO and before < ZERO:
        if kind == TRANSLUCENT:
            value = INV_PI * -cosine_l
            return value, value, value, value
        if kind in (GGX_REFRACTION, GGX_GLASS) and cosine_v > ZERO:
            return _evaluate_refraction(lobes, at, kind, vx, vy, vz, lx, ly, lz, cosine_v, -cosine_l)
    return _BLACK


@device
def _share_past_bump(lobes: np.ndarray, at: int, lx: float, ly: float, lz: float) -> float:
    """What of the light reaches a diffuse lobe whose normal a bump has tilted."""
    tilt, s = lobes[at + TILT], at + SMOOTH_NORMAL
    if tilt <= ZERO:
        return ONE
    return bump_share(tilt, lobes[s] * lx + lobes[s + 1] * ly + lobes[s + 2] * lz)


@device
def _evaluate_oren_nayar(
    lobes: np.ndarray, at: int, share: float, cosine_v: float, cosine_l: float, v_dot_l: float
) -> tuple[float, float, float, float]:
    roughness, lit = lobes[at + ALPHA], share * cosine_l
    once, more = oren_nayar(roughness, cosine_v, cosine_l, v_dot_l)
    return (
        lit * (once + more * oren_nayar_tint(roughness, lobes[at + REFLECTION_TINT])),
        lit * (once + more * oren_nayar_tint(roughness, lobes[at + REFLECTION_TINT + 1])),
        lit * (once + more * oren_nayar_tint(roughness, lobes[at + REFLECTION_TINT + 2])),
        INV_PI * cosine_l,
    )


@device
def _evaluate_cosine_power(
    exponent: float, cosine_l: float, distance_squared: float
) -> tuple[float, float, float, float]:
    power = cosine_power(exponent, distance_squared)
    value = cosine_power_brdf(exponent, power) * cosine_l
    return value, value, value, cosine_power_pdf(exponent, power)


@device
def _evaluate_reflection(
    lobes: np.ndarray, at: int, kind: int, hx: float, hy: float, hz: float, cosine_v: float, cosine_l: float
) -> tuple[float, float, float, float]:
    """h = v + l, twice as long as its cosine to either."""
    alpha = lobes[at + ALPHA]
    length = np.sqrt(hx * hx + hy * hy + hz * hz)
    if is_smooth(alpha) or length == ZERO:
        return _BLACK
    density = ggx_density(alpha, lobes[at + NORMAL], lobes[at + NORMAL + 1], lobes[at + NORMAL + 2], hx, hy, hz)
    red, green, blue, _, _, _, chance = _facet_shares(lobes, at, kind, HALF * length)
    # The facets that mirror v into a solid angle around l fill 1 / (4 v·h) of it.
    scale = QUARTER * density * visible_and_lit_share(alpha, cosine_v, cosine_l)
    return scale * red, scale * green, scale * blue, chance * QUARTER * density * visible_share(alpha, cosine_v)


@device
def _evaluate_refraction(
    lobes: np.ndarray,
    at: int,
    kind: int,
    vx: float,
    vy: float,
    vz: float,
    lx: float,
    ly: float,
    lz: float,
    cosine_v: float,
    cosine_l: float,
) -> tuple[float, float, float, float]:
    """`cosine_l` is that on the far side, above 0."""
    alpha, eta = lobes[at + ALPHA], lobes[at + ETA]
    if is_smooth(alpha) or bends_nothing(eta):
        return _BLACK
    nx, ny, nz = lobes[at + NORMAL], lobes[at + NORMAL + 1], lobes[at + NORMAL + 2]
    # v + eta l is along the facet's normal, on the side of the lower index (Walter et al. 2007, section 4.1).
    sign = -ONE if eta > ONE else ONE
    hx, hy, hz = sign * (vx + eta * lx), sign * (vy + eta * ly), sign * (vz + eta * lz)
    v_dot_h, l_dot_h = vx * hx + vy * hy + vz * hz, lx * hx + ly * hy + lz * hz
    # No facet refracts v to l where both are on one side of it. Cycles 4.5 takes light from there all the same if it
    # samples a light, not if it samples the BSDF: its rough refraction is too bright under large lights.
    if v_dot_h <= ZERO or l_dot_h >= ZERO or nx * hx + ny * hy + nz * hz <= ZERO:
        return _BLACK
    squared = hx * hx + hy * hy + hz * hz
    _, _, _, red, green, blue, chance = _facet_shares(lobes, at, kind, v_dot_h / np.sqrt(squared))
    density = ggx_density(alpha, nx, ny, nz, hx, hy, hz)
    # The facets that refract v into a solid angle around l fill eta² |l·h| / |v + eta l|² of it.
    density *= (v_dot_h / squared) * (-l_dot_h / squared) * eta * eta
    scale = density * visible_and_lit_share(alpha, cosine_v, cosine_l)
    chance = ONE - chance
    return scale * red, scale * green, scale * blue, chance * density * visible_share(alpha, cosine_v)


@device
def _facet_shares(
    lobes: np.ndarray, at: int, kind: int, cosine: float
) -> tuple[float, float, float, float, float, float, float]:
    """What a facet reflects (3) and transmits (3) of light at this cosine, and the chance that a sample reflects.

    The chance must not depend on anything but the two directions, for `evaluate_lobes` to find the same: a mirror that
    reflects nothing is sampled all the same, and glass that does neither is sampled as if it transmitted.
    """
    if kind == GGX_REFLECTION:
        red, green, blue = _reflectance(lobes, at, cosine)
        return red, green, blue, ZERO, ZERO, ZERO, ONE
    through = transmitted_cosine(cosine, lobes[at + ETA]) > ZERO
    if kind == GGX_REFRACTION:
        share = ONE if through else ZERO
        return ZERO, ZERO, ZERO, share, share, share, ZERO
    red, green, blue = _reflectance(lobes, at, cosine) if through else (ONE, ONE, ONE)
    through_red = (ONE - red) * lobes[at + TRANSMISSION_TINT]
    through_green = (ONE - green) * lobes[at + TRANSMISSION_TINT + 1]
    through_blue = (ONE - blue) * lobes[at + TRANSMISSION_TINT + 2]
    red *= lobes[at + REFLECTION_TINT]
    green *= lobes[at + REFLECTION_TINT + 1]
    blue *= lobes[at + REFLECTION_TINT + 2]
    reflected = red + green + blue
    both = reflected + through_red + through_green + through_blue
    chance = reflected / both if both > ZERO else ZERO
    return red, green, blue, through_red, through_green, through_blue, chance


@device
def _reflectance(lobes: np.ndarray, at: int, cosine: float) -> tuple[float, float, float]:
    """The lobe's Fresnel reflectance, per channel."""
    model = np.int64(lobes[at + FRESNEL])
    if model == DIELECTRIC:
        share = dielectric_reflectance(cosine, lobes[at + ETA])
        return share, share, share
    r, g, b = lobes[at + F0], lobes[at + F0 + 1], lobes[at + F0 + 2]
    x, y, z = lobes[at + F90], lobes[at + F90 + 1], lobes[at + F90 + 2]
    if model == SCHLICK:
        share = schlick_share(cosine, lobes[at + ETA], lobes[at + EXPONENT])
        return r + share * (x - r), g + share * (y - g), b + share * (z - b)
    if model == F82_TINT:
        return f82_reflectance(cosine, r, x), f82_reflectance(cosine, g, y), f82_reflectance(cosine, b, z)
    if model == CONDUCTOR:
        return (
            conductor_reflectance(cosine, r, x),
            conductor_reflectance(cosine, g, y),
            conductor_reflectance(cosine, b, z),
        )
    return ONE, ONE, ONE


@subroutine
def lobe_albedo(lobes: np.ndarray, at: int, vx: float, vy: float, vz: float) -> tuple[float, float, float]:
    """(red, green, blue): about what share of the light from all around the lobe at `at` sends to v, weight included.

    The lobe's chance over its weight is that share, as the channels' mean; they have it in proportion to what a facet
    reflects and transmits at v's angle.
    """
    r, g, b = lobes[at + WEIGHT], lobes[at + WEIGHT + 1], lobes[at + WEIGHT + 2]
    kind, weights, shares = np.int64(lobes[at + KIND]), r + g + b, _THREE
    if kind in (GGX_REFLECTION, GGX_REFRACTION, GGX_GLASS):
        cosine = vx * lobes[at + NORMAL] + vy * lobes[at + NORMAL + 1] + vz * lobes[at + NORMAL + 2]
        red, green, blue, through_red, through_green, through_blue, _ = _facet_shares(lobes, at, kind, clamp01(cosine))
        red, green, blue = red + through_red, green + through_green, blue + through_blue
        r, g, b, shares = r * red, g * green, b * blue, red + green + blue
    scale = _THREE * _THREE * lobes[at + CHANCE] / (weights * shares) if weights * shares > ZERO else ZERO
    return scale * r, scale * g, scale * b


@subroutine
def sample_lobes(
    lobes: np.ndarray,
    first: int,
    count: int,
    vx: float,
    vy: float,
    vz: float,
    gx: float,
    gy: float,
    gz: float,
    choice: float,
    u: float,
    v: float,
) -> tuple[float, float, float, float, float, float, float, int]:
    """(x, y, z, red, green, blue, density, event): where a path goes on from `count` lobes from `first` of `lobes` on.

    `choice` picks a lobe by its chance, (u, v) the direction; all are in [0, 1). The colour is what the path's
    throughput is multiplied with: BSDF × |cosine| / density of all diffuse lobes together, or of all others, whichever
    the picked one is of; or that of the delta that was picked over the chance of picking it. The density is per
    steradian, 0 of a delta. Of ABSORBED all is 0.
    """
    at, share, rest = _pick_lobe(lobes, first, count, choice)
    if share <= ZERO:
        return _NOTHING
    kind = np.int64(lobes[at + KIND])
    if kind == TRANSPARENT:
        r, g, b = lobes[at + WEIGHT], lobes[at + WEIGHT + 1], lobes[at + WEIGHT + 2]
        return -vx, -vy, -vz, r / share, g / share, b / share, ZERO, STRAIGHT
    if kind in (GGX_REFLECTION, GGX_REFRACTION, GGX_GLASS):
        x, y, z, r, g, b, event, delta = _sample_facet(lobes, at, kind, vx, vy, vz, rest, u, v)
    else:
        x, y, z, event = _sample_broad(lobes, at, kind, vx, vy, vz, u, v)
        r, g, b, delta = ZERO, ZERO, ZERO, False
    if event == ABSORBED or not _leaves(lobes, at, event, x, y, z, gx * x + gy * y + gz * z):
        return _NOTHING
    if delta:
        return x, y, z, r / share, g / share, b / share, ZERO, event
    r, g, b, density, other_r, other_g, other_b, other_density = evaluate_lobes(
        lobes, first, count, vx, vy, vz, x, y, z, gx, gy, gz
    )
    if event in (GLOSSY_REFLECTION, TRANSMISSION):
        r, g, b, density = other_r, other_g, other_b, other_density
    if density < RAREST:
        return _NOTHING
    return x, y, z, r / density, g / density, b / density, density, event


@device
def _leaves(lobes: np.ndarray, at: int, event: int, x: float, y: float, z: float, before: float) -> bool:
    """Whether a direction is on the side that its event says, of the triangle and of the normal that it is from.

    What another lobe makes of it does not matter: the density is that of directions which their own lobe lets pass.
    """
    above = lobes[at + NORMAL] * x + lobes[at + NORMAL + 1] * y + lobes[at + NORMAL + 2] * z
    if event in (DIFFUSE_REFLECTION, GLOSSY_REFLECTION):
        return above > ZERO and before > ZERO
    return above < ZERO and before < ZERO


@device
def _pick_lobe(lobes: np.ndarray, first: int, count: int, choice: float) -> tuple[int, float, float]:
    """(where the lobe is, how likely it was, what is left of `choice`: a number in [0, 1))."""
    total = ZERO
    for k in range(count):
        total += lobes[first + k * LOBE_SIZE + CHANCE]
    at, chance, left, wanted = first, ZERO, ZERO, choice * total
    for k in range(count):
        here = first + k * LOBE_SIZE
        # Rounding may leave a little behind the last lobe: then that is it.
        if wanted >= ZERO and lobes[here + CHANCE] > ZERO:
            at, chance, left = here, lobes[here + CHANCE], wanted
        wanted -= lobes[here + CHANCE]
    if chance <= ZERO:
        return at, ZERO, ZERO
    return at, chance / total, min(left / chance, BELOW_ONE)


@device
def _sample_broad(
    lobes: np.ndarray, at: int, kind: int, vx: float, vy: float, vz: float, u: float, v: float
) -> tuple[float, float, float, int]:
    """(direction, event) from a lobe that is not of microfacets."""
    nx, ny, nz = lobes[at + NORMAL], lobes[at + NORMAL + 1], lobes[at + NORMAL + 2]
    if kind == COSINE_POWER:
        cosine_v = nx * vx + ny * vy + nz * vz
        if cosine_v <= ZERO:
            return ZERO, ZERO, ZERO, ABSORBED
        x, y, z = square_to_cosine_power(u, v, lobes[at + ALPHA])
        twice = TWO * cosine_v
        x, y, z = to_world(x, y, z, twice * nx - vx, twice * ny - vy, twice * nz - vz)
        return x, y, z, GLOSSY_REFLECTION
    x, y, z = square_to_cosine_hemisphere(u, v)
    x, y, z = to_world(x, y, z, nx, ny, nz)
    if kind == TRANSLUCENT:
        return -x, -y, -z, DIFFUSE_TRANSMISSION
    return x, y, z, DIFFUSE_REFLECTION


@device
def _sample_facet(
    lobes: np.ndarray, at: int, kind: int, vx: float, vy: float, vz: float, choice: float, u: float, v: float
) -> tuple[float, float, float, float, float, float, int, bool]:
    """(direction, colour if it is a delta, event, whether it is): v mirrored or refracted by a facet that it sees.

    `choice` decides between the two in glass. The colour of a delta is weight × share of the facet / chance of that.
    """
    nx, ny, nz = lobes[at + NORMAL], lobes[at + NORMAL + 1], lobes[at + NORMAL + 2]
    if nx * vx + ny * vy + nz * vz <= ZERO:
        return _NO_FACET
    eta, smooth = lobes[at + ETA], is_smooth(lobes[at + ALPHA])
    hx, hy, hz = (nx, ny, nz) if smooth else _sample_normal(lobes[at + ALPHA], vx, vy, vz, nx, ny, nz, u, v)
    cosine = max(hx * vx + hy * vy + hz * vz, ZERO)
    red, green, blue, through_red, through_green, through_blue, chance = _facet_shares(lobes, at, kind, cosine)
    if choice < chance:
        x, y, z = TWO * cosine * hx - vx, TWO * cosine * hy - vy, TWO * cosine * hz - vz
        event, delta = GLOSSY_REFLECTION, smooth
    elif transmitted_cosine(cosine, eta) > ZERO:
        x, y, z = _refract(vx, vy, vz, hx, hy, hz, cosine, eta)
        event, delta = TRANSMISSION, smooth or bends_nothing(eta)
        red, green, blue, chance = through_red, through_green, through_blue, ONE - chance
    else:
        return _NO_FACET
    red = lobes[at + WEIGHT] * red / chance
    green = lobes[at + WEIGHT + 1] * green / chance
    blue = lobes[at + WEIGHT + 2] * blue / chance
    return x, y, z, red, green, blue, event, delta


@device
def _sample_normal(
    alpha: float, vx: float, vy: float, vz: float, nx: float, ny: float, nz: float, u: float, v: float
) -> tuple[float, float, float]:
    """`square_to_visible_facet` in world space."""
    ax, ay, az, bx, by, bz = tangents(nx, ny, nz)
    x, y, z = square_to_visible_facet(
        u,
        v,
        alpha,
        ax * vx + ay * vy + az * vz,
        bx * vx + by * vy + bz * vz,
        nx * vx + ny * vy + nz * vz,
    )
    return x * ax + y * bx + z * nx, x * ay + y * by + z * ny, x * az + y * bz + z * nz


@device
def _refract(
    vx: float, vy: float, vz: float, hx: float, hy: float, hz: float, cosine: float, eta: float
) -> tuple[float, float, float]:
    """v passed through a facet with the normal h, to which it has this cosine (Snell's law)."""
    along = cosine - eta * transmitted_cosine(cosine, eta)
    x, y, z = along * hx - vx, along * hy - vy, along * hz - vz
    scale = ONE / np.sqrt(x * x + y * y + z * z)
    return scale * x, scale * y, scale * z
