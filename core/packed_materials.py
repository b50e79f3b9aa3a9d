"""Materials and textures as kernels read them: tables of numbers, and all images' pixels in one array."""

from __future__ import annotations

import numpy as np

from .errors import SceneError
from .scene import DEFAULT_GREY, Checker, Color, ImageTexture, Material, Texture

#: "There is none", where an index is expected.
NONE = -1

CHECKER, IMAGE_LINEAR, IMAGE_SRGB_BYTES = 0, 1, 2
UV, GENERATED, OBJECT = 0, 1, 2
REPEAT, MIRROR, EXTEND, CLIP = 0, 1, 2, 3
_COORDINATES = {"uv": UV, "generated": GENERATED, "object": OBJECT}
_EXTENSIONS = {"repeat": REPEAT, "mirror": MIRROR, "extend": EXTEND, "clip": CLIP}


def pack_materials(placed: list[Material]) -> tuple[dict, dict]:
    """The fields of `packing.SceneArrays` that hold the materials, each stored once, and those of their textures.

    `placed` is the material of each slot of each placement.

    Raises:
        SceneError: a colour is not finite, or a texture is not as it should be.
    """
    unique = list({id(material): material for material in placed}.values())
    index = {id(material): i for i, material in enumerate(unique)}
    values = [value for material in unique for value in (material.albedo, material.emission)]
    textures = list({id(value): value for value in values if isinstance(value, Checker | ImageTexture)}.values())
    texture_index = {id(texture): i for i, texture in enumerate(textures)}

    def texture_of(value: Color | Texture) -> int:
        return texture_index.get(id(value), NONE)

    def constant(value: Color | Texture) -> Color:
        return (1.0, 1.0, 1.0) if id(value) in texture_index else value

    for material in unique:
        colors = (constant(material.albedo), constant(material.emission), material.emission_strength)
        if not all(np.isfinite(color).all() for color in colors):
            raise SceneError(f"material {material.name!r}: its colour or strength is not a finite number")
    emissions = [np.array(constant(m.emission), np.float64) * m.emission_strength for m in unique]
    materials = {
        "materials": np.array([index[id(material)] for material in placed], np.int64),
        "albedo": np.array([constant(m.albedo) for m in unique] or [DEFAULT_GREY], np.float32),
        "albedo_texture": np.array([texture_of(m.albedo) for m in unique], np.int64),
        "emission": np.array(emissions or [(0, 0, 0)], np.float32),
        "emission_texture": np.array([texture_of(m.emission) for m in unique], np.int64),
        "emits": np.array([color.any() for color in emissions], bool),
    }
    return materials, _pack_textures(textures)


def _pack_textures(textures: list[Texture]) -> dict:
    count = len(textures)
    for texture in textures:
        if texture.coordinates not in _COORDINATES:
            raise SceneError(f"a texture's coordinates are {texture.coordinates!r}: choose {', '.join(_COORDINATES)}")
    fields = {
        "texture_kind": np.zeros(count, np.int64),
        "texture_space": np.array([_COORDINATES[texture.coordinates] for texture in textures], np.int64),
        "texture_color1": np.zeros((count, 3), np.float32),
        "texture_color2": np.zeros((count, 3), np.float32),
        "texture_scale": np.ones(count, np.float32),
        "texture_size": np.ones((count, 2), np.int64),
        "texture_extension": np.zeros(count, np.int64),
        "texture_smooth": np.zeros(count, bool),
        "texture_first": np.zeros(count, np.int64),
    }
    floats, small = [np.zeros((0, 3), np.float32)], [np.zeros((0, 3), np.uint8)]
    for i, texture in enumerate(textures):
        if isinstance(texture, Checker):
            fields["texture_kind"][i] = CHECKER
            fields["texture_color1"][i], fields["texture_color2"][i] = texture.color1, texture.color2
            fields["texture_scale"][i] = texture.scale
        else:
            _check_image(texture)
            bytes_ = texture.pixels.dtype == np.uint8
            store = small if bytes_ else floats
            fields["texture_kind"][i] = IMAGE_SRGB_BYTES if bytes_ else IMAGE_LINEAR
            fields["texture_size"][i] = texture.pixels.shape[1], texture.pixels.shape[0]
            fields["texture_extension"][i] = _EXTENSIONS[texture.extension]
            fields["texture_smooth"][i] = texture.interpolation == "linear"
            fields["texture_first"][i] = sum(map(len, store))
            store.append(texture.pixels.reshape(-1, 3).astype(np.uint8 if bytes_ else np.float32, copy=False))
    return fields | {"pixels": np.concatenate(floats), "bytes": np.concatenate(small)}


def _check_image(texture: ImageTexture) -> None:
    shape = np.shape(texture.pixels)
    if len(shape) != 3 or shape[2] != 3 or 0 in shape:
        raise SceneError(f"an image texture's pixels have the shape {shape}, not (height, width, 3)")
