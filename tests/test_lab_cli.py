"""The lab's command line: what it says of itself, and of packages that are not there, which rendering does not need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from core.lab.cli import COMMANDS

ROOT = Path(__file__).parents[1]
EXTRA = ("matplotlib", "scipy", "rich")


def run_without(packages: tuple[str, ...], code: str) -> subprocess.CompletedProcess:
    """Run Python code as if packages were not installed."""
    hide = "".join(f"sys.modules[{name!r}] = None; " for name in packages)
    program = f"import sys; {hide}{code}"
    return subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=600)


def lab(*arguments: str) -> str:
    return f"from core.lab.cli import main; sys.exit(main({list(arguments)!r}))"


@pytest.mark.parametrize(
    ("command", "missing"),
    [
        ("patterns", "matplotlib"),
        ("score", "scipy"),
        ("score", "rich"),
        ("figures", "matplotlib"),
        ("chart", "matplotlib"),
    ],
)
def test_a_command_says_which_package_is_missing_and_what_to_install(command, missing):
    done = run_without((missing,), lab(command))
    expected = f"rooks: {command} needs {missing}: install the lab's extra (pip install --group lab)\n"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", expected)


def test_the_commands_are_listed_without_the_packages():
    done = run_without(EXTRA, lab("--help"))
    assert done.returncode == 0
    assert all(f"  {name} " in done.stdout for name in COMMANDS)


@pytest.mark.parametrize(
    ("arguments", "words"), [((), "required: COMMAND"), (("nonsense",), "invalid choice: 'nonsense'")]
)
def test_a_wrong_command_is_one_line(arguments, words):
    done = run_without((), lab(*arguments))
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith("rooks: ")
    assert words in done.stderr


def test_rendering_needs_none_of_the_packages():
    code = (
        "import numpy as np, core; "
        "camera = core.Camera(np.eye(4), (4, 4), (-0.5, 0.5, -0.5, 0.5)); "
        "print(core.render(core.Scene(camera, world=(1.0, 1.0, 1.0)), core.RenderSettings()).passes['Combined'].mean())"
    )
    done = run_without(EXTRA, code)
    assert (done.returncode, done.stdout) == (0, "1.0\n"), done.stderr
