"""Previews of materials: what Blender's own scene for them asks for with nodes that Rooks does not know."""

from __future__ import annotations

from dataclasses import replace

from ._core import core

#: The floor of Blender's preview scene has this material where only the object is to be seen: by a Light Path node it
#: is transparent to the camera, and still reflects light.
HIDDEN_FLOOR = "FloorHidden"


def without_floor(scene: core.scene.Scene) -> core.scene.Scene:
    """The scene of a preview with that floor hidden from the camera."""
    return replace(scene, instances=tuple(map(_hidden_from_camera, scene.instances)))


def _hidden_from_camera(instance: core.scene.Instance) -> core.scene.Instance:
    if all(material.name != HIDDEN_FLOOR for material in instance.materials):
        return instance
    return replace(instance, visibility=instance.visibility & ~core.scene.VISIBLE_TO_CAMERA)
