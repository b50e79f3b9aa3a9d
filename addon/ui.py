"""Panels: where a Blender user looks for sampling, film, threads and passes."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_

from . import compare_operators, engine, pattern_plot, presets, versions
from ._core import core
from .engine import ENGINE_ID
from .progress import DOMAIN_LABELS, sample_text, sampler_label
from .settings import sampling

#: The height of a pattern's plot, in rows of the interface.
PLOT_SCALE = 9.0
#: Kinds of object that rays can see.
VISIBLE_TYPES = {"MESH", "CURVE", "SURFACE", "META", "FONT", "LIGHT"}
#: What the four marks of a good point set are called, in the order of `Criteria`.
MARKS = (n_("Even in 2-D"), n_("Even in 1-D"), n_("Min Distance"), n_("Irregular"))
#: Which rays see an object, as Blender's properties name them and as the user knows them.
RAYS = {
    "camera": n_("Camera"),
    "diffuse": n_("Diffuse"),
    "glossy": n_("Glossy"),
    "transmission": n_("Transmission"),
    "shadow": n_("Shadow"),
}
#: A lamp is neither seen by the camera nor in the way of other lamps.
LAMP_RAYS = ("diffuse", "glossy", "transmission")


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
        counts = column.column(align=True)
        counts.prop(rooks, "preview_samples", text="Viewport Samples")
        counts.prop(rooks, "samples", text="Render Samples")
        row = column.row()
        row.active = not rooks.use_separate_samplers
        row.prop(rooks, "sampler")
        for line in sample_count_lines(rooks) or [sample_text(_sampling_settings(rooks, rooks.samples))]:
            column.label(text=line, icon="INFO", translate=False)
        column.separator()
        row = column.row(align=True)
        row.prop(rooks, "seed")
        row.prop(rooks, "use_animated_seed", text="", icon="TIME")

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        presets.ROOKS_PT_presets.draw_panel_header(self.layout)


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
        settings = _sampling_settings(rooks, rooks.samples)
        used_for: dict[str, list[str]] = {}
        for domain, name in settings.samplers.items():
            used_for.setdefault(name, []).append(iface_(DOMAIN_LABELS[domain]))
        for name, domains in used_for.items():
            plot = pattern_plot.plot_of(name, settings.sample_count, rooks.seed)
            column = self.layout.column(align=True)
            column.template_icon(icon_value=plot.icon, scale=PLOT_SCALE)
            where = f" ({', '.join(domains)})" if len(used_for) > 1 else ""
            _draw_centered(column, sampler_label(name) + where)
            _draw_centered(column, point_text(settings.sample_count, plot.count))
            _draw_verdicts(column, core.samplers.SAMPLERS[name].criteria)


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
        row.progress(factor=worker.share, text=compare_operators.progress_text(worker), translate=False)
        row.operator("rooks.cancel_comparison", text="", icon="X")


class ROOKS_RENDER_PT_light_paths(_RooksPanel, bpy.types.Panel):
    bl_label = "Light Paths"

    def draw(self, context: bpy.types.Context) -> None:
        pass


class ROOKS_RENDER_PT_bounces(_RooksPanel, bpy.types.Panel):
    bl_label = "Max Bounces"
    bl_parent_id = "ROOKS_RENDER_PT_light_paths"

    def draw(self, context: bpy.types.Context) -> None:
        rooks = context.scene.rooks
        column = self.column()
        column.prop(rooks, "max_bounces", text="Total")
        kinds = column.column(align=True)
        kinds.active = rooks.max_bounces > 0
        for kind in ("diffuse", "glossy", "transmission"):
            kinds.prop(rooks, f"{kind}_bounces", text=RAYS[kind])
        column.prop(rooks, "transparent_bounces", text="Transparent")


class ROOKS_RENDER_PT_clamping(_RooksPanel, bpy.types.Panel):
    bl_label = "Clamping"
    bl_parent_id = "ROOKS_RENDER_PT_light_paths"

    def draw(self, context: bpy.types.Context) -> None:
        rooks = context.scene.rooks
        column = self.column()
        column.active = rooks.max_bounces > 0
        column.prop(rooks, "clamp_indirect", text="Indirect Light")


class ROOKS_RENDER_PT_simplify(_RooksPanel, bpy.types.Panel):
    """Blender's own, which is registered before ours, would stand above Sampling. Cycles has one of its own, too."""

    bl_label = "Simplify"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: bpy.types.Context) -> None:
        pass


