"""Comparing samplers on a scene that was handed over: measured, drawn and saved, with or without a window.

Nothing here touches bpy, so that it may run in a thread while Blender's window goes on living.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from ._core import core

#: What is compared where nobody says otherwise: the textbook's samplers, at counts that all of them can make.
DEFAULT_SAMPLERS = core.samplers.TEXTBOOK
DEFAULT_COUNTS = (4, 16, 64)
DEFAULT_SEEDS = 5
#: A picture's longer side: enough to judge samplers by, and a minute's work for two cores.
DEFAULT_SIZE = 256
MAX_SEEDS = 1000


@dataclass(frozen=True)
class Plan:
    """What to compare, and where to save it: `folder`/`name`.png and so on."""

    scene: core.scene.Scene
    settings: core.settings.RenderSettings
    samplers: tuple[str, ...]
    counts: tuple[int, ...]
    seeds: int
    folder: Path
    name: str


@dataclass(frozen=True)
class Outcome:
    """What came out. The first of the files is the sheet to look at."""

    recommendation: str
    files: tuple[Path, ...]


def check_folder(folder: Path) -> None:
    """Raise an OutputError now if files could not be saved to a folder later, which may still have to be made."""
    if folder.exists() and not folder.is_dir():
        raise core.errors.OutputError(f"{folder} is a file: choose a folder for the comparison")
    core.files.check_writable(folder / "x.png" if folder.is_dir() else folder)


def sheet_name(blend: Path) -> str:
    """What the files are called that a .blend is compared in."""
    return f"{blend.stem or 'untitled'}_samplers"


def parse_counts(text: str) -> tuple[int, ...]:
    """Sample counts, such as "4 16 64", in rising order.

    Raises:
        SettingsError: one is no number, or out of range; or there are none.
    """
    limit = core.limits.MAX_SAMPLES
    words = text.replace(",", " ").split()
    for word in words:
        if not word.isdecimal() or not 1 <= int(word) <= limit:
            raise core.errors.SettingsError(f"{word!r} is not a number of samples: give numbers from 1 to {limit}")
    if not words:
        raise core.errors.SettingsError('no numbers of samples are chosen: give some, such as "4 16 64"')
    return tuple(sorted({int(word) for word in words}))


def compare(plan: Plan, on_progress: Callable[[float, str], None], should_cancel: Callable[[], bool]) -> Outcome | None:
    """Measure and save; None where it was cancelled, and then nothing was saved.

    Raises:
        RooksError: a package is missing, or the scene cannot be rendered, or a file cannot be written.
    """
    comparison = load_comparison()
    compared = comparison.compare(
        plan.scene, plan.settings, plan.samplers, plan.counts, plan.seeds, on_progress, should_cancel
    )
    if compared is None or should_cancel():
        return None
    on_progress(1.0, "Drawing")
    return Outcome(compared.recommendation, tuple(comparison.save(compared, plan.folder, plan.name)))


def load_comparison() -> ModuleType:
    """The lab's module that compares. It needs matplotlib, which rendering does not."""
    try:
        return import_module(f"{core.__name__}.lab.comparison")
    except ImportError as error:
        raise core.errors.RooksError(
            f"comparing needs matplotlib, which cannot be loaded ({error}): "
            "install the lab's extra (pip install --group lab), or in Blender the extension anew"
        ) from error


class Worker:
    """Compares in a thread of its own."""

    def __init__(self, plan: Plan) -> None:
        self.share, self.doing = 0.0, "Loading the renderer"
        self.outcome: Outcome | None = None
        self.error: str | None = None
        self._plan = plan
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._run, name="rooks-compare")
        self._thread.start()

    @property
    def is_done(self) -> bool:
        return not self._thread.is_alive()

    @property
    def is_cancelled(self) -> bool:
        return self._cancelled.is_set()

    def cancel(self) -> None:
        """Ask it to stop: a render in progress ends within a batch, a drawing is finished and thrown away."""
        self._cancelled.set()

    def stop(self) -> None:
        """Ask it to stop, and wait until it has."""
        self.cancel()
        self._thread.join()

    def _run(self) -> None:
        try:
            self.outcome = compare(self._plan, self._tell, self._cancelled.is_set)
        except Exception as error:
            if "interpreter shutdown" in str(error):
                return  # Blender was closed, and Python starts no more threads
            # Here, because it needs bpy, which is not there yet when the command line loads this module.
            from .failures import failure_text

            self.error = failure_text(error)

    def _tell(self, share: float, doing: str) -> None:
        self.share, self.doing = share, doing
