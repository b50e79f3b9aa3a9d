"""Draw the points of samplers with their projections and their spectrum, and the textbook's figures of patterns."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import track

from .. import command_line
from ..files import check_writable
from ..samplers import SAMPLERS
from . import style
from .pattern_drawing import panels, pattern
from .point_sets import independent_sets

MOST_POINTS = 4096


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's options to its parser."""
    names = list(SAMPLERS)
    parser.add_argument(
        "--samplers", nargs="+", type=command_line.sampler, default=names, metavar="NAME", help=", ".join(names)
    )
    parser.add_argument("--counts", nargs="+", type=_count, default=[16, 64, 256], metavar="N", help="points per set")
    parser.add_argument(
        "--seed", type=command_line.integer(0, 2**31 - 1), default=1, metavar="N", help="chooses the sets"
    )
    parser.add_argument(
        "--output", type=Path, default=Path("out/patterns"), metavar="FOLDER", help="where to (out/patterns)"
    )


def _count(text: str) -> int:
    count = command_line.integer(1, 2**31 - 1)(text)
    if count > MOST_POINTS:
        raise argparse.ArgumentTypeError(f"{count} points fill the square with ink: draw {MOST_POINTS} at most")
    return count


def run(options: argparse.Namespace) -> int:
    """Draw and save one figure after the other; those that are done stay if it is interrupted."""
    style.make_folder(options.output)
    check_writable(options.output / "pattern.png")
    console = Console(stderr=True)
    drawings: dict[str, Callable[[], Figure]] = {}
    for name in dict.fromkeys(options.samplers):
        for asked in dict.fromkeys(options.counts):
            count = SAMPLERS[name].actual_count(asked)
            if count != asked:
                console.print(f"{name}: {count} points for {asked}, since {SAMPLERS[name].counts.rule}")
            drawings[f"{name}_{count}"] = lambda name=name, count=count: pattern(SAMPLERS[name], count, options.seed)
        if name in BOOK_FIGURES:
            title, draw = BOOK_FIGURES[name]
            drawings[title] = lambda draw=draw: draw(options.seed)
    for title, draw in track(drawings.items(), "drawing", console=console, disable=not console.is_terminal):
        style.save(draw(), options.output / title)
    print(f"{len(drawings)} figures, each as .png and .svg, are in {options.output}")
    return 0


# The textbook's figures. Where a set is drawn before it is shuffled, it is the next panel's: the same coordinates.


def _by_count(name: str, *counts: int) -> Callable[[int], Figure]:
    return lambda seed: panels(
        SAMPLERS[name], [_points(name, count, seed) for count in counts], [f"{count} points" for count in counts]
    )


def _n_rooks(seed: int) -> Figure:
    shuffled = _points("n_rooks", 16, seed)
    captions = ["16 points on the diagonal", "after the shuffle", "256 points"]
    return panels(SAMPLERS["n_rooks"], [np.sort(shuffled, axis=0), shuffled, _points("n_rooks", 256, seed)], captions)


def _multi_jittered(seed: int) -> Figure:
    shuffled = _points("multi_jittered", 16, seed)
    captions = ["16 points before the shuffles", "after the shuffles", "256 points"]
    sets = [canonical(shuffled), shuffled, _points("multi_jittered", 256, seed)]
    return panels(SAMPLERS["multi_jittered"], sets, captions)


def canonical(points: np.ndarray) -> np.ndarray:
    """The coordinates of m² multi-jittered points, (m², 2), in the arrangement before the shuffles.

    The point of the coarse cell in column i, row j is in the j-th fine column of i and the i-th fine row of j.
    """
    m = round(len(points) ** 0.5)
    x, y = np.sort(points, axis=0).T.reshape(2, m, m)
    return np.stack((x.T, y), axis=-1).reshape(-1, 2)


def _points(name: str, count: int, seed: int) -> np.ndarray:
    return independent_sets(SAMPLERS[name], count, 1, seed)[0]


BOOK_FIGURES = {
    "regular": ("textbook_regular", _by_count("regular", 16, 256)),
    "random": ("textbook_5_8_random", _by_count("random", 16, 256)),
    "jittered": ("textbook_5_9_jittered", _by_count("jittered", 16, 256)),
    "n_rooks": ("textbook_n_rooks", _n_rooks),
    "multi_jittered": ("textbook_5_11_multi_jittered", _multi_jittered),
    "hammersley": ("textbook_5_12_hammersley", _by_count("hammersley", 16, 64, 256)),
}
