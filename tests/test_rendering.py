"""Renders: the same to the bit however they are cut and spread, stopped and restarted safely, honest about bad input,
and unbiased with every sampler that leaves something to chance."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from core import (
    AreaLight,
    Camera,
    Instance,
    Material,
    Mesh,
    PointLight,
    RenderSettings,
    Scene,
    SceneError,
    SettingsError,
    SunLight,
    preparation,
    render,
    rendering,
)
from core.embree import EmbreeScene
from core.film import PASSES
from core.samplers import SAMPLERS
from core.scene import VISIBLE_TO_SHADOWS
from core.shaders import Diffuse, Emission
from core.shared_use import SharedUse
from core.values import OBJECT, Checker, ImageTexture
from tests.scenes import (
    WHITE,
    box,
    camera_down,
    emitter,
    floor,
    lambertian,
    picture,
    quad,
    rotation,
    scaling,
    sphere,
    translation,
)

CHANCE = [name for name in SAMPLERS if name not in ("regular", "hammersley")]


def still_life(resolution: tuple[int, int] = (45, 30), at=(0.0, 0.0, 0.0)) -> Scene:
    """A bit of everything: lens, instances, textures, four kinds of lamp, a world, glowing and smooth surfaces."""
    x, y, z = at
    aim = translation(*at) @ rotation(0, 1.0) @ translation(0, 0, 6)
    aspect = resolution[1] / resolution[0]
    camera = Camera(aim, resolution, (-0.4, 0.4, -0.4 * aspect, 0.4 * aspect), lens_radius=0.05, focus_distance=6)
    ball, cube = sphere(0.5, rings=12, smooth=True), box(0.6)
    checker = Material("checker", Diffuse(Checker((0.8,) * 3, (0.2, 0.3, 0.4), 2.0, OBJECT)))
    instances = (
        Instance(floor(8), translation(x, y, z - 0.5), (checker,)),
        Instance(ball, translation(x - 0.8, y, z), (lambertian(0.7),)),
        Instance(ball, translation(x + 0.9, y + 0.4, z + 0.2) @ scaling(0.6, 0.6, 1), (WHITE,)),
        Instance(cube, translation(x, y + 0.3, z - 0.1) @ rotation(2, 0.5), (emitter(0.5),)),
    )
    lights = (
        AreaLight((x, y, z + 3), (1.5, 0, 0), (0, 1, 0), (80.0, 70.0, 60.0)),
        AreaLight((x - 2, y - 1, z + 2), (0.5, 0, 0.5), (0, 0.5, 0), (30.0, 40.0, 50.0), "ellipse"),
        PointLight((x + 2, y - 2, z + 1), (20.0, 20.0, 20.0), 0.2),
        SunLight((1, -1, 2), (0.3, 0.3, 0.2), 0.05),
    )
    return Scene(camera, instances, lights, (0.05, 0.06, 0.1))


SETTINGS = RenderSettings(samples=5, sampler="multi_jittered", seed=3, max_bounces=1, threads=1)


def film_of(scene: Scene, settings: RenderSettings = SETTINGS, **changes):
    return render(scene, replace(settings, **changes))


def same(a, b) -> bool:
    return all(np.array_equal(a.passes[name], b.passes[name]) for name in PASSES)


@pytest.fixture(scope="module")
def reference():
    return film_of(still_life())


# Deterministic


@pytest.mark.parametrize(
    "changes",
    [
        {"threads": 2},
        {"threads": 0},
        {"tile_size": 4},
        {"tile_size": 13, "threads": 2},
        {"tile_size": 4096},
        {"batch_packets": 1},
        {"batch_packets": 3},
        {"batch_packets": 7, "tile_size": 16, "threads": 2},
        {"batch_packets": 4096},
    ],
    ids=str,
)
def test_the_picture_is_the_same_to_the_bit_however_it_is_cut(changes, reference):
    assert same(film_of(still_life(), **changes), reference)


@pytest.mark.parametrize("border", [(0, 0, 45, 30), (7, 3, 22, 30), (44, 29, 45, 30), (4, 8, 12, 16), (1, 2, 3, 4)])
@pytest.mark.parametrize("tile_size", [8, 64])
def test_a_border_is_that_part_of_the_full_picture(border, tile_size, reference):
    left, bottom, right, top = border
    part = film_of(still_life(), border=border, tile_size=tile_size)
    assert (part.x, part.y, part.width, part.height) == (left, bottom, right - left, top - bottom)
    for name in PASSES:
        assert np.array_equal(part.passes[name], reference.passes[name][bottom:top, left:right])


@pytest.mark.parametrize("border", [(5, 0, 5, 8), (0, 0, 46, 30), (-1, 0, 4, 4)])
def test_a_border_outside_of_the_picture_is_refused(border):
    with pytest.raises(SettingsError, match="border"):
        film_of(still_life(), border=border)


def test_the_seed_decides(reference):
    assert same(film_of(still_life()), reference)
    other = film_of(still_life(), seed=4)
    assert (other.passes["Combined"][..., :3] != reference.passes["Combined"][..., :3]).mean() > 0.5


def test_samplers_of_unused_domains_do_not_change_the_picture():
    pinhole = replace(still_life(), camera=replace(still_life().camera, lens_radius=0.0))
    expected = film_of(pinhole, samples=16)
    assert same(film_of(pinhole, samples=16, lens_sampler="random"), expected)
    assert not same(film_of(pinhole, samples=16, light_sampler="random"), expected)
    assert not same(film_of(pinhole, samples=16, bsdf_sampler="random"), expected)
    assert not same(film_of(pinhole, samples=16, pixel_sampler="random"), expected)


# Settings


@pytest.mark.parametrize(
    ("settings", "count"),
    [
        ({"samples": 20, "sampler": "jittered"}, 20),
        ({"samples": 7, "sampler": "jittered"}, 9),
        ({"samples": 7, "sampler": "random"}, 7),
        ({"samples": 7, "sampler": "random", "light_sampler": "regular"}, 9),
        ({"samples": 17, "sampler": "n_rooks", "lens_sampler": "jittered"}, 20),
        ({"samples": 1, "sampler": "regular"}, 1),
    ],
)
def test_the_count_is_the_smallest_that_all_samplers_make(settings, count):
    assert RenderSettings(**settings).sample_count == count
    assert film_of(Scene(camera_down(1, (4, 4))), RenderSettings(**settings)).samples == count


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sampler": "halton"}, "unknown sampler 'halton': choose one of regular, random"),
        ({"light_sampler": "Jittered"}, "unknown sampler 'Jittered'"),
        ({"samples": 0}, "samples must be between 1 and"),
        ({"samples": 10**9}, "samples must be between 1 and"),
        ({"seed": -1}, "seed"),
        ({"max_bounces": -1}, "bounces"),
        ({"threads": -1}, "threads"),
        ({"tile_size": 0}, "tile size"),
        ({"batch_packets": 0}, "batch"),
        ({"pixel_filter": "gauss"}, "unknown pixel filter 'gauss'"),
        ({"filter_width": 0.0}, "filter width"),
        ({"filter_width": math.nan}, "filter width"),
    ],
)
def test_settings_out_of_range_are_refused_when_made(changes, message):
    with pytest.raises(SettingsError, match=message):
        RenderSettings(**changes)


# Tiles


@pytest.mark.parametrize(("border", "tile_size"), [(None, 16), ((5, 6, 43, 29), 8), ((5, 6, 43, 29), 10)])
def test_tiles_cover_the_film_once_and_carry_its_pixels(border, tile_size):
    tiles = []
    settings = replace(SETTINGS, border=border, tile_size=tile_size, threads=2)
    caller = threading.get_ident()

    def on_tile(tile):
        assert threading.get_ident() == caller
        tiles.append(tile)

    film = render(still_life(), settings, on_tile)
    times = np.zeros((film.height, film.width), int)
    for tile in tiles:
        place = np.s_[tile.y - film.y : tile.y - film.y + tile.height, tile.x - film.x : tile.x - film.x + tile.width]
        times[place] += 1
        for name, channels in PASSES.items():
            assert tile.passes[name].shape == (tile.height, tile.width, len(channels))
            assert tile.passes[name].flags.c_contiguous
            assert np.array_equal(tile.passes[name], film.passes[name][place])
    assert (times == 1).all()
    assert [tile.done for tile in tiles] == list(range(1, len(tiles) + 1))
    assert {tile.total for tile in tiles} == {len(tiles)}


def rooks_threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith("rooks")]


@pytest.mark.parametrize("threads", [1, 2])
def test_cancelling_keeps_finished_tiles_and_harms_no_later_render(threads, reference):
    tiles = []
    settings = replace(SETTINGS, samples=2000, tile_size=8, threads=threads)
    start = time.perf_counter()
    film = render(still_life(), settings, tiles.append, lambda: len(tiles) > 0)
    assert time.perf_counter() - start < 10
    assert film.cancelled
    assert 0 < len(tiles) < tiles[0].total
    done = np.zeros((film.height, film.width), bool)
    for tile in tiles:
        done[tile.y : tile.y + tile.height, tile.x : tile.x + tile.width] = True
    assert (film.passes["Combined"][..., 3] == done).all()
    assert not rooks_threads()
    again = film_of(still_life())
    assert not again.cancelled
    assert same(again, reference)


def test_cancelled_before_it_began():
    film = render(still_life(), replace(SETTINGS, samples=500, tile_size=64), None, lambda: True)
    assert film.cancelled
    assert not rooks_threads()


@pytest.mark.parametrize("where", ["on_tile", "should_cancel"])
def test_an_exception_of_the_callers_own_comes_back_and_the_threads_end(where, reference):
    def fail(*_):
        raise KeyError("the caller's own")

    calls = {"on_tile": None, "should_cancel": None, where: fail}
    with pytest.raises(KeyError, match="the caller's own"):
        render(still_life(), replace(SETTINGS, samples=500, tile_size=8, threads=2), **calls)
    assert not rooks_threads()
    assert same(film_of(still_life()), reference)


def test_two_renders_at_once_do_not_disturb_each_other(reference):
    films = [None, None]

    def work(k: int):
        films[k] = film_of(still_life(), threads=2, tile_size=8)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(same(film, reference) for film in films)


# Alpha and empty scenes


def test_alpha_is_coverage_where_the_film_is_transparent():
    half = Instance(quad((1, 0, 0), (2, 0, 0), (0, 4, 0)), materials=(emitter(0.25),))
    scene = Scene(camera_down(1.0, (8, 8)), (half,), world=(3.0, 3.0, 3.0))
    clear = picture(scene, channel=None, film_transparent=True)
    assert np.allclose(clear[:, :4], 0)
    assert (clear[:, 4:, 3] == 1).all()
    assert np.allclose(clear[:, 4:, :3], 0.25)  # black but for what it emits; the world still lights what reflects
    opaque = picture(scene, channel=None)
    assert (opaque[..., 3] == 1).all()
    assert np.allclose(opaque[:, :4, :3], 3)


def test_edges_have_premultiplied_color_and_the_world_lights_through_a_transparent_film():
    half = Instance(quad((1 + 1 / 16, 0, 0), (2, 0, 0), (0, 4, 0)), materials=(WHITE,))
    scene = Scene(camera_down(1.0, (8, 8)), (half,), world=(3.0, 3.0, 3.0))
    edge = picture(scene, channel=None, film_transparent=True, sampler="regular", samples=16)[:, 4]
    assert np.allclose(edge[:, 3], 0.5)
    assert np.allclose(edge[:, :3], 1.5, rtol=1e-5)


@pytest.mark.parametrize("transparent", [False, True])
def test_an_empty_scene_shows_the_world(transparent):
    scene = Scene(camera_down(1.0, (9, 5)), (), (PointLight((0, 0, 1), (1.0,) * 3),), (0.1, 0.2, 0.3))
    film = film_of(scene, film_transparent=transparent)
    expected = (0, 0, 0, 0) if transparent else (0.1, 0.2, 0.3, 1)
    assert np.allclose(film.passes["Combined"], expected)
    assert (film.passes["Depth"] == 1e10).all()
    assert (film.passes["Normal"] == 0).all()
    assert np.allclose(film.passes["Sampling Error"], 0, atol=1e-7)


def test_a_mesh_without_triangles_is_ignored():
    scene = still_life()
    empty = Mesh("empty", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    points = Mesh("points", np.full((3, 3), 1e6, np.float32), np.zeros((0, 3), np.int32))
    more = replace(scene, instances=(Instance(empty), *scene.instances, Instance(points), Instance(points)))
    assert same(film_of(more), film_of(scene))
    assert film_of(Scene(scene.camera, (Instance(empty),))).passes["Combined"][..., 3].all()


def bad_mesh(**changes) -> Mesh:
    good = floor()
    return Mesh(**({"name": "Plane.001", "vertices": good.vertices, "triangles": good.triangles} | changes))


NAN_VERTICES = np.array([(0, 0, 0), (1, 0, math.nan), (0, 1, 0), (0, math.inf, 0)], np.float32)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vertices": NAN_VERTICES}, "2 of its vertices are not finite"),
        ({"vertices": np.zeros((4, 2), np.float32)}, r"vertices have the shape \(4, 2\)"),
        ({"vertices": np.zeros(12, np.float32)}, "vertices have the shape"),
        ({"triangles": np.zeros((2, 4), np.int32)}, "triangles have the shape"),
        ({"triangles": np.array([(0, 1, 4)], np.int32)}, "vertex that is not there"),
        ({"triangles": np.array([(0, -1, 2)], np.int32)}, "vertex that is not there"),
        ({"uvs": np.zeros((4, 2), np.float32)}, "UVs have the shape"),
        ({"corner_normals": np.zeros((4, 3), np.float32)}, "corner normals have the shape"),
        ({"material_slots": np.zeros(5, np.int16)}, "material slots have the shape"),
    ],
)
def test_a_broken_mesh_is_named_and_the_next_render_is_right(changes, message, reference):
    scene = still_life()
    with pytest.raises(SceneError, match=f"mesh 'Plane.001'.*{message}"):
        film_of(replace(scene, instances=(*scene.instances, Instance(bad_mesh(**changes)))))
    assert same(film_of(scene), reference)


def test_a_matrix_that_is_not_finite_is_named():
    with pytest.raises(SceneError, match=r"object 'Cube'.*matrix"):
        film_of(Scene(camera_down(1), (Instance(box(), np.full((4, 4), math.nan), name="Cube"),)))


def test_far_from_the_origin_the_picture_is_the_same():
    """At 10⁵ m float32 has steps of 8 mm; the pictures differ by the noise of rounded positions at most."""
    here = film_of(still_life(), samples=64).passes
    there = film_of(still_life(at=(1e5, -1e5, 1e5)), samples=64).passes
    difference = np.abs(there["Combined"][..., :3] - here["Combined"][..., :3])
    assert difference.mean() < 1e-3 * here["Combined"][..., :3].mean()
    assert abs(there["Combined"].mean() / here["Combined"].mean() - 1) < 1e-4


# The error that a render claims, and its means


def penumbra(sampler: str, seed: int, samples: int = 16):
    """A ball's soft shadow under a square lamp: the noisiest that direct light gets."""
    ball = Instance(sphere(0.3, (0, 0, 0.5), rings=12), visibility=VISIBLE_TO_SHADOWS)
    lamp = AreaLight((0, 0, 2), (1, 0, 0), (0, 1, 0), (50.0, 50.0, 50.0))
    scene = Scene(camera_down(1.2, (16, 16), height=0.9), (ball, Instance(floor(), materials=(WHITE,))), (lamp,))
    film = render(scene, RenderSettings(samples=samples, sampler=sampler, seed=seed, threads=1))
    return film.passes["Combined"][..., 0].astype(np.float64), film.passes["Sampling Error"][..., 0].astype(np.float64)


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    """The penumbra at 32,768 samples, by a sampler and seeds of its own: its error is a tenth of the tests'."""
    return np.mean([penumbra("multi_jittered", 100_000 + seed, 2048)[0] for seed in range(16)], axis=0)


