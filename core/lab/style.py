"""How the lab's pictures look: one colour and one marker for each sampler everywhere, sizes for print, and saving.

The colours are Okabe and Ito's (2008) and Tol's "muted" ones (2021) and a dark brown, chosen to be hard to confuse for
normal eyes and for those that lack one kind of cone (Machado, Oliveira and Fernandes 2009): any two are 17 or more
apart in CIELAB, any two of the textbook's six 27. The marker makes sure that colour is never the only cue.

Nothing here touches pyplot, which only the main thread may use: figures are `matplotlib.figure.Figure` objects.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock

import matplotlib
from matplotlib.figure import Figure

from ..errors import OutputError
from ..files import replacing
from ..samplers import SAMPLERS

#: By the `number` of a sampler, which never changes.
COLORS = ("#000000", "#E69F00", "#56B4E9", "#882255", "#117733", "#332288", "#D55E00", "#AA4499", "#CC6677", "#663300")
#: One more than colours, so that not before number 110 two samplers share both.
MARKERS = ("s", "o", "^", "D", "v", "P", "X", "p", "<", "h", ">")

INK = "#222222"
FAINT = "#BBBBBB"

DPI = 200
CM_PER_INCH = 2.54

RC = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same on every machine
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.4,
    "lines.markersize": 4,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    # Letters as outlines: as text they would be set in whatever font the reader has, and no longer fit.
    "svg.fonttype": "path",
    # Without it the names of an SVG's parts are random, and the same picture is never the same file.
    "svg.hashsalt": "rooks",
}

# matplotlib's settings belong to the whole process: one drawing at a time may change them.
_LOCK = RLock()


@contextmanager
def drawing() -> Iterator[None]:
    """The lab's matplotlib settings, for as long as the block runs; also a decorator: `@drawing()`.

    All making of axes and text goes into it, since matplotlib looks sizes up when a thing is made. Other threads that
    want to draw wait meanwhile.
    """
    with _LOCK, matplotlib.rc_context(RC):
        yield


def color(name: str) -> str:
    """The colour, `#RRGGBB`, of the sampler of this name."""
    return COLORS[SAMPLERS[name].number % len(COLORS)]


def marker(name: str) -> str:
    """matplotlib's code of the marker of the sampler of this name."""
    return MARKERS[SAMPLERS[name].number % len(MARKERS)]


def figure(width_cm: float, height_cm: float) -> Figure:
    """An empty white figure; what is put on it is laid out without overlaps ("constrained")."""
    with drawing():
        return Figure(figsize=(width_cm / CM_PER_INCH, height_cm / CM_PER_INCH), layout="constrained")


def save(figure: Figure, path: Path) -> list[Path]:
    """Write PATH.png at 200 dpi and PATH.svg, each whole or not at all; returns the two paths.

    The same figure makes the same PNG; of an SVG's numbers the solver behind the layout may change the last digit.

    Raises:
        OutputError: the folder does not exist or cannot be written to.
    """
    formats = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}
    paths = []
    with drawing():
        for kind, metadata in formats.items():
            paths.append(path.with_name(f"{path.name}.{kind}"))
            with replacing(paths[-1]) as temporary:
                figure.savefig(temporary, format=kind, dpi=DPI, metadata=metadata)
    return paths


def make_folder(folder: Path) -> None:
    """Make the folder that pictures go to, and those above it.

    Raises:
        OutputError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {error.strerror}") from None
