"""Which sample point meets which: a table of point sets per domain, and the choice of a set for each pixel.

A render has four domains: the pixel, the lens, the lights and the BSDF. Each has a table of sets made by its sampler.
A pixel takes one set from it for each *dimension* it needs there (one per light and bounce, say): the first by a hash
of (seed, pixel, domain), the next at an odd stride, which visits every set once before any twice, so that two
dimensions of one pixel never share a set.

A sampler may ask for more (`Sampler.along_curve`): that pixels take its sets in the order of a curve through the
picture. Then each dimension has a run of 4^digits sets of its own, for squares of 2^digits × 2^digits pixels, which it
gives out along a Z-curve whose turns are chosen by a hash (Ahmed and Wonka 2020).

If sample i of one dimension always met sample i of another, their product would be integrated wrongly for ever, or
converge slowly (the coupling is measured in the tests). So the points inside each set are put into a random order once.
For the lights that is the order of a space-filling curve from a random start: next to all others it is as random as a
shuffle, and no path carries the light of two lamps, so that what two lamps share is a sum and not a product. In that
order a packet's 16 shadow rays go to neighbouring points of the lamp, and are traced together in less time.

The choice depends on the seed and the pixel alone, never on tiles, batches or threads.
"""

from __future__ import annotations

from itertools import permutations
from typing import NamedTuple

import numpy as np

from .batch import LANES, PACKET, Batch, Y
from .errors import SettingsError
from .jit import device, kernel
from .samplers import SAMPLERS
from .settings import RenderSettings

DOMAINS = ("pixel", "lens", "light", "bsdf")

#: Points per table. The sets of a table are all that a picture ever sees of a sampler, so they bound how well the mean
#: over the whole picture can converge: at 2^18 points even random ones are within 0.2 % of a standard deviation. (A
#: small part of the picture sees each set more than once where a pixel has thousands of samples.)
TABLE_POINTS = 1 << 18
#: A table beyond this is a mistake in the settings rather than a wish.
MAX_TABLE_BYTES = 1 << 31
#: How much of a table is made at a time: making points takes up to seven times the memory that they take.
PART_POINTS = 1 << 22

_MASK32 = np.uint64(0xFFFFFFFF)
#: All orders in which a Z-curve can visit the four quarters of a square.
_ORDERS = np.array(list(permutations(range(4))))


class PointTable(NamedTuple):
    """Point sets as kernels read them: `points` is (2, set_count, count) float32.

    `digits` is 0 where a hash chooses the set, and `set_count` a power of two then. Else each dimension has 4^digits
    sets of its own, to be taken along a curve.
    """

    points: np.ndarray
    salt: int
    digits: int = 0


class Run(NamedTuple):
    """Which points of its set each pixel takes: `count` of them, from number `start` on."""

    start: int
    count: int


#: For a domain in which nobody looks anything up.
NO_POINTS = PointTable(np.zeros((2, 1, 1), np.float32), 0)


