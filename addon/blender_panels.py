"""Blender's own panels that apply to Rooks: for camera, lights, world, materials, output and colour management."""

from __future__ import annotations

import bpy

from .engine import ENGINE_ID

#: Panels for "every engine" that show what Rooks does not do, by how their names begin.
EXCLUDED_PANELS = (
    "DATA_PT_camera_stereoscopy",
    "DATA_PT_lightprobe",
    "DATA_PT_volume_render",
    "MATERIAL_PT_freestyle",
    "NODE_DATA_PT_light",
    "NODE_DATA_PT_spot",
    "OBJECT_PT_shading",  # light linking
    "PARTICLE_PT_render_path",  # hair
    "RENDER_PT_freestyle",
    "RENDER_PT_gpencil",
    "RENDER_PT_grease_pencil",
    "RENDER_PT_hydra",
    "RENDER_PT_output_views",
    "RENDER_PT_simplify",  # it would stand above Sampling: there is one of our own
    "RENDER_PT_stereoscopy",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_freestyle",
    "VIEWLAYER_PT_layer_passes",
)
#: And one that is Workbench's: its lamps have a colour only.
EXCLUDED_PANEL = "DATA_PT_light"

#: Panels of other engines that fit. Some exist in some versions of Blender only.
BORROWED_PANELS = (
    "DATA_PT_EEVEE_light",
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "MATERIAL_PT_preview",
    "VIEWLAYER_PT_layer_passes",
)


def register() -> None:
    for panel in _panels():
        # Panels share one set of engines among them; each gets a copy, so that no other panel appears with it.
        panel.COMPAT_ENGINES = {*panel.COMPAT_ENGINES, ENGINE_ID}


def unregister() -> None:
    for panel in bpy.types.Panel.__subclasses__():
        if not panel.__module__.startswith(f"{__package__}.") and ENGINE_ID in getattr(panel, "COMPAT_ENGINES", ()):
            panel.COMPAT_ENGINES.discard(ENGINE_ID)


def _panels() -> list[type]:
    general = [
        panel
        for panel in bpy.types.Panel.__subclasses__()
        if "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ())
        and panel.__name__ != EXCLUDED_PANEL
        and not panel.__name__.startswith(EXCLUDED_PANELS)
    ]
    borrowed = [getattr(bpy.types, name) for name in BORROWED_PANELS if hasattr(bpy.types, name)]
    return list(dict.fromkeys(general + borrowed))
