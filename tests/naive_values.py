"""Values computed with numpy, by the book and one by one: what `core.values` say, without the renderer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core import values


@dataclass(frozen=True)
class Hits:
    """n hits: `coordinates` and `attributes` map names to (n, 3)."""

    coordinates: dict[str, np.ndarray]
    attributes: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.coordinates["uv"])


def evaluate(value: values.Value, hits: Hits) -> np.ndarray:
    """(n, 3) float64."""
    if not isinstance(value, values.Expression):
        return np.broadcast_to(np.asarray(value, np.float64), (len(hits), 3))
    return _EVALUATORS[type(value)](value, hits)


def _affine(value: values.Affine, hits: Hits) -> np.ndarray:
    return evaluate(value.vector, hits) @ value.matrix[:, :3].T + value.matrix[:, 3]


def _normalized(value: values.Normalized, hits: Hits) -> np.ndarray:
    vector = evaluate(value.vector, hits)
    lengths = np.linalg.norm(vector, axis=1, keepdims=True)
    return np.divide(vector, lengths, out=np.zeros_like(vector), where=lengths > 0)


def _checker(value: values.Checker, hits: Hits) -> np.ndarray:
    # Cycles moves the coordinates a little, so that a whole number lies in the cube above it.
    cell = np.floor(evaluate(value.vector, hits) * evaluate(value.scale, hits) * 0.999999 + 1e-6).astype(int)
    first = (cell[:, 0] % 2 == cell[:, 1] % 2) == (cell[:, 2] % 2 == 1)
    return np.where(first[:, None], evaluate(value.color1, hits), evaluate(value.color2, hits))


def _image(value: values.ImageTexture, hits: Hits) -> np.ndarray:
    height, width, _ = value.pixels.shape
    place = evaluate(value.vector, hits)[:, :2] * (width, height)
    pixels = value.pixels / 255 if value.pixels.dtype == np.uint8 else value.pixels
    if value.interpolation == "closest":
        found = _texels(pixels, np.floor(place).astype(int), value.extension)
    else:
        corner = np.floor(place - 0.5).astype(int)
        share = place - 0.5 - corner
        found = np.zeros((len(hits), 3))
        for i, j in np.ndindex(2, 2):
            weight = np.where((i, j), share, 1 - share).prod(axis=1)
            found += weight[:, None] * _texels(pixels, np.add(corner, (i, j)), value.extension)
    if value.pixels.dtype == np.uint8:
        found = np.where(found <= 0.04045, found / 12.92, ((found + 0.055) / 1.055) ** 2.4)
    return found


def _texels(pixels: np.ndarray, place: np.ndarray, extension: str) -> np.ndarray:
    size = np.array(pixels.shape[1::-1])
    outside = ((place < 0) | (place >= size)).any(axis=1)
    if extension == "repeat":
        place = place % size
    elif extension == "mirror":
        place = np.minimum(place % (2 * size), 2 * size - 1 - place % (2 * size))
    x, y = np.clip(place, 0, size - 1).T
    return np.where((outside & (extension == "clip"))[:, None], 0.0, pixels[y, x])


def _ramp(value: values.ColorRamp, hits: Hits) -> np.ndarray:
    last = len(value.table) - 1
    place = np.clip(evaluate(value.factor, hits)[:, 0], 0, 1) * last
    below = np.floor(place).astype(int)
    share = (place - below)[:, None] if value.smooth else 0.0
    return (1 - share) * value.table[below] + share * value.table[np.minimum(below + 1, last)]


_BLENDS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "mix": lambda a, b: b,
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "lighten": np.maximum,
    "difference": lambda a, b: np.abs(a - b),
}


def _mix(value: values.Mix, hits: Hits) -> np.ndarray:
    factor, a, b = (evaluate(part, hits) for part in (value.factor, value.a, value.b))
    share = factor[:, :1].clip(0, 1) if value.clamp_factor else factor[:, :1]
    mixed = (1 - share) * a + share * _BLENDS[value.blend](a, b)
    return mixed.clip(0, 1) if value.clamp_result else mixed


_OPERATIONS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "add": lambda a, b, c: a + b,
    "subtract": lambda a, b, c: a - b,
    "divide": lambda a, b, c: np.divide(a, b, out=np.zeros_like(a), where=b != 0),
    "multiply_add": lambda a, b, c: a * b + c,
    "power": lambda a, b, c: a**b,
    "minimum": lambda a, b, c: np.minimum(a, b),
    "maximum": lambda a, b, c: np.maximum(a, b),
    "sqrt": lambda a, b, c: np.sqrt(a),
}


def _math(value: values.Math, hits: Hits) -> np.ndarray:
    operands = (evaluate(part, hits)[:, :1] for part in (value.a, value.b, value.c))
    result = _OPERATIONS[value.operation](*operands)
    return np.repeat(result.clip(0, 1) if value.clamp else result, 3, axis=1)


def _map_range(value: values.MapRange, hits: Hits) -> np.ndarray:
    parts = (value.value, value.from_min, value.from_max, value.to_min, value.to_max)
    number, from_min, from_max, to_min, to_max = (evaluate(part, hits)[:, :1] for part in parts)
    share = (number - from_min) / (from_max - from_min)
    if value.interpolation != "linear":
        share = share.clip(0, 1)
        smooth, smoother = share**2 * (3 - 2 * share), share**3 * (share * (6 * share - 15) + 10)
        share = smooth if value.interpolation == "smoothstep" else smoother
    result = to_min + share * (to_max - to_min)
    if value.clamp:
        result = result.clip(np.minimum(to_min, to_max), np.maximum(to_min, to_max))
    return np.repeat(result, 3, axis=1)


def _thrice(number: np.ndarray) -> np.ndarray:
    return np.repeat(number[:, None], 3, axis=1)


_EVALUATORS = {
    values.Coordinates: lambda value, hits: hits.coordinates[value.space],
    values.Attribute: lambda value, hits: hits.attributes[value.name],
    values.Affine: _affine,
    values.Normalized: _normalized,
    values.Checker: _checker,
    values.ImageTexture: _image,
    values.ColorRamp: _ramp,
    values.Mix: _mix,
    values.Math: _math,
    values.MapRange: _map_range,
    values.Gray: lambda value, hits: _thrice(evaluate(value.color, hits) @ (0.2126729, 0.7151522, 0.0721750)),
    values.Average: lambda value, hits: _thrice(evaluate(value.vector, hits).mean(axis=1)),
    values.Component: lambda value, hits: _thrice(evaluate(value.value, hits)[:, value.index]),
    values.Combine: lambda value, hits: np.stack(
        [evaluate(part, hits)[:, 0] for part in (value.x, value.y, value.z)], axis=1
    ),
}