def make_table(domain: str, settings: RenderSettings, dimensions: int, pixels: int) -> PointTable:
    """Make the table of `domain` for a picture of `pixels` pixels that each need `dimensions` sets of it.

    Raises:
        SettingsError: the table would not fit into memory.
    """
    if dimensions == 0:
        return NO_POINTS
    count = settings.sample_count
    sampler = SAMPLERS[settings.samplers[domain]]
    wanted = max(dimensions, min(pixels * dimensions, TABLE_POINTS // count), 16)
    digits = max((wanted // dimensions).bit_length() - 1 >> 1, 2) if sampler.along_curve else 0
    set_count = dimensions << 2 * digits if digits else 1 << (wanted - 1).bit_length()
    size = set_count * count * 8
    need = f"{count} samples in {dimensions} {domain} dimensions need {size / 2**30:.3g} GB of tables"
    if size > MAX_TABLE_BYTES:
        raise SettingsError(f"{need}: use fewer samples, lights or bounces")
    rng = np.random.default_rng([settings.seed, DOMAINS.index(domain)])
    order = follow_curve if domain == "light" else shuffle_sets
    # Whole dimensions of a curve: both are powers of two.
    part = max(PART_POINTS // count, 4**digits)
    try:
        table = np.empty((2, set_count, count), np.float32)
        for first in range(0, set_count, part):
            points = order(sampler(min(part, set_count - first), count, rng), rng)
            table[:, first : first + part] = points.transpose(2, 0, 1)
    except MemoryError:
        raise SettingsError(f"{need}, more memory than there is: use fewer samples, lights or bounces") from None
    return PointTable(table, int(rng.integers(1 << 32)), digits)


def shuffle_sets(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Put the points of each set, (set_count, count, 2), into a fair random order of its own."""
    return _points(rng.permuted(_pairs(points), axis=1))


def follow_curve(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Order each set, (set_count, count, 2), along the Z-curve (Morton 1966), from a random start round the end."""
    set_count, count, _ = points.shape
    cell = (points * 16).astype(np.uint8)
    along = np.argsort(_spread_bits(cell[..., 0]) | _spread_bits(cell[..., 1]) << 1, axis=1, kind="stable")
    turn = (np.arange(count) + rng.integers(count, size=(set_count, 1))) % count
    return _points(np.take_along_axis(_pairs(points), np.take_along_axis(along, turn, axis=1), axis=1))


def _pairs(points: np.ndarray) -> np.ndarray:
    """Points, float32 (set_count, count, 2), as numbers of 64 bits, (set_count, count), which are quicker to move."""
    return np.ascontiguousarray(points).view(np.uint64)[..., 0]


def _points(pairs: np.ndarray) -> np.ndarray:
    return pairs[..., None].view(np.float32)


def _spread_bits(number: np.ndarray) -> np.ndarray:
    """Put a zero before each of 4 bits: abcd becomes 0a0b0c0d."""
    number = (number | number << 2) & 0x33
    return (number | number << 1) & 0x55


@device
def hash32(a: int, b: int, c: int) -> int:
    """Mix three integers into 32 even bits (the finaliser of MurmurHash3, Appleby 2011, once per input).

    Products stay below 2^64 and are masked, so that the result is the same with and without the JIT.
    """
    state = np.uint64(0x9E3779B9)
    for value in (a, b, c):
        state = (state ^ np.uint64(value & 0xFFFFFFFF)) * np.uint64(0x85EBCA6B) & _MASK32
        state = (state ^ (state >> np.uint64(13))) * np.uint64(0xC2B2AE35) & _MASK32
        state = state ^ (state >> np.uint64(16))
    return np.int64(state)


@device
def set_of_pixel(table: PointTable, x: int, y: int, dimension: int) -> int:
    """The set that pixel (x, y) of the full frame uses for a dimension of this table's domain."""
    if table.digits:
        return (dimension << 2 * table.digits) + place_on_curve(x, y, table.digits, hash32(dimension, 0, table.salt))
    mixed = hash32(x, y, table.salt)
    stride = hash32(y, x, table.salt ^ 0x5BD1E995) | 1
    return (mixed + dimension * stride) & (table.points.shape[1] - 1)


@device
def place_on_curve(x: int, y: int, digits: int, salt: int) -> int:
    """The place of pixel (x, y) in its square of 2^digits × 2^digits pixels, along a Z-curve: 0 … 4^digits - 1.

    A square is a run of the curve, and so is each quarter of it, down to the pixel; a hash of the square decides in
    which of the 24 orders its quarters follow each other.
    """
    place = 0
    for level in range(digits - 1, -1, -1):
        quarter = ((y >> level) & 1) << 1 | ((x >> level) & 1)
        order = hash32(x >> (level + 1), y >> (level + 1), salt + level) % 24
        place = place << 2 | _ORDERS[order, quarter]
    return place


@kernel
def look_up_points(
    batch: Batch, row: int, table: PointTable, dimension: int, blocks: np.ndarray, run: Run, first: int, count: int
) -> None:
    """Fill the batch's two rows from `row` on with the points of `count` samples, number `first` of the tile and on.

    Samples are numbered through the tile's blocks of 4×4 pixels, their pixels, and each pixel's `run`. `blocks` is
    (B, 2): the lower left pixel of each block in the full frame.
    """
    f, points = batch.floats, table.points
    done = chosen = 0
    while done < count:
        pixel, number = divmod(first + done, run.count)
        # As far as one pixel's set and one packet go: there both lie in one piece of memory.
        length = min(run.count - number, count - done, LANES - done % LANES)
        if number == 0 or done == 0:
            x, y = blocks[pixel >> 4, 0] + (pixel & 3), blocks[pixel >> 4, 1] + ((pixel >> 2) & 3)
            chosen = set_of_pixel(table, x, y, dimension)
        to = done // LANES * PACKET + done % LANES + row
        for j in range(length):
            f[to + j] = points[0, chosen, run.start + number + j]
            f[to + j + Y] = points[1, chosen, run.start + number + j]
        done += length
