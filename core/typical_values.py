"""What is known of a value before anything is hit: a guess at its mean, and whether it can be other than 0.

Both are right for constants, images and products of them. What else may vary is taken for 0.5 on average.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .graph_walk import children_first
from .value_arithmetic import color_of, is_constant
from .values import EnvironmentTexture, Expression, ImageTexture, Mix, Value

_UNKNOWN = 0.5
#: Components of an image that are looked at together.
STRIP = 1 << 22
_LARGEST = float(np.finfo(np.float32).max)


def typical(value: Value) -> np.ndarray:
    """A guess at the mean size of a value, (3,) float64: finite, and 0 only where `can_differ_from_0` is false."""
    found = _through_products(value, _mean, lambda a, b: np.minimum(a * b, _LARGEST))
    return np.where((found == 0) & can_differ_from_0(value), _UNKNOWN, found)


def can_differ_from_0(value: Value) -> np.ndarray:
    """Whether each component can be something else, NaN included, (3,) bool."""
    return _through_products(value, _is_anywhere, np.logical_and)


def _through_products(
    value: Value, of_factor: Callable[[Value], np.ndarray], multiply: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """The product of what `of_factor` says of the factors that a value is made of."""
    known: dict[int, np.ndarray] = {}

    def found(part: Value) -> np.ndarray:
        return known[id(part)] if isinstance(part, Expression) else of_factor(part)

    if not isinstance(value, Expression):
        return of_factor(value)
    for node in children_first(value, _factors):
        known[id(node)] = multiply(found(node.a), found(node.b)) if _is_product(node) else of_factor(node)
    return known[id(value)]


def _is_product(value: Expression) -> bool:
    return isinstance(value, Mix) and value.blend == "multiply" and is_constant(value.factor, 1.0)


def _factors(value: Expression) -> list[Expression]:
    return [part for part in (value.a, value.b) if isinstance(part, Expression)] if _is_product(value) else []


def _mean(value: Value) -> np.ndarray:
    if isinstance(value, ImageTexture | EnvironmentTexture):
        return _mean_pixel(value.pixels)
    return np.full(3, _UNKNOWN) if isinstance(value, Expression) else np.abs(color_of(value))


def _mean_pixel(pixels: np.ndarray) -> np.ndarray:
    """Of those components that are finite; in strips, for a large image's copies would fill the memory."""
    sums, counts = np.zeros(3), np.zeros(3)
    for strip in np.array_split(pixels, -(-pixels.size // STRIP)):
        for channel in range(3):
            sizes = np.abs(strip[..., channel])
            finite = np.isfinite(sizes)
            sums[channel] += sizes.sum(dtype=np.float64, where=finite)
            counts[channel] += finite.sum()
    return sums * (1 / 255 if pixels.dtype == np.uint8 else 1) / np.maximum(counts, 1)


def _is_anywhere(value: Value) -> np.ndarray:
    if isinstance(value, ImageTexture | EnvironmentTexture):
        return np.array([value.pixels[..., channel].any() for channel in range(3)])
    return np.full(3, True) if isinstance(value, Expression) else np.not_equal(color_of(value), 0)
