"""Renders through Blender's operator are the core's pixels, in the right place, or an error that says why."""

from __future__ import annotations

import contextlib
import signal

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import addon.export  # noqa: E402
import core  # noqa: E402
from addon.settings import BOUNCES, render_border, render_settings  # noqa: E402
from addon.ui import sample_count_lines  # noqa: E402
from addon.versions import choose_file_format, choose_multilayer_format  # noqa: E402
from addon.watch import Watch, watched_render, watching  # noqa: E402
from core.command_line import run_command  # noqa: E402
from core.film import CHANNELS  # noqa: E402
from core.samplers import SAMPLERS  # noqa: E402
from tests.addon_helpers import add, empty_scene, export, lamp, quad, shader  # noqa: E402

WIDTH, HEIGHT = 40, 28


@pytest.fixture
def scene():
    """A lit quad that is seen at an angle, with the background around it."""
    scene = empty_scene(WIDTH, HEIGHT)
    scene.rooks.samples, scene.rooks.sampler = 4, "JITTERED"
    quad(size=4).rotation_euler = (0.5, 0.3, 0.2)
    lamp("AREA", 200, size=2)
    return scene


def render(watch: Watch | None = None) -> Watch:
    with watching(watch or Watch()) as worn:
        bpy.ops.render.render()
    return worn


def saved_pixels(path) -> np.ndarray:
    """What Blender saves as a float EXR, (height, width, 4), bottom row first."""
    settings = bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    bpy.data.images["Render Result"].save_render(str(path))
    image = bpy.data.images.load(str(path), check_existing=False)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)


def core_pixels() -> np.ndarray:
    scene = bpy.context.scene
    exported, _warnings = export()
    return core.render(exported, render_settings(scene, exported.camera.resolution)).passes["Combined"]


def test_the_picture_is_the_cores(scene, tmp_path):
    watch = render()
    picture = saved_pixels(tmp_path / "x.exr")
    assert picture.shape == (HEIGHT, WIDTH, 4)
    assert picture[..., :3].max() > 0.1
    np.testing.assert_array_equal(picture, core_pixels())
    np.testing.assert_array_equal(picture, watch.films[0].passes["Combined"])


def test_transparent_film_has_alpha(scene, tmp_path):
    scene.render.film_transparent = True
    render()
    picture = saved_pixels(tmp_path / "x.exr")
    assert (picture[..., 3].min(), picture[..., 3].max()) == (0, 1)
    np.testing.assert_array_equal(picture, core_pixels())


# In the last, 0.35 and 0.7 of 40 pixels are 14 and 28 in float32, which Blender uses, and one less in float64.
BORDERS = [
    (0.25, 0.1, 0.8, 0.7),
    (0.0, 0.0, 0.33, 1.0),
    (0.501, 0.499, 1.0, 1.0),
    (0.07, 0.61, 0.93, 0.77),
    (0.35, 0.1, 0.7, 0.8),
]


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("crop", [True, False])
def test_a_render_region_is_that_part_of_the_full_picture(scene, tmp_path, border, crop):
    full = core_pixels()
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    names = ("border_min_x", "border_min_y", "border_max_x", "border_max_y")
    for name, value in zip(names, border, strict=True):
        setattr(scene.render, name, value)
    left, bottom, right, top = render_border(scene.render, (WIDTH, HEIGHT))
    render()
    picture = saved_pixels(tmp_path / "x.exr")
    if not crop:
        assert picture.shape == full.shape
        outside = picture.copy()
        outside[bottom:top, left:right] = 0
        assert not outside.any()
        picture = picture[bottom:top, left:right]
    np.testing.assert_array_equal(picture, full[bottom:top, left:right])


def test_an_empty_region_is_refused_by_blender(scene):
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.5, 0.501
    with pytest.raises(RuntimeError, match="too small"):
        render()


def test_passes_are_there_when_asked_for(scene, tmp_path):
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.rooks.use_pass_sampling_error = True
    layer.rooks.use_pass_denoising_data = True
    choose_multilayer_format(scene.render.image_settings)
    scene.render.filepath = str(tmp_path / "layers.exr")
    with watching(Watch()) as watch:
        bpy.ops.render.render(write_still=True)
    openexr = pytest.importorskip("OpenEXR")
    channels = {}
    with openexr.File(str(tmp_path / "layers.exr"), separate_channels=True) as file:
        for part in file.parts:
            channels.update({name: channel.pixels for name, channel in part.channels.items()})
    film = watch.films[0]
    passes = {"Denoising Normal": film.passes["Normal"], **film.passes}
    assert set(passes) == {*CHANNELS, "Denoising Normal"}
    for name, values in passes.items():
        for index, letter in enumerate(CHANNELS.get(name, "XYZ")):
            saved = next(value for key, value in channels.items() if key.endswith(f".{name}.{letter}"))
            np.testing.assert_array_equal(saved[::-1], values[..., index], err_msg=f"{name}.{letter}")


