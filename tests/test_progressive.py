"""Pictures that get better pass by pass end as the picture of a render, and each pass is worth having."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import AreaLight, Instance, Material, PointLight, RenderSettings, Scene, progressive, render
from core.preparation import Prepared, prepare
from core.progressive import Progressive, coarser, golden_order
from core.shaders import Transparent
from tests.scenes import WHITE, box, camera_down, camera_forward, floor, lambertian, sphere, translation
from tests.test_rendering import still_life

NEVER = np.zeros(1, np.uint8)


@pytest.fixture(scope="module")
def pool():
    with ThreadPoolExecutor(2) as pool:
        yield pool


def passes(prepared: Prepared, scene: Scene, pool: ThreadPoolExecutor, count: int, **more) -> np.ndarray:
    picture = Progressive(prepared, scene.camera, **more)
    for _ in range(count):
        assert picture.add_pass(pool, NEVER)
    return picture.pixels()


@pytest.mark.parametrize("settings", [
    {"samples": 9, "max_bounces": 3},
    {"samples": 4, "sampler": "sobol_owen", "film_transparent": True},
    {"samples": 7, "sampler": "random", "pixel_filter": "blackman_harris"},
], ids=["bounces", "transparent", "filter"])  # fmt: skip
def test_all_passes_together_are_the_render(settings, pool):
    """But for the last digit: sums in another order."""
    scene, settings = still_life(), RenderSettings(**settings)
    expected = render(scene, settings).passes["Combined"]
    prepared = prepare(scene, settings)
    np.testing.assert_allclose(passes(prepared, scene, pool, settings.sample_count), expected, rtol=2e-6, atol=1e-7)
    prepared.let_go()


def test_what_is_lost_is_counted_as_in_a_render(pool):
    """Blocked by transparent sheets, and negative by a lamp."""
    clear = (Material("", Transparent()),)
    sheets = tuple(Instance(floor(1, (-1, 0, 0.1 * (k + 1))), materials=clear) for k in range(3))
    things = Instance(floor(9), materials=(WHITE,)), *sheets
    scene = Scene(camera_down(3, (24, 16)), things, (PointLight((1, 0, 1), (-1.0,) * 3),))
    settings = RenderSettings(samples=4, transparent_bounces=1)
    film, prepared = render(scene, settings), prepare(scene, settings)
    try:
        progressive = Progressive(prepared, scene.camera)
        while progressive.done < progressive.total:
            progressive.add_pass(pool, np.zeros(1, np.uint8))
        found, expected = ((of.blocked_samples, of.negative_pixels, of.dropped_samples) for of in (progressive, film))
        assert found == expected
        assert min(found[:2]) > 0
    finally:
        prepared.let_go()


def test_a_part_of_the_picture_is_cut_from_the_whole(pool):
    scene = still_life()
    prepared = prepare(scene, RenderSettings(samples=4))
    whole, part = passes(prepared, scene, pool, 2), passes(prepared, scene, pool, 2, bounds=(7, 3, 30, 21))
    assert (part == whole[3:21, 7:30]).all()
    prepared.let_go()


def test_a_pass_that_is_stopped_adds_nothing(pool):
    scene = still_life()
    prepared = prepare(scene, RenderSettings(samples=4))
    picture = Progressive(prepared, scene.camera)
    assert picture.add_pass(pool, NEVER)
    before = picture.pixels()
    assert not picture.add_pass(pool, np.ones(1, np.uint8))
    assert picture.done == 1
    assert (picture.pixels() == before).all()
    prepared.let_go()


@pytest.mark.parametrize("size", [1, 2, 4, 7])
def test_coarse_pixels_cover_what_the_fine_ones_see(size):
    camera = camera_forward(0.5, (45, 30))
    rough = coarser(camera, size)
    assert rough.resolution == (-(-45 // size), -(-30 // size))
    (left, right, bottom, top), (a, b, c, d) = camera.window, rough.window
    assert (a, c) == (left, bottom)
    assert (b - a) / rough.resolution[0] == pytest.approx(size * (right - left) / 45)
    assert (d - c) / rough.resolution[1] == pytest.approx(size * (top - bottom) / 30)


@given(st.integers(1, 5000))
def test_the_order_of_passes_takes_each_sample_once(count):
    assert sorted(golden_order(count)) == list(range(count))


@pytest.mark.parametrize("count", [16, 64, 100, 256])
def test_the_first_passes_lie_evenly(count):
    """Wherever one stops: no gap is much larger than it would have to be."""
    order = golden_order(count)
    for k in range(2, count):
        places = np.sort(order[:k])
        gaps = np.diff(np.append(places, places[0] + count))
        assert gaps.max() <= 2.5 * count / k


def test_few_passes_see_all_of_a_lamp(pool, monkeypatch):
    """The light's points run along a curve over the lamp: four in a row would come from one corner of it."""
    lamp = AreaLight((0, 0, 1), (3, 0, 0), (0, 3, 0), (30.0,) * 3)
    scene = Scene(camera_down(1, (32, 32), height=0.5), (Instance(floor(9), materials=(WHITE,)),), (lamp,))
    settings = RenderSettings(samples=16, sampler="multi_jittered")
    reference = render(scene, replace(settings, samples=1024)).passes["Combined"][..., 0]
    prepared = prepare(scene, settings)

    def error(pixels: np.ndarray) -> float:
        return float(np.std(pixels[..., 0] - reference))

    jumping = error(passes(prepared, scene, pool, 4))
    monkeypatch.setattr(progressive, "golden_order", np.arange)
    in_a_row = error(passes(prepared, scene, pool, 4))
    independent = error(render(scene, replace(settings, samples=4, sampler="random")).passes["Combined"])
    assert jumping < independent
    assert jumping < 0.9 * in_a_row
    prepared.let_go()


