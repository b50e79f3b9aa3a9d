"""The first two dimensions of Sobol's sequence, and Owen's scrambling of them: what several samplers are made of.

Both dimensions are digital: in binary, point i is a matrix times the digits of i, modulo 2 (Sobol 1967). The first is
the van der Corput sequence, the second has Pascal's triangle for its matrix. Every run of 2^k points that begins at a
multiple of 2^k has exactly one point in each elementary interval 2^-a × 2^-b, a + b = k: it is a (0, k, 2)-net.

Owen's scrambling (1995) keeps that, and makes the points random: it goes down the binary digits of a coordinate and
flips each or not by a coin that belongs to the digits before it. Here the coins come from a hash in which a bit can
change higher bits only (Laine and Karras 2011), applied to the mirrored digits (Burley 2020), with the constants of
Vegdahl (2021).
"""

from __future__ import annotations

from .late_numpy import np

#: Neighbouring groups of 1, 2, 4 … bits, and a mask of the lower group of each pair.
_GROUPS = ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF))


def scrambled_sobol(index: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Owen-scrambled points of Sobol's sequence.

    `index` are integers in [0, 2**32), `seeds` uint32 (…, 2), one for each coordinate; their leading shape broadcasts
    against that of `index`. Returns float32 (…, 2) in [0, 1), multiples of 2**-24.
    """
    index = index.astype(np.uint32)
    # The first dimension is the mirrored index, so that mirrored once more it is the index itself.
    mirrored = index, mirrored_pascal(index)
    coordinates = [unit_interval(reverse_bits(_hash(m, seeds[..., axis]))) for axis, m in enumerate(mirrored)]
    return np.stack(coordinates, axis=-1)


def reverse_bits(bits: np.ndarray) -> np.ndarray:
    """The 32 binary digits of uint32 numbers in reverse order."""
    for width, mask in _GROUPS:
        # Swap neighbouring groups: after the last turn the order of all 32 is reversed.
        bits = (bits >> np.uint32(width) & np.uint32(mask)) | (bits & np.uint32(mask)) << np.uint32(width)
    return bits


def mirrored_pascal(index: np.ndarray) -> np.ndarray:
    """The second dimension of Sobol's sequence at uint32 indices, unscrambled, its 32 digits in reverse order: uint32.

    Column j of its matrix is row j of Pascal's triangle modulo 2. So bit r of the result is the sum modulo 2 of the
    index's bits j for which C(j, r) is odd, which are those whose number j has all the binary digits of r, and maybe
    more (Lucas 1878). Each turn adds those that have one digit more.
    """
    for width, mask in _GROUPS:
        index = index ^ (index >> np.uint32(width) & np.uint32(mask))
    return index


def _hash(bits: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Change each bit by a hash of the seed and of the bits below it."""
    bits = bits ^ bits * np.uint32(0x3D20ADEA)
    bits = (bits + seed) * (seed >> np.uint32(16) | np.uint32(1))
    bits ^= bits * np.uint32(0x05526C56)
    return bits ^ bits * np.uint32(0x53A22864)


def unit_interval(bits: np.ndarray) -> np.ndarray:
    """uint32 as float32 in [0, 1): of 32 digits the first 24, which are exact."""
    return (bits >> np.uint32(8)).astype(np.float32) * np.float32(2**-24)