SEEDS = 100


@pytest.fixture(scope="module", params=CHANCE)
def renders(request):
    pairs = [penumbra(request.param, seed) for seed in range(SEEDS)]
    return request.param, np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def test_no_pixel_is_biased_with_any_sampler(renders, truth):
    """z of each pixel's mean over 100 seeds: all together by χ² (p > 1e-3), each below 4.5."""
    _, pictures, _ = renders
    error = pictures.std(axis=0, ddof=1) / math.sqrt(SEEDS)
    noisy = error > 1e-3 * pictures.mean()
    assert noisy.mean() > 0.3
    t = (pictures.mean(axis=0) - truth)[noisy] / error[noisy]
    # A t of 99 degrees has the variance 99/97; the truth's own error adds a hundredth.
    z = t / math.sqrt(99 / 97 * 1.01)
    assert np.abs(z).max() < 4.5
    assert stats.chi2.sf((z**2).sum(), len(z)) > 1e-3
    assert abs(z.mean()) < 4 / math.sqrt(len(z)) * 2  # pixels that share a set are not independent


def test_the_sampling_error_pass_is_the_means_standard_deviation(renders):
    """Over seeds: exact for random samples, and for stratified ones not below it on average."""
    name, pictures, claimed = renders
    empirical = pictures.var(axis=0, ddof=1).mean()
    ratio = (claimed**2).mean() / empirical
    if name == "random":
        assert ratio == pytest.approx(1, abs=0.1)
    else:
        assert ratio > 1.2


