"""The lab's scenes: closed forms of what they show, and how much of their variance is the domain that they isolate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from core import RenderSettings, render
from core.lab import scenes
from core.lab.scenes import DARK, LIGHT
from core.lab.tone import display
from tests.scenes import estimate, picture

SIGNIFICANCE = 1e-3
SEEDS = 24
DOMAINS = ("pixel", "lens", "light", "bsdf")
ONLY_THE_PIXEL = (scenes.checkerboard, scenes.sharp_edge)


def agrees(values: np.ndarray, expected: np.ndarray, rounding: float = 2e-6) -> bool:
    """Whether the means of `values` (seeds, places) are `expected` by Student's test, Šidák-corrected."""
    assert expected.size > 30
    each = 1 - (1 - SIGNIFICANCE) ** (1 / expected.size)
    margin = stats.t.isf(each / 2, len(values) - 1) * values.std(axis=0, ddof=1) / math.sqrt(len(values))
    return bool(np.all(np.abs(values.mean(axis=0) - expected) <= margin + rounding))


def not_rare(share: np.ndarray) -> np.ndarray:
    """Where a share is not so near to 0 or 1 that few samples tell: their spread is not that of Student's test."""
    return ~(((share > 0) & (share < 0.02)) | ((share > 0.98) & (share < 1)))


def pictures(scene, samples: int) -> np.ndarray:
    return np.array([picture(scene, samples=samples, seed=seed) for seed in range(SEEDS)])


def places_in_pixels(scene, points: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x (n, 1, w), y (n, h, 1) in the camera's window and weights (n,): a Gauss-Legendre rule over every pixel."""
    left, right, bottom, top = scene.camera.window
    width, height = scene.camera.resolution
    nodes, weights = np.polynomial.legendre.leggauss(points)
    u, v = (grid.ravel()[:, None, None] for grid in np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2))
    x = left + (np.arange(width)[None, None, :] + u) * (right - left) / width
    y = bottom + (np.arange(height)[None, :, None] + v) * (top - bottom) / height
    return x, y, np.outer(weights, weights).ravel() / 4


