"""Arithmetic on values that may be constants: done at once where they are, else left to an expression."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from . import values
from .values import Expression, Value


class CannotCompileError(Exception):
    """Why a program cannot be made; the text goes on after the material's name."""


def color_of(value: float | values.Color) -> tuple[float, float, float]:
    """The three components of a constant, as float32 has them."""
    try:
        red, green, blue = np.broadcast_to(np.asarray(value, np.float32), 3)
    except (TypeError, ValueError):
        raise CannotCompileError(f"{value!r} is neither a number nor a colour of three") from None
    return float(red), float(green), float(blue)


def is_constant(value: Value, number: float) -> bool:
    """Whether a value is this number for sure."""
    return not isinstance(value, Expression) and color_of(value) == (number, number, number)


def product(a: Value, b: Value) -> Value:
    if is_constant(a, 0.0) or is_constant(b, 0.0):
        return 0.0
    if is_constant(a, 1.0):
        return b
    if is_constant(b, 1.0):
        return a
    if isinstance(a, Expression) or isinstance(b, Expression):
        return values.Mix(1.0, a, b, "multiply", clamp_factor=False)
    return tuple(np.multiply(color_of(a), color_of(b)))


def total(parts: Iterable[Value]) -> Value:
    """The sum of all parts."""
    found: Value = 0.0
    for part in parts:
        if is_constant(found, 0.0):
            found = part
        elif is_constant(part, 0.0):
            continue
        elif isinstance(found, Expression) or isinstance(part, Expression):
            found = values.Mix(1.0, found, part, "add", clamp_factor=False)
        else:
            found = tuple(np.add(color_of(found), color_of(part)))
    return found


def clamped(factor: Value) -> Value:
    """A number, or the nearer end of 0 to 1."""
    if isinstance(factor, Expression):
        return values.Math("add", factor, 0.0, clamp=True)
    return min(max(color_of(factor)[0], 0.0), 1.0)


def not_negative(color: Value) -> Value:
    """A colour, 0 where it is negative."""
    if isinstance(color, Expression):
        return values.Mix(1.0, color, 0.0, "lighten", clamp_factor=False)
    return tuple(max(component, 0.0) for component in color_of(color))


def rest(factor: Value) -> Value:
    """1 - factor."""
    if isinstance(factor, Expression):
        return values.Math("subtract", 1.0, factor)
    return 1.0 - color_of(factor)[0]
