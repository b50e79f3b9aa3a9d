"""Presets of the Sampling panel: three that come with Rooks, and those that the user adds.

They are scripts in the folder `preset_scripts`, as Blender's own presets are.
"""

from __future__ import annotations

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .engine import ENGINE_ID
from .settings import LIGHT_PATHS

_FOLDER = str(Path(__file__).parent / "preset_scripts")

#: What a preset sets: how the picture is sampled, and nothing of what it shows.
_VALUES = (
    *("samples", "preview_samples", "sampler", "use_separate_samplers"),
    *("pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler"),
    *LIGHT_PATHS,
    "pixel_filter",
)


class ROOKS_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Rooks Presets"
    preset_subdir = "rooks/render"
    preset_operator = "script.execute_preset"
    preset_add_operator = "rooks.preset_add"
    COMPAT_ENGINES = {ENGINE_ID}


class ROOKS_OT_preset_add(AddPresetBase, bpy.types.Operator):
    """Keep the sampling, the light paths and the pixel filter as a preset, or remove a preset of one's own"""

    bl_idname = "rooks.preset_add"
    bl_label = "Add Rooks Preset"
    preset_menu = "ROOKS_PT_presets"
    preset_defines = ["rooks = bpy.context.scene.rooks"]
    preset_values = [f"rooks.{name}" for name in _VALUES]
    preset_subdir = "rooks/render"


def register() -> None:
    bpy.utils.register_class(ROOKS_OT_preset_add)
    bpy.utils.register_class(ROOKS_PT_presets)
    bpy.utils.register_preset_path(_FOLDER)


def unregister() -> None:
    bpy.utils.unregister_preset_path(_FOLDER)
    bpy.utils.unregister_class(ROOKS_PT_presets)
    bpy.utils.unregister_class(ROOKS_OT_preset_add)
