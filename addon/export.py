"""A depsgraph as the renderer's `Scene`.

Everything that Blender would render is walked once. A mesh that appears many times is read once, each appearance is a
matrix and a tuple of materials. What Blender hands out while iterating is only valid until the next step, so all is
copied at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ._core import core
from .camera import export_camera
from .images import Images
from .lights import export_light, surface_visibility
from .materials import ExportedMaterial, MaterialExporter
from .meshes import Needs, add_needed, export_mesh, warnings_of
from .world import export_world

#: Kinds of object that Blender renders and that are not turned into meshes.
NOT_MODELLED = {
    "CURVES": "hair curves",
    "POINTCLOUD": "a point cloud",
    "VOLUME": "a volume",
    "GREASEPENCIL": "a grease pencil",
    "GPENCIL": "a grease pencil",
}


def export_scene(
    depsgraph: bpy.types.Depsgraph, resolution: tuple[int, int] | None = None
) -> tuple[core.scene.Scene, list[str]]:
    """The scene of a depsgraph, and warnings, one line each, about what is not shown as Blender would.

    `resolution` is the full frame's in pixels, if it is not the scene's own.

    Raises:
        SceneError: something cannot be rendered; the text names it.
    """
    camera = export_camera(depsgraph, resolution or frame_resolution(depsgraph.scene_eval.render))
    images = Images()
    world, warnings = export_world(depsgraph, images)
    walk = _Walk(depsgraph, images)
    walk.run()
    scene = core.scene.Scene(camera, walk.instances(), tuple(walk.lights), world)
    return scene, list(dict.fromkeys([*warnings, *walk.warnings, *walk.materials.warnings]))


def frame_resolution(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """The full frame in pixels, percentage applied and rounded as Blender does."""
    percent = render.resolution_percentage
    return max(render.resolution_x * percent // 100, 1), max(render.resolution_y * percent // 100, 1)


@dataclass(frozen=True)
class _Kind:
    """What all appearances of one object share."""

    mesh_key: int
    materials: tuple[core.scene.Material, ...]
    visibility: int
    name: str


class _Walk:
    """One pass over a depsgraph's instances."""

    def __init__(self, depsgraph: bpy.types.Depsgraph, images: Images) -> None:
        self.lights: list[core.scene.Light] = []
        self.warnings: list[str] = []
        self.materials = MaterialExporter(images)
        self._depsgraph = depsgraph
        self._meshes: dict[int, core.scene.Mesh | None] = {}
        self._needs: dict[int, Needs] = {}
        self._kinds: dict[tuple[int, int], _Kind | None] = {}
        self._parents: dict[int, int] = {}
        # One entry for each appearance of a mesh. Instances are made in the end, when meshes are whole.
        self._placed: list[tuple[_Kind, int]] = []
        self._matrices: list[float] = []

    def run(self) -> None:
        for instance in self._depsgraph.object_instances:
            if not instance.show_self:
                continue
            kind = instance.object.type
            if kind == "MESH":
                self._mesh(instance)
            elif kind == "LIGHT":
                self._light(instance)
            elif kind in NOT_MODELLED:
                self.warnings.append(f'object "{instance.object.name}" is {NOT_MODELLED[kind]}: Rooks leaves it out')

    def instances(self) -> tuple[core.scene.Instance, ...]:
        matrices = np.array(self._matrices, dtype=np.float64).reshape(-1, 4, 4)
        for index in np.flatnonzero(~np.isfinite(matrices).all(axis=(1, 2))):
            name = self._placed[index][0].name
            raise core.errors.SceneError(f'object "{name}" is nowhere (its position is NaN or infinite): move it')
        return tuple(
            core.scene.Instance(self._meshes[kind.mesh_key], matrix, kind.materials, visibility, kind.name)
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
            self._kinds[key] = self._kind(instance.object, source)
        kind = self._kinds[key]
        if kind is None:
            return
        visibility = kind.visibility & self._parent_visibility(parent)
        if visibility:
            self._placed.append((kind, visibility))
            # Far quicker for many instances than an array for each.
            for row in instance.matrix_world:
                self._matrices.extend(row)

    def _kind(self, obj: bpy.types.Object, source: bpy.types.Object) -> _Kind | None:
        """Read an object on its first appearance; None where there is nothing to show."""
        visibility = self._visibility(obj)
        if visibility == 0:
            return None
        mesh_key = obj.data.as_pointer()
        # In Edit Mode the data block has no arrays yet.
        mesh = obj.to_mesh() if obj.data.is_editmode else obj.data
        if mesh_key not in self._meshes:
            self._meshes[mesh_key] = export_mesh(mesh, obj.name)
        if self._meshes[mesh_key] is None:
            # A mesh that only carries instances or particles is empty on purpose.
            if not _is_carrier(obj):
                self.warnings.append(f'object "{obj.name}" has no faces: there is nothing to render')
            return None
        if obj.is_holdout or obj.is_shadow_catcher:
            self.warnings.append(f'object "{obj.name}": Rooks renders holdouts and shadow catchers as usual surfaces')
        slots = self._slots(obj, obj.data, source)
        self._add_needed(mesh_key, mesh, slots)
        return _Kind(mesh_key, tuple(slot.material for slot in slots), visibility, obj.name)

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
        used = self._meshes[mesh.as_pointer()].material_slots
        # Blender gives faces beyond the last slot the last slot's material.
        missing = 0 if used is None else int(used.max()) + 1 - len(exported)
        return tuple(exported + [exported[-1]] * missing)

    def _add_needed(self, mesh_key: int, mesh: bpy.types.Mesh, slots: tuple[ExportedMaterial, ...]) -> None:
        """Read what these materials look up on a mesh, of which others may have asked for less."""
        before = self._needs.get(mesh_key, Needs())
        needs = before
        for slot in slots:
            needs |= slot.needs
        if needs == before:
            return
        self._needs[mesh_key] = needs
        self._meshes[mesh_key] = add_needed(self._meshes[mesh_key], mesh, needs)
        self.warnings += warnings_of(mesh, needs)

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


def _is_carrier(obj: bpy.types.Object) -> bool:
    return obj.is_instancer or any(modifier.type in ("NODES", "PARTICLE_SYSTEM") for modifier in obj.modifiers)