def to_the_dark_side(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The signed distance from the line through the origin that leans over to the right by EDGE_ANGLE."""
    return x * math.cos(scenes.EDGE_ANGLE) - y * math.sin(scenes.EDGE_ANGLE)


# Isolation


def share_of_variance(scene, domain: str) -> float:
    """The share of the variance of one random sample per pixel that `domain` alone has (Sobol 1993).

    Two pictures of which each pixel has the domain's point in common and others of its own: their covariance is the
    variance of the mean over the other domains. The other sampler makes one random point too, out of other numbers.
    """
    others = {f"{name}_sampler": "multi_jittered" for name in DOMAINS if name != domain}

    def take(seed: int, **samplers) -> np.ndarray:
        settings = RenderSettings(samples=1, sampler="random", seed=seed, threads=1, **samplers)
        return render(scene, settings).passes["Combined"][..., :3].astype(np.float64)

    first = np.array([take(seed) for seed in range(SEEDS)])
    second = np.array([take(seed, **others) for seed in range(SEEDS)])
    covariance = np.sum((first - first.mean(axis=0)) * (second - second.mean(axis=0)), axis=0) / (SEEDS - 1)
    return covariance.mean() / ((first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)) / 2).mean()


@pytest.mark.parametrize("scene", ONLY_THE_PIXEL, ids=lambda make: make.__name__)
def test_nothing_but_the_pixel_varies(scene):
    others = {f"{name}_sampler": "random" for name in DOMAINS if name != "pixel"}
    a = picture(scene((48, 48)), channel=None, sampler="hammersley", seed=1)
    b = picture(scene((48, 48)), channel=None, sampler="hammersley", seed=2, **others)
    assert np.array_equal(a, b)
    assert share_of_variance(scene((48, 48)), "pixel") == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(
    ("scene", "domain"),
    [(scenes.defocus, "lens"), (scenes.penumbra, "light"), (scenes.hemisphere, "bsdf"), (scenes.lobe, "bsdf")],
)
def test_one_domain_has_nearly_all_of_the_variance(scene, domain):
    assert share_of_variance(scene((64, 64)), domain) >= 0.95
    pixel = share_of_variance(scene((64, 64)), "pixel")
    assert pixel < 0.02, "the pixel's own share is none; that of independent pictures scatters by 1/√(24 · 64)"


def test_everything_leaves_no_domain_out_and_none_alone():
    shares = {domain: share_of_variance(scenes.everything((96, 64)), domain) for domain in DOMAINS}
    assert all(0.01 < share < 0.5 for share in shares.values()), shares
    assert sum(shares.values()) < 1


# Closed forms


def test_the_checkerboard_fades_to_the_mean_of_its_colours_at_the_horizon():
    resolution = (64, 64)
    scene = scenes.checkerboard(resolution)
    row = math.floor(scenes.horizon(resolution)) - 1
    mean = estimate(lambda seed: picture(scene, samples=64, seed=seed)[row].mean(), SEEDS)
    # At this distance, from 90 m on, the checks at both ends of the row weigh a thousandth of it.
    assert mean.agrees((DARK + LIGHT) / 2, rounding=1e-3)


def test_above_the_horizon_is_sky_and_below_it_are_checks():
    for resolution in ((64, 64), (96, 40), (33, 77)):
        seen = picture(scenes.checkerboard(resolution), channel=None, samples=1, sampler="regular")[..., :3]
        is_sky = np.all(np.isclose(seen, scenes.SKY, atol=1e-6), axis=2)
        row = math.floor(scenes.horizon(resolution))
        assert is_sky[row + 1 :].all()
        assert not is_sky[:row].any()
        checks = seen[:row]
        assert np.all(np.isclose(checks, DARK, atol=1e-6) | np.isclose(checks, LIGHT, atol=1e-6))


def area(polygon: list[tuple[float, float]]) -> float:
    x, y = np.array(polygon).T if polygon else np.zeros((2, 1))
    return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2


def clip(polygon: list[tuple[float, ...]], inside) -> list[tuple[float, ...]]:
    """The part of a convex polygon where the linear function `inside` is positive (Sutherland and Hodgman 1974)."""
    kept = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        f, g = inside(a), inside(b)
        if f > 0:
            kept.append(a)
        if (f > 0) != (g > 0):
            kept.append(tuple(np.add(a, np.subtract(b, a) * (f / (f - g)))))
    return kept


@pytest.mark.parametrize("resolution", [(7, 5), (5, 7), (16, 16), (1, 1), (64, 3)])
def test_the_edge_covers_as_much_of_a_pixel_as_clipping_it_says(resolution):
    width, height = resolution
    expected = np.empty((height, width))
    for j in range(height):
        for i in range(width):
            x, y = i - width / 2, j - height / 2
            square = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
            expected[j, i] = area(clip(square, lambda point: to_the_dark_side(*point)))
    np.testing.assert_allclose(scenes.edge_coverage(resolution), expected, atol=1e-12)


def test_coverage_is_exactly_none_or_all_where_the_edge_does_not_pass():
    covered = scenes.edge_coverage((7, 5))
    assert np.sum((covered > 0) & (covered < 1)) == 7
    assert covered.min() == 0
    assert covered.max() == 1


def test_the_sharp_edge_renders_to_its_coverage():
    scene, covered = scenes.sharp_edge((14, 10)), scenes.edge_coverage((14, 10))
    judged = not_rare(covered)
    expected = LIGHT + (DARK - LIGHT) * covered
    assert agrees(pictures(scene, samples=64)[:, judged], expected[judged])


def test_the_edge_out_of_focus_has_the_profile_of_a_disk_cut_off():
    scene = scenes.defocus((12, 8))
    x, y, weights = places_in_pixels(scene)
    t = np.clip(-to_the_dark_side(x, y) * 2 / scenes.DEFOCUS_RADIUS, -1, 1)
    light = np.tensordot(weights, 0.5 + (np.arcsin(t) + t * np.sqrt(1 - t**2)) / np.pi, axes=1)
    judged = not_rare(light)
    assert agrees(pictures(scene, samples=64)[:, judged], (DARK + (LIGHT - DARK) * light)[judged])


def irradiance(x: float, y: float, blocked: bool) -> float:
    """On the floor of `penumbra`: Lambert's formula (1760) for the light, or the part that the blocker leaves of it."""
    half, height = scenes.LIGHT_SIDE / 2, scenes.LIGHT_HEIGHT
    square = [(-half, -half), (half, -half), (half, half), (-half, half)]
    share = scenes.BLOCKER_HEIGHT / height

    def is_free(point) -> float:
        return -to_the_dark_side(x + (point[0] - x) * share, y + (point[1] - y) * share)

    seen = clip(square, is_free) if blocked else square
    if len(seen) < 3:
        return 0.0
    towards = np.array([(px - x, py - y, height) for px, py in seen])
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    following = np.roll(towards, -1, axis=0)
    normals = np.cross(towards, following)
    angles = np.arctan2(np.linalg.norm(normals, axis=1), np.sum(towards * following, axis=1))
    return scenes.LIGHT_RADIANCE / 2 * np.sum(angles * normals[:, 2] / np.linalg.norm(normals, axis=1))


def test_the_penumbra_is_lamberts_formula_for_what_the_blocker_leaves():
    scene = scenes.penumbra((10, 8))
    x, y, weights = places_in_pixels(scene)
    x, y = np.broadcast_arrays(x, y)
    expected, whole = (np.tensordot(weights, np.vectorize(irradiance)(x, y, is_on), axes=1) for is_on in (True, False))
    share = np.round(expected / whole, 12)
    assert share.min() < 0.05
    assert share.max() > 0.95
    judged = not_rare(share)
    assert agrees(pictures(scene, samples=64)[:, judged], expected[judged] / np.pi)


def test_a_light_found_by_chance_casts_the_same_shadow():
    """The matt floor under the panel is that under the light, whose pictures have a closed form."""
    found, sampled = (pictures(make((8, 6)), samples=256) for make in (scenes.hemisphere, scenes.penumbra))
    judged = not_rare(sampled.mean(axis=0) / sampled.mean(axis=0).max())
    assert agrees(found[:, judged] - sampled[:, judged], np.zeros(judged.sum()))


def test_every_scene_fills_any_picture_with_finite_numbers():
    makers = (
        *(scenes.checkerboard, scenes.sharp_edge, scenes.defocus, scenes.penumbra),
        *(scenes.hemisphere, scenes.lobe, scenes.box, scenes.everything),
    )
    for scene in makers:
        for resolution in ((4, 4), (31, 8), (8, 31)):
            film = render(scene(resolution), RenderSettings(samples=4, threads=1))
            assert film.dropped_samples == 0
            assert (film.width, film.height) == resolution
            assert np.isfinite(film.passes["Combined"]).all()


# What a screen shows


def test_display_is_srgb_clipped_with_the_top_row_first():
    linear = np.array([[0.0, 0.0031308, 0.18], [0.5, 1.0, 7.0], [-1.0, np.nan, np.inf]])
    shown = display(np.repeat(linear[:, :, None], 3, axis=2))
    assert shown.dtype == np.uint8
    assert shown.shape == (3, 3, 3)
    assert shown[..., 0].tolist() == [[0, 0, 255], [188, 255, 255], [0, 10, 118]]
