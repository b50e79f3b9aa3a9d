"""Panels: where a Blender user looks for sampling, film, threads and passes, and Blender's own panels that apply."""

from __future__ import annotations

import bpy

from . import compare_operators, pattern_plot
from ._core import core
from .engine import ENGINE_ID, sample_text
from .settings import sampling

#: The height of a pattern's plot, in rows of the interface.
PLOT_SCALE = 9.0
#: What the user knows the domains as.
DOMAIN_LABELS = {"pixel": "pixel", "lens": "lens", "light": "light", "bsdf": "surface"}
#: What the four marks of a good point set are called, in the order of `Criteria`.
MARKS = ("Even in 2-D", "Even in 1-D", "Min Distance", "Irregular")

#: Panels for "every engine" that show what Rooks does not do.
EXCLUDED_PANELS = {
    "DATA_PT_light",
    "DATA_PT_preview",
    "DATA_PT_spot",
    "MATERIAL_PT_freestyle_line",
    "NODE_DATA_PT_light",
    "NODE_DATA_PT_spot",
    "RENDER_PT_freestyle",
    "RENDER_PT_hydra_debug",
    "RENDER_PT_simplify",
    "RENDER_PT_stereoscopy",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_freestyle",
    "VIEWLAYER_PT_freestyle_lineset",
    "VIEWLAYER_PT_layer_passes",
}

#: Panels of other engines that fit. Some exist in some versions of Blender only.
BORROWED_PANELS = (
    "DATA_PT_EEVEE_light",
    "DATA_PT_EEVEE_spot",
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "MATERIAL_PT_preview",
    "VIEWLAYER_PT_layer_passes",
)


