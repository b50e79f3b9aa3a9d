"""A depsgraph as the renderer's `Scene`.

Everything that Blender would render is walked once. A mesh that appears many times is read once, each appearance is a
matrix and a tuple of materials. What Blender hands out while iterating is only valid until the next step, so all is
copied at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_

from . import versions
from ._core import core
from .kept import Kept, KeptMesh
from .lights import export_light, linking_problems, surface_visibility
from .materials import ExportedMaterial, MaterialExporter
from .meshes import add_needed, export_mesh, lost_normals, lost_numbers, warnings_of
from .world import export_world

#: Kinds of object that Blender renders and that are not turned into meshes.
NOT_MODELLED = {
    "CURVES": n_("hair curves"),
    "POINTCLOUD": n_("a point cloud"),
    "VOLUME": n_("a volume"),
    "GREASEPENCIL": n_("a grease pencil"),
    "GPENCIL": n_("a grease pencil"),
}


def export_scene(
    depsgraph: bpy.types.Depsgraph,
    camera: core.scene.Camera,
    kept: Kept | None = None,
    is_shown: Callable[[bpy.types.Object], bool] = lambda _: True,
) -> tuple[core.scene.Scene, list[str]]:
    """The scene of a depsgraph, and warnings, one line each, about what is not shown as Blender would.

    `kept` has what an earlier export can lend, and keeps what this one can. `is_shown` says of each object that stands
    in the scene by itself whether it is to be seen.

    Raises:
        SceneError: something cannot be rendered; the text names it.
    """
    kept = Kept(depsgraph.scene_eval.frame_current) if kept is None else kept
    world, warnings = export_world(depsgraph, kept.images)
    walk = _Walk(depsgraph, kept, is_shown)
    walk.run()
    scene = core.scene.Scene(camera, walk.instances(), tuple(walk.lights), world)
    return scene, list(dict.fromkeys([*left_out(depsgraph), *warnings, *walk.warnings, *walk.materials.warnings]))


def left_out(depsgraph: bpy.types.Depsgraph) -> list[str]:
    """Warnings about what the scene or the view layer asks for and Rooks does not do."""
    render, layer = depsgraph.scene_eval.render, depsgraph.view_layer_eval
    wishes = {
        rpt_("motion blur"): render.use_motion_blur,
        rpt_("Freestyle lines"): render.use_freestyle,
        rpt_("stereoscopy"): render.use_multiview,
        rpt_("view layers without sky, surfaces or hair"): not (layer.use_sky and layer.use_solid and layer.use_strand),
    }
    return [rpt_("Rooks leaves out {wish}").format(wish=wish) for wish, is_wanted in wishes.items() if is_wanted]


@dataclass(frozen=True)
class _Kind:
    """What all appearances of one object share."""

    mesh_key: int
    materials: tuple[core.scene.Material, ...]
    visibility: int
    name: str
    lift_shadows_below: float


class _Walk:
    """One pass over a depsgraph's instances."""

    def __init__(
        self, depsgraph: bpy.types.Depsgraph, kept: Kept, is_shown: Callable[[bpy.types.Object], bool]
    ) -> None:
        self.lights: list[core.scene.Light] = []
        self.warnings: list[str] = []
        self.materials = MaterialExporter(kept.images)
        self._depsgraph = depsgraph
        self._is_shown = is_shown
        self._kept = kept
        self._met: set[int] = set()
        self._kinds: dict[tuple[int, int], _Kind | None] = {}
        self._parents: dict[int, int] = {}
        # One entry for each appearance of a mesh. Instances are made in the end, when meshes are whole.
        self._placed: list[tuple[_Kind, int]] = []
        self._matrices: list[float] = []

    def run(self) -> None:
        for instance in self._depsgraph.object_instances:
            if not instance.show_self or not (instance.is_instance or self._is_shown(instance.object.original)):
                continue
            kind = instance.object.type
            if kind == "MESH":
                self._mesh(instance)
            elif kind == "LIGHT":
                self._light(instance)
            elif kind in NOT_MODELLED:
                text = rpt_('object "{name}" is {kind}: Rooks leaves it out')
                self.warnings.append(text.format(name=instance.object.name, kind=rpt_(NOT_MODELLED[kind])))
        self._kept.meshes = {key: mesh for key, mesh in self._kept.meshes.items() if key in self._met}

    def instances(self) -> tuple[core.scene.Instance, ...]:
        matrices = np.array(self._matrices, dtype=np.float64).reshape(-1, 4, 4)
        for index in np.flatnonzero(~np.isfinite(matrices).all(axis=(1, 2))):
            name = self._placed[index][0].name
            text = rpt_('object "{name}" is nowhere (its position is NaN or infinite): move it')
            raise core.errors.SceneError(text.format(name=name))
        return tuple(
            core.scene.Instance(
                self._kept.meshes[kind.mesh_key].mesh,
                matrix,
                kind.materials,
                visibility,
                kind.name,
                kind.lift_shadows_below,
            )
            for (kind, visibility), matrix in zip(self._placed, matrices, strict=True)
        )

    def _light(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        matrix = np.array(instance.matrix_world, dtype=np.float64)
        light, warnings = export_light(instance.object, matrix)
        self.warnings += warnings
        if light is not None:
            self.lights.append(light)

    def _mesh(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        source, parent = instance.instance_object or instance.object, instance.parent
        key = (instance.object.data.as_pointer(), source.as_pointer())
        if key not in self._kinds:
            self._kinds[key] = self._kind(instance.object, source, not instance.is_instance)
        kind = self._kinds[key]
        if kind is None:
            return
        visibility = kind.visibility & self._parent_visibility(parent)
        if visibility:
            self._placed.append((kind, visibility))
            # Far quicker for many instances than an array for each.
            for row in instance.matrix_world:
                self._matrices.extend(row)

    def _kind(self, obj: bpy.types.Object, source: bpy.types.Object, is_own: bool) -> _Kind | None:
        """Read an object on its first appearance; None where there is nothing to show."""
        visibility = self._visibility(obj)
        if visibility == 0:
            return None
        mesh_key = obj.data.as_pointer()
        # In Edit Mode the data block has no arrays yet.
        mesh = obj.to_mesh() if obj.data.is_editmode else obj.data
        if mesh_key not in self._kept.meshes:
            exported = export_mesh(mesh, obj.name)
            self._kept.meshes[mesh_key] = KeptMesh(exported, is_own=is_own)
            self.warnings += [] if exported is None else lost_normals(mesh, exported)
        self._met.add(mesh_key)
        if self._kept.meshes[mesh_key].mesh is None:
            # A mesh that only carries instances or particles is empty on purpose.
            if not _is_carrier(obj):
                text = rpt_('object "{name}" has no faces: there is nothing to render')
                self.warnings.append(text.format(name=obj.name))
            return None
        if obj.original.holdout_get(view_layer=self._depsgraph.view_layer) or obj.is_shadow_catcher:
            self._warn(obj, rpt_("Rooks renders holdouts and shadow catchers as usual surfaces"))
        for problem in linking_problems(obj):
            self._warn(obj, problem)
        if any(_is_hair(system.settings) for system in obj.particle_systems):
            self._warn(obj, rpt_("Rooks leaves out its hair"))
        slots = self._slots(obj, obj.data, source)
        self._add_needed(mesh_key, mesh, slots)
        lift_below, shading_offset = versions.shadow_terminator_offsets(obj)
        if shading_offset > 0:
            self._warn(obj, rpt_("Rooks leaves out the Shading Offset of its shadow terminator"))
        return _Kind(mesh_key, tuple(slot.material for slot in slots), visibility, obj.name, lift_below)

    def _warn(self, obj: bpy.types.Object, problem: str) -> None:
        self.warnings.append(rpt_('object "{name}": {problem}').format(name=obj.name, problem=problem))

    def _slots(
        self, obj: bpy.types.Object, mesh: bpy.types.Mesh, source: bpy.types.Object
    ) -> tuple[ExportedMaterial, ...]:
        """One material for each slot that faces use. An object's own slots count for its own mesh only."""
        override = self._depsgraph.view_layer_eval.material_override
        if override is not None:
            slots = [override]
        elif source.data is not None and source.data.as_pointer() == mesh.as_pointer():
            slots = [slot.material for slot in obj.material_slots]
        else:
            slots = list(mesh.materials) or [slot.material for slot in source.material_slots]
        exported = [self.materials.export(material) for material in slots or [None]]
        used = self._kept.meshes[mesh.as_pointer()].mesh.material_slots
        # Blender gives faces beyond the last slot the last slot's material.
        missing = 0 if used is None else int(used.max()) + 1 - len(exported)
        return tuple(exported + [exported[-1]] * missing)

    def _add_needed(self, mesh_key: int, mesh: bpy.types.Mesh, slots: tuple[ExportedMaterial, ...]) -> None:
        """Read what these materials look up on a mesh, of which others may have asked for less."""
        kept = self._kept.meshes[mesh_key]
        needs = kept.needs
        for slot in slots:
            needs |= slot.needs
        if needs != kept.needs:
            kept.mesh, kept.needs = add_needed(kept.mesh, mesh, needs), needs
            self.warnings += warnings_of(mesh, needs) + lost_numbers(mesh, kept.mesh, needs)

    def _parent_visibility(self, parent: bpy.types.Object | None) -> int:
        """What an instancer's own visibility leaves of that of its instances."""
        if parent is None:
            return core.scene.VISIBLE_TO_ALL
        key = parent.as_pointer()
        if key not in self._parents:
            self._parents[key] = self._visibility(parent)
        return self._parents[key]

    def _visibility(self, obj: bpy.types.Object) -> int:
        bits = _ray_visibility(obj)
        if obj.original.indirect_only_get(view_layer=self._depsgraph.view_layer):
            bits &= ~core.scene.VISIBLE_TO_CAMERA
        return bits


def _ray_visibility(obj: bpy.types.Object) -> int:
    return (
        (core.scene.VISIBLE_TO_CAMERA if obj.visible_camera else 0)
        | surface_visibility(obj)
        | (core.scene.VISIBLE_TO_SHADOWS if obj.visible_shadow else 0)
    )


def _is_hair(settings: bpy.types.ParticleSettings) -> bool:
    return settings.type == "HAIR" and settings.render_type == "PATH"


def _is_carrier(obj: bpy.types.Object) -> bool:
    return obj.is_instancer or any(modifier.type in ("NODES", "PARTICLE_SYSTEM") for modifier in obj.modifiers)
