"""The rendered viewport, as far as it needs Blender: on the main thread the scene is exported, and pictures are drawn.

All else happens in a thread (see `viewport_session`), so that the window never waits for a picture.
"""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Callable, Iterator

import bpy
import gpu
from gpu_extras.presets import draw_texture_2d

from . import kernels
from ._core import core
from .export import export_scene
from .failures import failure_text
from .kept import Kept
from .region_view import export_view
from .settings import viewport_settings
from .viewport_session import Picture, Session, View

_open: weakref.WeakSet[Viewport] = weakref.WeakSet()


class Viewport:
    """What one 3-D view in rendered mode shows. `redraw` is called from another thread when there is something new."""

    def __init__(self, redraw: Callable[[], None]) -> None:
        kernels.choose_cache_folder()
        self._session = Session(redraw)
        self._kept: Kept | None = None
        self._exported: tuple = ()
        self._view: View | None = None
        self._picture: Picture | None = None
        self._texture: gpu.types.GPUTexture | None = None
        _open.add(self)

    def update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Something has changed: export the scene, unless it is something that Rooks does not look at."""
        with self._telling():
            space, settings = context.space_data, viewport_settings(depsgraph.scene_eval)

            def is_shown(obj: bpy.types.Object) -> bool:
                return obj.visible_in_viewport_get(space)

            if not self._looks_other(depsgraph, settings, is_shown):
                return
            self._kept = self._kept or Kept(depsgraph.scene_eval.frame_current)
            self._kept.forget_changed(depsgraph)
            self._view = export_view(context, depsgraph)
            scene, _ = export_scene(depsgraph, self._view.camera, self._kept, is_shown)
            self._session.show_scene(scene, settings)
            self._session.show_view(self._view)

    def _looks_other(
        self,
        depsgraph: bpy.types.Depsgraph,
        settings: core.settings.RenderSettings,
        is_shown: Callable[[bpy.types.Object], bool],
    ) -> bool:
        """Whether the scene may look other than at the last export. Selecting something changes nothing."""
        scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
        blocks = scene.camera, scene.world, layer.material_override, layer.world_override
        names = (getattr(block, "name_full", None) for block in blocks)
        # Hiding an object, local view, and Indirect Only tell no more than that the scene has changed.
        shown = frozenset(
            (obj.name_full, obj.original.indirect_only_get(view_layer=depsgraph.view_layer))
            for obj in depsgraph.objects
            if is_shown(obj.original)
        )
        before, self._exported = self._exported, (settings, scene.frame_current, shown, *names)
        only_scene = all(
            isinstance(update.id, bpy.types.Scene)
            and not (update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading)
            for update in depsgraph.updates
        )
        return self._kept is None or not only_scene or before != self._exported

    def draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> str:
        """Draw the latest picture, and ask for another if the view has changed. Returns what is being done."""
        with self._telling():
            view = export_view(context, depsgraph)
            if not view.is_same(self._view):
                self._view = view
                self._session.show_view(view)
        picture = self._session.picture
        if picture is not None:
            self._draw(picture)
        return self._session.text

    def forget(self) -> None:
        """Take nothing for granted at the next export: Blender has put another state in the place of this one."""
        self._kept = None

    def close(self) -> None:
        """Stop rendering."""
        self._session.close()

    def _draw(self, picture: Picture) -> None:
        height, width = picture.pixels.shape[:2]
        if picture is not self._picture:
            buffer = gpu.types.Buffer("FLOAT", picture.pixels.size, picture.pixels.reshape(-1))
            self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)
            self._picture = picture
        gpu.state.blend_set("ALPHA_PREMULT")
        draw_texture_2d(self._texture, (picture.x, picture.y), width * picture.size, height * picture.size)
        gpu.state.blend_set("NONE")

    @contextlib.contextmanager
    def _telling(self) -> Iterator[None]:
        """Errors are shown in the view: Blender would print them, and go on."""
        try:
            yield
        except Exception as error:
            self._session.show_error(failure_text(error))


def forget_all(*_arguments) -> None:
    """For Blender's handlers: after undoing, and when a file is loaded."""
    for viewport in _open:
        viewport.forget()


def close_all() -> None:
    """Stop all viewports."""
    for viewport in list(_open):
        viewport.close()
