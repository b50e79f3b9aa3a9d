"""*Compare Samplers* in Blender's window: the scene is exported at once, and measured while the window goes on living.

The measuring thread knows nothing of Blender. A modal operator looks at it ten times a second, shows how far it is, and
shows the result in an image editor when it is done. Without a window the operator does it all at once.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from . import comparing
from ._core import core
from .failures import failure_text

LOOK_EVERY = 0.1  # seconds


@dataclass
class Session:
    """A comparison that is running in the window."""

    worker: comparing.Worker
    timer: bpy.types.Timer


_session: Session | None = None


def running() -> comparing.Worker | None:
    """What the panel shows the progress of."""
    return _session and _session.worker


class ROOKS_OT_compare_samplers(bpy.types.Operator):
    """Measure the error and the time of several samplers on this scene, and recommend one"""

    bl_idname = "rooks.compare_samplers"
    bl_label = "Compare Samplers"
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if _session is not None:
            cls.poll_message_set("Samplers are being compared")
        return _session is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            return self._finish(context, comparing.compare(self._plan(context), lambda *_: None, lambda: False))
        except Exception as error:
            return self._fail(error)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        global _session
        if bpy.app.background:
            return self.execute(context)
        try:
            plan = self._plan(context)
        except Exception as error:
            return self._fail(error)
        manager = context.window_manager
        timer = manager.event_timer_add(LOOK_EVERY, window=context.window)
        _session = Session(comparing.Worker(plan), timer)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if _session is None:
            return {"CANCELLED"}
        worker = _session.worker
        if event.type == "ESC" and event.value == "PRESS":
            worker.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if not worker.is_done:
            text = iface_("Comparing samplers: {progress} (Esc: cancel)").format(progress=progress_text(worker))
            context.workspace.status_text_set(text)
            _redraw_properties(context)
            return {"PASS_THROUGH"}
        _end(context)
        if worker.error is not None:
            self.report({"ERROR"}, worker.error)
            return {"CANCELLED"}
        try:
            return self._finish(context, worker.outcome)
        except Exception as error:
            return self._fail(error)

    def cancel(self, context: bpy.types.Context) -> None:
        """Called by Blender when another file is opened, or on its way out."""
        worker = running()
        _end(context)
        if worker is not None:
            worker.stop()

    def _plan(self, context: bpy.types.Context) -> comparing.Plan:
        # Here, because Blender's start has no need of it.
        from .handover import hand_over, size_within

        scene = context.scene
        wishes = scene.rooks.comparison
        if not wishes.samplers:
            raise core.errors.SettingsError(rpt_("no samplers are chosen: choose some in the Compare Samplers panel"))
        counts = comparing.parse_counts(wishes.counts)
        folder = _folder(context, wishes.folder)
        comparing.check_folder(folder)
        handed = hand_over(scene, size_within(scene.render, wishes.size))
        for warning in handed.warnings:
            self.report({"WARNING"}, warning)
        names = tuple(name for name in core.samplers.SAMPLERS if name.upper() in wishes.samplers)
        name = comparing.sheet_name(Path(bpy.data.filepath))
        return comparing.Plan(handed.scene, handed.settings, names, counts, wishes.seeds, folder, name)

    def _finish(self, context: bpy.types.Context, outcome: comparing.Outcome | None) -> set[str]:
        if outcome is None:
            self.report({"INFO"}, rpt_("Comparing samplers was cancelled"))
            return {"CANCELLED"}
        _show(context, outcome.files[0])
        said = rpt_("{recommendation} (saved in {folder})").format(
            recommendation=outcome.recommendation, folder=outcome.files[0].parent
        )
        self.report({"INFO"}, said)
        return {"FINISHED"}

    def _fail(self, error: Exception) -> set[str]:
        self.report({"ERROR"}, failure_text(error))
        return {"CANCELLED"}


class ROOKS_OT_cancel_comparison(bpy.types.Operator):
    """Stop comparing samplers; nothing is saved"""

    bl_idname = "rooks.cancel_comparison"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return _session is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        _session.worker.cancel()
        return {"FINISHED"}


def progress_text(worker: comparing.Worker) -> str:
    return iface_("stopping") if worker.is_cancelled else f"{worker.share:.0%}, {iface_(worker.doing)}"


def _folder(context: bpy.types.Context, chosen: str) -> Path:
    """The folder for the files: the user's, else Blender's folder for temporary files, which outlives Blender."""
    if not chosen:
        return Path(context.preferences.filepaths.temporary_directory or tempfile.gettempdir())
    if chosen.startswith("//") and not bpy.data.filepath:
        text = rpt_("{folder} lies beside the .blend file, which has not been saved: save it first")
        raise core.errors.OutputError(text.format(folder=chosen))
    return Path(bpy.path.abspath(chosen))


def _end(context: bpy.types.Context) -> None:
    """Stop the thread and take back what the window shows of it."""
    global _session
    if _session is None:
        return
    session, _session = _session, None
    session.worker.cancel()
    context.window_manager.event_timer_remove(session.timer)
    for workspace in bpy.data.workspaces:
        with context.temp_override(workspace=workspace):
            workspace.status_text_set(None)
    _redraw_properties(context)


def _redraw_properties(context: bpy.types.Context) -> None:
    for area in _areas(context, "PROPERTIES"):
        area.tag_redraw()


def _areas(context: bpy.types.Context, kind: str) -> list[bpy.types.Area]:
    """The areas of one kind, those of the active window first."""
    windows = sorted(context.window_manager.windows, key=lambda window: window != context.window)
    return [area for window in windows for area in window.screen.areas if area.type == kind]


def _show(context: bpy.types.Context, sheet: Path) -> None:
    """Show a picture in an image editor that is open, or else in a window, as Blender shows what it renders."""
    image = bpy.data.images.load(str(sheet), check_existing=True)
    image.reload()
    image.pack()  # it stays in the .blend, whatever becomes of the file
    if bpy.app.background:
        return
    if not _areas(context, "IMAGE_EDITOR"):
        bpy.ops.render.view_show("INVOKE_DEFAULT")
    for area in _areas(context, "IMAGE_EDITOR")[:1]:
        area.spaces.active.image = image
        region = next(region for region in area.regions if region.type == "WINDOW")
        with context.temp_override(area=area, region=region):
            bpy.ops.image.view_all(fit_view=True)


CLASSES = (ROOKS_OT_compare_samplers, ROOKS_OT_cancel_comparison)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    worker = running()
    _end(bpy.context)
    if worker is not None:
        worker.stop()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
