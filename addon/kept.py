"""What of one export still holds for the next: the meshes and images that have not changed since."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from ._core import core
from .images import Images
from .meshes import Needs


@dataclass
class KeptMesh:
    """A mesh as it was exported (None: it has no faces), and what it was asked for."""

    mesh: core.scene.Mesh | None
    needs: Needs = field(default_factory=Needs)
    #: Whether an object has it for its own. What modifiers make of other meshes is not told apart when it changes.
    is_own: bool = True


class Kept:
    """Meshes by the address of Blender's evaluated mesh, which is the same until that is evaluated again."""

    def __init__(self, frame: int) -> None:
        self._frame = frame
        self.images = Images(frame)
        self.meshes: dict[int, KeptMesh] = {}

    def forget_changed(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Forget what Blender says has changed since the last export."""
        frame = depsgraph.scene_eval.frame_current
        if depsgraph.id_type_updated("IMAGE") or frame != self._frame:
            self._frame, self.images = frame, Images(frame)
        changed = [update.id for update in depsgraph.updates if update.is_updated_geometry]
        if not changed:
            return
        for block in changed:
            mesh = block.data if isinstance(block, bpy.types.Object) else block
            if isinstance(mesh, bpy.types.Mesh):
                self.meshes.pop(mesh.as_pointer(), None)
        self.meshes = {key: kept for key, kept in self.meshes.items() if kept.is_own}
