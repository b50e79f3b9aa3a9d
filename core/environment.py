"""The world as a light: panoramas, and directions as likely as a picture of the world is bright.

A panorama's u runs from -X over +Y, +X and -Y back to -X for u = 0, 1/4, 1/2, 3/4, 1 as Blender's equirectangular
environments do, v from straight down (0) to straight up (1). Pictures are bottom row first, as Blender keeps images.

An `EnvironmentMap` holds a density over the sphere that is constant in each cell of such a picture. Directions are
chosen row by row and then along the row, by inverting the cumulative distributions (Pharr, Jakob and Humphreys 2023,
section 12.5), so that even points of the square stay even over bright regions. The picture is only a sample of the
world, which may be bright where the picture is black: a small share of the directions is spread evenly over the sphere
whatever the picture says, as a defensive mixture (Hesterberg 1995; Owen and Zhou 2000).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .arctangent import arctan2
from .jit import device, kernel, subroutine
from .warps import (
    BELOW_ONE,
    HALF,
    INV_PI,
    INV_TWO_PI,
    ONE,
    PI,
    TWO,
    TWO_PI,
    ZERO,
    cos_sin,
)

#: How much of the density is spread evenly over the sphere. A direction that the picture has black is worth at most
#: 4π / this share times the world's radiance there.
EVEN_SHARE = 0.01
#: The largest side of a picture, in cells: `EnvironmentMap` counts them in 16 bits.
LARGEST_SIDE = 2**16 - 1
#: Luminance of linear Rec.709.
_LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)
#: Directions keep so far off a cell's border, in units of the whole panorama's width or height, that rounding puts
#: none of them on the other side: 3 times the largest error of `direction_to_panorama`.
_CLEARANCE = np.float32(5e-7)


@device
def direction_to_panorama(dx: float, dy: float, dz: float) -> tuple[float, float]:
    """(u, v) in [0, 1]² of a direction, which need not be of unit length. u is 1/2 at the poles.

    Next to straight down v keeps its relative precision, next to straight up only 1 - v's absolute one.
    """
    return HALF - arctan2(dy, dx) * INV_TWO_PI, arctan2(np.sqrt(dx * dx + dy * dy), -dz) * INV_PI


@device
def panorama_to_direction(u: float, v: float) -> tuple[float, float, float]:
    """The unit vector of a place in a panorama, the inverse of `direction_to_panorama`."""
    cosine, sine = cos_sin(PI - u * TWO_PI)
    low = v < HALF
    pole_cosine, pole_sine = cos_sin(PI * (v if low else ONE - v))
    return pole_sine * cosine, pole_sine * sine, (-pole_cosine if low else pole_cosine)


@device
def direction_to_mirror_ball(dx: float, dy: float, dz: float) -> tuple[float, float]:
    """(u, v) of a unit vector in a picture of a mirroring ball taken along +Y from far away, as Blender's.

    The ball fills the picture's inscribed disk. -Y is its middle and +Y all of its rim; of that (1/2, 1/2) is returned.
    """
    # 1 - y, from x and z where it would cancel.
    depth = ONE - dy if dy < ZERO else (dx * dx + dz * dz) / (ONE + dy)
    scale = HALF / np.sqrt(TWO * depth) if depth > ZERO else ZERO
    return HALF + dx * scale, HALF + dz * scale


class EnvironmentMap(NamedTuple):
    """A density over directions, constant in each of (h, w) cells; `build_environment` makes it."""

    even_share: float  # of the samples, spread evenly over the sphere: 1 for a black world
    density: np.ndarray  # (h, w) per steradian, the even share included
    row_sums: np.ndarray  # (h + 1,) cumulative distribution over rows, from 0 to 1
    row_guide: np.ndarray  # (G,) uint16: the row in which k / G lies, G a power of two
    column_sums: np.ndarray  # (h, w + 1) of each row, over its columns
    column_guide: np.ndarray  # (h, H) uint16, likewise
    cap_depth: np.ndarray  # (h + 1,) 1 - cos of the angle that the first k rows span from the pole


#: Of a world that is not sampled.
NO_ENVIRONMENT = EnvironmentMap(
    np.float32(1),
    np.zeros((0, 0), np.float32),
    np.zeros(0, np.float32),
    np.zeros(0, np.uint16),
    np.zeros((0, 0), np.float32),
    np.zeros((0, 0), np.uint16),
    np.zeros(0, np.float32),
)


def build_environment(radiance: np.ndarray) -> EnvironmentMap:
    """The density for a panorama `radiance` (h, w, 3), bottom row first, of the radiance in the middle of each cell.

    Between the cells' middles the world is taken to change linearly. Negative numbers count as black, and so do
    infinities and NaN.
    """
    height, width = radiance.shape[:2]
    assert max(height, width) <= LARGEST_SIDE
    luminance = np.maximum(np.nan_to_num(radiance @ _LUMINANCE, nan=0, posinf=0, neginf=0), 0)
    mean = _average_over_cells(luminance.astype(np.float32, copy=False))
    borders = np.arange(height + 1) / height
    cap_depth = 2 * np.sin(np.pi / 2 * borders) ** 2
    # z at the upper less z at the lower border, from the product of sines that it is.
    rows = 2 * np.sin(np.pi * (borders[:-1] + borders[1:]) / 2) * np.sin(np.pi / 2 / height)
    solid_angle = 2 * np.pi * rows / width
    row_power = mean.sum(axis=1, dtype=np.float64) * solid_angle
    power = row_power.sum()
    even_share = EVEN_SHARE if power > 0 else 1.0
    # In float64: the factor of a world that is almost black is beyond float32.
    np.multiply(mean, (1 - even_share) / power if power > 0 else 0, out=mean, dtype=np.float64, casting="same_kind")
    environment = EnvironmentMap(
        np.float32(even_share),
        mean + np.float32(even_share / (4 * np.pi)),
        np.zeros(height + 1, np.float32),
        np.zeros(_power_of_two_within(height), np.uint16),
        np.zeros((height, width + 1), np.float32),
        np.zeros((height, _power_of_two_within(width)), np.uint16),
        cap_depth.astype(np.float32),
    )
    _accumulate(row_power, environment.row_sums, environment.row_guide)
    _accumulate_rows(mean, environment.column_sums, environment.column_guide)
    return environment


def _average_over_cells(values: np.ndarray) -> np.ndarray:
    """The mean over each cell of what is interpolated bilinearly between the cells' middles, round and round in u.

    Along each side 1/8, 6/8 and 1/8 of a cell's own value and its neighbours'. What lies beside a sun is so never taken
    to be as dark as its middle.
    """
    padded = np.pad(values, ((1, 1), (0, 0)), mode="edge")
    values = np.float32(0.75) * values + np.float32(0.125) * (padded[:-2] + padded[2:])
    padded = np.pad(values, ((0, 0), (1, 1)), mode="wrap")
    return np.float32(0.75) * values + np.float32(0.125) * (padded[:, :-2] + padded[:, 2:])


def _power_of_two_within(count: int) -> int:
    return 2 ** int(math.log2(count))


@kernel
def _accumulate_rows(weights: np.ndarray, sums: np.ndarray, guide: np.ndarray) -> None:
    for row in range(len(weights)):
        _accumulate(weights[row], sums[row], guide[row])


@kernel
def _accumulate(weights: np.ndarray, sums: np.ndarray, guide: np.ndarray) -> None:
    """The cumulative distribution of `weights` (n,), even if all are 0, and where to begin to look in it."""
    total = 0.0
    for k in range(len(weights)):
        total += weights[k]
    below = 0.0
    for k in range(len(weights)):
        sums[k] = np.float32(below / total if total > 0 else k / len(weights))
        below += weights[k]
    sums[len(weights)] = ONE
    place = 0
    for k in range(len(guide)):
        while sums[place + 1] <= k / len(guide):
            place += 1
        guide[k] = place


@device
def _look_up(sums: np.ndarray, guide: np.ndarray, u: float) -> int:
    """The last k with sums[k] <= u (Chen and Asau 1974): 1 + n / G steps on average, for u in [0, 1)."""
    # A product with a power of two is exact, so u cannot lie below the place where the guide begins.
    place = int(guide[int(u * np.float32(len(guide)))])
    while sums[place + 1] <= u:
        place += 1
    return place


@device
def _within(below: float, above: float, value: float, clearance: float) -> float:
    """How far `value` lies from `below` to `above`, as a share that keeps `clearance` away from 0 and 1."""
    share = min(max((value - below) / (above - below), ZERO), ONE)
    return clearance + share * (ONE - TWO * clearance)


@subroutine
def sample_environment(environment: EnvironmentMap, u: float, v: float) -> tuple[float, float, float, float]:
    """A unit vector, and its density per steradian: that which `environment_pdf` gives of it, to the bit."""
    even_share = environment.even_share
    if v < even_share:
        i, j, across, along = _spread_evenly(environment, u, v / even_share)
    else:
        # Rounding may lift the largest v to 1.
        i, j, across, along = _follow_brightness(environment, u, min((v - even_share) / (ONE - even_share), BELOW_ONE))
    dx, dy, dz = _direction_in_cell(environment, i, j, across, along)
    return dx, dy, dz, environment.density[i, j]


@device
def _follow_brightness(environment: EnvironmentMap, u: float, v: float) -> tuple[int, int, float, float]:
    """Row i and column j of a cell, and how far across and up it, by the cumulative distributions."""
    height, width = environment.density.shape
    i = _look_up(environment.row_sums, environment.row_guide, v)
    row = environment.column_sums[i]
    j = _look_up(row, environment.column_guide[i], u)
    across = _within(row[j], row[j + 1], u, _CLEARANCE * np.float32(width))
    along = _within(environment.row_sums[i], environment.row_sums[i + 1], v, TWO * _CLEARANCE * np.float32(height))
    return i, j, across, along


@device
def _spread_evenly(environment: EnvironmentMap, u: float, v: float) -> tuple[int, int, float, float]:
    """The same by Archimedes' theorem: z is as evenly spread as the angle."""
    height, width = environment.density.shape
    columns, rows = np.float32(width), np.float32(height)
    j = min(int(u * columns), width - 1)
    across = _within(np.float32(j), np.float32(j + 1), u * columns, _CLEARANCE * columns)
    depth = TWO * v
    angle = arctan2(np.sqrt(depth * (TWO - depth)), ONE - depth)
    i = min(int(angle * INV_PI * rows), height - 1)
    low, below, above = _row_from_nearer_pole(environment, i)
    along = _within(below, above, (depth if low else TWO - depth), TWO * _CLEARANCE * rows)
    return i, j, across, along


