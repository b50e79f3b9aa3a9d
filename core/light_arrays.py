"""The lamps of a scene as arrays for kernels: checked, re-centred, and with every constant factor in their colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .errors import SceneError
from .light_choice import Emitters, LightTree, build_light_tree
from .scene import AreaLight, Light, PointLight, SpotLight, SunLight

#: With more lamps than these one is chosen at each surface, by `light_choice`: looking at all would cost too much.
MOST_ONE_BY_ONE = 8

IS_RECTANGLE, IS_ELLIPSE, IS_POINT, IS_SPHERE, IS_FACING_DISK, IS_SUN = 0, 1, 2, 3, 4, 5

#: How near is near: in squared diagonals of an area light, from its centre. (`area_lights` takes `near` for the squared
#: diagonal.)
NEAR = 1.0
#: The same for spheres and disks that face each point, in squared radii: farther off, the surface's cosine is next to
#: the same for all of their points.
NEAR_SPHERE = 16.0
#: A spot's edge without blend: steep enough to be a step, finite so that 0 × it stays 0.
_HARD_EDGE = 1e30
#: Metres: the squares of lengths have to fit into float32.
_LONGEST = 1e18
_LENGTHS = ("center", "axis_u", "axis_v", "position", "radius")
#: A bit of visibility beside those of `scene`: nothing can be in the way of this light.
SHINES_THROUGH = 64


class LightArrays(NamedTuple):
    """The lamps for kernels, L of them, positions re-centred."""

    kind: np.ndarray  # (L,) int64: IS_RECTANGLE, ...
    color: np.ndarray  # (L, 3)
    position: np.ndarray  # (L, 3); a sun: the direction towards it
    axis_u: np.ndarray  # (L, 3), full edge or axis of an area light
    axis_v: np.ndarray
    along_u: np.ndarray  # (L, 3) 1/m: their product with an offset from the centre is its share of axis_u
    along_v: np.ndarray
    normal: np.ndarray  # (L, 3), the side an area light shines to
    size: np.ndarray  # (L,) radius in metres; a sun: 1 - cos of half its angle
    area: np.ndarray  # (L,) m², that a sphere shows; a sun: steradians, seen flat. 0 without a size
    shared_area: np.ndarray  # (L,) the same; 0 if it shines through what would block the rays that meet it
    near: np.ndarray  # (L,) m²: from within this squared distance a lamp is looked at more closely, see `lights`
    extended: np.ndarray  # (L,) bool: it has a size, so that a point of it is to be sampled
    cast_shadow: np.ndarray  # (L,) bool
    visibility: np.ndarray  # (L,) uint32: bits of `scene`
    spot: np.ndarray  # (L,) bool: the light stands behind a cone
    to_spot: np.ndarray  # (L, 3, 3) world to lamp space
    spot_cosine: np.ndarray  # (L,) of half the cone's angle
    spot_edge: np.ndarray  # (L,) 1 / width of the blend, in cosines
    each: int  # so many lamps are sampled one by one at each surface; of the rest one is chosen
    tree: LightTree  # to choose by: its emitter k is lamp each + k


def pack_lights(lights: Sequence[Light], center: np.ndarray) -> LightArrays:
    """Check the lamps and turn them into what kernels read; those that send no light are left out.

    Raises:
        SceneError: a lamp's numbers are not finite, or it has the wrong shape.
    """
    shining = [light for light in lights if np.any(np.nan_to_num(_strength(light), nan=1) != 0)]
    count = each = len(shining)
    if count > MOST_ONE_BY_ONE:
        # Suns are infinitely far, and no tree bounds them: they come first.
        shining.sort(key=lambda light: not isinstance(light, SunLight))
        each = sum(isinstance(light, SunLight) for light in shining)
    fields = {
        "kind": np.zeros(count, np.int64),
        "color": np.zeros((count, 3), np.float32),
        "position": np.zeros((count, 3), np.float32),
        "axis_u": np.zeros((count, 3), np.float32),
        "axis_v": np.zeros((count, 3), np.float32),
        "along_u": np.zeros((count, 3), np.float32),
        "along_v": np.zeros((count, 3), np.float32),
        "normal": np.zeros((count, 3), np.float32),
        "size": np.zeros(count, np.float32),
        "area": np.zeros(count, np.float32),
        "near": np.zeros(count, np.float32),
        "visibility": np.array(
            [light.visibility | (0 if light.cast_shadow else SHINES_THROUGH) for light in shining], np.uint32
        ),
        "cast_shadow": np.array([light.cast_shadow for light in shining], bool),
        "spot": np.zeros(count, bool),
        "to_spot": np.zeros((count, 3, 3), np.float32),
        "spot_cosine": np.zeros(count, np.float32),
        "spot_edge": np.zeros(count, np.float32),
    }
    for i, light in enumerate(shining):
        _check_light(light)
        row = {name: array[i : i + 1] for name, array in fields.items()}
        with np.errstate(over="ignore"):
            if isinstance(light, AreaLight):
                _pack_area(row, light, center)
            elif isinstance(light, SunLight):
                _pack_sun(row, light)
            else:
                _pack_point(row, light, center)
        if not all(np.isfinite(array).all() for array in row.values()):
            raise SceneError(f"lamp {light.name!r}: its size or its scale is too small or too large for float32")
    is_sun = fields["kind"] == IS_SUN
    fields["shared_area"] = np.where(fields["cast_shadow"], fields["area"], np.float32(0))
    fields["extended"] = (fields["kind"] != IS_POINT) & ~(is_sun & (fields["size"] == 0))
    tree = build_light_tree(_emitters([fields[name][each:] for name in _OF_EMITTERS], shining[each:]))
    return LightArrays(**fields, each=each, tree=tree)


_OF_EMITTERS = ("position", "axis_u", "axis_v", "normal", "size", "color")


def _emitters(arrays: list[np.ndarray], lights: Sequence[Light]) -> Emitters:
    """The lamps as `light_choice` sees them."""
    position, axis_u, axis_v, normal, size, color = (array.astype(np.float64) for array in arrays)
    is_area = np.array([isinstance(light, AreaLight) for light in lights], bool)
    is_spot = np.array([isinstance(light, SpotLight) for light in lights], bool)
    reach = np.where(is_area[:, None], (np.abs(axis_u) + np.abs(axis_v)) / 2, size[:, None])
    axis = normal.copy()
    axis[~is_area] = 0, 0, 1
    falloff = np.full(len(lights), np.pi / 2)
    for k in np.flatnonzero(is_spot):
        axis[k], falloff[k] = _spot_cone(lights[k])
    return Emitters(
        low=position - reach,
        high=position + reach,
        axis=axis,
        cone=np.where(is_area | is_spot, 0.0, np.pi),
        falloff=falloff,
        two_sided=np.zeros(len(lights), bool),
        power=np.abs(color).mean(axis=1),
    )


def _spot_cone(light: SpotLight) -> tuple[np.ndarray, float]:
    """Where a spot looks, and how far off that it shines, radians: of a stretched one, anywhere."""
    matrix = np.array(light.matrix, np.float64)[:3, :3]
    squares = matrix.T @ matrix
    is_round = np.allclose(squares, squares[0, 0] * np.eye(3), rtol=1e-3, atol=1e-3 * squares[0, 0])
    return -matrix[:, 2] / max(np.sqrt(squares[2, 2]), 1e-30), light.spot_size / 2 if is_round else np.pi


def _check_light(light: Light) -> None:
    for name, value in vars(light).items():
        if not isinstance(value, str) and not np.isfinite(value).all():
            raise SceneError(f"lamp {light.name!r}: its {name.replace('_', ' ')} is not a finite number")
        if name in _LENGTHS and not np.max(np.abs(value)) < _LONGEST:
            raise SceneError(f"lamp {light.name!r}: its {name.replace('_', ' ')} is longer than {_LONGEST:g} m")
    if isinstance(light, SunLight):
        if not 0 <= light.angle <= np.pi:
            raise SceneError(f"lamp {light.name!r}: a sun's angle must lie between 0° and 180°")
        if not np.any(light.direction):
            raise SceneError(f"lamp {light.name!r}: a sun's direction must not be zero")
    elif isinstance(light, PointLight) and light.radius < 0:
        raise SceneError(f"lamp {light.name!r}: its radius must not be negative")
    elif isinstance(light, AreaLight) and light.shape not in ("rectangle", "ellipse"):
        raise SceneError(f"lamp {light.name!r}: its shape is {light.shape!r}, choose rectangle or ellipse")


def _strength(light: Light) -> tuple[float, float, float]:
    return light.irradiance if isinstance(light, SunLight) else light.power


def _pack_area(row: dict[str, np.ndarray], light: AreaLight, center: np.ndarray) -> None:
    normal = np.cross(light.axis_v, light.axis_u)
    length = np.linalg.norm(normal)
    is_rectangle = light.shape == "rectangle"
    row["kind"][:] = IS_RECTANGLE if is_rectangle else IS_ELLIPSE
    # Radiance P / (π area), times the area that a uniform point stands for, times the surface's 1/π.
    row["color"][:] = np.array(light.power) / np.pi**2
    row["position"][:] = np.array(light.center) - center
    row["axis_u"][:], row["axis_v"][:] = light.axis_u, light.axis_v
    # The axes of a sheared light are not at right angles.
    row["along_u"][:], row["along_v"][:] = np.linalg.pinv(np.column_stack([light.axis_u, light.axis_v]))
    row["normal"][:] = normal / length if length > 0 else 0
    row["area"][:] = length if is_rectangle else length * np.pi / 4
    row["near"][:] = NEAR * (np.dot(light.axis_u, light.axis_u) + np.dot(light.axis_v, light.axis_v))


def _pack_sun(row: dict[str, np.ndarray], light: SunLight) -> None:
    row["kind"][:] = IS_SUN
    row["color"][:] = np.array(light.irradiance) / np.pi
    row["position"][:] = np.array(light.direction) / np.linalg.norm(light.direction)
    row["size"][:] = 2 * np.sin(light.angle / 4) ** 2
    row["area"][:] = np.pi * np.sin(light.angle / 2) ** 2


def _pack_point(row: dict[str, np.ndarray], light: PointLight, center: np.ndarray) -> None:
    row["kind"][:] = IS_POINT if light.radius == 0 else IS_FACING_DISK if light.soft_falloff else IS_SPHERE
    # Radiant intensity P / 4π, times the surface's 1/π.
    row["color"][:] = np.array(light.power) / (4 * np.pi**2)
    row["position"][:] = np.array(light.position) - center
    row["size"][:] = light.radius
    row["area"][:] = np.pi * light.radius**2
    row["near"][:] = NEAR_SPHERE * light.radius**2
    if isinstance(light, SpotLight):
        cosine = np.cos(light.spot_size / 2)
        width = (1 - cosine) * light.blend
        row["spot"][:] = True
        row["to_spot"][:] = np.linalg.pinv(np.array(light.matrix, np.float64)[:3, :3])
        row["spot_cosine"][:] = cosine
        row["spot_edge"][:] = min(1 / width, _HARD_EDGE) if width > 0 else _HARD_EDGE