@pytest.mark.parametrize("name", ["PNG", "OPEN_EXR", "OPEN_EXR_MULTILAYER"])
def test_what_blender_saves_says_how_it_was_sampled(scene, tmp_path, name):
    if name == "OPEN_EXR_MULTILAYER":
        choose_multilayer_format(scene.render.image_settings)
    else:
        choose_file_format(scene.render.image_settings, name)
    render()
    path = tmp_path / ("x.png" if name == "PNG" else "x.exr")
    bpy.data.images["Render Result"].save_render(str(path))
    if name == "PNG":
        with pytest.importorskip("PIL.Image").open(path) as picture:
            header = picture.info
    else:
        with pytest.importorskip("OpenEXR").File(str(path)) as file:
            header = dict(file.header())
    assert (header["rooks:samples"], header["rooks:light_sampler"], header["rooks:frame"]) == ("4", "jittered", "1")


def test_each_view_layer_is_rendered(scene):
    layer = scene.view_layers.new("Clay")
    layer.material_override = shader("ShaderNodeBsdfDiffuse", "Black", Color=(0, 0, 0, 1))[0]
    first, second = render().films
    assert first.passes["Combined"][..., :3].any()
    assert not second.passes["Combined"][..., :3].any()


def test_every_setting_arrives():
    scene = empty_scene()
    rooks, blender = scene.rooks, scene.render
    rooks.samples, rooks.sampler, rooks.seed = 9, "N_ROOKS", 7
    rooks.max_bounces, rooks.diffuse_bounces, rooks.glossy_bounces = 9, 1, 2
    rooks.transmission_bounces, rooks.transparent_bounces, rooks.clamp_indirect = 3, 5, 2.5
    rooks.pixel_filter, blender.filter_size, blender.film_transparent = "BLACKMAN_HARRIS", 2.5, True
    blender.threads_mode, blender.threads = "FIXED", 3
    settings = render_settings(scene, (32, 24))
    assert settings == core.RenderSettings(
        samples=9,
        sampler="n_rooks",
        seed=7,
        max_bounces=9,
        diffuse_bounces=1,
        glossy_bounces=2,
        transmission_bounces=3,
        transparent_bounces=5,
        clamp_indirect=2.5,
        pixel_filter="blackman_harris",
        filter_width=2.5,
        film_transparent=True,
        threads=3,
    )
    rooks.use_separate_samplers = True
    rooks.pixel_sampler, rooks.lens_sampler = "REGULAR", "RANDOM"
    rooks.light_sampler, rooks.bsdf_sampler = "JITTERED", "HAMMERSLEY"
    samplers = {"pixel": "regular", "lens": "random", "light": "jittered", "bsdf": "hammersley"}
    assert render_settings(scene, (32, 24)).samplers == samplers


def test_the_seed_changes_with_the_frame_where_it_is_to():
    scene = empty_scene()
    scene.rooks.seed = core.limits.MAX_SEED
    for animate, seeds in ((False, [core.limits.MAX_SEED] * 2), (True, [2, 3])):
        scene.rooks.use_animated_seed = animate
        found = []
        for frame in (3, 4):
            scene.frame_set(frame)
            found.append(render_settings(scene, (32, 24)).seed)
        assert found == seeds


def test_the_defaults_are_those_of_cycles():
    scene = empty_scene()
    ours, cycles = render_settings(scene, (32, 24)), scene.cycles
    assert {name: getattr(ours, name) for name in BOUNCES} == {
        "max_bounces": cycles.max_bounces,
        "diffuse_bounces": cycles.diffuse_bounces,
        "glossy_bounces": cycles.glossy_bounces,
        "transmission_bounces": cycles.transmission_bounces,
        "transparent_bounces": cycles.transparent_max_bounces,
    }
    assert ours.clamp_indirect == 0, "it would be a bias"


def test_the_menu_of_samplers_is_the_registry():
    items = bpy.context.scene.rooks.bl_rna.properties["sampler"].enum_items
    assert [(i.identifier, i.name, i.value) for i in items] == [
        (name.upper(), sampler.label, sampler.number) for name, sampler in SAMPLERS.items()
    ]


