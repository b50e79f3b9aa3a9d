"""Rendering files without a window: pictures show what the options ask for, one for each frame, layer and camera."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.cli import main  # noqa: E402
from tests.addon_helpers import add, empty_scene, lamp, quad, shader  # noqa: E402

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def film(tmp_path_factory) -> Path:
    """A file in which something moves, with several cameras, view layers and scenes, none of which show the same."""
    path = tmp_path_factory.mktemp("film") / "film.blend"
    scene = empty_scene(40, 28)
    scene.rooks.samples = 2
    floor = quad()
    for frame, x in ((1, 0.0), (3, 2.0)):
        floor.location.x = x
        floor.keyframe_insert("location", frame=frame)
    lamp("SUN", 3)
    scene.timeline_markers.new("Front", frame=1).camera = scene.camera
    near = add("Near", bpy.data.cameras.new("Near"), location=(0, 0, 4))
    scene.timeline_markers.new("Near", frame=3).camera = near
    scene.view_layers.new("Red").material_override = shader("ShaderNodeBsdfDiffuse", Color=(1, 0, 0, 1))[0]
    scene.view_layers.new("Off").use = False
    # A scene of its own: the same but for the quad.
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(scene.camera)
    other.camera = scene.camera
    other.render.resolution_x, other.render.resolution_y = 20, 10
    other.render.dither_intensity = 0.0
    other.world = bpy.data.worlds.new("Sky")
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def pixels(path: Path, name: str = "RGBA") -> np.ndarray:
    """A channel, or several, of an EXR: its data window alone, top row first."""
    with pytest.importorskip("OpenEXR").File(str(path)) as file:
        return file.channels()[name].pixels.copy()


def render(film: Path, *arguments) -> None:
    """Run the command in this process, on the file as it was saved."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert main(["render", str(film), *map(str, arguments)]) == 0


def rendered(film: Path, path: Path, *options) -> np.ndarray:
    render(film, "--output", path, *options)
    return pixels(path)


def test_a_range_of_frames_is_each_of_them_under_its_number(film, tmp_path, capfd):
    options = ("--view-layer", "ViewLayer", "--samples", 3)
    (tmp_path / "x.exr").write_text("an older picture")
    render(film, "--output", tmp_path / "x.exr", "--output", f"{tmp_path}/", "--frames", -1, 2, *options)
    printed = capfd.readouterr()
    numbers = ("-0001", "0000", "0001", "0002")
    wanted = [
        f"{name}_{number}.{end}" for name, end in (("film", "exr"), ("film", "png"), ("x", "exr")) for number in numbers
    ]
    assert sorted(os.listdir(tmp_path)) == sorted([*wanted, "x.exr"])
    assert (tmp_path / "x.exr").read_text() == "an older picture"
    told = [line.partition(":")[0] for line in printed.out.splitlines() if "saved" not in line]
    assert told == [f"film.blend, frame {frame}" for frame in range(-1, 3)]
    assert printed.err == ""
    for frame in (1, 2):
        single = rendered(film, tmp_path / "single.exr", "--frame", frame, *options)
        np.testing.assert_array_equal(pixels(tmp_path / f"x_000{frame}.exr"), single)
    assert (pixels(tmp_path / "x_0001.exr") != pixels(tmp_path / "x_0002.exr")).any()
    assert (pixels(tmp_path / "x_0000.exr") == pixels(tmp_path / "x_0001.exr")).all(), "nothing moves before frame 1"


def test_an_animated_seed_is_another_for_each_frame(film, tmp_path):
    render(film, "--output", tmp_path / "x.exr", "--frames", 0, 1, "--animate-seed", "--seed", 5)
    openexr = pytest.importorskip("OpenEXR")
    seeds = []
    for number in ("0000", "0001"):
        with openexr.File(str(tmp_path / f"x_{number}.exr")) as file:
            seeds.append(file.header()["rooks:seed"])
    assert seeds == [5, 6]


def test_a_view_layer_is_rendered_alone(film, tmp_path, capfd):
    white = rendered(film, tmp_path / "first.exr")
    assert 'only the first of 2 view layers, "ViewLayer", is rendered' in capfd.readouterr().err
    assert (white[..., 0] == white[..., 1]).all()
    red = rendered(film, tmp_path / "red.exr", "--view-layer", "Red")
    assert capfd.readouterr().err == ""
    assert red[..., 0].max() > 0.1
    assert red[..., 1].max() == 0
    np.testing.assert_array_equal(rendered(film, tmp_path / "off.exr", "--view-layer", "Off"), white)