def test_one_sample_claims_no_error():
    assert (penumbra("random", 1, samples=1)[1] == 0).all()


def test_a_render_can_be_cancelled_while_its_kernels_load(monkeypatch):
    """Compiling takes seconds: asked to stop meanwhile, a first render comes back, and the next one is right."""
    compiled = preparation.render_blocks
    monkeypatch.setattr(preparation, "render_blocks", lambda *arguments: time.sleep(4))
    start = time.perf_counter()
    film = render(still_life(), RenderSettings(samples=1), should_cancel=lambda: True)
    assert time.perf_counter() - start < 3
    assert film.cancelled
    assert film.finished_pixels == 0
    monkeypatch.setattr(preparation, "render_blocks", compiled)
    assert not render(still_life(), RenderSettings(samples=1)).cancelled


def test_ctrl_c_while_a_thread_starts_does_not_take_the_scene_from_under_it(monkeypatch):
    """The pool does not know of a thread whose start was interrupted, and does not wait for it."""
    done, began, start, tile = [], threading.Event(), threading.Thread.start, rendering._render_tile

    def interrupted_start(thread):
        start(thread)
        if thread.name.startswith("rooks_"):
            assert began.wait(10)
            raise KeyboardInterrupt

    def slow_tile(*arguments):
        began.set()
        time.sleep(0.3)
        result = tile(*arguments)
        done.append("traced")
        return result

    monkeypatch.setattr(threading.Thread, "start", interrupted_start)
    monkeypatch.setattr(rendering, "_render_tile", slow_tile)
    monkeypatch.setattr(EmbreeScene, "close", lambda scene: done.append("closed"))
    with pytest.raises(KeyboardInterrupt):
        render(Scene(camera_down(4, (8, 8)), (Instance(floor()),)), RenderSettings(samples=1, threads=1))
    deadline = time.monotonic() + 10
    while len(done) < 2 and time.monotonic() < deadline:
        time.sleep(0.01)
    assert done == ["traced", "closed"]


