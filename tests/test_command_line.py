"""Commands end by signals with one line and the status that shells expect, and leave the handlers as they were."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from core.command_line import run_command, was_interrupted


@pytest.mark.parametrize(
    ("number", "status", "text"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
def test_a_signal_ends_a_command(number, status, text, capsys):
    before = signal.getsignal(number)
    assert run_command(lambda: signal.raise_signal(number)) == status
    assert capsys.readouterr().err == f"rooks: {text}\n"
    assert signal.getsignal(number) is before


def test_a_signal_that_somebody_swallows_is_not_forgotten(capsys):
    def command() -> int:
        assert not was_interrupted()
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        if was_interrupted():
            raise KeyboardInterrupt
        return 0

    assert run_command(command) == 143
    assert capsys.readouterr().err == "rooks: terminated\n"
    assert not was_interrupted(), "the next command begins anew"


def test_the_status_holds_for_a_signal_in_code_that_is_made_of_text(tmp_path):
    (tmp_path / "tried.py").write_text("""
import signal, sys
from core.command_line import run_command
sys.exit(run_command(lambda: exec("signal.raise_signal(signal.SIGINT)")))
""")
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-m", "tried"]  # a script's end, unlike a module's, does not forget the status
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "rooks: interrupted\n")
