"""Panels show settings where a user of Cycles looks for them, and nothing that does nothing."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from addon import ui  # noqa: E402
from tests.addon_helpers import empty_scene, quad, shader  # noqa: E402


class Layout:
    """Stands in for Blender's layout, which there is only with a window: remembers what is drawn."""

    def __init__(self, drawn: list[str]) -> None:
        self._drawn = drawn

    def column(self, **_options) -> Layout:
        return Layout(self._drawn)

    def prop(self, owner, name: str, **_options) -> None:
        assert name in owner.bl_rna.properties, f"{owner} has no {name}"
        self._drawn.append(name)

    def label(self, text: str) -> None:
        self._drawn.append(text)

    def template_node_view(self, tree, node, socket) -> None:
        self._drawn.append(f"{node.bl_idname} {socket.identifier}")


class Context:
    """What panels read of Blender's context."""

    engine = "ROOKS"

    def __init__(self, **members) -> None:
        self.scene = bpy.context.scene
        self.object = self.material = self.world = None
        self.__dict__.update(members)


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def drawn_by(panel, **members) -> list[str] | None:
    """What a panel draws, or None where it does not show."""
    context = Context(**members)
    if not panel.poll(context):
        return None
    drawn: list[str] = []

    class Instance:
        layout = Layout(drawn)
        column = panel.column

    panel.draw(Instance(), context)
    return drawn


def test_light_paths():
    kinds = ["diffuse_bounces", "glossy_bounces", "transmission_bounces"]
    assert drawn_by(ui.ROOKS_RENDER_PT_bounces) == ["max_bounces", *kinds, "transparent_bounces"]
    assert drawn_by(ui.ROOKS_RENDER_PT_clamping) == ["clamp_indirect"]
    assert {ui.ROOKS_RENDER_PT_bounces.bl_parent_id, ui.ROOKS_RENDER_PT_clamping.bl_parent_id} == {
        "ROOKS_RENDER_PT_light_paths"
    }


def test_the_surface_of_a_material_is_that_of_final_renders():
    paint, _node = shader("ShaderNodeBsdfDiffuse")
    surface = drawn_by(ui.ROOKS_MATERIAL_PT_surface, material=paint)
    choice = ["use_nodes"] if bpy.app.version < (5, 0) else []
    assert surface == [*choice, "ShaderNodeOutputMaterial Surface"]
    paint.node_tree.nodes.clear()
    assert drawn_by(ui.ROOKS_MATERIAL_PT_surface, material=paint) == [*choice, "No output node"]


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="every material has nodes from Blender 5.0 on")
def test_without_nodes_only_the_colour_that_counts_is_shown():
    paint = bpy.data.materials.new("Plain")
    assert drawn_by(ui.ROOKS_MATERIAL_PT_surface, material=paint) == ["use_nodes", "diffuse_color"]
    world = bpy.data.worlds.new("Plain")
    assert drawn_by(ui.ROOKS_WORLD_PT_surface, world=world) == ["use_nodes", "color"]


def test_settings_of_a_material():
    paint, _node = shader("ShaderNodeBsdfDiffuse")
    assert drawn_by(ui.ROOKS_MATERIAL_PT_settings, material=paint) == ["glossy_lobe", "emission_sampling"]


def test_the_choices_of_the_glossy_lobe():
    items = bpy.data.materials.new("Paint").rooks.bl_rna.properties["glossy_lobe"].enum_items
    assert items.keys() == ["MICROFACET", "COSINE_POWER"]
    assert "Replaces the lobe of the material's Glossy BSDF nodes" in items["COSINE_POWER"].description


@pytest.mark.parametrize("panel", ["MATERIAL_PT_surface", "MATERIAL_PT_settings", "WORLD_PT_surface"])
def test_panels_hide_where_there_is_nothing(panel):
    assert drawn_by(getattr(ui, f"ROOKS_{panel}")) is None


def shown_panels() -> set[str]:
    panels = bpy.types.Panel.__subclasses__()
    return {panel.__name__ for panel in panels if "ROOKS" in getattr(panel, "COMPAT_ENGINES", ())}


def test_blenders_panels_that_apply_are_there_and_those_that_do_nothing_are_not():
    shown = shown_panels()
    assert {"DATA_PT_EEVEE_light", "DATA_PT_spot", "DATA_PT_camera_dof"} <= shown
    assert not {"DATA_PT_light", "DATA_PT_volume_render", "OBJECT_PT_shading", "PARTICLE_PT_render_path"} & shown
    assert not {"DATA_PT_lightprobe", "DATA_PT_lightprobe_display"} & shown
    assert "RENDER_PT_simplify" not in shown, "it is registered before Sampling, and would stand above it"
    for word in ("freestyle", "gpencil", "grease", "stereo", "hydra"):
        assert not {name for name in shown if word in name.lower()}


def test_no_panel_is_there_without_the_one_that_it_is_part_of():
    shown = shown_panels()
    for name in shown:
        parent = getattr(getattr(bpy.types, name, None), "bl_parent_id", "")
        # Some panels show for all engines, and have no list of them.
        assert not parent or parent in shown or not hasattr(getattr(bpy.types, parent), "COMPAT_ENGINES"), name


def test_lamps_may_cast_no_shadow():
    bulb = bpy.data.lights.new("Bulb", "POINT")
    assert drawn_by(ui.ROOKS_LIGHT_PT_shadow, light=bulb) == ["use_shadow"]
    assert drawn_by(ui.ROOKS_LIGHT_PT_shadow, light=None) is None


def test_nodes_of_a_lamp():
    bulb = bpy.data.lights.new("Bulb", "POINT")
    bulb.use_nodes = True
    choice = ["use_nodes"] if bpy.app.version < (5, 2) else []
    assert drawn_by(ui.ROOKS_LIGHT_PT_nodes, light=bulb) == [*choice, "ShaderNodeOutputLight Surface"]
    assert drawn_by(ui.ROOKS_LIGHT_PT_nodes, light=None) is None


def test_what_a_view_layer_overrides():
    layer = bpy.context.view_layer
    assert drawn_by(ui.ROOKS_VIEWLAYER_PT_override, view_layer=layer) == ["material_override", "world_override"]


def test_ray_visibility():
    surfaces = ["visible_diffuse", "visible_glossy", "visible_transmission"]
    panel = ui.ROOKS_OBJECT_PT_ray_visibility
    assert drawn_by(panel, object=quad()) == ["visible_camera", *surfaces, "visible_shadow"]
    bulb = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
    assert drawn_by(panel, object=bulb) == surfaces
    assert drawn_by(panel, object=bpy.data.objects.new("Empty", None)) is None
    assert drawn_by(panel) is None
