"""The command line: pictures where they were asked for, or one line that says what is wrong, and nothing written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.settings import LIGHT_PATHS  # noqa: E402
from tests.addon_helpers import add, empty_scene, feed, lamp, quad, shader  # noqa: E402
from tests.disks import fill, small_disk  # noqa: E402

ROOT = Path(__file__).parents[1]


def command(*arguments) -> list[str]:
    return [sys.executable, "-m", "addon", "render", *map(str, arguments)]


def run(*arguments, **options) -> subprocess.CompletedProcess:
    return subprocess.run(command(*arguments), cwd=ROOT, capture_output=True, text=True, timeout=600, **options)


def infinite_on_the_left() -> bpy.types.Material:
    """Glossy with a roughness of 10 to the power of 100 where x < 0, and of 1 elsewhere."""
    paint, glossy = shader("ShaderNodeBsdfGlossy")
    power = feed(glossy.inputs["Roughness"], "ShaderNodeMath", operation="POWER")
    power.inputs[0].default_value = 10
    hundred = feed(power.inputs[1], "ShaderNodeMath", operation="MULTIPLY")
    hundred.inputs[1].default_value = 100
    left = feed(hundred.inputs[0], "ShaderNodeMath", operation="LESS_THAN")
    left.inputs[1].default_value = 0
    axes = feed(left.inputs[0], "ShaderNodeSeparateXYZ", "X")
    feed(axes.inputs[0], "ShaderNodeTexCoord", "Object")
    return paint


@pytest.fixture(scope="module")
def blends(tmp_path_factory) -> Path:
    """A folder with files to render: good.blend, negative.blend, infinite.blend, and some that cannot be rendered."""
    folder = tmp_path_factory.mktemp("blends")

    def save(name):
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / name), copy=True)

    scene = empty_scene(40, 28)
    scene.rooks.samples, scene.rooks.sampler = 5, "N_ROOKS"
    quad()
    lamp("AREA", 100)
    add("Nothing", bpy.data.meshes.new("Nothing"))
    save("good.blend")
    negative = lamp("SUN", -100)
    save("negative.blend")
    bpy.data.objects.remove(negative)
    bpy.data.objects["Quad"].data.materials.append(infinite_on_the_left())
    bpy.data.objects["Quad"].scale = (9, 9, 1)
    save("infinite.blend")
    bpy.data.objects["Quad"].data.materials.clear()
    camera = scene.camera.data
    camera.type = "PANO"
    save("panorama.blend")
    camera.keyframe_insert("type", frame=2)
    camera.type = "PERSP"
    camera.keyframe_insert("type", frame=1)
    save("panorama_from_2.blend")
    camera.animation_data_clear()
    broken = quad("Broken")
    broken.data.vertices[0].co.x = float("nan")
    save("broken.blend")
    scene.camera = None
    save("no_camera.blend")
    whole = (folder / "good.blend").read_bytes()
    (folder / "damaged.blend").write_bytes(whole[: len(whole) // 3])
    (folder / "text.blend").write_text("not a picture")
    return folder


def test_a_folder_gets_an_exr_and_a_png(blends, tmp_path):
    done = run(blends / "good.blend", "--output", f"{tmp_path}/")
    assert (done.returncode, sorted(os.listdir(tmp_path))) == (0, ["good.exr", "good.png"])
    assert "N-Rooks, 5 samples per pixel" in done.stdout
    assert "million samples/s" in done.stdout
    assert done.stderr == 'rooks: warning: object "Nothing" has no faces: there is nothing to render\n'
    openexr, image = pytest.importorskip("OpenEXR"), pytest.importorskip("PIL.Image")
    with openexr.File(str(tmp_path / "good.exr")) as file:
        header = file.header()
        assert (header["rooks:samples"], header["rooks:pixel_sampler"]) == (5, "n_rooks")
    with image.open(tmp_path / "good.png") as picture:
        assert np.asarray(picture).shape == (28, 40, 3)
        # Neither the .blend's path nor the date.
        assert not {"File", "Date", "RenderTime"} & set(picture.info)


def test_light_paths_are_options_and_in_the_header(blends, tmp_path):
    wished = dict(zip(LIGHT_PATHS, (3, 1, 2, 0, 5, 7.5), strict=True))
    options = [text for name, value in wished.items() for text in (f"--{name.replace('_', '-')}", value)]
    done = run(blends / "good.blend", "--output", tmp_path / "x.exr", *options)
    assert done.returncode == 0, done.stderr
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File(str(tmp_path / "x.exr")) as file:
        assert {name: file.header()[f"rooks:{name}"] for name in LIGHT_PATHS} == wished


def test_options_override_the_file(blends, tmp_path):
    options = "--sampler jittered --lens-sampler random --samples 7 --resolution 20x10 --threads 1 --seed 3 --frame 4"
    done = run(blends / "good.blend", "--output", tmp_path / "x.jpg", "--output", tmp_path / "x.exr", *options.split())
    assert done.returncode == 0, done.stderr
    assert "Jittered (pixel), Random (lens)" in done.stdout
    assert "9 samples per pixel (7 asked for)" in done.stdout
    assert "20 × 10 pixels" in done.stdout
    assert sorted(os.listdir(tmp_path)) == ["x.exr", "x.jpg"]


@pytest.mark.parametrize(
    ("file", "options", "status", "words"),
    [
        ("missing.blend", [], 1, "missing.blend does not exist"),
        ("text.blend", [], 1, "is not a .blend file"),
        ("damaged.blend", [], 1, "damaged"),
        ("", [], 1, "is a folder"),
        ("no_camera.blend", [], 1, 'scene "Scene" has no camera'),
        ("panorama.blend", [], 1, 'camera "Camera" is panoramic'),
        ("broken.blend", [], 1, 'object "Broken": 1 of its 4 vertices'),
        ("good.blend", ["--sampler", "sobol"], 2, "unknown sampler 'sobol'"),
        ("good.blend", ["--samples", "0"], 2, "between 1 and"),
        ("good.blend", ["--samples", "1000000000"], 2, "between 1 and"),
        ("good.blend", ["--samples", "many"], 2, "not a whole number"),
        ("good.blend", ["--resolution", "640"], 2, "not a size such as 640x360"),
        ("good.blend", ["--max-bounces", "-1"], 2, "between 0 and"),
        ("good.blend", ["--glossy-bounces", "65"], 2, "between 0 and 64"),
        ("good.blend", ["--clamp-indirect", "-1"], 2, "must be 0 or more"),
        ("good.blend", ["--clamp-indirect", "inf"], 2, "must be 0 or more"),
        ("good.blend", ["--clamp-indirect", "much"], 2, "not a number"),
        ("good.blend", ["--frame", "9999999"], 2, "between -1048574 and 1048574"),
        ("good.blend", ["--frames", "3"], 2, "--frames: expected 2 arguments"),
        ("good.blend", ["--frames", "5", "3"], 2, "the first frame, 5, comes after the last, 3"),
        ("good.blend", ["--frames", "1", "2", "--frame", "1"], 2, "not allowed with argument --frames"),
        ("good.blend", ["--filter", "sinc"], 2, "unknown filter 'sinc': choose box or blackman_harris"),
        ("good.blend", ["--filter-width", "0"], 2, "between 0.01 and 10"),
        ("good.blend", ["--filter-width", "nan"], 2, "between 0.01 and 10"),
        ("good.blend", ["--tile-size", "3"], 2, "between 4 and 4096"),
        ("good.blend", ["--percentage", "0"], 2, "between 1 and"),
        ("good.blend", ["--border", "0", "1", "0"], 2, "--border: expected 4 arguments"),
        ("good.blend", ["--border", "0", "1.5", "0", "1"], 2, "between 0 and 1, not 1.5"),
        ("good.blend", ["--border", "-0.5", "1", "0", "1"], 2, "between 0 and 1, not -0.5"),
        ("good.blend", ["--border", "0", "1", "0.7", "0.7"], 2, "BOTTOM less than TOP"),
        ("good.blend", ["--border", "0.5", "0.501", "0", "1"], 1, "good.blend: the render region is empty"),
        ("good.blend", ["--view-layer", "Clay"], 1, '"Scene" has no view layer "Clay": choose "ViewLayer"'),
        ("good.blend", ["--camera", "Lamp"], 1, '"Scene" has no camera "Lamp": choose "Camera"'),
        ("good.blend", ["--scene", "Set"], 1, 'good.blend has no scene "Set": choose "Scene"'),
        ("good.blend", ["--what"], 2, "unrecognized arguments: --what"),
        ("good.blend", ["--output", "nowhere/x.exr"], 1, "nowhere does not exist"),
        ("good.blend", ["--output", "/proc/x.exr"], 1, "cannot write into the folder /proc"),
        ("good.blend", ["--output", "x.xcf"], 1, "must end in one of"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(blends, tmp_path, file, options, status, words):
    target = tmp_path / "x.exr"
    target.write_text("an older picture")
    done = run(blends / file, "--output", target, *options)
    assert (done.returncode, done.stdout) == (status, ""), done.stderr
    errors = [line for line in done.stderr.splitlines() if "warning" not in line]
    assert len(errors) == 1
    assert errors[0].startswith("rooks: ")
    assert words in errors[0]
    assert (os.listdir(tmp_path), target.read_text()) == (["x.exr"], "an older picture")


def test_blenders_reports_are_not_printed_and_tracebacks_of_bugs_are(blends, tmp_path):
    script = (
        "import sys, addon.cli, addon.export; "
        "addon.export.export_scene = lambda *_: 1 / 0; "
        "sys.exit(addon.cli.main(sys.argv[1:]))"
    )
    arguments = [sys.executable, "-c", script, "render", blends / "good.blend", "--output", tmp_path / "x.exr"]
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert (done.returncode, done.stdout) == (1, "")
    lines = done.stderr.splitlines()
    assert lines[0].startswith("Traceback")
    assert [line for line in lines if "internal error" in line] == lines[-1:]


def test_a_full_disk_leaves_the_pictures_that_were_there(blends, tmp_path):
    resource = pytest.importorskip("resource")
    outputs = [tmp_path / name for name in ("x.exr", "x.png", "x.tga")]
    size = ("--resolution", "200x150", "--samples", "1")
    assert run(blends / "good.blend", *size, *(f"--output={output}" for output in outputs)).returncode == 0
    before = {output: output.read_bytes() for output in outputs}
    for output in outputs:
        room = len(before[output]) // 2
        limit = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (room, room))
        done = run(blends / "good.blend", *size, "--output", output, preexec_fn=limit)
        assert done.returncode == 1
        assert f"rooks: cannot write {output}: " in done.stderr
        assert "Traceback" not in done.stderr
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize(("name", "room"), [("x.exr", 0), ("x.exr", 8192), ("x.png", 8192)])
def test_a_disk_without_room_leaves_the_picture_that_was_there(blends, tmp_path, name, room):
    disk = tmp_path / "disk"
    with small_disk(disk, megabytes=1):
        picture = disk / name
        picture.write_text("an older picture")
        fill(disk, but=room)
        done = run(blends / "good.blend", "--resolution=400x300", "--samples=1", "--output", picture)
        assert done.returncode == 1
        errors = [line for line in done.stderr.splitlines() if "warning" not in line]
        assert len(errors) == 1
        assert errors[0].startswith(f"rooks: cannot write {picture}: ")
        assert sorted(os.listdir(disk)) == ["filler", name]
        assert picture.read_text() == "an older picture"


def test_without_room_for_kernels_nothing_is_rendered_and_one_line_says_why(blends, tmp_path):
    disk = tmp_path / "disk"
    with small_disk(disk, megabytes=1):
        environment = os.environ | {"ROOKS_CACHE_DIR": str(disk / "kernels"), "TMPDIR": str(disk)}
        done = run(blends / "good.blend", "--output", tmp_path / "x.exr", env=environment)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "compiled kernels can be kept neither in" in done.stderr
    assert os.listdir(tmp_path) == ["disk"]


def test_no_output_is_a_wrong_command(blends):
    done = run(blends / "good.blend")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "--output" in done.stderr


def test_several_files_need_a_folder(blends, tmp_path):
    done = run(blends / "good.blend", blends / "panorama.blend", "--output", tmp_path / "x.exr")
    assert done.returncode == 1
    assert "give --output a folder" in done.stderr


def test_a_frame_that_cannot_be_rendered_is_named_and_those_before_it_are_there(blends, tmp_path):
    done = run(blends / "panorama_from_2.blend", "--output", tmp_path / "x.exr", "--frames", 1, 3)
    assert (done.returncode, os.listdir(tmp_path)) == (1, ["x_0001.exr"])
    warning, error = done.stderr.splitlines()
    assert warning == 'rooks: warning: object "Nothing" has no faces: there is nothing to render'
    assert 'panorama_from_2.blend, frame 2: the camera "Camera" is panoramic' in error


def test_pictures_of_frames_are_planned_by_their_numbered_names(blends, tmp_path):
    """What is in the way of the last is found before the first is rendered."""
    (tmp_path / "x_0002.png").mkdir()
    done = run(blends / "good.blend", "--output", tmp_path / "x.png", "--frames", 1, 2)
    assert done.returncode == 1
    assert "x_0002.png: it is a folder" in done.stderr
    assert os.listdir(tmp_path) == ["x_0002.png"]


def test_help_explains_every_option():
    text = run("--help").stdout
    samplers = ("sampler", "pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler")
    for name in (*samplers, "samples", *LIGHT_PATHS):
        assert f"--{name.replace('_', '-')}" in text


@pytest.mark.parametrize(
    ("number", "status", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
def test_a_signal_stops_without_a_traceback(blends, tmp_path, number, status, word):
    picture = tmp_path / "x.exr"
    picture.write_text("an older picture")
    arguments = (blends / "good.blend", "--output", picture, "--samples", 50_000, "--resolution", "2000x2000")
    with subprocess.Popen(command(*arguments), cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(4)
        process.send_signal(number)
        _out, errors = process.communicate(timeout=600)
    assert process.returncode == status
    assert errors.splitlines()[-1] == f"rooks: {word}"
    assert "Traceback" not in errors
    assert (os.listdir(tmp_path), picture.read_text()) == (["x.exr"], "an older picture")


def test_what_was_left_out_is_in_the_summary_and_the_header(blends, tmp_path):
    done = run(blends / "negative.blend", "--output", tmp_path / "x.exr")
    assert done.returncode == 0
    assert "pixels were negative" in done.stdout
    assert "pixels were negative" in done.stderr
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File(str(tmp_path / "x.exr")) as file:
        assert file.header()["rooks:negative_pixels"] > 0
        assert file.header()["rooks:dropped_samples"] == 0


def test_samples_that_are_no_numbers_are_counted_in_the_summary_and_the_header(blends, tmp_path):
    """Those of the left half of the picture, whose roughness is infinite."""
    done = run(blends / "infinite.blend", "--output", tmp_path / "x.exr")
    dropped = 20 * 28 * 5
    for text in (done.stdout, done.stderr):
        assert f"{dropped} samples were not finite numbers and were left out" in text
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File(str(tmp_path / "x.exr")) as file:
        assert (done.returncode, file.header()["rooks:dropped_samples"]) == (0, dropped)
        pixels = file.channels()["RGBA"].pixels
    assert np.isfinite(pixels).all()
    assert (pixels[:, :20, :3].max(), pixels[:, 20:, :3].min() > 0) == (0, True)


def test_two_files_of_one_name_do_not_overwrite_each_other(blends, tmp_path):
    (tmp_path / "good.blend").write_bytes((blends / "good.blend").read_bytes())
    done = run(blends / "good.blend", tmp_path / "good.blend", "--output", f"{tmp_path}/")
    assert (done.returncode, os.listdir(tmp_path)) == (1, ["good.blend"])
    assert "two pictures would be saved as" in done.stderr