class ROOKS_RENDER_PT_simplify_viewport(_RooksPanel, bpy.types.Panel):
    bl_label = "Viewport"
    bl_parent_id = "ROOKS_RENDER_PT_simplify"

    def draw(self, context: bpy.types.Context) -> None:
        render = context.scene.render
        column = self.column()
        column.active = render.use_simplify
        column.prop(render, "simplify_subdivision", text="Max Subdivision")
        column.prop(render, "simplify_child_particles", text="Max Child Particles")


class ROOKS_RENDER_PT_simplify_render(_RooksPanel, bpy.types.Panel):
    bl_label = "Render"
    bl_parent_id = "ROOKS_RENDER_PT_simplify"

    def draw(self, context: bpy.types.Context) -> None:
        render = context.scene.render
        column = self.column()
        column.active = render.use_simplify
        column.prop(render, "simplify_subdivision_render", text="Max Subdivision")
        column.prop(render, "simplify_child_particles_render", text="Max Child Particles")


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
        column.prop(context.scene.rooks, "tile_size")
        for line in engine.last_render:
            column.label(text=line, icon="INFO", translate=False)


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
        column.prop(view_layer.rooks, "use_pass_denoising_data")


class ROOKS_VIEWLAYER_PT_override(_RooksPanel, bpy.types.Panel):
    bl_label = "Override"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        column.prop(context.view_layer, "material_override")
        column.prop(context.view_layer, "world_override")


class ROOKS_OBJECT_PT_ray_visibility(_RooksPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.object is not None and context.object.type in VISIBLE_TYPES

    def draw(self, context: bpy.types.Context) -> None:
        column = self.column()
        for ray in LAMP_RAYS if context.object.type == "LIGHT" else RAYS:
            column.prop(context.object, f"visible_{ray}", text=RAYS[ray])


class ROOKS_OBJECT_PT_shadow_terminator(_RooksPanel, bpy.types.Panel):
    bl_label = "Shadow Terminator"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context) or context.object is None:
            return False
        kinds = VISIBLE_TYPES - {"LIGHT"}
        return context.object.type in kinds and versions.shadow_terminator(context.object) is not None

    def draw(self, context: bpy.types.Context) -> None:
        owner = versions.shadow_terminator(context.object)
        self.column().prop(owner, "shadow_terminator_geometry_offset", text="Geometry Offset")


class _LightPanel(_RooksPanel):
    """A part of the panel of a lamp."""

    bl_context = "data"
    bl_parent_id = "DATA_PT_EEVEE_light"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light is not None


class ROOKS_LIGHT_PT_shadow(_LightPanel, bpy.types.Panel):
    bl_label = "Shadow"

    def draw(self, context: bpy.types.Context) -> None:
        self.column().prop(context.light, "use_shadow", text="Cast Shadow")


class ROOKS_LIGHT_PT_nodes(_LightPanel, bpy.types.Panel):
    bl_label = "Nodes"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        light, column = context.light, self.column()
        if versions.nodes_are_a_choice(light):
            column.prop(light, "use_nodes", icon="NODETREE")
        if versions.uses_nodes(light):
            _draw_surface(column, light)


class _MaterialPanel(_RooksPanel):
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = context.material
        return super().poll(context) and material is not None and material.grease_pencil is None


class ROOKS_MATERIAL_PT_surface(_MaterialPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context: bpy.types.Context) -> None:
        _draw_nodes(self.column(), context.material, "diffuse_color")


