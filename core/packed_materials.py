"""Materials as kernels read them: their programs, and all images' pixels in one array."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .albedo_tables import NO_TABLES, AlbedoTables, load_tables
from .programs import Programs, compile_programs
from .scene import Material
from .values import EXTENSIONS, EnvironmentTexture, ImageTexture, Value

IMAGE_LINEAR, IMAGE_SRGB_BYTES = 0, 1
REPEAT, MIRROR, EXTEND, CLIP = range(len(EXTENSIONS))


#: Columns of `Textures.table`.
KIND, WIDTH, HEIGHT, EXTENSION, SMOOTH, FIRST = range(6)


class Textures(NamedTuple):
    """All images for kernels."""

    table: np.ndarray  # (X, 6) int64: IMAGE_LINEAR, ...; size; REPEAT, ...; 1 for linear interpolation; first pixel
    pixels: np.ndarray  # (·, 3) float32
    bytes: np.ndarray  # (·, 3) uint8


class MaterialArrays(NamedTuple):
    """The materials for kernels, K of them, then the world and the prologue of the programs."""

    world: int  # the material of a ray that hits nothing
    albedo: np.ndarray  # (K + 2, 3), of Lambertian materials without a program
    emission: np.ndarray  # (K + 2, 3): W/(m² sr), where it is constant
    program: np.ndarray  # (K + 2,) int64 into the code, or NONE where all is constant
    code: np.ndarray  # int64: see `instructions`
    ramps: np.ndarray  # (·, 3)
    largest_lobe_count: int
    textures: Textures
    albedo_tables: AlbedoTables


def pack_materials(placed: Sequence[Material], world: Value) -> tuple[MaterialArrays, np.ndarray, Programs]:
    """The materials, each stored once, and the world; which of them `placed` are, int64; and the programs.

    `placed` is the material of each slot of each placement. Constant colours are filled in by
    `materials.fill_constants`.

    Raises:
        SceneError: a number is not finite, a texture is not as it should be, or a material is too complex.
    """
    unique = list({id(material): material for material in placed}.values())
    index = {id(material): i for i, material in enumerate(unique)}
    programs = compile_programs([m.surface for m in unique], [m.name for m in unique], world)
    count = len(unique) + 2
    starts = [m.start for m in (*programs.materials, programs.world)]
    arrays = MaterialArrays(
        world=len(unique),
        albedo=np.zeros((count, 3), np.float32),
        emission=np.zeros((count, 3), np.float32),
        program=np.array([*starts, programs.prologue], np.int64),
        code=programs.code,
        ramps=programs.ramps,
        largest_lobe_count=programs.lobes,
        textures=_pack_textures(programs.textures),
        albedo_tables=load_tables() if programs.lobes else NO_TABLES,
    )
    return arrays, np.array([index[id(material)] for material in placed], np.int64), programs


def _pack_textures(textures: Sequence[ImageTexture | EnvironmentTexture]) -> Textures:
    table = np.zeros((len(textures), 6), np.int64)
    floats, small = [np.zeros((0, 3), np.float32)], [np.zeros((0, 3), np.uint8)]
    firsts: dict[int, int] = {}
    for row, texture in zip(table, textures, strict=True):
        pixels = texture.pixels
        bytes_ = pixels.dtype == np.uint8
        if id(pixels) not in firsts:
            store = small if bytes_ else floats
            firsts[id(pixels)] = sum(map(len, store))
            store.append(pixels.reshape(-1, 3).astype(np.uint8 if bytes_ else np.float32, copy=False))
        row[KIND] = IMAGE_SRGB_BYTES if bytes_ else IMAGE_LINEAR
        row[WIDTH], row[HEIGHT] = pixels.shape[1], pixels.shape[0]
        # A panorama goes on where it ends: round the horizon, and hardly any of it is interpolated over a pole.
        row[EXTENSION] = EXTENSIONS.index(texture.extension) if isinstance(texture, ImageTexture) else REPEAT
        row[SMOOTH] = texture.interpolation == "linear"
        row[FIRST] = firsts[id(pixels)]
    return Textures(table, _joined(floats), _joined(small))


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """All pixels in one array: of a single image its own, for a large one fits into memory once rather than twice."""
    filled = [part for part in parts if len(part)]
    return np.ascontiguousarray(filled[0]) if len(filled) == 1 else np.concatenate(parts)
