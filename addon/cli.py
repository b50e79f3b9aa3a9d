"""The command line: `python -m addon render FILE.blend --output PATH …`, and `compare FILE.blend --output FOLDER …`.

Inside Blender they are `blender FILE.blend --command rooks render --output PATH …` and `… compare …`. How they say what
is wrong, and their exit statuses: see `core.command_line`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from . import comparing
from ._core import core

kinds = core.command_line  # of arguments

#: Blender's own limit.
MAX_FRAME = 1048574
BOUNCES = {
    "max": "how often light is reflected or let through in all; 0 is direct light only",
    "diffuse": "how often it is reflected diffusely",
    "glossy": "how often it is reflected by glossy surfaces",
    "transmission": "how often it goes through glass and the like",
    "transparent": "how many transparent surfaces it passes straight on",
}
DOMAINS = {"pixel": "the area of a pixel", "lens": "the lens", "light": "the lights", "bsdf": "the surfaces"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    return _run(make_parser(), arguments)


def run_in_blender(arguments: list[str]) -> int:
    """Run a command in Blender, on the file that is open where none is named, and return its exit status."""
    import bpy

    from .kernels import choose_drawing_folder

    choose_drawing_folder()
    parser, commands = _empty_parser("blender FILE.blend --command rooks")
    opened = Path(bpy.data.filepath) if bpy.data.filepath else None
    _add_render(commands, opened)
    _add_compare(commands, opened)
    try:
        return _run(parser, arguments)
    except SystemExit as end:  # argparse's, which Blender would take for a bug
        return end.code


def make_parser() -> argparse.ArgumentParser:
    """The parser of `python -m addon`."""
    parser, commands = _empty_parser("python -m addon")
    _add_render(commands, None)
    _add_compare(commands, None)
    return parser


def _empty_parser(program: str) -> tuple[argparse.ArgumentParser, argparse._SubParsersAction]:
    parser = kinds.OneLineParser(prog=program, description="Rooks on .blend files, without a window.")
    return parser, parser.add_subparsers(
        title="commands", required=True, metavar="COMMAND", parser_class=kinds.OneLineParser
    )


def _run(parser: argparse.ArgumentParser, arguments: Sequence[str] | None) -> int:
    options = parser.parse_args(arguments)
    return kinds.run_command(lambda: options.run(options))


def _add_render(commands: argparse._SubParsersAction, opened: Path | None) -> None:
    """`opened` is the file that is meant where none is named."""
    parser = commands.add_parser(
        "render",
        help="render .blend files to pictures",
        description="Render .blend files with Rooks. What no option sets is taken from the file.",
    )
    parser.set_defaults(run=_run_render)
    many, default = ("*", [opened]) if opened else ("+", None)
    parser.add_argument("files", nargs=many, default=default, metavar="FILE.blend", type=Path, help="what to render")
    parser.add_argument(
        "--output",
        action="append",
        required=True,
        metavar="PATH",
        help="where to save: .exr holds all passes, unclamped and linear, with the sampling in its header; .png, .jpg, "
        ".tif, .webp, .bmp, .tga and .hdr are what Blender's render window shows; a folder gets NAME.exr and NAME.png. "
        "May be given several times",
    )
    names = list(core.samplers.SAMPLERS)
    parser.add_argument("--sampler", type=kinds.sampler, metavar="NAME", help=f"the sampler: {', '.join(names)}")
    for domain, place in DOMAINS.items():
        parser.add_argument(f"--{domain}-sampler", type=kinds.sampler, metavar="NAME", help=f"another one for {place}")
    parser.add_argument(
        "--samples",
        type=kinds.integer(1, core.limits.MAX_SAMPLES),
        metavar="N",
        help="samples per pixel; a sampler that cannot make this count takes the next one above that it can",
    )
    _add_scene_options(parser, "chooses the noise pattern", "the size in pixels, such as 640x360")


def _add_compare(commands: argparse._SubParsersAction, opened: Path | None) -> None:
    """`opened` is the file that is meant where none is named."""
    parser = commands.add_parser(
        "compare",
        help="compare samplers on a .blend file: pictures, error maps, charts and a recommendation",
        description="Render a .blend file with several samplers, sample counts and seeds, measure their error and "
        "their time, and recommend one. What no option sets is taken from the file.",
    )
    parser.set_defaults(run=_run_compare)
    many, default = ("?", opened) if opened else (None, None)
    parser.add_argument("file", nargs=many, default=default, metavar="FILE.blend", type=Path, help="what to render")
    parser.add_argument(
        "--output",
        required=True,
        metavar="FOLDER",
        type=Path,
        help="where to save NAME_samplers.png and .svg (the sheet), _chart.png and .svg, .csv and .json; "
        "made where it does not exist",
    )
    parser.add_argument(
        "--samplers",
        nargs="+",
        type=kinds.sampler,
        default=comparing.DEFAULT_SAMPLERS,
        metavar="NAME",
        help=f"what to compare: any of {', '.join(core.samplers.SAMPLERS)}; default: the first six",
    )
    parser.add_argument(
        "--counts",
        nargs="+",
        type=kinds.integer(1, core.limits.MAX_SAMPLES),
        default=comparing.DEFAULT_COUNTS,
        metavar="N",
        help=f"numbers of samples per pixel; default: {' '.join(map(str, comparing.DEFAULT_COUNTS))}",
    )
    parser.add_argument(
        "--seeds",
        type=kinds.integer(1, comparing.MAX_SEEDS),
        default=comparing.DEFAULT_SEEDS,
        metavar="N",
        help=f"how many noise patterns of each are measured; default: {comparing.DEFAULT_SEEDS}",
    )
    size = f"the size in pixels, such as 640x360; default: the file's, its longer side at most {comparing.DEFAULT_SIZE}"
    _add_scene_options(parser, "chooses the noise patterns", size)


def _add_scene_options(parser: argparse.ArgumentParser, seed: str, size: str) -> None:
    """What every command can set; `seed` and `size` are what it says of those two."""
    parser.add_argument(
        "--frame", type=kinds.integer(-MAX_FRAME, MAX_FRAME), metavar="N", help="the frame of the animation"
    )
    parser.add_argument("--seed", type=kinds.integer(0, core.limits.MAX_SEED), metavar="N", help=seed)
    limits = core.limits
    for name, text in BOUNCES.items():
        largest = limits.MAX_TRANSPARENT_BOUNCES if name == "transparent" else limits.MAX_BOUNCES
        parser.add_argument(f"--{name}-bounces", type=kinds.integer(0, largest), metavar="N", help=text)
    parser.add_argument(
        "--clamp-indirect",
        type=_limit,
        metavar="X",
        help="cut off what one sample of bounced light adds above this, which darkens the picture; 0 is off",
    )
    parser.add_argument("--resolution", type=kinds.resolution, metavar="WxH", help=size)
    parser.add_argument("--threads", type=kinds.integer(0, 1024), metavar="N", help="threads; 0 is one per core")


def _limit(text: str) -> float:
    """An argument that is a finite number of at least 0."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"must be 0 or more, not {text}")
    return value


# Blender takes a second to load: only for a command that is right so far.


def _run_render(options: argparse.Namespace) -> int:
    from .headless import render_files

    return render_files(options)


def _run_compare(options: argparse.Namespace) -> int:
    from .headless_compare import compare_file

    return compare_file(options)
