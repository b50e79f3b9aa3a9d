"""How much light one bounce off GGX facets leaves, and what that says about layers: tables and their lookup.

Light that bounces on from facet to facet is lost in the model of `microfacet`. What is left, by roughness and
direction, has no closed form; `make_albedo_tables` integrates it. From it follows by how much a surface has to be
brightened (`closures`), and how much of a layer is seen through a rough coat (`principled`).

Tables and purposes are those of Cycles 4.5, but entries lie closer where they are needed: near grazing angles, where
Cycles' interpolation is off by up to a tenth, and on the way out of glass, where it is and where Cycles besides counts
light that is refracted back to the side it came from as if it were kept. Interpolated albedos here are off by less than
1/150 of themselves, shares by less than 1/100, from a roughness of 0.05 and up to 89 degrees; most by 1/1000.

Roughness is what users see, the root of alpha. Cosines are the viewer's to the normal. Both are 0 to 1.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .jit import device
from .microfacet import bends_nothing, is_smooth, reach
from .warps import HALF, ONE, ZERO

FILE = Path(__file__).with_name("ggx_albedo.npz")

TWO_THIRDS = np.float32(2 / 3)
#: Keeps a ratio of cosines from being 0 / 0.
TINY = np.float32(1e-20)


class AlbedoTables(NamedTuple):
    """Float32, evenly spaced along axes from 0 to 1: the roughness; `_direction`, `_turn` or the root of the cosine;
    `_index`.

    An albedo is the share of the light that one bounce leaves in the viewer's direction; a mean is its average over the
    hemisphere, weighted with 2 cosine. Shares are how far a reflectance has gone from that head on to 1.
    """

    mirrors: np.ndarray  # (roughness, direction)
    mirrors_mean: np.ndarray  # (roughness)
    glass_in: np.ndarray  # (index, roughness, direction): the viewer is on the side of the lower index
    glass_in_mean: np.ndarray  # (index, roughness)
    glass_out: np.ndarray  # (index, roughness, direction): and here on the other side
    glass_out_mean: np.ndarray  # (index, roughness)
    dielectric_share: np.ndarray  # (index, roughness, root)
    dielectric_share_out: np.ndarray  # (index, roughness, turn)
    schlick_share: np.ndarray  # (roughness, root)


#: For scenes without facets, whose kernels look nothing up.
NO_TABLES = AlbedoTables(*(np.zeros((1,) * dimensions, np.float32) for dimensions in (2, 1, 3, 2, 3, 2, 3, 3, 2)))


@functools.cache
def load_tables() -> AlbedoTables:
    """The tables of all scenes with facets."""
    with np.load(FILE) as file:
        return AlbedoTables(*(file[name] for name in AlbedoTables._fields))


@device
def mirrors_albedo(tables: AlbedoTables, roughness: float, cosine: float) -> tuple[float, float]:
    """(albedo, mean) of facets without Fresnel."""
    alpha = roughness * roughness
    if is_smooth(alpha):
        return ONE, ONE
    albedo = _between_four(tables.mirrors, roughness, _direction(alpha, cosine))
    return albedo, _between_two(tables.mirrors_mean, roughness)


@device
def glass_albedo(tables: AlbedoTables, roughness: float, cosine: float, eta: float) -> tuple[float, float]:
    """(albedo, mean) of a dielectric's facets, which reflect or transmit. Eta is as in `fresnel`."""
    alpha = roughness * roughness
    if is_smooth(alpha) or bends_nothing(eta):
        return ONE, ONE
    table, means = (tables.glass_out, tables.glass_out_mean) if eta < ONE else (tables.glass_in, tables.glass_in_mean)
    direction = _direction(alpha, cosine)
    return _between_eight(table, _index(eta), roughness, direction), _between_four(means, _index(eta), roughness)


@device
def dielectric_share(tables: AlbedoTables, roughness: float, cosine: float, eta: float) -> float:
    """How far a dielectric's reflectance has gone, on average over the facets that the viewer sees."""
    if eta < ONE:
        return _between_eight(tables.dielectric_share_out, _index(eta), roughness, _turn(cosine, eta))
    return _between_eight(tables.dielectric_share, _index(eta), roughness, np.sqrt(cosine))


@device
def schlick_share(tables: AlbedoTables, roughness: float, cosine: float) -> float:
    """The same of Schlick's reflectance."""
    return _between_four(tables.schlick_share, roughness, np.sqrt(cosine))


@device
def _direction(alpha: float, cosine: float) -> float:
    """Where a direction is on its axis.

    What facets do to each other depends on the cosine in the space in which the distribution is a hemisphere, Fresnel
    on the cosine itself. The mean of both has entries where either needs them.
    """
    stretched = cosine / max(reach(alpha, cosine), TINY)
    return HALF * (np.sqrt(cosine) + stretched**TWO_THIRDS)


@device
def _turn(cosine: float, eta: float) -> float:
    """Where a direction is on the axis that has the critical angle of an eta below 1 in its middle.

    There the reflectance has a kink, which would be lost between entries, and a vertical tangent.
    """
    critical = np.sqrt((ONE - eta) * (ONE + eta))
    if cosine <= critical:
        return HALF - HALF * np.sqrt((critical - cosine) / max(critical, TINY))
    return HALF + HALF * np.sqrt((cosine - critical) / max(ONE - critical, TINY))


@device
def _index(eta: float) -> float:
    """Where an index of refraction, or its inverse, is on its axis: entries are close for indices close to 1."""
    return np.sqrt(abs(eta - ONE) / (eta + ONE))


@device
def _cell(place: float, entries: int) -> tuple[int, float]:
    """The entry before a place on an axis, and how far it is from there to the next. NaN is 0."""
    scaled = min(place if place > ZERO else ZERO, ONE) * np.float32(entries - 1)
    entry = min(np.int64(scaled), entries - 2)
    return entry, scaled - np.float32(entry)


@device
def _mix(a: float, b: float, part: float) -> float:
    return a + part * (b - a)


@device
def _between_two(table: np.ndarray, x: float) -> float:
    i, part = _cell(x, table.shape[0])
    return _mix(table[i], table[i + 1], part)


@device
def _between_four(table: np.ndarray, x: float, y: float) -> float:
    i, part = _cell(x, table.shape[0])
    return _mix(_between_two(table[i], y), _between_two(table[i + 1], y), part)


@device
def _between_eight(table: np.ndarray, x: float, y: float, z: float) -> float:
    i, part = _cell(x, table.shape[0])
    return _mix(_between_four(table[i], y, z), _between_four(table[i + 1], y, z), part)
