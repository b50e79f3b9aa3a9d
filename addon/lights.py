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
from bpy.app.translations import pgettext_rpt as rpt_

from . import versions
from ._core import core
from .folding import constant_of
from .images import Images
from .losses import Losses
from .nodes import Color, surface_of
from .radiance import RadianceReader
from .values import GREY, ValueReader

#: Cycles' limit of the bounces that see a lamp, as it is unless somebody changes it.
ALL_BOUNCES = 1024


def export_light(lamp: bpy.types.Object, matrix: np.ndarray) -> tuple[core.scene.Light | None, list[str]]:
    """A lamp placed by `matrix`, or None where it sheds no light on surfaces; and warnings that name it.

    Raises:
        SceneError: the lamp is nowhere.
    """
    light = lamp.data
    if not surface_visibility(lamp) or _is_portal(light):
        return None, []
    if not np.isfinite(matrix).all():
        text = rpt_('light "{name}" is nowhere (its position is NaN or infinite): move it')
        raise core.errors.SceneError(text.format(name=lamp.name))
    emitted, warnings = _shader_color(lamp)
    color = tuple(
        light.energy * tint * shader for tint, shader in zip(versions.light_tint(light), emitted, strict=True)
    )
    if not any(color):
        return None, warnings
    exported = _EXPORTERS[light.type](lamp, matrix, color)
    if exported is None:
        warnings.append(_warning(lamp, rpt_("it has a size or a scale of 0, and sheds no light")))
        return None, warnings
    return exported, warnings + _warnings(lamp)


def surface_visibility(obj: bpy.types.Object) -> int:
    """The bits of the rays from surfaces that can see an object or a lamp."""
    return (
        (core.scene.VISIBLE_TO_DIFFUSE if obj.visible_diffuse else 0)
        | (core.scene.VISIBLE_TO_GLOSSY if obj.visible_glossy else 0)
        | (core.scene.VISIBLE_TO_TRANSMISSION if obj.visible_transmission else 0)
    )


def linking_problems(obj: bpy.types.Object) -> list[str]:
    """What Rooks does not do of an object's light linking, if it shines: clauses that go on after its name."""
    problems = []
    if obj.light_linking.receiver_collection is not None:
        problems.append(rpt_("Rooks has no light linking, and it lights everything"))
    if obj.light_linking.blocker_collection is not None:
        problems.append(rpt_("Rooks has no shadow linking, and everything casts a shadow in its light"))
    return problems


def _point(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> core.scene.PointLight:
    return core.scene.PointLight(**_sphere_fields(lamp, matrix, color))


def _spot(lamp: bpy.types.Object, matrix: np.ndarray, color: Color) -> core.scene.SpotLight | None:
    light = lamp.data
    if not matrix[:3, :3].any():
        return None
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
    # The renderer's light shines along axis_v × axis_u, Cycles' along the lamp's -Z, which a mirrored scale turns.
    if np.cross(axis_v, axis_u) @ -matrix[:3, 2] < 0.0:
        axis_u = -axis_u
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
    angle = min(light.angle, math.pi)  # Blender's maximum, a float32, is a little more
    area = math.pi * math.sin(angle / 2.0) ** 2 or 1.0
    return core.scene.SunLight(
        direction=tuple(axis / length),
        irradiance=_scaled(color, 1.0 if versions.light_is_normalized(light) else area),
        angle=angle,
        cast_shadow=light.use_shadow,
        name=lamp.name,
        visibility=surface_visibility(lamp),
    )


_EXPORTERS = {"POINT": _point, "SPOT": _spot, "AREA": _area, "SUN": _sun}


def _scaled(color: Color, gain: float) -> Color:
    return color[0] * gain, color[1] * gain, color[2] * gain


def _is_portal(light: bpy.types.Light) -> bool:
    """Whether an area lamp only shows Cycles the way to the world's light, and has none of its own."""
    return light.type == "AREA" and getattr(versions.cycles_settings(light), "is_portal", False)


def _warnings(lamp: bpy.types.Object) -> list[str]:
    """What of a lamp's settings Rooks does not do."""
    light, problems = lamp.data, []
    if light.type == "AREA" and light.spread < math.pi - 1e-4:
        text = rpt_("Rooks lights every direction, as with a spread of 180°, not {degrees:.0f}°")
        problems.append(text.format(degrees=math.degrees(light.spread)))
    if lamp.visible_camera:
        problems.append(rpt_("Rooks does not show lamps to the camera"))
    problems += linking_problems(lamp)
    bounces = getattr(versions.cycles_settings(light), "max_bounces", ALL_BOUNCES)
    if bounces < ALL_BOUNCES:
        problems.append(rpt_("Rooks does not leave it out after its {count} bounces").format(count=bounces))
    return [_warning(lamp, problem) for problem in problems]


def _warning(lamp: bpy.types.Object, problem: str) -> str:
    return rpt_('light "{name}": {problem}').format(name=lamp.name, problem=problem)


def _shader_color(lamp: bpy.types.Object) -> tuple[Color, list[str]]:
    """What a lamp's nodes emit, which its power is multiplied by: white for a lamp without nodes."""
    if not versions.uses_nodes(lamp.data):
        return (1.0, 1.0, 1.0), []
    losses = Losses()
    values = ValueReader(Images(), losses, of_world=True)
    emitted = RadianceReader(values, losses).radiance(surface_of(lamp.data.node_tree))
    color = constant_of(emitted)
    if color is None:
        text = rpt_("its nodes give it light that is not the same everywhere, and what varies is taken for {grey}")
        losses.add(text.format(grey=GREY))
        color = constant_of(emitted, GREY)
    text = losses.warning()
    return color, [] if text is None else [_warning(lamp, text)]
