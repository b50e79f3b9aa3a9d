"""Where people read on the command line: results and errors, while Blender's own chatter goes elsewhere."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TextIO

#: How much of all there is to do is done, and what is being done.
OnProgress = Callable[[float, str], None]


@dataclass(frozen=True)
class Console:
    """The real stdout and stderr."""

    out: TextIO
    err: TextIO


@contextmanager
def quiet_blender() -> Iterator[Console]:
    """Send what Blender's own code prints, to stdout and stderr, to nowhere.

    Blender writes to the file descriptors 1 and 2, and operators' reports to Python's streams. All are pointed
    elsewhere meanwhile; `Console` is the real ones.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    python_streams = sys.stdout, sys.stderr
    with (
        tempfile.TemporaryFile("w", errors="replace") as sink,
        os.fdopen(os.dup(saved[0]), "w", buffering=1) as out,
        os.fdopen(os.dup(saved[1]), "w", buffering=1) as err,
    ):
        os.dup2(sink.fileno(), 1)
        os.dup2(sink.fileno(), 2)
        sys.stdout = sys.stderr = sink
        try:
            yield Console(out, err)
        finally:
            sys.stdout, sys.stderr = python_streams
            for number, original in enumerate(saved, start=1):
                os.dup2(original, number)
                os.close(original)


@contextmanager
def progress_bar(console: Console) -> Iterator[OnProgress]:
    """A progress bar on a terminal, nothing elsewhere."""
    from rich.console import Console as RichConsole
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    times = (TimeElapsedColumn(), TimeRemainingColumn())
    screen = RichConsole(file=console.err)
    progress = Progress(
        *(*columns, *times),
        console=screen,
        transient=True,
        disable=not screen.is_terminal,
        # What is printed elsewhere is Blender's chatter.
        redirect_stdout=False,
        redirect_stderr=False,
    )
    with progress:
        task = progress.add_task("", total=None)
        yield lambda share, text: progress.update(task, completed=share, total=1.0, description=text)