class ROOKS_MATERIAL_PT_settings(_MaterialPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        material = context.material
        column = self.column()
        column.prop(material.rooks, "glossy_lobe")
        # A setting of Cycles', which Rooks shares, and which is not there where Cycles is disabled.
        if hasattr(material, "cycles"):
            column.prop(material.cycles, "emission_sampling")


class _WorldPanel(_RooksPanel):
    bl_context = "world"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.world is not None


class ROOKS_WORLD_PT_preview(_WorldPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.template_preview(context.world)


class ROOKS_WORLD_PT_surface(_WorldPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context: bpy.types.Context) -> None:
        _draw_nodes(self.column(), context.world, "color")


CLASSES = (
    ROOKS_RENDER_PT_sampling,
    ROOKS_RENDER_PT_separate_samplers,
    ROOKS_RENDER_PT_pattern,
    ROOKS_RENDER_PT_compare,
    ROOKS_RENDER_PT_light_paths,
    ROOKS_RENDER_PT_bounces,
    ROOKS_RENDER_PT_clamping,
    ROOKS_RENDER_PT_simplify,
    ROOKS_RENDER_PT_simplify_viewport,
    ROOKS_RENDER_PT_simplify_render,
    ROOKS_RENDER_PT_film,
    ROOKS_RENDER_PT_performance,
    ROOKS_VIEWLAYER_PT_passes,
    ROOKS_VIEWLAYER_PT_override,
    ROOKS_OBJECT_PT_ray_visibility,
    ROOKS_OBJECT_PT_shadow_terminator,
    ROOKS_LIGHT_PT_shadow,
    ROOKS_LIGHT_PT_nodes,
    ROOKS_MATERIAL_PT_surface,
    ROOKS_MATERIAL_PT_settings,
    ROOKS_WORLD_PT_preview,
    ROOKS_WORLD_PT_surface,
)


def sample_count_lines(rooks: bpy.types.PropertyGroup) -> list[str]:
    """What the user is told where other counts than those asked for are taken."""
    lines, names = [], set(sampling(rooks).values())
    taken = _sampling_settings(rooks, rooks.samples).sample_count
    if taken != rooks.samples and len(names) > 1:
        lines.append(iface_("Together they take {count} samples").format(count=taken))
    elif taken != rooks.samples:
        lines.append(iface_("{sampler} takes {count} samples").format(sampler=sampler_label(names.pop()), count=taken))
    in_viewport = _sampling_settings(rooks, rooks.preview_samples).sample_count
    if in_viewport != rooks.preview_samples:
        lines.append(iface_("In the viewport: {count} samples").format(count=in_viewport))
    return lines


def _sampling_settings(rooks: bpy.types.PropertyGroup, samples: int) -> core.settings.RenderSettings:
    return core.settings.RenderSettings(samples=samples, **sampling(rooks))


def point_text(count: int, shown: int) -> str:
    """How many points a set has, and how many are in its plot where that is another set."""
    if shown != count:
        return iface_("{count} points; shown: a set of {shown}").format(count=count, shown=shown)
    return iface_("1 point") if count == 1 else iface_("{count} points").format(count=count)


def _draw_nodes(layout: bpy.types.UILayout, id_block: bpy.types.Material | bpy.types.World, color: str) -> None:
    """The nodes of a final render's Surface, or the property `color` that stands in for nodes."""
    if versions.nodes_are_a_choice(id_block):
        layout.prop(id_block, "use_nodes", icon="NODETREE")
    if versions.uses_nodes(id_block):
        _draw_surface(layout, id_block)
    else:
        layout.prop(id_block, color, text="Color")


def _draw_surface(layout: bpy.types.UILayout, id_block: bpy.types.Material | bpy.types.World | bpy.types.Light) -> None:
    output = id_block.node_tree.get_output_node("CYCLES")
    if output is None:
        layout.label(text="No output node")
    else:
        layout.template_node_view(id_block.node_tree, output, output.inputs["Surface"])


def _draw_centered(layout: bpy.types.UILayout, text: str) -> None:
    row = layout.row()
    row.alignment = "CENTER"
    row.label(text=text, translate=False)


def _draw_verdicts(layout: bpy.types.UILayout, criteria: core.samplers.Criteria) -> None:
    """Which marks a sampler has, as a table of two columns."""
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    for mark, is_met in zip(MARKS, criteria, strict=True):
        grid.label(text=mark, icon="CHECKMARK" if is_met else "X")


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    pattern_plot.forget()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
