"""Comparing samplers in Blender: on what F12 renders, without a trace in the file, to files or one line of error."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import core  # noqa: E402
from addon import compare_operators, comparing  # noqa: E402
from addon.handover import hand_over, size_within  # noqa: E402
from addon.watch import Watch, watched_render  # noqa: E402
from tests.addon_helpers import add, empty_scene, lamp, quad, shader  # noqa: E402

ROOT = Path(__file__).parents[1]
WIDTH, HEIGHT = 40, 28
FILES = [f"_samplers{ending}" for ending in (".csv", ".json", ".png", ".svg", "_chart.png", "_chart.svg")]


@pytest.fixture
def scene():
    """What a render shows differently than the viewport: hidden objects, render-level modifiers, an instancer."""
    scene = empty_scene(WIDTH, HEIGHT)
    scene.rooks.samples, scene.rooks.sampler, scene.rooks.seed = 4, "MULTI_JITTERED", 3
    floor = quad(size=4)
    floor.rotation_euler = (0.5, 0.3, 0.2)
    modifier = floor.modifiers.new("Waves", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    quad("Hidden", size=9).hide_render = True
    quad("Unseen", location=(1, 1, 1)).hide_viewport = True
    quad("Leaf", size=0.4).parent = quad("Tree", location=(0, 0, 1), instance_type="VERTS")
    lamp("AREA", 200, size=2)
    return scene


def rendered(scene) -> Watch:
    watch = Watch()
    watched_render(watch, scene=scene.name)
    return watch


# The scene that is handed over


@pytest.mark.parametrize("border", [False, True])
def test_what_is_handed_over_renders_to_the_picture_of_f12(scene, border):
    scene.render.use_border = border
    scene.render.border_min_x, scene.render.border_max_y = 0.3, 0.7
    handed = hand_over(scene, (WIDTH, HEIGHT))
    watch = rendered(scene)
    assert handed.settings == watch.settings[0]
    picture = core.render(handed.scene, handed.settings).passes["Combined"]
    assert picture[..., :3].max() > 0.1
    np.testing.assert_array_equal(picture, watch.films[0].passes["Combined"])


def test_it_is_the_scene_of_the_current_frame(scene):
    scene.camera.keyframe_insert("location", frame=1)
    scene.camera.location.x = 1
    scene.camera.keyframe_insert("location", frame=5)
    scene.rooks.samples = 1
    scene.rooks.keyframe_insert("samples", frame=1)
    scene.rooks.samples = 9
    scene.rooks.keyframe_insert("samples", frame=5)
    scene.frame_set(5)
    handed = hand_over(scene, (WIDTH, HEIGHT))
    assert (handed.settings.samples, handed.scene.camera.matrix[0][3]) == (9, 1)


def test_the_size_is_the_only_difference(scene):
    handed = hand_over(scene, (20, 14))
    scene.render.resolution_x, scene.render.resolution_y = 20, 14
    picture = core.render(handed.scene, handed.settings).passes["Combined"]
    np.testing.assert_array_equal(picture, rendered(scene).films[0].passes["Combined"])


def test_the_file_and_the_last_picture_stay_as_they_were(scene, tmp_path):
    def shown() -> bytes:
        scene.render.image_settings.file_format = "BMP"
        bpy.data.images["Render Result"].save_render(str(tmp_path / "x.bmp"), scene=scene)
        return (tmp_path / "x.bmp").read_bytes()

    rendered(scene)
    before = shown(), bpy.data.scenes.keys(), bpy.data.objects.keys(), scene.render.resolution_x
    hand_over(scene, (20, 14))
    assert (shown(), bpy.data.scenes.keys(), bpy.data.objects.keys(), scene.render.resolution_x) == before


def test_only_the_first_view_layer_is_handed_over_and_that_is_said(scene):
    scene.view_layers.new("Clay").material_override = shader("ShaderNodeBsdfDiffuse", "Black")[0]
    handed = hand_over(scene, (WIDTH, HEIGHT))
    assert handed.warnings == ('only the first of 2 view layers, "ViewLayer", is rendered',)
    assert all(layer.use for layer in scene.view_layers)


def _no_camera(scene):
    scene.camera = None


def _panorama(scene):
    scene.camera.data.type = "PANO"


def _no_layer(scene):
    scene.view_layers[0].use = False


@pytest.mark.parametrize(
    ("spoil", "words"),
    [(_no_camera, "has no camera"), (_panorama, 'camera "Camera" is panoramic'), (_no_layer, "view layer")],
)
def test_a_scene_that_cannot_be_rendered_is_an_error_and_leaves_no_trace(scene, spoil, words):
    spoil(scene)
    with pytest.raises(core.SceneError, match=words):
        hand_over(scene, (WIDTH, HEIGHT))
    assert bpy.data.scenes.keys() == ["Scene"]


@pytest.mark.parametrize(
    ("resolution", "percent", "longest", "size"),
    [
        ((1920, 1080), 100, 256, (256, 144)),
        ((1080, 1920), 100, 256, (144, 256)),
        ((1920, 1080), 10, 256, (192, 108)),
        ((300, 1), 100, 256, (256, 4)),
    ],
)
def test_a_size_within(resolution, percent, longest, size):
    render = SimpleNamespace(resolution_x=resolution[0], resolution_y=resolution[1], resolution_percentage=percent)
    assert size_within(render, longest) == size


# The operator, without a window


def wish(scene, tmp_path, **wishes) -> None:
    values = {"samplers": {"RANDOM", "MULTI_JITTERED"}, "counts": "1 4", "seeds": 2, "folder": str(tmp_path)} | wishes
    for name, value in values.items():
        setattr(scene.rooks.comparison, name, value)


def test_the_operator_saves_and_loads_the_sheet(scene, tmp_path, capfd):
    wish(scene, tmp_path)
    assert bpy.ops.rooks.compare_samplers() == {"FINISHED"}
    assert sorted(os.listdir(tmp_path)) == [f"untitled{name}" for name in FILES]
    image = bpy.data.images["untitled_samplers.png"]
    assert image.packed_file is not None
    assert min(image.size) > 500
    (said,) = (line for line in capfd.readouterr().out.splitlines() if line.startswith("Info: "))
    assert "this scene" in said
    assert str(tmp_path) in said


def test_a_second_comparison_replaces_the_first(scene, tmp_path):
    wish(scene, tmp_path)
    bpy.ops.rooks.compare_samplers()
    first = bytes(bpy.data.images["untitled_samplers.png"].packed_file.data)
    scene.rooks.comparison.counts = "1 2"
    bpy.ops.rooks.compare_samplers()
    (image,) = (image for image in bpy.data.images if image.name.startswith("untitled"))
    assert bytes(image.packed_file.data) == (tmp_path / "untitled_samplers.png").read_bytes() != first


@pytest.mark.parametrize(
    ("wishes", "words"),
    [
        ({"samplers": set()}, "no samplers are chosen"),
        ({"counts": "4 x"}, "'x' is not a number of samples"),
        ({"counts": ""}, "no numbers of samples"),
        ({"folder": "/nowhere/x"}, "/nowhere"),
        ({"folder": "//"}, "save it first"),
    ],
)
def test_what_is_wrong_is_one_line_of_error(scene, tmp_path, wishes, words):
    wish(scene, tmp_path, **wishes)
    with pytest.raises(RuntimeError, match=words) as caught:
        bpy.ops.rooks.compare_samplers()
    assert str(caught.value).strip().count("\n") == 0
    assert os.listdir(tmp_path) == []


def test_a_bug_is_one_line_of_error_and_a_traceback(scene, tmp_path, monkeypatch, capsys):
    wish(scene, tmp_path)
    monkeypatch.setattr(comparing, "compare", lambda *_: 1 / 0)
    with pytest.raises(RuntimeError, match="internal error: ZeroDivisionError"):
        bpy.ops.rooks.compare_samplers()
    assert "Traceback" in capsys.readouterr().err


# In a thread


def plan(scene, folder, seeds=2) -> comparing.Plan:
    handed = hand_over(scene, (WIDTH, HEIGHT))
    names, counts = ("random", "multi_jittered"), (1, 4)
    return comparing.Plan(handed.scene, handed.settings, names, counts, seeds, folder, "x_samplers")


def finished(worker: comparing.Worker) -> comparing.Worker:
    start = time.monotonic()
    while not worker.is_done:
        assert time.monotonic() < start + 60
        time.sleep(0.02)
    return worker


def test_the_files_own_sampler_is_compared_by_the_picture_of_f12(scene, tmp_path):
    tone = pytest.importorskip("core.lab.tone")
    picture = rendered(scene).films[0].passes["Combined"][..., :3]
    wanted = plan(scene, tmp_path)
    comparison = comparing.load_comparison().compare(
        wanted.scene, wanted.settings, wanted.samplers, wanted.counts, wanted.seeds
    )
    np.testing.assert_array_equal(comparison.shots["multi_jittered", 4].picture, tone.display(picture))


def test_a_worker_measures_and_saves(scene, tmp_path):
    worker = finished(comparing.Worker(plan(scene, tmp_path)))
    assert (worker.error, worker.share) == (None, 1)
    assert sorted(os.listdir(tmp_path)) == [f"x{name}" for name in FILES]
    assert worker.outcome.files[0] == tmp_path / "x_samplers.png"


def test_a_worker_that_is_cancelled_stops_soon_and_saves_nothing(scene, tmp_path):
    worker = comparing.Worker(plan(scene, tmp_path, seeds=1000))
    while worker.share == 0:
        time.sleep(0.02)
    start = time.monotonic()
    worker.stop()
    assert time.monotonic() - start < 2
    assert (worker.is_done, worker.outcome, worker.error, os.listdir(tmp_path)) == (True, None, None, [])
    assert "stopping" in compare_operators.progress_text(worker)


def test_a_worker_keeps_errors_for_the_window(scene, tmp_path, capsys):
    (tmp_path / "file").touch()
    worker = finished(comparing.Worker(plan(scene, tmp_path / "file")))
    assert worker.outcome is None
    assert str(tmp_path / "file") in worker.error
    broken = finished(comparing.Worker(None))
    assert broken.error.startswith("internal error")
    assert "Traceback" in capsys.readouterr().err


def test_counts_are_sorted_and_unique():
    assert comparing.parse_counts("16 4, 4 64") == (4, 16, 64)


# The command line


@pytest.fixture(scope="module")
def blends(tmp_path_factory) -> Path:
    """A folder with good.blend and no_camera.blend."""
    folder = tmp_path_factory.mktemp("blends")
    scene = empty_scene(WIDTH, HEIGHT)
    quad()
    lamp("AREA", 100, size=2)
    add("Nothing", bpy.data.meshes.new("Nothing"))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "good.blend"), copy=True)
    scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "no_camera.blend"), copy=True)
    return folder


def command(*arguments) -> list[str]:
    return [sys.executable, "-m", "addon", "compare", *map(str, arguments)]


def run(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run(command(*arguments), cwd=ROOT, capture_output=True, text=True, timeout=600)


QUICK = ("--samplers", "random", "n_rooks", "--counts", "1", "4", "--seeds", "2")


def test_a_file_is_compared_into_a_new_folder(blends, tmp_path):
    done = run(blends / "good.blend", "--output", tmp_path / "new", "--resolution", "24x16", *QUICK)
    assert done.returncode == 0, done.stderr
    assert done.stderr == 'rooks: warning: object "Nothing" has no faces: there is nothing to render\n'
    first, recommendation, *saved = done.stdout.splitlines()
    assert first == "good.blend: comparing 2 samplers, 24 × 16 pixels, 2 seeds, samples: 1 4"
    assert "this scene" in recommendation
    assert sorted(os.listdir(tmp_path / "new")) == [f"good{name}" for name in FILES]
    assert sorted(Path(line.removeprefix("  saved ")).name for line in saved) == [f"good{name}" for name in FILES]


def run_in_blender(prepare: str, *arguments) -> subprocess.CompletedProcess:
    """What `blender … --command rooks …` runs, after some lines of Python."""
    script = (
        f"import bpy, sys, addon.cli; addon.register(); {prepare}; sys.exit(addon.cli.run_in_blender(sys.argv[1:]))"
    )
    whole = [sys.executable, "-c", script, *map(str, arguments)]
    return subprocess.run(whole, cwd=ROOT, capture_output=True, text=True, timeout=600)


def test_in_blender_the_open_file_is_meant_with_all_that_was_done_to_it(blends, tmp_path):
    change = "bpy.context.scene.render.resolution_x = 20"
    prepare = f"bpy.ops.wm.open_mainfile(filepath={str(blends / 'good.blend')!r}); {change}"
    done = run_in_blender(prepare, "compare", "--output", tmp_path, *QUICK)
    assert done.returncode == 0, done.stderr
    assert "good.blend: comparing 2 samplers, 20 × 28 pixels" in done.stdout
    assert sorted(os.listdir(tmp_path)) == [f"good{name}" for name in FILES]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare"], "--output"),
        (["compare", "--output", "x", "--samplers", "sobol"], "unknown sampler 'sobol'"),
        (["compare", "--output", "x"], "required: FILE.blend"),
        (["show", "x.blend", "--output", "x.png"], "invalid choice: 'show'"),
        ([], "required: COMMAND"),
    ],
)
def test_in_blender_a_wrong_command_has_exit_status_2(arguments, words):
    done = run_in_blender("pass", *arguments)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1), done.stderr
    assert words in done.stderr


@pytest.mark.parametrize(
    ("file", "options", "status", "words"),
    [
        ("missing.blend", [], 1, "missing.blend does not exist"),
        ("no_camera.blend", [], 1, 'scene "Scene" has no camera'),
        ("good.blend", ["--samplers", "sobol"], 2, "unknown sampler 'sobol'"),
        ("good.blend", ["--counts", "0"], 2, "between 1 and"),
        ("good.blend", ["--counts"], 2, "expected at least one argument"),
        ("good.blend", ["--seeds", "many"], 2, "not a whole number"),
        ("good.blend", ["--resolution", "640"], 2, "not a size such as 640x360"),
        ("good.blend", ["--output", "nowhere/x"], 1, "nowhere does not exist"),
        ("good.blend", ["--output", "/proc/x"], 1, "cannot write into the folder /proc"),
        ("good.blend", ["--output", "README.md"], 1, "README.md is a file"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(blends, tmp_path, file, options, status, words):
    done = run(blends / file, "--output", tmp_path / "out", *options)
    assert (done.returncode, done.stdout) == (status, ""), done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("rooks: ")
    assert words in line
    assert os.listdir(tmp_path) == []


def test_without_matplotlib_one_line_says_what_to_install(blends, tmp_path):
    script = "import sys; sys.modules['matplotlib'] = None; import addon.cli; sys.exit(addon.cli.main(sys.argv[1:]))"
    arguments = [sys.executable, "-c", script, "compare", blends / "good.blend", "--output", tmp_path / "out"]
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert "pip install --group lab" in done.stderr


def test_ctrl_c_stops_without_a_traceback_and_leaves_nothing(blends, tmp_path):
    arguments = command(blends / "good.blend", "--output", tmp_path / "out", "--seeds", 1000)
    with subprocess.Popen(arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        time.sleep(2)
        process.send_signal(signal.SIGINT)
        _out, errors = process.communicate(timeout=600)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "rooks: interrupted"
    assert "Traceback" not in errors
    assert os.listdir(tmp_path) == []
