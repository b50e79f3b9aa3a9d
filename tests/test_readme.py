"""The README is true: its table is the registry's, and its Python runs."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import OpenEXR

README = Path(__file__).parent.parent / "README.md"


def test_the_table_of_samplers_is_made_from_the_registry():
    updated = runpy.run_path(str(README.parent / "docs" / "update_readme.py"))["updated"]
    assert updated(README.read_text()) == README.read_text(), "run `make docs`"


def test_the_example_of_the_core_runs_and_writes_its_picture(tmp_path, monkeypatch, capsys):
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out == "(320, 320, 4) 64 samples per pixel\n"
    with OpenEXR.File("shadow.exr") as picture:
        assert picture.header()["rooks:samples"] == 64
        pixels = picture.channels()["RGBA"].pixels
    # The shadow falls away from the lamp, around x = -0.75 m: 40 pixels left of the middle.
    shadow, open_floor = pixels[150:170, 85:125, 0].mean(), pixels[230:250, 85:125, 0].mean()
    assert shadow < 0.5 * open_floor


def test_the_pictures_that_it_shows_are_there():
    for image in re.findall(r"!\[.*?\]\((.*?)\)", README.read_text()):
        assert (README.parent / image).is_file(), image