class _RooksPanel:
    """A panel that shows while Rooks is the render engine."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE_ID}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def column(self) -> bpy.types.UILayout:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout.column()


class ROOKS_RENDER_PT_sampling(_RooksPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context: bpy.types.Context) -> None:
        rooks = context.scene.rooks
        column = self.column()
        column.prop(rooks, "samples")
        row = column.row()
        row.active = not rooks.use_separate_samplers
        row.prop(rooks, "sampler")
        for line in sample_count_lines(rooks) or [sample_text(_sampling_settings(rooks))]:
            column.label(text=line, icon="INFO")
        column.separator()
        column.prop(rooks, "max_bounces")
        column.prop(rooks, "seed")


class ROOKS_RENDER_PT_separate_samplers(_RooksPanel, bpy.types.Panel):
    bl_label = "Separate Samplers"
    bl_parent_id = "ROOKS_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.rooks, "use_separate_samplers", text="")

    def draw(self, context: bpy.types.Context) -> None:
        rooks = context.scene.rooks
        column = self.column()
        column.active = rooks.use_separate_samplers
        for name in ("pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler"):
            column.prop(rooks, name)


class ROOKS_RENDER_PT_pattern(_RooksPanel, bpy.types.Panel):
    bl_label = "Pattern"
    bl_parent_id = "ROOKS_RENDER_PT_sampling"

    def draw(self, context: bpy.types.Context) -> None:
        rooks = context.scene.rooks
        settings = _sampling_settings(rooks)
        used_for: dict[str, list[str]] = {}
        for domain, name in settings.samplers.items():
            used_for.setdefault(name, []).append(DOMAIN_LABELS[domain])
        for name, domains in used_for.items():
            sampler = core.samplers.SAMPLERS[name]
            plot = pattern_plot.plot_of(name, settings.sample_count, rooks.seed)
            column = self.layout.column(align=True)
            column.template_icon(icon_value=plot.icon, scale=PLOT_SCALE)
            where = f" ({', '.join(domains)})" if len(used_for) > 1 else ""
            _draw_centered(column, sampler.label + where)
            _draw_centered(column, point_text(settings.sample_count, plot.count))
            _draw_verdicts(column, sampler.criteria)


class ROOKS_RENDER_PT_compare(_RooksPanel, bpy.types.Panel):
    bl_label = "Compare Samplers"
    bl_parent_id = "ROOKS_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        wishes = context.scene.rooks.comparison
        column = self.column()
        for name in ("samplers", "counts", "seeds", "size", "folder"):
            column.prop(wishes, name)
        column.separator()
        worker = compare_operators.running()
        if worker is None:
            column.operator("rooks.compare_samplers", icon="RENDER_RESULT")
            return
        row = column.row()
        row.progress(factor=worker.share, text=compare_operators.progress_text(worker))
        row.operator("rooks.cancel_comparison", text="", icon="X")


class ROOKS_RENDER_PT_film(_RooksPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        scene = context.scene
        column = self.column()
        column.prop(scene.render, "film_transparent", text="Transparent")
        column.prop(scene.rooks, "pixel_filter")
        if scene.rooks.pixel_filter != "BOX":
            column.prop(scene.render, "filter_size", text="Width")


class ROOKS_RENDER_PT_performance(_RooksPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        render = context.scene.render
        column = self.column()
        column.prop(render, "threads_mode")
        row = column.row()
        row.active = render.threads_mode == "FIXED"
        row.prop(render, "threads")


class ROOKS_VIEWLAYER_PT_passes(_RooksPanel, bpy.types.Panel):
    bl_label = "Data"
    bl_context = "view_layer"
    bl_parent_id = "VIEWLAYER_PT_layer_passes"

    def draw(self, context: bpy.types.Context) -> None:
        view_layer = context.view_layer
        column = self.column()
        column.prop(view_layer, "use_pass_z", text="Depth")
        column.prop(view_layer, "use_pass_normal")
        column.prop(view_layer.rooks, "use_pass_sampling_error")


CLASSES = (
    ROOKS_RENDER_PT_sampling,
    ROOKS_RENDER_PT_separate_samplers,
    ROOKS_RENDER_PT_pattern,
    ROOKS_RENDER_PT_compare,
    ROOKS_RENDER_PT_film,
    ROOKS_RENDER_PT_performance,
    ROOKS_VIEWLAYER_PT_passes,
)


def sample_count_lines(rooks: bpy.types.PropertyGroup) -> list[str]:
    """What the user is told where another count than the one asked for is taken."""
    asked, names = rooks.samples, set(sampling(rooks).values())
    taken = _sampling_settings(rooks).sample_count
    if taken == asked:
        return []
    choosers = [core.samplers.SAMPLERS[name].label for name in sorted(names)]
    who = choosers[0] if len(choosers) == 1 else "Together they"
    verb = "takes" if len(choosers) == 1 else "take"
    return [f"{who} {verb} {taken} samples"]


def _sampling_settings(rooks: bpy.types.PropertyGroup) -> core.settings.RenderSettings:
    return core.settings.RenderSettings(samples=rooks.samples, **sampling(rooks))


def point_text(count: int, shown: int) -> str:
    """How many points a set has, and how many are in its plot where that is another set."""
    text = f"{count} point{'s' * (count != 1)}"
    return text if shown == count else f"{text}; shown: a set of {shown}"


def _draw_centered(layout: bpy.types.UILayout, text: str) -> None:
    row = layout.row()
    row.alignment = "CENTER"
    row.label(text=text)


def _draw_verdicts(layout: bpy.types.UILayout, criteria: core.samplers.Criteria) -> None:
    """Which marks a sampler has, as a table of two columns."""
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    for mark, is_met in zip(MARKS, criteria, strict=True):
        grid.label(text=mark, icon="CHECKMARK" if is_met else "X")


def register() -> None:
    for panel in _blender_panels():
        # Panels share one set of engines among them; each gets a copy, so that no other panel appears with it.
        panel.COMPAT_ENGINES = {*panel.COMPAT_ENGINES, ENGINE_ID}
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    pattern_plot.forget()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    for panel in bpy.types.Panel.__subclasses__():
        if panel not in CLASSES and ENGINE_ID in getattr(panel, "COMPAT_ENGINES", ()):
            panel.COMPAT_ENGINES.discard(ENGINE_ID)


def _blender_panels() -> list[type]:
    general = [
        panel
        for panel in bpy.types.Panel.__subclasses__()
        if "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ()) and panel.__name__ not in EXCLUDED_PANELS
    ]
    borrowed = [getattr(bpy.types, name) for name in BORROWED_PANELS if hasattr(bpy.types, name)]
    return list(dict.fromkeys(general + borrowed))
