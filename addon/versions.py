"""What differs between the Blender versions that are supported, 4.2 to 5.2, each in a function of its own."""

from __future__ import annotations

import bpy


def nodes_are_a_choice(id_block: bpy.types.Material | bpy.types.World | bpy.types.Light) -> bool:
    """Whether a material, a world or a lamp can do without shader nodes.

    From 5.0 materials and worlds always have nodes, from 5.2 lamps too, and asking them is deprecated.
    """
    return bpy.app.version < ((5, 2) if isinstance(id_block, bpy.types.Light) else (5, 0))


def uses_nodes(id_block: bpy.types.Material | bpy.types.World | bpy.types.Light) -> bool:
    """Whether shader nodes describe a material, a world or a lamp."""
    return id_block.node_tree is not None and (not nodes_are_a_choice(id_block) or id_block.use_nodes)


def light_tint(light: bpy.types.Light) -> tuple[float, float, float]:
    """A lamp's colour, with the blackbody colour and the exposure (in stops) that lamps have from 4.5 on."""
    red, green, blue = light.color
    if getattr(light, "use_temperature", False):
        red, green, blue = (channel * warm for channel, warm in zip(light.color, light.temperature_color, strict=True))
    gain = 2.0 ** getattr(light, "exposure", 0.0)
    return red * gain, green * gain, blue * gain


def light_is_normalized(light: bpy.types.Light) -> bool:
    """Whether a lamp's power stays the same when its size changes; a choice from 4.5 on."""
    return getattr(light, "normalize", True)


def choose_file_format(settings: bpy.types.ImageFormatSettings, file_format: str) -> None:
    """Make rendered pictures be saved in a format. From 5.0 the kind of medium has to be chosen first."""
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format = file_format


def choose_multilayer_format(settings: bpy.types.ImageFormatSettings) -> None:
    """Make rendered pictures be saved as EXRs with all passes, in single precision."""
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"


def animation_curves(block: bpy.types.ID) -> list[bpy.types.FCurve]:
    """The curves and drivers that animate a data block's properties, also those in NLA strips."""
    animation = block.animation_data
    if animation is None:
        return []
    curves = [*animation.drivers, *_curves_of_action(animation)]
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    while strips:
        strip = strips.pop()
        strips += strip.strips  # of a meta strip
        curves += _curves_of_action(strip)
    return curves


def _curves_of_action(owner: bpy.types.AnimData | bpy.types.NlaStrip) -> list[bpy.types.FCurve]:
    """From 4.4 on an action is one of layers, with a part for each of those that use it."""
    if owner.action is None:
        return []
    if not hasattr(owner, "action_slot"):
        return list(owner.action.fcurves)
    bags = (bag for layer in owner.action.layers for strip in layer.strips for bag in strip.channelbags)
    return [curve for bag in bags if bag.slot == owner.action_slot for curve in bag.fcurves]


def path_options() -> set[str]:
    """The options of a property that is a path: it may begin with "//". That has to be said from 4.5 on."""
    return {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5) else set()


def is_looked_up(socket: bpy.types.NodeSocket | None, texture: bpy.types.Node) -> bool:
    """Whether a texture looks up the value of the unlinked socket that feeds its Vector.

    From 5.0 on it does if that is a group's input, and does not hide its value.
    """
    return bpy.app.version >= (5, 0) and socket is not None and socket.node != texture and not socket.hide_value


def normal_map_points_down(node: bpy.types.Node) -> bool:
    """Whether a Normal Map node's green grows downwards, DirectX's convention; a choice that 5.0 does not have yet."""
    return getattr(node, "convention", "OPENGL") == "DIRECTX"


def shadow_terminator(obj: bpy.types.Object) -> bpy.types.bpy_struct | None:
    """What has the offsets of an object's shadow terminator: itself; up to 4.3 what Cycles adds, if enabled.

    For panels, which change it: of an evaluated object, see `shadow_terminator_offsets`.
    """
    return obj if hasattr(obj, "shadow_terminator_geometry_offset") else getattr(obj, "cycles", None)


def cycles_settings(block: bpy.types.ID, name: str = "cycles") -> bpy.types.bpy_struct | None:
    """What Cycles has stored with a data block; None where it is disabled, and where nothing was changed.

    Asked for what is not stored, Blender would add it to the evaluated data block, which up to 4.3 it does not free if
    that is an object.
    """
    is_known = name in block.bl_rna.properties
    return getattr(block, name) if is_known and block.is_property_set(name) else None


def shadow_terminator_offsets(obj: bpy.types.Object) -> tuple[float, float]:
    """The Geometry Offset and the Shading Offset of an object's shadow terminator."""
    owner = obj if hasattr(obj, "shadow_terminator_geometry_offset") else cycles_settings(obj)
    geometry = getattr(owner, "shadow_terminator_geometry_offset", 0.1)  # Blender's default
    older = getattr(owner, "shadow_terminator_offset", 0.0)
    return geometry, getattr(owner, "shadow_terminator_shading_offset", older)
