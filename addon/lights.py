"""Blender's lamps as the renderer's lights, in Cycles' units.

Power is in watts (an area light of power P and area A has the radiance P/(πA), a point light the intensity P/(4π)), a
sun's strength is an irradiance. A lamp that is not normalized (a choice from Blender 4.5 on) gives its power per area
instead: per 4πr² of a sphere, per A of an area light, per π sin²(angle/2) of the sun. Scale counts for area lights and
for the cone of a spot; the radius of a sphere ignores it.
"""

from __future__ import annotations

import math

import bpy
import numpy as np

from . import versions
from ._core import core
from .nodes import Color, constant_color, constant_number, label, surface_of


def export_light(lamp: bpy.types.Object, matrix: np.ndarray) -> tuple[core.scene.Light | None, list[str]]:
    """A lamp placed by `matrix`, or None where it sheds no light on surfaces; and warnings that name it.

    Raises:
        SceneError: the lamp is nowhere.
    """
    light = lamp.data
    if not surface_visibility(lamp):
        return None, []
    if not np.isfinite(matrix).all():
        raise core.errors.SceneError(f'light "{lamp.name}" is nowhere (its position is NaN or infinite): move it')
    emitted, warnings = _shader_color(lamp)
    color = tuple(
        light.energy * tint * shader for tint, shader in zip(versions.light_tint(light), emitted, strict=True)
    )
    if not any(color):
        return None, warnings
    if light.type == "AREA":
        warnings += _area_warnings(lamp)
    if lamp.visible_camera:
        warnings.append(f'light "{lamp.name}": Rooks does not show lamps to the camera')
    return _EXPORTERS[light.type](lamp, matrix, color), warnings


def surface_visibility(obj: bpy.types.Object) -> int:
    """The bits of the rays from surfaces that can see an object or a lamp."""
    return (
        (core.scene.VISIBLE_TO_DIFFUSE if obj.visible_diffuse else 0)
        | (core.scene.VISIBLE_TO_GLOSSY if obj.visible_glossy else 0)
        | (core.scene.VISIBLE_TO_TRANSMISSION if obj.visible_transmission else 0)
    )


def _point(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> core.scene.PointLight:
    return core.scene.PointLight(**_sphere_fields(lamp, matrix, color))


def _spot(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> core.scene.SpotLight:
    light = lamp.data
    return core.scene.SpotLight(
        **_sphere_fields(lamp, matrix, color), matrix=matrix, spot_size=light.spot_size, blend=light.spot_blend
    )


def _sphere_fields(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> dict:
    light = lamp.data
    radius = light.shadow_soft_size
    # Cycles divides by an area of 4 where the radius is 0.
    area = 4.0 * math.pi * radius**2 or 4.0
    gain = 1.0 if versions.light_is_normalized(light) else area
    return {
        "position": tuple(matrix[:3, 3]),
        "power": _scaled(color, gain),
        "radius": radius,
        "soft_falloff": light.use_soft_falloff,
        "cast_shadow": light.use_shadow,
        "name": lamp.name,
        "visibility": surface_visibility(lamp),
    }


def _area(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> core.scene.AreaLight | None:
    light = lamp.data
    size_y = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    axis_u, axis_v = matrix[:3, 0] * light.size, matrix[:3, 1] * size_y
    shape = "ellipse" if light.shape in ("DISK", "ELLIPSE") else "rectangle"
    area = float(np.linalg.norm(axis_u) * np.linalg.norm(axis_v)) * (math.pi / 4 if shape == "ellipse" else 1.0)
    if area == 0.0:
        return None
    return core.scene.AreaLight(
        center=tuple(matrix[:3, 3]),
        axis_u=tuple(axis_u),
        axis_v=tuple(axis_v),
        power=_scaled(color, 1.0 if versions.light_is_normalized(light) else area),
        shape=shape,
        cast_shadow=light.use_shadow,
        name=lamp.name,
        visibility=surface_visibility(lamp),
    )


def _sun(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> core.scene.SunLight | None:
    light = lamp.data
    axis = matrix[:3, 2]
    length = np.linalg.norm(axis)
    if length == 0.0:
        return None
    area = math.pi * math.sin(light.angle / 2.0) ** 2 or 1.0
    return core.scene.SunLight(
        direction=tuple(axis / length),
        irradiance=_scaled(color, 1.0 if versions.light_is_normalized(light) else area),
        angle=light.angle,
        cast_shadow=light.use_shadow,
        name=lamp.name,
        visibility=surface_visibility(lamp),
    )


_EXPORTERS = {"POINT": _point, "SPOT": _spot, "AREA": _area, "SUN": _sun}


def _scaled(color: Color, gain: float) -> Color:
    return color[0] * gain, color[1] * gain, color[2] * gain


def _area_warnings(lamp: bpy.types.Object) -> list[str]:
    if lamp.data.spread < math.pi - 1e-4:
        degrees = math.degrees(lamp.data.spread)
        return [f'light "{lamp.name}": Rooks lights every direction, as with a spread of 180°, not {degrees:.0f}°']
    return []


def _shader_color(lamp: bpy.types.Object) -> tuple[Color, list[str]]:
    """Colour × strength of a lamp's Emission node: white for a lamp without nodes."""
    if not versions.uses_nodes(lamp.data):
        return (1.0, 1.0, 1.0), []
    source = surface_of(lamp.data.node_tree)
    if source is None:
        return (0.0, 0.0, 0.0), []
    if source.node.type != "EMISSION":
        return (1.0, 1.0, 1.0), [_node_warning(lamp, label(source.node))]
    color, strength = constant_color(source.input("Color")), constant_number(source.input("Strength"))
    warnings = []
    if color is None:
        warnings.append(_node_warning(lamp, label(source.input("Color").node)))
    if strength is None:
        warnings.append(_node_warning(lamp, label(source.input("Strength").node)))
    return _scaled(color or (1.0, 1.0, 1.0), 1.0 if strength is None else strength), warnings


def _node_warning(lamp: bpy.types.Object, node: str) -> str:
    return f'light "{lamp.name}": Rooks does not know its node "{node}", and leaves it out'
