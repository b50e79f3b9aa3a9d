"""What a denoiser wants to know beside the noisy picture: the colour of what the camera sees, without light and shadow.

A network that is shown it can tell a texture from noise. Open Image Denoise asks for "the approximate color of the
surfaces independent of illumination and viewing angle", from 0 to 1, 1 for glass; for emission and the world Cycles
adds their radiance (`film_write_denoising_features_surface` and `film_write_emission_or_background_pass` in its
source). Rooks takes the first hit, as for its other passes: what is seen in mirrors and through panes, where Cycles
follows the path, is not in it.
"""

from __future__ import annotations

import numpy as np

from .batch import ALBEDO, EMISSION, LANES, LOBE_COUNT, MATERIAL, PACKET, Batch, Y, Z
from .film import TileSums
from .jit import device, kernel
from .lobe_record import LOBE_SIZE
from .lobes import first_lobe, lobe_albedo
from .packed_materials import MaterialArrays
from .surface_lobes import view_of
from .warps import ONE, ZERO


@kernel
def add_albedos(
    batch: Batch, sums: TileSums, materials: MaterialArrays, hide_world: bool, first: int, samples: int, packets: int
) -> None:
    """Add to `sums` what the surfaces reached reflect of a white world, and what they emit, each sample's from 0 to 1.

    The camera rays of the batch are numbered from `first` through the tile, with `samples` per pixel. `hide_world`: the
    camera does not see the world, whose albedo is 0 then.
    """
    bits, albedo = batch.bits, sums.albedo
    for p in range(packets):
        for lane in range(LANES):
            i = p * PACKET + lane
            if hide_world and bits[i + MATERIAL] == np.uint32(materials.world):
                continue
            pixel = (first + p * LANES + lane) // samples
            red, green, blue = _reflected(batch, materials.largest_lobe_count, i)
            albedo[pixel, 0] += _share(red + batch.floats[i + EMISSION])
            albedo[pixel, 1] += _share(green + batch.floats[i + EMISSION + Y])
            albedo[pixel, 2] += _share(blue + batch.floats[i + EMISSION + Z])


@device
def _reflected(batch: Batch, lobe_stride: int, i: int) -> tuple[float, float, float]:
    f, count = batch.floats, np.int64(batch.bits[i + LOBE_COUNT])
    if count == 0:
        return f[i + ALBEDO], f[i + ALBEDO + Y], f[i + ALBEDO + Z]
    vx, vy, vz = view_of(f, i)
    red = green = blue = ZERO
    for lobe in range(count):
        r, g, b = lobe_albedo(batch.lobes, first_lobe(i, lobe_stride) + lobe * LOBE_SIZE, vx, vy, vz)
        red, green, blue = red + r, green + g, blue + b
    return red, green, blue


@device
def _share(value: float) -> float:
    # Written so that NaN is 0, too.
    return min(value if value > ZERO else ZERO, ONE)
