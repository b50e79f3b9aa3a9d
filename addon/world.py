"""The world's background as a value over directions: a colour, or an environment image and what changes its colour."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from . import versions
from .images import Images
from .losses import Losses
from .materials import warn_of_outputs
from .nodes import surface_of
from .radiance import BLACK, RadianceReader
from .values import Value, ValueReader


def export_world(depsgraph: bpy.types.Depsgraph, images: Images) -> tuple[Value, list[str]]:
    """The radiance of the background, in W/(m² sr), and warnings about what was left out."""
    world = depsgraph.view_layer_eval.world_override or depsgraph.scene_eval.world
    if world is None:
        return BLACK, []
    if not versions.uses_nodes(world):
        return tuple(world.color), []
    losses = Losses()
    radiance = RadianceReader(ValueReader(images, losses, of_world=True), losses).radiance(surface_of(world.node_tree))
    warn_of_outputs(world.node_tree, ("Volume",), losses)
    if hidden := _hidden_from(world):
        losses.add(rpt_("Rooks shows it to all rays, also to {kinds} rays").format(kinds=", ".join(hidden)))
    text = losses.warning()
    return radiance, [rpt_('world "{name}": {problem}').format(name=world.name, problem=text)] if text else []


def _hidden_from(world: bpy.types.World) -> list[str]:
    """The kinds of ray that Cycles does not show the world to."""
    visibility = versions.cycles_settings(world, "cycles_visibility")
    kinds = ("camera", "diffuse", "glossy", "transmission")
    return [] if visibility is None else [kind for kind in kinds if not getattr(visibility, kind)]