@pytest.mark.parametrize(
    ("sampler", "lens", "asked", "line"),
    [
        ("JITTERED", None, 17, ["Jittered takes 20 samples"]),
        ("JITTERED", None, 16, []),
        ("N_ROOKS", None, 17, []),
        ("N_ROOKS", "JITTERED", 17, ["Together they take 20 samples"]),
    ],
)
def test_the_count_that_is_really_taken_is_shown(sampler, lens, asked, line):
    rooks = empty_scene().rooks
    rooks.sampler, rooks.samples, rooks.use_separate_samplers = sampler, asked, lens is not None
    rooks.pixel_sampler = rooks.light_sampler = rooks.bsdf_sampler = sampler
    rooks.lens_sampler = lens or sampler
    assert sample_count_lines(rooks) == line
    rooks.preview_samples = asked
    assert sample_count_lines(rooks) == [*line, *(["In the viewport: 20 samples"] if line else [])]


def test_without_a_camera_an_error_and_the_next_render_is_right(scene, tmp_path):
    camera, scene.camera = scene.camera, None
    with watching(Watch()) as watch, pytest.raises(RuntimeError, match="camera"):
        bpy.ops.render.render()
    assert not watch.films
    scene.camera = camera
    render()
    np.testing.assert_array_equal(saved_pixels(tmp_path / "x.exr"), core_pixels())


def test_a_broken_mesh_is_an_error_and_the_next_render_is_right(scene, tmp_path):
    broken = quad("Broken")
    broken.data.vertices[0].co.x = float("nan")
    with watching(Watch()) as watch, pytest.raises(RuntimeError, match='"Broken"'):
        bpy.ops.render.render()
    assert "Broken" in watch.error
    bpy.data.objects.remove(broken)
    render()
    np.testing.assert_array_equal(saved_pixels(tmp_path / "x.exr"), core_pixels())


def test_a_bug_is_reported_and_not_swallowed(scene, monkeypatch, capsys):
    monkeypatch.setattr("addon.export.export_scene", lambda *_: 1 / 0)
    with watching(Watch()) as watch, pytest.raises(RuntimeError, match="internal error: ZeroDivisionError"):
        bpy.ops.render.render()
    assert watch.error.startswith("internal error")
    assert "Traceback" in capsys.readouterr().err


def test_warnings_do_not_fail_a_render(scene):
    add("Nothing", bpy.data.meshes.new("Nothing"))
    watch = render()
    assert watch.warnings == ['object "Nothing" has no faces: there is nothing to render']
    assert watch.films


def test_hidden_from_renders_and_instancers_children_are_left_out(scene, monkeypatch):
    quad("Hidden").hide_render = True
    quad("Leaf").parent = quad("Tree", instance_type="VERTS", show_instancer_for_render=False)
    exported, export_scene = [], addon.export.export_scene
    monkeypatch.setattr("addon.export.export_scene", lambda *a: exported.append(export_scene(*a)) or exported[0])
    render()
    assert sorted(instance.name for instance in exported[0][0].instances) == ["Leaf"] * 4 + ["Quad"]


def test_progress_reaches_the_end(scene):
    steps = []
    render(Watch(lambda done, total: steps.append((done, total))))
    assert steps
    assert steps[-1][0] == steps[-1][1]


def test_after_escape_the_next_render_is_right(scene, monkeypatch):
    scene.render.resolution_x, scene.render.resolution_y, scene.rooks.samples = 200, 140, 64  # several tiles
    expected = render().films[0].passes["Combined"]
    progress = []
    whole = core.render
    # Escape itself is the engine's test_break, which is Blender's and cannot be replaced.
    monkeypatch.setattr(core, "render", lambda *given: whole(*given[:3], lambda: bool(progress)))
    (stopped,) = render(Watch(lambda *tile: progress.append(tile))).films
    assert stopped.cancelled
    assert 0 < stopped.finished_pixels < 200 * 140
    monkeypatch.undo()
    (again,) = render().films
    assert not again.cancelled
    np.testing.assert_array_equal(again.passes["Combined"], expected)


def test_a_signal_that_somebody_swallowed_ends_the_render(scene):
    scene.rooks.tile_size, scene.rooks.threads = 8, 1

    def swallow(done: int, _total: int) -> None:
        if done == 1:
            with contextlib.suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGTERM)

    watch = Watch(swallow)
    assert run_command(lambda: watched_render(watch)) == 143
    assert watch.films[0].cancelled


def test_registering_twice_and_unregistering_leave_no_trace():
    addon.register()
    addon.unregister()
    addon.unregister()
    try:
        assert not any(hasattr(cls, "rooks") for cls in (bpy.types.Scene, bpy.types.ViewLayer, bpy.types.Material))
        panels = [p for p in bpy.types.Panel.__subclasses__() if "ROOKS" in getattr(p, "COMPAT_ENGINES", ())]
        assert [panel for panel in panels if not panel.__name__.startswith("ROOKS_")] == []
    finally:
        addon.register()
    assert hasattr(bpy.types.Scene, "rooks")
    assert "ROOKS" in bpy.types.RENDER_PT_output.COMPAT_ENGINES