def test_a_pixel_below_black_is_written_as_black_and_counted():
    """A lamp of negative power takes light away: half of the floor has some to give."""
    lights = (
        AreaLight((0, 0, 1), (1, 0, 0), (0, 1, 0), (-50.0, -50.0, 5.0)),
        SunLight((0, 0, 1), (1.0, 1.0, 1.0)),
    )
    film = render(Scene(camera_down(8, (16, 16)), (Instance(floor(20)),), lights), RenderSettings(samples=16))
    combined = film.passes["Combined"]
    assert combined.min() == 0
    assert 0 < film.negative_pixels == (combined[..., 0] == 0).sum() < 256
    assert film.dropped_samples == 0


def test_what_is_shared_is_closed_once_by_the_last_who_uses_it():
    closed = []
    shared = SharedUse(lambda: closed.append(True))
    with shared.user() as first:
        shared.let_go()
        with shared.user() as second:
            assert first
            assert second
        assert not closed
    assert closed == [True]
    with shared.user() as late:
        assert not late
    assert closed == [True]


def test_a_pixel_without_a_sample_that_is_a_number_is_black_and_no_hole():
    walls = Material("walls", Emission(ImageTexture(np.full((1, 1, 3), np.nan, np.float32))))
    film = render(Scene(camera_down(4, (8, 8)), (Instance(floor(), materials=(walls,)),)), RenderSettings(samples=4))
    assert film.dropped_samples == 8 * 8 * 4
    assert (film.passes["Combined"] == (0, 0, 0, 1)).all()


