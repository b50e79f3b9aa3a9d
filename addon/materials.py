"""Blender's materials as the renderer's `Material`: a tree of shaders, and what that tree looks up on the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import versions
from ._core import core
from .images import Images
from .losses import Losses
from .meshes import Needs, any_is_deformed
from .nodes import surface_of, trace
from .shaders import ShaderReader
from .values import ValueReader


@dataclass(frozen=True)
class ExportedMaterial:
    """A material, and what it looks up on the meshes that have it."""

    material: core.scene.Material
    needs: Needs


class MaterialExporter:
    """Turns materials into the renderer's, each once. Warnings gather in `warnings`."""

    def __init__(self, images: Images) -> None:
        self.warnings: list[str] = []
        self._images = images
        self._is_deformed = any_is_deformed()
        self._materials: dict[int, ExportedMaterial] = {}
        self._default = ExportedMaterial(core.scene.Material(), Needs())

    def export(self, material: bpy.types.Material | None) -> ExportedMaterial:
        """The renderer's material; None, an empty slot, is Blender's default grey."""
        if material is None:
            return self._default
        key = material.as_pointer()
        if key not in self._materials:
            self._materials[key] = self._read(material)
        return self._materials[key]

    def _read(self, material: bpy.types.Material) -> ExportedMaterial:
        if not versions.uses_nodes(material):
            grey = core.shaders.Diffuse(tuple(material.diffuse_color)[:3])
            return ExportedMaterial(core.scene.Material(material.name, grey), Needs())
        losses = Losses()
        values = ValueReader(self._images, losses, is_deformed=self._is_deformed)
        reader = ShaderReader(values, losses, material.rooks.glossy_lobe)
        source = surface_of(material.node_tree)
        ignored = warn_of_outputs(material.node_tree, ("Volume", "Displacement"), losses)
        if source is None and "Volume" in ignored:
            losses.add(rpt_("it is a volume without a surface, and transparent"))
            surface = core.shaders.Transparent()
        else:
            surface = reader.shader(source)
        if (text := losses.warning()) is not None:
            warning = rpt_('material "{name}": {problem}').format(name=material.name, problem=text)
            self.warnings.append(warning)
        exported = core.scene.Material(material.name, surface, sample_as_light=_is_sampled(material))
        return ExportedMaterial(exported, values.needs)


def warn_of_outputs(tree: bpy.types.NodeTree, identifiers: tuple[str, ...], losses: Losses) -> list[str]:
    """Note, and return, which of these inputs of a tree's output node are linked: they are not rendered."""
    output = tree.get_output_node("CYCLES")
    linked = [name for name in identifiers if output is not None and not trace(output.inputs[name]).is_constant]
    for name in linked:
        losses.ignore(name, output)
    return linked


def _is_sampled(material: bpy.types.Material) -> bool:
    """Whether light is searched for on what shines; a setting of Cycles'."""
    return getattr(versions.cycles_settings(material), "emission_sampling", "AUTO") != "NONE"
