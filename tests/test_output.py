"""Pictures on disk: an EXR holds the film's numbers the right way up, and appears whole or not at all."""

from __future__ import annotations

import os
import stat

import numpy as np
import pytest

from core import OutputError, write_exr
from core.files import check_writable, replacing
from core.film import CHANNELS, Film
from tests.disks import fill, small_disk

OpenEXR = pytest.importorskip("OpenEXR")


@pytest.fixture
def film() -> Film:
    rng = np.random.default_rng(1)
    passes = {name: rng.normal(0, 1e3, (3, 5, len(c))).astype(np.float32) for name, c in CHANNELS.items()}
    passes["Depth"][0, 0] = 1e10
    return Film(0, 0, 5, 3, 16, (5, 3), passes)


def channels_of(path) -> tuple[dict, dict]:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        part = file.parts[0]
        return dict(part.header), {name: np.array(channel.pixels) for name, channel in part.channels.items()}


def test_values_names_and_orientation_survive(tmp_path, film):
    path = tmp_path / "x.exr"
    write_exr(path, film, {})
    _, channels = channels_of(path)
    combined = {"R", "G", "B", "A"}
    layers = {"Depth.Z", "Normal.X", "Normal.Y", "Normal.Z"}
    layers |= {f"{name}.{c}" for name in ("Sampling Error", "Denoising Albedo") for c in "RGB"}
    assert set(channels) == combined | layers
    for name, letters in CHANNELS.items():
        for index, letter in enumerate(letters):
            pixels = channels[letter if name == "Combined" else f"{name}.{letter}"]
            assert pixels.dtype == np.float32
            # The film's bottom row comes first, the file's top row.
            assert np.array_equal(pixels, film.passes[name][::-1, :, index])


def test_metadata_tells_how_it_was_made(tmp_path, film):
    path = tmp_path / "x.exr"
    write_exr(path, film, {"sampler": "n_rooks", "samples": 16, "seconds": 1.5, "note": "füße"})
    header, _ = channels_of(path)
    assert header["rooks:sampler"] == "n_rooks"
    assert header["rooks:samples"] == 16
    assert header["rooks:seconds"] == 1.5
    assert header["rooks:note"] == "füße"


def test_a_file_that_is_there_is_replaced_and_nothing_else_is_left(tmp_path, film):
    path = tmp_path / "x.exr"
    path.write_text("old")
    write_exr(str(path), film, {})
    assert len(channels_of(path)[1]) == 14
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(os.name == "nt", reason="permissions are POSIX's")
def test_the_file_follows_the_users_mask(tmp_path, film):
    before = os.umask(0o027)
    try:
        write_exr(tmp_path / "x.exr", film, {})
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "x.exr").stat().st_mode) == 0o640


def test_while_it_is_written_the_old_file_stays(tmp_path):
    path = tmp_path / "x.exr"
    path.write_text("old")

    def fail_half_way():
        with replacing(path) as temporary:
            temporary.write_text("half")
            assert path.read_text() == "old"
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [OSError("no space left"), RuntimeError("bad channel")])
def test_an_error_while_writing_is_the_users_to_read(tmp_path, error):
    with pytest.raises(OutputError, match=rf"cannot write .*x\.exr.*{error}"), replacing(tmp_path / "x.exr"):
        raise error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("check", [write_exr, lambda path, *_: check_writable(path)], ids=["write", "check"])
def test_a_folder_that_is_not_there_is_named(tmp_path, film, check):
    with pytest.raises(OutputError, match=r"the folder .*missing.* does not exist"):
        check(tmp_path / "missing" / "x.exr", film, {})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("check", [write_exr, lambda path, *_: check_writable(path)], ids=["write", "check"])
def test_a_folder_is_no_file(tmp_path, film, check):
    (tmp_path / "x.exr").mkdir()
    with pytest.raises(OutputError, match="it is a folder"):
        check(tmp_path / "x.exr", film, {})
    assert [p.name for p in tmp_path.iterdir()] == ["x.exr"]


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path, film):
    tmp_path.chmod(0o500)
    try:
        if os.access(tmp_path, os.W_OK):
            pytest.skip("this user may write anywhere")
        with pytest.raises(OutputError, match="cannot write into the folder"):
            write_exr(tmp_path / "x.exr", film, {})
    finally:
        tmp_path.chmod(0o700)
    assert not list(tmp_path.iterdir())


def test_a_name_too_long_for_the_disk_is_an_output_error(tmp_path, film):
    name = "x" * 300 + ".exr"
    with pytest.raises(OutputError, match="cannot write"):
        write_exr(tmp_path / name, film, {})
    assert not list(tmp_path.iterdir())


def test_a_part_of_the_frame_says_where_it_lies(tmp_path):
    write_exr(tmp_path / "part.exr", Film(2, 1, 5, 3, 16, (20, 10)), {})
    with OpenEXR.File(str(tmp_path / "part.exr")) as file:
        windows = [[tuple(map(int, corner)) for corner in file.header()[k]] for k in ("displayWindow", "dataWindow")]
    # OpenEXR counts rows from the top: the film's 3 rows above the lowest are rows 6 to 8 of 10.
    assert windows == [[(0, 0), (19, 9)], [(2, 6), (6, 8)]]


@pytest.mark.parametrize("room", [0, 8192])
def test_on_a_full_disk_the_older_file_stays_and_one_line_says_why(tmp_path, room):
    passes = {name: np.random.default_rng(1).random((64, 64, len(c))).astype("f4") for name, c in CHANNELS.items()}
    disk = tmp_path / "disk"
    with small_disk(disk, megabytes=1):
        (disk / "x.exr").write_text("old")
        fill(disk, but=room)
        with pytest.raises(OutputError, match=r"^cannot write \S+/x\.exr: [^\n]+$"):
            write_exr(disk / "x.exr", Film(0, 0, 64, 64, 16, (64, 64), passes), {})
        assert sorted(os.listdir(disk)) == ["filler", "x.exr"]
        assert (disk / "x.exr").read_text() == "old"