INTERRUPTED = """
import signal, threading
from dataclasses import replace
from core import RenderSettings, render
from core.compiling import smallest_scene

def interrupt(*_):
    raise KeyboardInterrupt

scene = smallest_scene()
render(scene, RenderSettings(samples=1))
scene = replace(scene, camera=replace(scene.camera, resolution=(400, 400)))
signal.signal(signal.SIGALRM, interrupt)
for number in range(20):
    signal.setitimer(signal.ITIMER_REAL, 0.2 + 0.013 * number)
    try:
        render(scene, RenderSettings(samples=4096, tile_size=4, threads=2))
    except KeyboardInterrupt:
        assert not [thread.name for thread in threading.enumerate() if thread.name.startswith("rooks_")]
    else:
        raise SystemExit("not interrupted")
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="Windows has no such timer")
def test_an_interrupt_at_any_moment_ends_all_threads():
    """Futures that the signal left locked made a worker, and the render, wait for ever: at every tenth or so."""
    result = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], cwd=Path(__file__).parents[1], capture_output=True, text=True, timeout=600
    )
    assert (result.returncode, result.stderr) == (0, "")


def test_an_interrupt_while_threads_start_waits_for_them(monkeypatch):
    """On a busy machine a thread begins to run after the signal has ended the wait for that."""
    made = []

    class Late(threading.Thread):
        def __init__(self, **options) -> None:
            super().__init__(**options)
            made.append(self)

        def start(self) -> None:
            threading.Timer(0.05, super().start).start()
            raise KeyboardInterrupt

    scene = still_life((32, 24))
    monkeypatch.setattr(rendering, "threading", SimpleNamespace(Thread=Late))
    with pytest.raises(KeyboardInterrupt):
        render(scene, RenderSettings(samples=1, threads=2, tile_size=16))
    assert [thread.ident is not None and not thread.is_alive() for thread in made] == [True, False]
