"""Values that are the same everywhere, worked out before anything is rendered.

The renderer does that itself, with compiled code. Here it is done for what has to be a constant: the light of a lamp,
and the numbers of a Mapping.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ._core import core
from .nodes import Color

values = core.values
Value = core.values.Value

LUMINANCE = (0.2126729, 0.7151522, 0.0721750)

#: What the operations of a Math node and the blends of a Mix node make of constants, (3,) float64. Others are not
#: worked out.
MATHS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "add": lambda a, b, c: a + b,
    "subtract": lambda a, b, c: a - b,
    "multiply": lambda a, b, c: a * b,
    "divide": lambda a, b, c: np.divide(a, b, out=np.zeros(3), where=b != 0),
    "multiply_add": lambda a, b, c: a * b + c,
    "power": lambda a, b, c: np.where(a > 0, np.abs(a) ** b, 0.0),
    "sqrt": lambda a, b, c: np.sqrt(np.maximum(a, 0.0)),
    "absolute": lambda a, b, c: np.abs(a),
    "minimum": lambda a, b, c: np.minimum(a, b),
    "maximum": lambda a, b, c: np.maximum(a, b),
}
BLENDS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "mix": lambda a, b: b,
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "darken": np.minimum,
    "lighten": np.maximum,
}


def constant_of(value: Value, unknown: float | None = None) -> Color | None:
    """The components of a value that is the same everywhere.

    None for others, or, where it is given, what they are if `unknown` stands for what varies.
    """
    folded = _folded(value, unknown)
    return None if folded is None else (float(folded[0]), float(folded[1]), float(folded[2]))


def _folded(value: Value, unknown: float | None) -> np.ndarray | None:
    """(3,) float64, or None."""
    if not isinstance(value, values.Expression):
        return np.broadcast_to(np.asarray(value, np.float64), 3)
    names, compute = _FOLDS.get(type(value), ((), None))
    parts = [_folded(getattr(value, name), unknown) for name in names]
    result = None if compute is None or any(part is None for part in parts) else compute(value, *parts)
    return np.full(3, unknown) if result is None and unknown is not None else result


def _mix(value: values.Mix, factor: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    if value.blend not in BLENDS:
        return None
    share = np.clip(factor[0], 0.0, 1.0) if value.clamp_factor else factor[0]
    mixed = (1.0 - share) * a + share * BLENDS[value.blend](a, b)
    return np.clip(mixed, 0.0, 1.0) if value.clamp_result else mixed


def _math(value: values.Math, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray | None:
    if value.operation not in MATHS:
        return None
    result = MATHS[value.operation](*(np.full(3, operand[0]) for operand in (a, b, c)))
    return np.clip(result, 0.0, 1.0) if value.clamp else result


#: For each class of value that can be worked out, its parts and how.
_FOLDS: dict[type, tuple[tuple[str, ...], Callable[..., np.ndarray | None]]] = {
    values.Mix: (("factor", "a", "b"), _mix),
    values.Math: (("a", "b", "c"), _math),
    values.Gray: (("color",), lambda value, color: np.full(3, color @ LUMINANCE)),
    values.Average: (("vector",), lambda value, vector: np.full(3, vector.mean())),
    values.Component: (("value",), lambda value, whole: np.full(3, whole[value.index])),
    values.Combine: (("x", "y", "z"), lambda value, x, y, z: np.array([x[0], y[0], z[0]])),
}
