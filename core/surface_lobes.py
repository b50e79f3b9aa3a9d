"""The `instructions` that add lobes to a surface: their operands, handed to `closures` and `principled`."""

from __future__ import annotations

import numpy as np

from .batch import (
    DIRECTION,
    EMISSION,
    GEOMETRIC_NORMAL,
    LOBE_COUNT,
    SHADING_NORMAL,
    SIDE,
    Batch,
    Y,
    Z,
)
from .closures import (
    View,
    append_conductor,
    append_cosine_power,
    append_diffuse,
    append_glass,
    append_glossy,
    append_refraction,
    append_tinted_metal,
    append_translucent,
    append_transparent,
)
from .diffuse import bump_alpha_squared
from .instructions import (
    COSINE_POWER,
    DIFFUSE,
    GLASS,
    GLOSSY,
    METAL,
    NONE,
    PRINCIPLED,
    REFRACTION,
    TRANSLUCENT,
    TRANSPARENT,
)
from .jit import device
from .lobe_record import KIND, LAMBERT, LOBE_SIZE, NORMAL, OREN_NAYAR, SMOOTH_NORMAL, TILT, WEIGHT
from .lobes import first_lobe
from .packed_materials import MaterialArrays
from .principled import Inputs, append_principled
from .surface import normalize
from .warps import ZERO


