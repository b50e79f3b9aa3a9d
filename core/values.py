"""What varies over a surface: colours, numbers and vectors computed from where a ray hit, as small trees.

Each class is one of Blender's nodes, reduced to what changes its result. A `Value` is a constant or such a tree. Every
value has three components: a number is the same three times, so that numbers, colours and vectors meet without casts
(what Blender casts otherwise is said by `Gray` and `Average`). Trees are shared by reference: a node that feeds two
others is the same object in both, and is computed once.

`compile_values` turns trees into instructions, and folds what is constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

Color = tuple[float, float, float]

#: The names that nodes know, as Blender has them, in lower case.
BLENDS = (
    "mix", "darken", "multiply", "burn", "lighten", "screen", "dodge", "add", "overlay", "soft_light", "linear_light",
    "difference", "exclusion", "subtract", "divide", "hue", "saturation", "color", "value",
)  # fmt: skip
MATHS = (
    "add", "subtract", "multiply", "divide", "multiply_add", "power", "logarithm", "sqrt", "inverse_sqrt", "absolute",
    "exponent", "minimum", "maximum", "less_than", "greater_than", "sign", "compare", "smooth_min", "smooth_max",
    "round", "floor", "ceil", "trunc", "fract", "modulo", "floored_modulo", "wrap", "snap", "pingpong", "sine",
    "cosine", "tangent", "arcsine", "arccosine", "arctangent", "arctan2", "sinh", "cosh", "tanh", "radians", "degrees",
)  # fmt: skip
INTERPOLATIONS = ("linear", "smoothstep", "smootherstep")
NORMAL_SPACES = ("tangent", "object", "world")
EXTENSIONS = ("repeat", "mirror", "extend", "clip")
TEXTURE_INTERPOLATIONS = ("linear", "closest")
LAYER_WEIGHTS = ("fresnel", "facing")


@dataclass(frozen=True, eq=False)
class Expression:
    """Base of everything that is computed at a hit."""


Value = float | Color | Expression


@dataclass(frozen=True, eq=False)
class Coordinates(Expression):
    """Where the hit lies: in the mesh's UV map, in Blender's generated coordinates (0 to 1 across the mesh's texture
    space), in the object's own space or in the world's. For the world, `generated` and `object` are the direction
    looked in.
    """

    space: Literal["uv", "generated", "object", "world"]


UV, GENERATED, OBJECT, WORLD = (Coordinates(space) for space in ("uv", "generated", "object", "world"))


@dataclass(frozen=True, eq=False)
class Affine(Expression):
    """`matrix` (3, 4) applied to a vector: Blender's Mapping node."""

    vector: Value
    matrix: np.ndarray


@dataclass(frozen=True, eq=False)
class Normalized(Expression):
    """A vector made one long."""

    vector: Value


@dataclass(frozen=True, eq=False)
class Attribute(Expression):
    """One of `Mesh.attributes`, interpolated over the triangle; black where the mesh has none of that name."""

    name: str


@dataclass(frozen=True, eq=False)
class Checker(Expression):
    """Blender's Checker Texture: two colours in cubes of side 1/`scale` of the coordinates, `color2` at the origin."""

    color1: Value
    color2: Value
    scale: Value = 1.0
    vector: Value = GENERATED


@dataclass(frozen=True, eq=False)
class ImageTexture(Expression):
    """An image looked up by the first two components of `vector`.

    `pixels` is (height, width, 3), bottom row first (as Blender keeps images): float32 in linear Rec.709, or uint8 in
    sRGB, which is interpolated as it is and made linear afterwards, as Cycles does. `extension` says what lies outside
    [0, 1): the image again, mirrored, its edge, or black.
    """

    pixels: np.ndarray
    extension: Literal["repeat", "mirror", "extend", "clip"] = "repeat"
    interpolation: Literal["linear", "closest"] = "linear"
    vector: Value = UV


@dataclass(frozen=True, eq=False)
class EnvironmentTexture(Expression):
    """An equirectangular panorama looked up by a direction, which is where in `environment` it says.

    `pixels` as in `ImageTexture`.
    """

    pixels: np.ndarray
    interpolation: Literal["linear", "closest"] = "linear"
    vector: Value = GENERATED


@dataclass(frozen=True, eq=False)
class ColorRamp(Expression):
    """`table` (n, 3) float32 looked up from factor 0 to 1: the nearest entry below, or `smooth` between entries."""

    factor: Value
    table: np.ndarray
    smooth: bool = True


@dataclass(frozen=True, eq=False)
class Mix(Expression):
    """`a` blended with `b` by one of BLENDS: factor 0 is `a`."""

    factor: Value
    a: Value
    b: Value
    blend: str = "mix"
    clamp_factor: bool = True
    clamp_result: bool = False


@dataclass(frozen=True, eq=False)
class Math(Expression):
    """One of MATHS, the operations of Blender's Math node, on numbers; `clamp` to 0 … 1 afterwards."""

    operation: str
    a: Value
    b: Value = 0.0
    c: Value = 0.0
    clamp: bool = False


@dataclass(frozen=True, eq=False)
class MapRange(Expression):
    """A number moved from one range to another; `smoothstep` and `smootherstep` always clamp."""

    value: Value
    from_min: Value = 0.0
    from_max: Value = 1.0
    to_min: Value = 0.0
    to_max: Value = 1.0
    interpolation: Literal["linear", "smoothstep", "smootherstep"] = "linear"
    clamp: bool = True


@dataclass(frozen=True, eq=False)
class Gray(Expression):
    """A colour's luminance (Rec.709), as Blender casts a colour to a number."""

    color: Value


@dataclass(frozen=True, eq=False)
class Average(Expression):
    """The mean of a vector's components, as Blender casts a vector to a number."""

    vector: Value


@dataclass(frozen=True, eq=False)
class Component(Expression):
    """Component 0, 1 or 2: Blender's Separate nodes."""

    value: Value
    index: int


@dataclass(frozen=True, eq=False)
class Combine(Expression):
    """Three numbers as one vector or colour: Blender's Combine nodes."""

    x: Value
    y: Value
    z: Value


@dataclass(frozen=True, eq=False)
class Fresnel(Expression):
    """The share of light that a smooth dielectric reflects towards the viewer; `normal` None: the shading normal."""

    ior: Value = 1.5
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class LayerWeight(Expression):
    """Blender's Layer Weight: `fresnel` by 1 / (1 - blend) as the ior, or `facing`, 0 seen from the front."""

    blend: Value = 0.5
    kind: Literal["fresnel", "facing"] = "facing"
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class NormalMap(Expression):
    """A world-space unit normal from a colour: 0 … 1 stands for -1 … 1.

    In tangent space the mesh's `tangents` are the base; else the vector is in the object's or in the world's space.
    """

    color: Value
    strength: Value = 1.0
    space: Literal["tangent", "object", "world"] = "tangent"


@dataclass(frozen=True, eq=False)
class Bump(Expression):
    """A world-space unit normal tilted against the slope of `height` × `distance` (metres) over the surface."""

    height: Value
    strength: Value = 1.0
    distance: Value = 1.0
    invert: bool = False
    normal: Expression | None = None
