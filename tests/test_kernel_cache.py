"""Compiled kernels: where they are kept, when they are stale, and how much of them there is."""

from __future__ import annotations

import errno
import importlib.util
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest

from core import Instance, Material, PointLight, RenderSettings, Scene, compiling, jit
from core.preparation import prepare
from core.shaders import Glass
from core.values import EnvironmentTexture
from tests.disks import read_only, small_disk
from tests.scenes import box, camera_down, emitter, floor, translation
from tests.test_rendering import still_life

BOX, GLASS = box(), Material("glass", Glass((1.0, 1.0, 1.0)))
FORTRAN = Instance(BOX, np.asfortranarray(translation(1, 2, 3)))
ROOT = Path(__file__).parent.parent
ASK = "from core import kernel_cache as k; print(k.cache_folder().name, k.are_compiled(), k.share_compiled())"


@pytest.fixture
def copy(tmp_path) -> Path:
    """A copy of the core to change."""
    shutil.copytree(ROOT / "core", tmp_path / "core", ignore=shutil.ignore_patterns("__pycache__", "lab"))
    return tmp_path


def ask(copy: Path, code: str = ASK, before: Sequence[str] = ()) -> list[str]:
    environment = os.environ | {"ROOKS_CACHE_DIR": str(copy / "cache"), "TMPDIR": str(copy)}
    return subprocess.run(
        [*before, sys.executable, "-c", code], cwd=copy, env=environment, capture_output=True, text=True, check=True
    ).stdout.split()


def test_a_changed_source_means_other_kernels(copy):
    before = ask(copy)
    with (copy / "core" / "warps.py").open("a") as source:
        source.write("# changed\n")
    assert before[1:] == ["False", "0.0"]
    assert ask(copy)[0] != before[0]


def test_kernels_count_as_compiled_when_all_are(copy):
    folder = copy / "cache" / ask(copy)[0]
    for number in range(1000):
        (folder / f"kernel-{number}.nbi").touch()
    assert ask(copy)[1:] == ["False", "1.0"]
    ask(copy, "from core import kernel_cache; kernel_cache.note_compiled()")
    assert ask(copy)[1:] == ["True", "1.0"]


def test_sources_that_were_copied_again_are_compiled_again(copy):
    """Numba goes by the time of the file as well."""
    ask(copy, "from core import kernel_cache; kernel_cache.note_compiled()")
    os.utime(copy / "core" / "warps.py", (1, 1))
    assert ask(copy)[1] == "False"


def test_another_processor_has_kernels_of_its_own(copy):
    ask(copy, "from core import kernel_cache; kernel_cache.note_compiled()")
    elsewhere = "from core import kernel_cache; kernel_cache._processor = lambda: 'another'"
    assert ask(copy, f"{elsewhere}; print(kernel_cache.are_compiled())") == ["False"]
    assert ask(copy)[1] == "True"


def test_asking_does_not_load_the_compiler(copy):
    assert ask(copy, f"{ASK}; import sys; print('numba' in sys.modules)")[-1] == "False"


FOLDER = "from core import kernel_cache as k; print(k.cache_folder().parent.name)"


def on_full_disks(code: str, but: str = "nowhere") -> str:
    """`code` where no folder has room but those with `but` in their paths."""
    fake = f"lambda path: usage(path)._replace(free=({but!r} in str(path)) << 40)"
    return f"import shutil\nusage = shutil.disk_usage\nshutil.disk_usage = {fake}\n{code}"


def test_a_folder_that_cannot_be_written_is_replaced_by_a_temporary_one(copy):
    (copy / "cache").write_text("a file")
    assert ask(copy, FOLDER)[0].startswith("rooks-cache-")


def test_a_full_disk_is_replaced_by_a_temporary_folder_unless_the_kernels_are_there(copy):
    code = on_full_disks(FOLDER, but="rooks-cache-")
    assert ask(copy, code)[0].startswith("rooks-cache-")
    ask(copy, "from core import kernel_cache; kernel_cache.note_compiled()")
    assert ask(copy, code) == ["cache"]


def test_without_room_for_kernels_one_line_says_so(copy):
    code = "from core import errors, kernel_cache as k\ntry: k.cache_folder()\nexcept errors.RooksError as e: print(e)"
    text = " ".join(ask(copy, on_full_disks(code)))
    assert f"neither in {copy}/cache nor in a temporary folder: make 32 MB of room" in text


def test_a_temporary_folder_is_removed_at_the_end(copy):
    (copy / "cache").write_text("a file")
    code = "from core import kernel_cache as k; k.cache_folder().joinpath('x.nbi').touch(); print(k.cache_folder())"
    assert "rooks-cache-" in ask(copy, code)[0]
    assert not list(copy.glob("rooks-cache-*"))


#: A kernel beside the core's: whether it is loaded, and from where.
LOAD = """
import numpy as np, probe
from core import jit, kernel_cache
double, numbers = jit.kernel(probe.double), np.ones(1)
double(numbers)
print(numbers[0], bool(double.stats.cache_hits), kernel_cache.cache_folder().parent.name)
"""
PROBE = "def double(numbers):\n    for i in range(len(numbers)):\n        numbers[i] *= 2\n"