def test_a_camera_counts_more_than_the_markers(film, tmp_path):
    options = ("--view-layer", "ViewLayer", "--frames", 1, 3)
    for name, camera in (("own", ()), ("near", ("--camera", "Near")), ("far", ("--camera", "Camera"))):
        render(film, "--output", tmp_path / f"{name}.exr", *camera, *options)
    covered = {path.stem: (pixels(path)[..., :3] > 0).any(-1).sum() for path in tmp_path.iterdir()}
    # Seen from 4 m a quad is (10 / 4)² times as large as from 10 m, as far as it is in the picture.
    assert covered["near_0001"] > 2 * covered["far_0001"] > 0
    assert covered["near_0001"] > 2 * covered["own_0001"]
    assert covered["own_0001"] == covered["far_0001"]
    np.testing.assert_array_equal(pixels(tmp_path / "own_0003.exr"), pixels(tmp_path / "near_0003.exr"))
    assert (pixels(tmp_path / "own_0003.exr") != pixels(tmp_path / "far_0003.exr")).any()


def test_another_scene_is_rendered_in_every_format(film, tmp_path):
    sky = rendered(film, tmp_path / "x.exr", "--scene", "Other", "--output", tmp_path / "x.png")
    assert sky.shape == (10, 20, 4)
    assert (sky == sky[0, 0]).all()
    assert sky[0, 0, 0] > 0
    with pytest.importorskip("PIL.Image").open(tmp_path / "x.png") as picture:
        assert picture.size == (20, 10)
        assert np.ptp(np.asarray(picture), axis=(0, 1)).max() == 0


@pytest.mark.parametrize(("crop", "size"), [("--crop", (20, 7)), ("--no-crop", (40, 28))])
def test_a_border_is_that_part_of_the_picture(film, tmp_path, crop, size):
    common = ("--view-layer", "ViewLayer", "--max-bounces", 0)
    whole = rendered(film, tmp_path / "whole.exr", *common)
    border = ("--output", tmp_path / "part.png", "--border", 0.25, 0.75, 0.5, 0.75, crop)
    part = rendered(film, tmp_path / "part.exr", *border, *common)
    np.testing.assert_array_equal(part, whole[7:14, 10:30])  # the top row is the first
    with pytest.importorskip("PIL.Image").open(tmp_path / "part.png") as picture:
        assert picture.size == size


def test_film_and_filter_are_those_that_were_asked_for(film, tmp_path):
    common = ("--view-layer", "ViewLayer", "--max-bounces", 0, "--samples", 16)
    clear = rendered(film, tmp_path / "clear.exr", "--transparent", *common)
    full = rendered(film, tmp_path / "full.exr", "--no-transparent", *common)
    assert (clear[..., 3].min(), clear[..., 3].max(), full[..., 3].min()) == (0, 1, 1)
    # How many pixels the edge of the quad is spread over grows with the filter's width.
    spread = []
    for width in (1, 4):
        options = ("--transparent", "--filter", "blackman_harris", "--filter-width", width, *common)
        alpha = rendered(film, tmp_path / "filter.exr", *options)[..., 3]
        spread.append(((alpha > 0) & (alpha < 1)).sum())
    assert 0 < spread[0] < spread[1]


def test_denoising_data_are_a_pass_more(film, tmp_path):
    albedo = "Denoising Albedo"
    options = ("--view-layer", "Red", "--frame", 1)
    rendered(film, tmp_path / "with.exr", "--denoising-data", *options)
    rendered(film, tmp_path / "without.exr", "--no-denoising-data", *options)
    red = pixels(tmp_path / "with.exr", albedo)
    np.testing.assert_allclose(red[14, 20], (1, 0, 0), atol=1e-6)
    with pytest.importorskip("OpenEXR").File(str(tmp_path / "without.exr")) as file:
        assert not any(name.startswith(albedo) for name in file.channels())


def test_in_blender_the_open_file_takes_the_same_options(film, tmp_path):
    options = ("--view-layer", "Red", "--camera", "Near", "--border", "0", "0.5", "0", "1", "--frames", "1", "2")
    render(film, "--output", tmp_path / "outside.exr", *options)
    script = (
        f"import bpy, sys, addon.cli; addon.register(); bpy.ops.wm.open_mainfile(filepath={str(film)!r}); "
        "sys.exit(addon.cli.run_in_blender(sys.argv[1:]))"
    )
    whole = [sys.executable, "-c", script, "render", "--output", str(tmp_path / "inside.exr"), *options]
    done = subprocess.run(whole, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    for number in ("0001", "0002"):
        inside, outside = (pixels(tmp_path / f"{name}_{number}.exr") for name in ("inside", "outside"))
        np.testing.assert_array_equal(inside, outside)
