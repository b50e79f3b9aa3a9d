"""The command line: `python -m addon render FILE.blend --output PATH …`.

What is wrong with a command is said before anything is rendered, in one line on stderr that starts with "rooks:". Exit
status: 0 done, 1 something is wrong with a file or a scene, 2 with the command itself, 130 interrupted.
"""

from __future__ import annotations

import argparse
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from ._core import core

PROGRAM = "rooks"
#: Blender's own limit.
MAX_FRAME = 1048574
DOMAINS = {"pixel": "the area of a pixel", "lens": "the lens", "light": "the lights", "bsdf": "the surfaces"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    parser = make_parser()
    try:
        options = parser.parse_args(arguments)
        return options.run(options)
    except core.errors.RooksError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        # A bug: unlike a user's mistake it deserves a traceback.
        traceback.print_exc()
        print(f"{PROGRAM}: internal error: {error}", file=sys.stderr)
        return 1


class _OneLineParser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage."""

    def error(self, message: str) -> None:
        self.exit(2, f"{PROGRAM}: {message} (see {self.prog} --help)\n")


def make_parser() -> argparse.ArgumentParser:
    parser = _OneLineParser(prog="python -m addon", description="Rooks: render .blend files without a window.")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=_OneLineParser)
    _add_render(commands)
    return parser


def _add_render(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "render",
        help="render .blend files to pictures",
        description="Render .blend files with Rooks. What no option sets is taken from the file.",
    )
    parser.set_defaults(run=_run_render)
    parser.add_argument("files", nargs="+", metavar="FILE.blend", type=Path, help="what to render")
    parser.add_argument(
        "--output",
        action="append",
        required=True,
        metavar="PATH",
        help="where to save: .exr holds all passes, unclamped and linear, with the sampling in its header; .png, .jpg, "
        ".tif, .webp, .bmp, .tga and .hdr are what Blender's render window shows; a folder gets NAME.exr and NAME.png. "
        "May be given several times",
    )
    parser.add_argument("--frame", type=_integer(-MAX_FRAME, MAX_FRAME), metavar="N", help="the frame of the animation")
    names = list(core.samplers.SAMPLERS)
    parser.add_argument("--sampler", type=_sampler, metavar="NAME", help=f"the sampler: {', '.join(names)}")
    for domain, place in DOMAINS.items():
        parser.add_argument(f"--{domain}-sampler", type=_sampler, metavar="NAME", help=f"another one for {place}")
    parser.add_argument(
        "--samples",
        type=_integer(1, core.limits.MAX_SAMPLES),
        metavar="N",
        help="samples per pixel; a sampler that cannot make this count takes the next one above that it can",
    )
    parser.add_argument("--seed", type=_integer(0, 2**31 - 1), metavar="N", help="chooses the noise pattern")
    parser.add_argument(
        "--max-bounces",
        type=_integer(0, core.limits.MAX_BOUNCES),
        metavar="N",
        help="how often light is reflected between surfaces; 0 is direct light only",
    )
    parser.add_argument("--resolution", type=_resolution, metavar="WxH", help="the size in pixels, such as 640x360")
    parser.add_argument("--threads", type=_integer(0, 1024), metavar="N", help="threads; 0 is one per core")


def _run_render(options: argparse.Namespace) -> int:
    # Blender takes a second to load: only for a command that is right so far.
    from . import headless

    return headless.render_files(options)


def _integer(low: int, high: int) -> Callable[[str], int]:
    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"must be between {low} and {high}, not {value}")
        return value

    return parse


def _sampler(text: str) -> str:
    name = text.lower()
    if name not in core.samplers.SAMPLERS:
        raise argparse.ArgumentTypeError(f"unknown sampler {text!r}: choose {', '.join(core.samplers.SAMPLERS)}")
    return name


def _resolution(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    # Blender's own limits.
    if not all(4 <= side <= 65536 for side in size):
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 640x360, of 4 pixels and more each way")
    return size
