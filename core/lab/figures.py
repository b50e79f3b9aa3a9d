"""Render the textbook's figures: the checkerboard to the horizon, jaggies, brute force and moiré, with their errors.

Figures 4.1 and 5.19 to 5.21 of K. Suffern, Ray Tracing from the Ground Up (2007), and three that its argument asks for:
brute force against sampling at equal cost, moiré with its cure, and what happens where domains share their points. Each
goes into a PNG and an SVG; one sheet shows all that are rendered, and figures.json holds every number with its settings
and seeds. Linear radiance is compared, never what a screen shows; a converged reference shares neither sampler nor seed
with what it judges.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from .. import command_line as kinds
from ..files import check_writable, replacing
from . import figure_brute_force, figure_decorrelation, figure_edge, figure_horizon, figure_moire, scenes, style
from .figure_decorrelation import Results
from .figure_plates import Plate, in_grid, sheet
from .figure_shots import Studio

#: Per pixel, twice: the reference of figures 5.19 to 5.21 and of moiré, to err ten times less than the best of them.
REFERENCE_SAMPLES = 8192
RENDERS = 2 + sum(part.RENDERS for part in (figure_edge, figure_brute_force, figure_moire, figure_horizon))
#: Fewer pixels show no horizon; more do not fit a page, where a pixel is at least a dot.
SMALLEST, LARGEST = 32, 512


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--output", type=Path, default=Path("out/figures"), metavar="FOLDER", help="where to save (default out/figures)"
    )
    parser.add_argument("--seed", type=kinds.integer(0, 2**31 - 1), default=0, metavar="N", help="chooses the noise")
    parser.add_argument(
        "--threads", type=kinds.integer(0, 1024), default=0, metavar="N", help="threads; 0 (default) is one per core"
    )
    parser.add_argument(
        "--resolution",
        type=_resolution,
        default=(256, 256),
        metavar="WxH",
        help=f"the size of the checkerboard in pixels, {SMALLEST} to {LARGEST} each way (default 256x256)",
    )


def _resolution(text: str) -> tuple[int, int]:
    size = kinds.resolution(text)
    if not all(SMALLEST <= side <= LARGEST for side in size):
        raise argparse.ArgumentTypeError(f"{text} is not between {SMALLEST} and {LARGEST} pixels each way")
    return size


def run(options: argparse.Namespace) -> int:
    style.make_folder(options.output)
    check_writable(options.output / "figures.json")
    written = []
    with _progress() as advance:
        plates = {}
        for plate in make_plates(Studio(options.seed, options.threads, advance), options.resolution):
            plates[plate.name] = plate
            written += style.save(plate.figure(), options.output / plate.name)
        written += style.save(contact_sheet(plates), options.output / "contact_sheet")
    couplings = figure_decorrelation.measure(options.seed)
    written += figure_decorrelation.draw(couplings, options.output / "decorrelation", options.seed)
    written.append(options.output / "figures.json")
    _write_numbers(written[-1], options, plates, couplings)
    print(f"{len(written)} files in {options.output}: {', '.join(path.name for path in written)}")
    return 0


def make_plates(studio: Studio, resolution: tuple[int, int]) -> Iterator[Plate]:
    """Render all figures, one after the other."""
    yield figure_edge.make(studio)
    yield figure_brute_force.make(studio, resolution)
    board = scenes.checkerboard(resolution)
    reference = studio.reference(board, REFERENCE_SAMPLES)
    yield figure_moire.make(studio, board, reference)
    yield from figure_horizon.make(studio, board, reference)


def contact_sheet(plates: dict[str, Plate]) -> Figure:
    """All figures on one sheet, the problem first, the results last."""
    rows = (("figure_4_1", "brute_force", "moire"), ("figure_5_19", "figure_5_20", "figure_5_21"))
    placed = list(in_grid([[plates[name] for name in row] for row in rows]))
    return sheet([plate for plate, _ in placed], [corner for _, corner in placed])


def _write_numbers(path: Path, options: argparse.Namespace, plates: dict[str, Plate], couplings: Results) -> None:
    numbers = {
        "resolution": "x".join(map(str, options.resolution)),
        "seed": options.seed,
        "figures": {name: {"caption": plate.caption} | plate.numbers for name, plate in plates.items()},
        "decorrelation": couplings,
    }
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(numbers, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


@contextmanager
def _progress() -> Iterator[Callable[[float], None]]:
    """A progress bar on a terminal, nothing elsewhere: a function that takes the share of a render just done."""
    console = Console(stderr=True)
    columns = (TextColumn("Figures"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=RENDERS)
        yield lambda share: progress.advance(task, share)
