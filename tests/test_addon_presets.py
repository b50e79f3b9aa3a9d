"""The presets that come with Rooks set all that a preset sets, to values that exist."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("bpy")

import bpy

import addon
from addon import presets
from addon.settings import render_settings
from tests.addon_helpers import empty_scene

addon.register()

FILES = sorted(Path(presets.__file__).parent.glob("preset_scripts/presets/rooks/render/*.py"))


def test_there_are_three_and_blender_finds_them():
    assert [path.stem for path in FILES] == ["Final", "Preview", "Textbook_figure"]
    assert str(FILES[0].parent) in bpy.utils.preset_paths("rooks/render")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_preset_sets_all_that_is_sampled(path):
    scene = empty_scene()
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname="ROOKS_PT_presets")
    domains = {f"{domain}_sampler" for domain in ("pixel", "lens", "light", "bsdf")}
    wanted = {value.removeprefix("rooks.") for value in presets.ROOKS_OT_preset_add.preset_values} - domains
    names = {property.identifier for property in scene.rooks.bl_rna.properties} - {"rna_type"}
    assert {name for name in names if scene.rooks.is_property_set(name)} == wanted
    render_settings(scene, (32, 24))


def test_without_rooks_its_presets_are_gone():
    addon.unregister()
    try:
        assert str(FILES[0].parent) not in bpy.utils.preset_paths("rooks/render")
    finally:
        addon.register()
