"""Arithmetic on values: products, movements, and the casts between Blender's kinds of socket."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ._core import core
from .folding import constant_of

values = core.values
Value = core.values.Value

IDENTITY = np.eye(3, 4)


def product(color: Value, factor: Value) -> Value:
    """A colour times a number or a colour."""
    if constant_of(factor) == (1.0, 1.0, 1.0):
        return color
    if isinstance(color, values.Expression) or isinstance(factor, values.Expression):
        return values.Mix(1.0, color, factor, "multiply")
    red, green, blue = np.broadcast_to(np.multiply(color, factor), 3)
    return float(red), float(green), float(blue)


def affine(vector: Value, matrix: np.ndarray) -> Value:
    """A vector moved by a (3, 4) matrix: nothing where that changes nothing, and one step after another in one."""
    if np.array_equal(matrix, IDENTITY):
        return vector
    if isinstance(vector, values.Affine):
        before = np.vstack([vector.matrix, (0.0, 0.0, 0.0, 1.0)])
        return values.Affine(vector.vector, matrix @ before)
    return values.Affine(vector, matrix)


def by_component(compute: Callable[..., Value], *operands: Value) -> Value:
    """A computation on numbers, done for each component of vectors."""
    parts = [[values.Component(operand, index) for operand in operands] for index in range(3)]
    return values.Combine(*(compute(*part) for part in parts))


def converted(value: Value, start: str, end: str) -> Value:
    """A value of one of Blender's types of socket, linked to a socket of another."""
    if end in ("VALUE", "INT", "BOOLEAN"):
        if start == "RGBA":
            return values.Gray(value)
        if start == "VECTOR":
            return values.Average(value)
    return value