@device
def _direction_in_cell(
    environment: EnvironmentMap, i: int, j: int, across: float, along: float
) -> tuple[float, float, float]:
    """The direction at a place in a cell, `along` in proportion to z."""
    cosine, sine = cos_sin(PI - (np.float32(j) + across) / np.float32(environment.density.shape[1]) * TWO_PI)
    low, below, above = _row_from_nearer_pole(environment, i)
    depth = below * (ONE - along) + above * along
    radius = np.sqrt(depth * (TWO - depth))
    return radius * cosine, radius * sine, (depth - ONE if low else ONE - depth)


@device
def _row_from_nearer_pole(environment: EnvironmentMap, i: int) -> tuple[bool, float, float]:
    """Whether row i is nearer to -Z, and 1 - |z| at its lower and upper border: so counted it keeps its digits."""
    height = len(environment.row_sums) - 1
    low = 2 * i < height
    below, above = (i if low else height - i), (i + 1 if low else height - i - 1)
    return low, environment.cap_depth[below], environment.cap_depth[above]


@subroutine
def environment_pdf(environment: EnvironmentMap, dx: float, dy: float, dz: float) -> float:
    """The density of `sample_environment` in a direction, per steradian: > 0 everywhere."""
    height, width = environment.density.shape
    u, v = direction_to_panorama(dx, dy, dz)
    return environment.density[min(int(v * np.float32(height)), height - 1), min(int(u * np.float32(width)), width - 1)]
