"""The command line: `python -m addon render FILE.blend --output PATH …`, and `compare FILE.blend --output FOLDER …`.

Inside Blender they are `blender FILE.blend --command rooks render --output PATH …` and `… compare …`. How they say what
is wrong, and their exit statuses: see `core.command_line`. Options that both have: see `scene_options`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from . import comparing
from ._core import core
from .scene_options import add_frame, add_scene_options, frame

kinds = core.command_line  # of arguments

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
        ".tif, .webp, .bmp, .tga and .hdr are what Blender's render window shows without compositing; a folder gets "
        "NAME.exr and NAME.png. May be given several times",
    )
    names = list(core.samplers.SAMPLERS)
    parser.add_argument("--sampler", type=kinds.sampler, metavar="NAME", help=f"the sampler: {', '.join(names)}")
    for domain, place in DOMAINS.items():
        parser.add_argument(f"--{domain}-sampler", type=kinds.sampler, metavar="NAME", help=f"another one for {place}")
    parser.add_argument(
        "--samples",
        dest="rooks.samples",
        type=kinds.integer(1, core.limits.MAX_SAMPLES),
        metavar="N",
        help="samples per pixel; a sampler that cannot make this count takes the next one above that it can",
    )
    _add_frames(parser)
    add_scene_options(parser, "chooses the noise pattern", "the size in pixels, such as 640x360")
    parser.add_argument(
        "--crop",
        dest="render.use_crop_to_border",
        action=argparse.BooleanOptionalAction,
        help="whether a picture is cut to the region, or is as large as the frame and empty around it",
    )
    parser.add_argument(
        "--denoising-data",
        action=argparse.BooleanOptionalAction,
        help="whether an .exr has the Denoising Albedo beside the other passes, which takes time of its own",
    )


def _add_frames(parser: argparse.ArgumentParser) -> None:
    frames = parser.add_mutually_exclusive_group()
    add_frame(frames)
    frames.add_argument(
        "--frames",
        nargs=2,
        type=frame,
        action=_FramesAction,
        metavar=("FIRST", "LAST"),
        help="every frame from one to another; each one's number ends the names of its pictures, such as NAME_0001.exr",
    )
    parser.add_argument(
        "--animate-seed",
        dest="rooks.use_animated_seed",
        action=argparse.BooleanOptionalAction,
        help="whether each frame has a noise pattern of its own",
    )


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
    add_frame(parser)
    size = f"the size in pixels, such as 640x360; default: the file's, its longer side at most {comparing.DEFAULT_SIZE}"
    add_scene_options(parser, "chooses the noise patterns", size)


class _FramesAction(argparse.Action):
    """Keeps the first and the last of a range of frames."""

    def __call__(self, parser, namespace, values: Sequence[int], option_string=None) -> None:
        first, last = values
        if first > last:
            raise argparse.ArgumentError(self, f"the first frame, {first}, comes after the last, {last}")
        setattr(namespace, self.dest, values)


# Blender takes a second to load: only for a command that is right so far.


def _run_render(options: argparse.Namespace) -> int:
    from .headless import render_files

    return render_files(options)


def _run_compare(options: argparse.Namespace) -> int:
    from .headless_compare import compare_file

    return compare_file(options)