@device
def add_lobes(batch: Batch, materials: MaterialArrays, i: int, at: int) -> int:
    """Carry out the instruction at `at` for lane i. Returns where the next begins."""
    bits, code = batch.bits, materials.code
    first = first_lobe(i, materials.largest_lobe_count)
    free = first + np.int64(bits[i + LOBE_COUNT]) * LOBE_SIZE
    operation = code[at]
    if operation == PRINCIPLED:
        following, free = _principled(batch, materials, i, at + 1, free)
    elif operation <= TRANSPARENT:
        following, free = _plain(batch, materials, i, at + 1, free, operation)
    else:
        following, free = _with_facets(batch, materials, i, at + 1, free, operation)
    for lobe in range(first + np.int64(bits[i + LOBE_COUNT]) * LOBE_SIZE, free, LOBE_SIZE):
        _note_bump(batch.floats, batch.lobes, i, lobe)
    bits[i + LOBE_COUNT] = np.uint32((free - first) // LOBE_SIZE)
    return following


@device
def _note_bump(f: np.ndarray, lobes: np.ndarray, i: int, lobe: int) -> None:
    """Tell a diffuse lobe how far its normal is tilted against the surface's own."""
    kind = np.int64(lobes[lobe + KIND])
    if kind in (LAMBERT, OREN_NAYAR):
        n, s = lobe + NORMAL, lobe + SMOOTH_NORMAL
        lobes[s], lobes[s + 1], lobes[s + 2] = (
            f[i + SHADING_NORMAL],
            f[i + SHADING_NORMAL + Y],
            f[i + SHADING_NORMAL + Z],
        )
        same = (lobes[n] == lobes[s]) & (lobes[n + 1] == lobes[s + 1]) & (lobes[n + 2] == lobes[s + 2])
        cosine = lobes[n] * lobes[s] + lobes[n + 1] * lobes[s + 1] + lobes[n + 2] * lobes[s + 2]
        lobes[lobe + TILT] = ZERO if same else bump_alpha_squared(cosine)
        if cosine <= ZERO:  # turned away from the surface's own, it reflects nothing
            lobes[lobe + WEIGHT] = lobes[lobe + WEIGHT + 1] = lobes[lobe + WEIGHT + 2] = ZERO


@device
def _plain(batch: Batch, materials: MaterialArrays, i: int, at: int, free: int, operation: int) -> tuple[int, int]:
    """Lobes without facets. Returns where the next instruction begins, and the next free lobe."""
    code, r = materials.code, batch.registers
    weight, c = r[code[at], 0], code[at + 1]
    if operation == DIFFUSE:
        nx, ny, nz = normal_of(batch.floats, r, i, code[at + 3])
        rough = r[code[at + 2], 0]
        free = append_diffuse(batch.lobes, free, weight, r[c, 0], r[c, 1], r[c, 2], rough, nx, ny, nz)
        return at + 4, free
    if operation == TRANSLUCENT:
        nx, ny, nz = normal_of(batch.floats, r, i, code[at + 2])
        view = _view(batch.floats, i)
        free = append_translucent(batch.lobes, free, weight, r[c, 0], r[c, 1], r[c, 2], nx, ny, nz, view)
        return at + 3, free
    return at + 2, append_transparent(batch.lobes, free, weight, r[c, 0], r[c, 1], r[c, 2])


@device
def _with_facets(
    batch: Batch, materials: MaterialArrays, i: int, at: int, free: int, operation: int
) -> tuple[int, int]:
    code, r, lobes, tables = materials.code, batch.registers, batch.lobes, materials.albedo_tables
    weight, c, d = r[code[at], 0], code[at + 1], code[at + 2]
    red, green, blue = r[c, 0], r[c, 1], r[c, 2]
    view = _view(batch.floats, i)
    if operation == COSINE_POWER:
        nx, ny, nz = normal_of(batch.floats, r, i, code[at + 3])
        return at + 4, append_cosine_power(lobes, free, weight, red, green, blue, r[d, 0], nx, ny, nz, view)
    if operation == GLOSSY:
        nx, ny, nz = normal_of(batch.floats, r, i, code[at + 3])
        multi = code[at + 4] != 0
        free = append_glossy(lobes, free, weight, red, green, blue, r[d, 0], multi, nx, ny, nz, view, tables)
        return at + 5, free
    e = code[at + 3]
    nx, ny, nz = normal_of(batch.floats, r, i, code[at + 4])
    if operation == REFRACTION:
        rough, ior = r[d, 0], r[e, 0]
        return at + 5, append_refraction(lobes, free, weight, red, green, blue, rough, ior, nx, ny, nz, view)
    multi = code[at + 5] != 0
    if operation == GLASS:
        rough, ior = r[d, 0], r[e, 0]
        free = append_glass(lobes, free, weight, red, green, blue, rough, ior, multi, nx, ny, nz, view, tables)
        return at + 6, free
    x, y, z, rough = r[d, 0], r[d, 1], r[d, 2], r[e, 0]
    if operation == METAL:
        free = append_tinted_metal(
            lobes, free, weight, red, green, blue, x, y, z, rough, multi, nx, ny, nz, view, tables
        )
    else:
        free = append_conductor(lobes, free, weight, red, green, blue, x, y, z, rough, multi, nx, ny, nz, view, tables)
    return at + 6, free


@device
def normal_of(f: np.ndarray, r: np.ndarray, i: int, register: int) -> tuple[float, float, float]:
    """A normal by its register; NONE is the shading normal."""
    if register == NONE:
        return f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    return r[register, 0], r[register, 1], r[register, 2]


@device
def view_of(f: np.ndarray, i: int) -> tuple[float, float, float]:
    """The unit vector to the viewer."""
    return normalize(-f[i + DIRECTION], -f[i + DIRECTION + Y], -f[i + DIRECTION + Z])


@device
def _view(f: np.ndarray, i: int) -> View:
    x, y, z = view_of(f, i)
    gx, gy, gz = f[i + GEOMETRIC_NORMAL], f[i + GEOMETRIC_NORMAL + Y], f[i + GEOMETRIC_NORMAL + Z]
    return View(x, y, z, gx, gy, gz, f[i + SIDE] > ZERO)


@device
def _principled(batch: Batch, materials: MaterialArrays, i: int, at: int, free: int) -> tuple[int, int]:
    """Returns where the next instruction begins, and the next free lobe. Adds what the node emits, too."""
    f, code, r = batch.floats, materials.code, batch.registers
    base, tint, coat_tint = code[at + 1], code[at + 8], code[at + 13]
    inputs = Inputs(
        base_r=r[base, 0],
        base_g=r[base, 1],
        base_b=r[base, 2],
        metallic=r[code[at + 2], 0],
        roughness=r[code[at + 3], 0],
        ior=r[code[at + 4], 0],
        alpha=r[code[at + 5], 0],
        diffuse_roughness=r[code[at + 6], 0],
        specular_level=r[code[at + 7], 0],
        specular_r=r[tint, 0],
        specular_g=r[tint, 1],
        specular_b=r[tint, 2],
        transmission=r[code[at + 9], 0],
        coat=r[code[at + 10], 0],
        coat_roughness=r[code[at + 11], 0],
        coat_ior=r[code[at + 12], 0],
        coat_r=r[coat_tint, 0],
        coat_g=r[coat_tint, 1],
        coat_b=r[coat_tint, 2],
        multiscatter=code[at + 17] != 0,
    )
    emission, weight = code[at + 14], r[code[at], 0]
    nx, ny, nz = normal_of(batch.floats, r, i, code[at + 15])
    cx, cy, cz = normal_of(batch.floats, r, i, code[at + 16])
    view, tables = _view(batch.floats, i), materials.albedo_tables
    free, er, eg, eb = append_principled(batch.lobes, free, weight, inputs, nx, ny, nz, cx, cy, cz, view, tables)
    f[i + EMISSION] += er * r[emission, 0]
    f[i + EMISSION + Y] += eg * r[emission, 1]
    f[i + EMISSION + Z] += eb * r[emission, 2]
    return at + 18, free
