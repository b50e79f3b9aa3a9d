"""Rendering files without a window: pictures show what the options ask for, one for each frame, layer and camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.cli import main  # noqa: E402
from tests.addon_helpers import add, empty_scene, lamp, quad, shader  # noqa: E402


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


def test_a_view_layer_is_rendered_alone(film, tmp_path, capfd):
    white = rendered(film, tmp_path / "first.exr")
    assert 'only the first of 2 view layers, "ViewLayer", is rendered' in capfd.readouterr().err
    assert (white[..., 0] == white[..., 1]).all()
    red = rendered(film, tmp_path / "red.exr", "--view-layer", "Red")
    assert capfd.readouterr().err == ""
    assert red[..., 0].max() > 0.1
    assert red[..., 1].max() == 0
    np.testing.assert_array_equal(rendered(film, tmp_path / "off.exr", "--view-layer", "Off"), white)


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
