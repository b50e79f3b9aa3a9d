"""The options that both commands have: what they set in the scene, in place of what the file says.

An option that sets one property of the scene has that property's path as its destination: "rooks.seed". Options that
set several, such as `--border`, are spelled out in `_properties`. The names of the scene, of its view layer and of its
camera are for `blend_files`, which looks them up.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence

from ._core import core

kinds = core.command_line  # of arguments

#: Blender's own limits.
MAX_FRAME = 1048574
MAX_PERCENTAGE = 32767
MAX_SUBDIVISION = 32767

BOUNCES = {
    "max": "how often light is reflected or let through in all; 0 is direct light only",
    "diffuse": "how often it is reflected diffusely",
    "glossy": "how often it is reflected by glossy surfaces",
    "transmission": "how often it goes through glass and the like",
    "transparent": "how many transparent surfaces it passes straight on",
}
#: The pixel filters by their names on the command line, which are those of `RenderSettings`.
FILTERS = ("box", "blackman_harris")

frame = kinds.integer(-MAX_FRAME, MAX_FRAME)


def add_frame(parser: argparse._ActionsContainer) -> None:
    parser.add_argument("--frame", type=frame, metavar="N", help="the frame of the animation")


def add_scene_options(parser: argparse.ArgumentParser, seed: str, size: str) -> None:
    """Add what both commands can set beside the frame; `seed` and `size` are what a command says of those two."""
    _add_view(parser)
    seeds = kinds.integer(0, core.limits.MAX_SEED)
    parser.add_argument("--seed", dest="rooks.seed", type=seeds, metavar="N", help=seed)
    _add_light_paths(parser)
    _add_film(parser, size)
    parser.add_argument(
        "--simplify-subdivision",
        type=kinds.integer(0, MAX_SUBDIVISION),
        metavar="N",
        help="switch Simplify on, with at most this many subdivisions by a modifier",
    )
    parser.add_argument("--threads", type=kinds.integer(0, 1024), metavar="N", help="threads; 0 is one per core")
    parser.add_argument(
        "--tile-size",
        dest="rooks.tile_size",
        type=kinds.integer(4, 4096),
        metavar="N",
        help="the side of the squares that are rendered one by one, in pixels, which changes nothing in the picture",
    )


def _add_view(parser: argparse.ArgumentParser) -> None:
    for option, text in {
        "scene": "the scene to render; default: the one that the file opens with",
        "view-layer": "the view layer to render, whether it is on or not; default: the first that is on",
        "camera": "the camera to look through, whatever markers on the timeline say",
    }.items():
        parser.add_argument(f"--{option}", metavar="NAME", help=text)


def _add_light_paths(parser: argparse.ArgumentParser) -> None:
    limits = core.limits
    for name, text in BOUNCES.items():
        largest = limits.MAX_TRANSPARENT_BOUNCES if name == "transparent" else limits.MAX_BOUNCES
        path = f"rooks.{name}_bounces"
        parser.add_argument(f"--{name}-bounces", dest=path, type=kinds.integer(0, largest), metavar="N", help=text)
    parser.add_argument(
        "--clamp-indirect",
        dest="rooks.clamp_indirect",
        type=_number(0.0),
        metavar="X",
        help="cut off what one sample of bounced light adds above this, which darkens the picture; 0 is off",
    )


def _add_film(parser: argparse.ArgumentParser, size: str) -> None:
    parser.add_argument("--resolution", type=kinds.resolution, metavar="WxH", help=size)
    parser.add_argument(
        "--percentage",
        dest="render.resolution_percentage",
        type=kinds.integer(1, MAX_PERCENTAGE),
        metavar="N",
        help="render at this percentage of the size",
    )
    parser.add_argument(
        "--border",
        nargs=4,
        type=_number(0.0, 1.0),
        action=_BorderAction,
        metavar=("LEFT", "RIGHT", "BOTTOM", "TOP"),
        help="the region to render, from 0 to 1 of the frame's width and height; 0 1 0 1 is the whole frame",
    )
    parser.add_argument(
        "--filter",
        dest="rooks.pixel_filter",
        type=_pixel_filter,
        metavar="NAME",
        help=f"the pixel filter: {' or '.join(FILTERS)}",
    )
    parser.add_argument(
        "--filter-width",
        dest="render.filter_size",
        type=_number(0.01, 10.0),
        metavar="X",
        help="the width of blackman_harris, in pixels; that of box is always 1",
    )
    parser.add_argument(
        "--transparent",
        dest="render.film_transparent",
        action=argparse.BooleanOptionalAction,
        help="whether the background is transparent",
    )


def set_scene(scene, options: argparse.Namespace) -> None:
    """Give a scene the frame and the properties that options ask for."""
    if options.frame is not None:
        scene.frame_set(options.frame)
    for path, value in _properties(options).items():
        set_property(scene, path, value)


def set_property(scene, path: str, value: object) -> None:
    """Set a property of a scene, by its path, for all frames: what animates it is muted."""
    from .versions import animation_curves

    for curve in animation_curves(scene):
        if curve.data_path == path:
            curve.mute = True
    owner, _, name = path.rpartition(".")
    setattr(scene.path_resolve(owner), name, value)


def _properties(options: argparse.Namespace) -> dict[str, object]:
    """The values of the properties that options set, by the properties' paths."""
    render: dict[str, object] = {}
    if options.resolution is not None:
        render["resolution_x"], render["resolution_y"] = options.resolution
        render["resolution_percentage"] = 100
    if options.border is not None:
        render["use_border"] = True
        edges = ("border_min_x", "border_max_x", "border_min_y", "border_max_y")
        render |= zip(edges, options.border, strict=True)
    if options.simplify_subdivision is not None:
        render |= {"use_simplify": True, "simplify_subdivision_render": options.simplify_subdivision}
    if options.threads is not None:
        render["threads_mode"] = "FIXED" if options.threads else "AUTO"
        render |= {"threads": options.threads} if options.threads else {}
    single = {path: value for path, value in vars(options).items() if "." in path and value is not None}
    return {f"render.{name}": value for name, value in render.items()} | single


class _BorderAction(argparse.Action):
    """Keeps the edges of a region that is not empty."""

    def __call__(self, parser, namespace, values: Sequence[float], option_string=None) -> None:
        left, right, bottom, top = values
        if left >= right or bottom >= top:
            raise argparse.ArgumentError(self, "LEFT must be less than RIGHT, and BOTTOM less than TOP")
        setattr(namespace, self.dest, values)


def _pixel_filter(text: str) -> str:
    """An argument that is a pixel filter's name, in any case, as Blender's property has it."""
    if text.lower() not in FILTERS:
        raise argparse.ArgumentTypeError(f"unknown filter {text!r}: choose {' or '.join(FILTERS)}")
    return text.upper()


def _number(low: float, high: float = math.inf) -> Callable[[str], float]:
    """An argument that is a finite number from `low` to `high`."""
    limits = f"{low:g} or more" if high == math.inf else f"between {low:g} and {high:g}"

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
        if not low <= value <= high or value == math.inf:
            raise argparse.ArgumentTypeError(f"must be {limits}, not {text}")
        return value

    return parse