# What a preparation lends the next one


def boxes(at: float = 0.0, albedo: float = 0.5, lamp: float = 10.0) -> Scene:
    instances = (
        Instance(floor(9), materials=(WHITE,)),
        Instance(box(1.0), translation(at, 0, 1), (lambertian(albedo),)),
    )
    return Scene(camera_down(4, (24, 16), height=5), instances, (PointLight((2, 2, 3), (lamp,) * 3, 0.2),))


@pytest.mark.parametrize(
    ("changed", "keeps_structure"),
    [
        (boxes(), True),
        (boxes(albedo=0.9), True),
        (boxes(lamp=20.0), True),
        (boxes(at=1.0), False),
        (replace(boxes(), instances=boxes().instances[:1]), False),
        (replace(boxes(), instances=(*boxes().instances, Instance(sphere(0.3)))), False),
    ],
    ids=["nothing", "material", "lamp", "moved", "removed", "added"],
)
def test_a_scene_that_has_changed_renders_as_if_prepared_anew(changed, keeps_structure, pool):
    settings = RenderSettings(samples=4)
    before = prepare(boxes(), settings)
    after = prepare(changed, settings, before)
    assert (after.packed.structure is before.packed.structure) == keeps_structure
    assert all(after.tables[name] is before.tables[name] for name in ("pixel", "light"))
    before.let_go()
    seen = passes(after, changed, pool, settings.sample_count)
    np.testing.assert_allclose(seen, render(changed, settings).passes["Combined"], rtol=2e-6, atol=1e-7)
    after.let_go()


@pytest.mark.parametrize("change", [{"samples": 9}, {"seed": 1}, {"light_sampler": "random"}])
def test_tables_for_other_points_are_made_anew(change):
    before = prepare(boxes(), RenderSettings(samples=4))
    after = prepare(boxes(), RenderSettings(**{"samples": 4} | change), before)
    assert after.tables["light"] is not before.tables["light"]
    before.let_go()
    after.let_go()


def test_a_camera_with_a_lens_finds_points_that_the_scene_was_not_prepared_for(pool):
    settings, lens = RenderSettings(samples=4), {"lens_radius": 0.1, "focus_distance": 4.0}
    prepared = prepare(boxes(), settings)
    with_lens = replace(boxes(), camera=replace(boxes().camera, **lens))
    seen = passes(prepared, with_lens, pool, settings.sample_count)
    np.testing.assert_allclose(seen, render(with_lens, settings).passes["Combined"], rtol=2e-6, atol=1e-7)
    prepared.let_go()


def test_a_render_says_how_much_memory_it_takes():
    few, many = (render(boxes(), RenderSettings(samples=samples, threads=1)) for samples in (1, 1024))
    assert 1e5 < few.memory < many.memory < 1e9
