"""What the command lines of the core and of the add-on share: one-line errors, exit statuses, kinds of argument.

What is wrong with a command is said before anything is done, in one line on stderr that starts with "rooks:". Exit
status: 0 done, 1 something is wrong with a file or a scene, 2 with the command itself, 130 interrupted (Ctrl-C), 143
terminated.
"""

from __future__ import annotations

import argparse
import re
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .errors import RooksError
from .samplers import SAMPLERS

PROGRAM = "rooks"

#: The signals that end a command, and what it says then.
ENDED_BY = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
_received: list[int] = []


class Ended(KeyboardInterrupt):
    """A signal has come to end the command.

    A class of its own, because CPython has a process die of SIGINT at its end once a plain KeyboardInterrupt has
    passed through `exec` of a text, as namedtuple's or numba's, even if it was handled after that.
    """


class OneLineParser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage."""

    def error(self, message: str) -> None:
        self.exit(2, f"{PROGRAM}: {message} (see {self.prog} --help)\n")


def run_command(command: Callable[[], int]) -> int:
    """Run a command and return its exit status, after saying what went wrong if anything did."""
    try:
        with _ended_by_signals():
            return command()
    except RooksError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        number = _received[0] if _received else signal.SIGINT
        print(f"{PROGRAM}: {ENDED_BY[number]}", file=sys.stderr)
        return 128 + number
    except Exception as error:
        # A bug: unlike a user's mistake it deserves a traceback.
        traceback.print_exc()
        print(f"{PROGRAM}: internal error: {error}", file=sys.stderr)
        return 1
    finally:
        _received.clear()


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Make each signal of `ENDED_BY` a KeyboardInterrupt, so that all that is open is closed."""

    def interrupt(number: int, _frame: object) -> None:
        _received.append(number)
        raise Ended

    before = {number: signal.signal(number, interrupt) for number in ENDED_BY}
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is not None:  # one of Blender's own, which ends with the command
                signal.signal(number, handler)


def was_interrupted() -> bool:
    """Whether a signal has come to end this command.

    What takes long asks: Blender, and Python in a finalizer, swallow exceptions, and may have swallowed that one.
    """
    return bool(_received)


def integer(low: int, high: int) -> Callable[[str], int]:
    """An argument that is a whole number from `low` to `high`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"must be between {low} and {high}, not {value}")
        return value

    return parse


def sampler(text: str) -> str:
    """An argument that is a sampler's name, in any case."""
    name = text.lower()
    if name not in SAMPLERS:
        raise argparse.ArgumentTypeError(f"unknown sampler {text!r}: choose {', '.join(SAMPLERS)}")
    return name


def resolution(text: str) -> tuple[int, int]:
    """An argument that is a picture's size, such as 640x360."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    # Blender's own limits.
    if not all(4 <= side <= 65536 for side in size):
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 640x360, of 4 pixels and more each way")
    return size
