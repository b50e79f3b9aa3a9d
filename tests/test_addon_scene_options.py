"""The options that set a scene: each sets its own properties and nothing else, for every frame, and none is missing."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from addon.cli import make_parser  # noqa: E402
from addon.properties import RooksSceneSettings  # noqa: E402
from addon.scene_options import FILTERS, set_property, set_scene  # noqa: E402
from addon.watch import Watch, watched_render  # noqa: E402
from tests.addon_helpers import empty_scene, lamp, quad  # noqa: E402

#: Settings of Rooks that no option of `render` is for, and why.
WITHOUT_OPTION = {
    "preview_samples": "of the viewport",
    "use_separate_samplers": "on where a domain has a sampler of its own",
    "comparison": "of the other command",
}
#: Options that set several properties, or that are set elsewhere.
OWN_NAMES = {"sampler", "pixel_sampler", "lens_sampler", "light_sampler", "bsdf_sampler"}


def parse(text: str = "", command: str = "render"):
    return make_parser().parse_args([command, "x.blend", "--output", "x", *text.split()])


def numbers(scene) -> dict[str, object]:
    """All of Rooks' and Blender's render settings that are plain values, by their paths."""
    return {
        f"{owner}.{name}": getattr(scene.path_resolve(owner), name)
        for owner in ("rooks", "render")
        for name, kind in scene.path_resolve(owner).bl_rna.properties.items()
        if kind.type in ("BOOLEAN", "INT", "FLOAT", "ENUM", "STRING") and not getattr(kind, "is_array", False)
    }


REGION = {"use_border": True, "border_min_x": 0.25, "border_max_x": 0.75, "border_min_y": 0, "border_max_y": 0.5}
OPTIONS = {
    "--samples 9": {"rooks.samples": 9},
    "--seed 7": {"rooks.seed": 7},
    "--animate-seed": {"rooks.use_animated_seed": True},
    "--max-bounces 3": {"rooks.max_bounces": 3},
    "--diffuse-bounces 0": {"rooks.diffuse_bounces": 0},
    "--glossy-bounces 64": {"rooks.glossy_bounces": 64},
    "--transmission-bounces 1": {"rooks.transmission_bounces": 1},
    "--transparent-bounces 256": {"rooks.transparent_bounces": 256},
    "--clamp-indirect 2.5": {"rooks.clamp_indirect": 2.5},
    "--tile-size 32": {"rooks.tile_size": 32},
    "--filter Blackman_Harris": {"rooks.pixel_filter": "BLACKMAN_HARRIS"},
    "--filter-width 2.25": {"render.filter_size": 2.25},
    "--transparent": {"render.film_transparent": True},
    "--resolution 64x48": {"render.resolution_x": 64, "render.resolution_y": 48, "render.resolution_percentage": 100},
    "--percentage 25": {"render.resolution_percentage": 25},
    "--percentage 25 --resolution 64x32": {
        "render.resolution_x": 64,
        "render.resolution_y": 32,
        "render.resolution_percentage": 25,
    },
    "--border 0.25 0.75 0 0.5": {f"render.{name}": value for name, value in REGION.items()},
    "--crop": {"render.use_crop_to_border": True},
    "--simplify-subdivision 1": {"render.use_simplify": True, "render.simplify_subdivision_render": 1},
    "--threads 3": {"render.threads_mode": "FIXED", "render.threads": 3},
    "": {},
}


@pytest.mark.parametrize("text", OPTIONS)
def test_an_option_sets_its_properties_and_no_others(text):
    scene = empty_scene()
    scene.render.resolution_percentage = 50
    before = numbers(scene)
    set_scene(scene, parse(text))
    after = numbers(scene)
    assert {path: after[path] for path in OPTIONS[text]} == OPTIONS[text]
    assert {path for path in after if after[path] != before[path]} <= set(OPTIONS[text])


@pytest.mark.parametrize(
    ("switch", "path"),
    [
        ("transparent", "render.film_transparent"),
        ("crop", "render.use_crop_to_border"),
        ("animate-seed", "rooks.use_animated_seed"),
    ],
)
def test_a_switch_can_be_switched_off(switch, path):
    scene = empty_scene()
    set_property(scene, path, True)
    set_scene(scene, parse())
    assert scene.path_resolve(path) is True
    set_scene(scene, parse(f"--no-{switch}"))
    assert scene.path_resolve(path) is False


def test_no_threads_are_one_per_core():
    scene = empty_scene()
    scene.render.threads_mode, scene.render.threads = "FIXED", 3
    set_scene(scene, parse("--threads 0"))
    assert scene.render.threads_mode == "AUTO"


def test_every_setting_of_rooks_has_an_option():
    paths = {path.removeprefix("rooks.") for path in vars(parse()) if path.startswith("rooks.")}
    settings = {name for name in RooksSceneSettings.bl_rna.properties.keys() if name not in ("rna_type", "name")}  # noqa: SIM118
    assert paths | OWN_NAMES | set(WITHOUT_OPTION) == settings
    assert not (paths | OWN_NAMES) & set(WITHOUT_OPTION)
    assert set(vars(parse())) >= OWN_NAMES


def test_the_filters_are_those_of_the_property():
    items = RooksSceneSettings.bl_rna.properties["pixel_filter"].enum_items
    assert [name.upper() for name in FILTERS] == [item.identifier for item in items]


def push_down(animation: bpy.types.AnimData) -> None:
    """Turn the action into a strip, as the NLA editor does."""
    strip = animation.nla_tracks.new().strips.new("Keys", 1, animation.action)
    if hasattr(strip, "action_slot"):  # from 4.4 on
        strip.action_slot = animation.action_slot
    animation.action = None


@pytest.mark.parametrize("in_strip", [False, True])
def test_options_hold_on_every_frame_and_what_else_moves_goes_on(in_strip):
    scene = empty_scene(8, 8)
    quad()
    lamp("SUN")
    for frame, samples, bounces, transparent in ((1, 1, 1, False), (3, 5, 3, True)):
        scene.rooks.samples, scene.rooks.max_bounces, scene.render.film_transparent = samples, bounces, transparent
        for path in ("rooks.samples", "rooks.max_bounces", "render.film_transparent"):
            scene.keyframe_insert(path, frame=frame)
    for path, expression in (("rooks.seed", "2 * frame"), ("rooks.diffuse_bounces", "frame")):
        scene.driver_add(path).driver.expression = expression
    if in_strip:
        push_down(scene.animation_data)
    set_scene(scene, parse("--samples 2 --no-transparent --seed 50"))
    settings = []
    for frame in (1, 3):
        scene.frame_set(frame)
        watch = Watch()
        watched_render(watch, scene=scene.name)
        settings += watch.settings
    assert [one.samples for one in settings] == [2, 2]
    assert [one.seed for one in settings] == [50, 50]
    assert [one.film_transparent for one in settings] == [False, False]
    assert [one.max_bounces for one in settings] == [1, 3]
    assert [one.diffuse_bounces for one in settings] == [1, 3]


@pytest.mark.parametrize("command", ["render", "compare"])
def test_both_commands_have_them(command):
    options = parse("--scene A --view-layer B --camera C --frame 3 --filter box --border 0 1 0 1 --seed 2", command)
    assert (options.scene, options.view_layer, options.camera, options.frame) == ("A", "B", "C", 3)
    scene = empty_scene()
    set_scene(scene, options)
    assert (scene.frame_current, scene.rooks.seed, scene.render.use_border) == (3, 2, True)
