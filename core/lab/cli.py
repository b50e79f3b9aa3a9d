"""The lab's command line: `python -m core COMMAND …`.

A command is a module of this package with `add_arguments(parser)` and `run(options) -> exit status`. It is imported
only when it is chosen: the list of commands can be read without matplotlib and scipy.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType

from ..command_line import PROGRAM, OneLineParser, run_command

PROG = "python -m core"
COMMANDS = {
    "patterns": "draw the points of samplers, with their projections and their spectrum",
    "score": "measure the four marks of a good point set, with a verdict on each",
    "figures": "render the textbook's figures: the checkerboard to the horizon, jaggies, moiré and their cures",
    "chart": "chart the error of each sampler against time and against samples",
}
#: What the lab needs beside the renderer's own packages.
EXTRA = ("matplotlib", "scipy", "rich")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    return run_command(lambda: _run(list(sys.argv[1:] if arguments is None else arguments)))


def _run(arguments: list[str]) -> int:
    chosen = _choose(arguments[:1])
    module = _load(chosen)
    if module is None:
        return 1
    parser = OneLineParser(prog=f"{PROG} {chosen}", description=module.__doc__.splitlines()[0])
    module.add_arguments(parser)
    options = parser.parse_args(arguments[1:])
    return module.run(options)


def _choose(first: list[str]) -> str:
    width = max(map(len, COMMANDS)) + 2
    parser = OneLineParser(
        prog=PROG,
        description="The sampling lab of Rooks.",
        epilog="\n".join(["commands:", *(f"  {name:{width}}{text}" for name, text in COMMANDS.items())]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND", help="one of those below; each has its --help")
    return parser.parse_args(first).command


def _load(command: str) -> ModuleType | None:
    """The command's module; None, after a line that says what to install, where a package is missing."""
    try:
        return import_module(f".{command}", __package__)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in EXTRA:
            raise
        package = error.name.partition(".")[0]
        advice = "install the lab's extra (pip install --group lab)"
        print(f"{PROGRAM}: {command} needs {package}: {advice}", file=sys.stderr)
        return None