def test_a_filled_folder_that_cannot_be_written_is_used(copy):
    """As it is where somebody else has installed Rooks, or the disk is mounted to be read."""
    (copy / "probe.py").write_text(PROBE)
    assert ask(copy, LOAD) == ["2.0", "False", "cache"]
    ask(copy, "from core import kernel_cache; kernel_cache.note_compiled()")
    with read_only(copy / "cache") as before:
        assert ask(copy, LOAD, before) == ["2.0", "True", "cache"]


def test_kernels_of_other_versions_are_removed_when_unused_for_a_month(copy):
    """Those of a folder that is no version's, or that holds something else, are not Rooks' to remove."""
    days = {"0123456789abcdef": 31, "fedcba9876543210": 29, "aaaaaaaaaaaaaaaa": 31, "kernels": 31}
    for name, age in days.items():
        folder = copy / "cache" / name / "core_1"
        folder.mkdir(parents=True)
        for file in ("a.nbi", "a.1.nbc", "../complete-1"):
            (folder / file).touch()
        if name == "aaaaaaaaaaaaaaaa":
            (folder / "picture.exr").touch()
        os.utime(folder.parent, (time.time() - age * 24 * 3600,) * 2)
    own = ask(copy)[0]
    kept = {"fedcba9876543210", "aaaaaaaaaaaaaaaa", "kernels", own}
    assert {path.name for path in (copy / "cache").iterdir()} == kept


def test_what_is_used_is_not_old(copy):
    folder = copy / "cache" / ask(copy)[0]
    os.utime(folder, (1, 1))
    ask(copy)
    assert time.time() - folder.stat().st_mtime < 3600


@pytest.mark.parametrize(("megabytes", "folder"), [(1, "rooks-cache-"), (40, "cache")])
def test_a_disk_that_is_full_or_fills_up_is_no_obstacle(copy, megabytes, folder):
    (copy / "probe.py").write_text(PROBE)
    fill_first = "from core import kernel_cache as k; from disks import fill; fill(k.cache_folder())"
    shutil.copy(ROOT / "tests" / "disks.py", copy)
    with small_disk(copy / "cache", megabytes):
        value, is_loaded, kept_in = ask(copy, fill_first + LOAD if folder == "cache" else LOAD)
        assert (value, is_loaded) == ("2.0", "False")
        assert kept_in.startswith(folder)
        assert not list((copy / "cache").rglob("*.nb*"))


def test_where_the_temporary_folder_is_on_the_full_disk_too_one_line_says_so(copy):
    code = "import tempfile; tempfile.tempdir = 'cache'\nfrom core import errors, kernel_cache as k\n"
    code += "try: k.cache_folder()\nexcept errors.RooksError as e: print(e)"
    with small_disk(copy / "cache", megabytes=1):
        text = " ".join(ask(copy, code))
        assert not list((copy / "cache").glob("rooks-cache-*"))
    assert text.startswith(
        f"compiled kernels can be kept neither in {copy}/cache nor in a temporary folder: make 32 MB"
    )


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Loads a small kernel as a new process would: calling it says what it computes, and whether it was compiled."""
    source = tmp_path / "probe.py"
    source.write_text(PROBE)
    monkeypatch.setattr(jit, "cache_folder", lambda: tmp_path / "cache")

    def load() -> tuple[float, bool]:
        spec = importlib.util.spec_from_file_location("probe", source)
        probe = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "probe", probe)
        spec.loader.exec_module(probe)
        double, numbers = jit.kernel(probe.double), np.ones(1)
        double(numbers)
        return float(numbers[0]), not double.stats.cache_hits

    return load


@pytest.mark.parametrize("damage", [b"", b"no pickle"])
@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_damaged_kernel_is_compiled_again(load, tmp_path, ending, damage):
    assert [load(), load()] == [(2.0, True), (2.0, False)]
    (file,) = (tmp_path / "cache").rglob(f"*.{ending}")
    file.write_bytes(damage)
    assert [load(), load()] == [(2.0, True), (2.0, False)]


def test_a_kernel_that_the_disk_cannot_take_is_run_all_the_same(load, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile._save_data", fail)
    assert load() == (2.0, True)


SCENES = {
    "empty": Scene(camera_down(1)),
    "still life": still_life(),
    "one emitter": Scene(camera_down(1), (Instance(floor(), materials=(emitter(),)),)),
    "one triangle": compiling.smallest_scene(),
    "lamps": Scene(camera_down(1), (), tuple(PointLight((i, 0, 1), (1.0,) * 3) for i in range(20))),
    "world": Scene(camera_down(1), world=EnvironmentTexture(np.ones((2, 4, 3), np.uint8))),
    "blender's order": Scene(replace(camera_down(1), matrix=np.asfortranarray(np.eye(4))), (FORTRAN,)),
    "instances": Scene(camera_down(1), (Instance(BOX), Instance(BOX, translation(1, 2, 3), (GLASS,)))),
}


def types_of(data: object) -> object:
    """What numba compiles for: a tuple of a tuple of types."""
    if isinstance(data, tuple):
        return type(data), *map(types_of, data)
    return str(numba.typeof(data))


@pytest.mark.parametrize("name", SCENES)
def test_kernels_are_compiled_once_for_all_scenes(name):
    """Numba compiles anew for every layout of an array and every kind of number."""
    prepared = prepare(SCENES[name], RenderSettings(samples=2, max_bounces=1))
    expected = prepare(compiling.smallest_scene(), RenderSettings(samples=1))
    for of in (lambda p: p.frame, lambda p: p.workspace()):
        assert types_of(of(prepared)) == types_of(of(expected))
    prepared.let_go()
    expected.let_go()
