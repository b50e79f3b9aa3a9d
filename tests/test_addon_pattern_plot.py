"""The plot in the panel shows the sampler's points where they are, and the panel says what is true of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon import pattern_plot, ui  # noqa: E402
from addon.pattern_plot import GAP, INK, KEPT, MOST_POINTS, PAPER, SIDE, SQUARE, STRIP  # noqa: E402
from core.samplers import SAMPLERS  # noqa: E402
from tests.addon_helpers import empty_scene  # noqa: E402

BOTTOM = SIDE - SQUARE  # the square's lowest row


def parts(points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The ink, 0 to 1, of the square (bottom row first), of the strip of x and of the strip of y."""
    picture = (pattern_plot.raster(np.array(points, np.float32))[..., 0] - PAPER) / (INK - PAPER)
    return picture[BOTTOM:, :SQUARE], picture[:STRIP, :SQUARE], picture[BOTTOM:, SIDE - STRIP :]


def pixel(coordinate: float) -> int:
    return int(coordinate * SQUARE)


@pytest.mark.parametrize(
    "point", [(0.5, 0.5), (0.1, 0.8), (0.93, 0.06), (0.0, 0.0), (1 - 2**-24, 1 - 2**-24), (0, 0.99)]
)
def test_a_point_lights_its_pixel_and_its_place_in_both_strips(point):
    square, along_x, along_y = parts([point])
    x, y = map(pixel, point)
    assert square[y, x] > 0.9
    assert (along_x[:, x] > 0.9).all()
    assert (along_y[y] > 0.9).all()
    # Nothing further off than a disc, or a line, is large.
    rows, columns = np.nonzero(square > 0)
    assert np.hypot(rows - y, columns - x).max() < 8
    assert np.abs(np.nonzero(along_x.max(axis=0) > 0)[0] - x).max() < 4
    assert np.abs(np.nonzero(along_y.max(axis=1) > 0)[0] - y).max() < 4


def test_the_ink_of_a_disc_is_its_area_wherever_it_lies():
    rng = np.random.default_rng(5)
    areas = [parts([point])[0].sum() for point in rng.uniform(0.1, 0.9, (50, 2))]
    np.testing.assert_allclose(areas, np.pi * 5**2, rtol=0.02)


@pytest.mark.parametrize("name", SAMPLERS)
def test_every_point_of_a_set_is_in_the_plot(name):
    count = SAMPLERS[name].actual_count(MOST_POINTS)
    points = pattern_plot.pattern(name, count, 0)
    square, along_x, along_y = parts(points)
    x, y = (points * SQUARE).astype(int).T
    assert square[y, x].min() > 0.5
    assert along_x[0, x].min() > 0.3
    assert along_y[y, 0].min() > 0.3


def test_the_projections_of_a_grid_are_as_many_lines_as_it_has_columns():
    _square, along_x, along_y = parts(pattern_plot.pattern("regular", 20, 0))
    for strip, lines in ((along_x[0], 5), (along_y[:, 0], 4)):
        assert np.count_nonzero(np.diff((strip > 0.4).astype(int)) == 1) == lines


def test_between_the_parts_it_is_transparent():
    alpha = pattern_plot.raster(np.array([(0.5, 0.5)], np.float32))[..., 3]
    assert not alpha[STRIP : STRIP + GAP].any()
    assert not alpha[:, SQUARE : SQUARE + GAP].any()
    assert not alpha[:STRIP, SQUARE:].any()
    assert alpha.sum() == SQUARE**2 + 2 * SQUARE * STRIP


def test_the_points_are_a_set_of_the_sampler_and_follow_the_seed():
    points = pattern_plot.pattern("multi_jittered", 64, 7)
    assert points.shape == (64, 2)
    for axis in (0, 1):
        assert sorted((points[:, axis] * 64).astype(int)) == list(range(64))
    assert not np.array_equal(points, pattern_plot.pattern("multi_jittered", 64, 8))


def test_pictures_are_kept_and_not_too_many_of_them():
    pattern_plot.forget()
    plots = [pattern_plot.plot_of(*key) for key in [("jittered", 16, 0), ("jittered", 16, 0), ("jittered", 16, 1)]]
    assert plots[0] == plots[1]
    assert list(pattern_plot._previews) == ["jittered 16 0", "jittered 16 1"]
    for seed in range(2 * KEPT):
        pattern_plot.plot_of("random", 4, seed)
    assert len(pattern_plot._previews) == KEPT
    pattern_plot.forget()


def test_blender_has_the_picture_to_the_byte():
    pattern_plot.forget()
    pattern_plot.plot_of("jittered", 16, 3)
    (preview,) = pattern_plot._previews.values()
    assert tuple(preview.image_size) == (SIDE, SIDE)
    picture = pattern_plot.raster(pattern_plot.pattern("jittered", 16, 3))
    np.testing.assert_allclose(np.array(preview.image_pixels_float[:]), picture.reshape(-1), atol=1 / 255)
    pattern_plot.forget()


def test_of_large_sets_another_set_is_shown_and_its_size_said():
    plot = pattern_plot.plot_of("z_sobol", 4096, 0)
    assert plot.count == MOST_POINTS
    assert ui.point_text(4096, plot.count) == "4096 points; shown: a set of 256"
    assert ui.point_text(16, 16) == "16 points"
    assert ui.point_text(1, 1) == "1 point"
    pattern_plot.forget()


# The panel


class Layout:
    """Notes what a panel draws, in place of Blender's layout, which is there in a window only."""

    def __init__(self) -> None:
        self.texts: list[tuple[str, str]] = []
        self.drawn: list[str] = []

    def label(self, text: str = "", icon: str = "NONE", **_options) -> None:
        self.texts.append((text, icon))

    def __getattr__(self, name: str):
        def draw(*arguments, **_options):
            self.drawn.append(" ".join([name, *(text for text in arguments if isinstance(text, str))]))
            return self

        return draw


def drawn(panel: type) -> Layout:
    layout = Layout()
    panel.draw(SimpleNamespace(layout=layout, column=lambda: layout), bpy.context)
    return layout


def test_the_panel_shows_the_pattern_its_count_and_the_four_verdicts():
    rooks = empty_scene().rooks
    rooks.sampler, rooks.samples = "JITTERED", 17
    layout = drawn(ui.ROOKS_RENDER_PT_pattern)
    assert layout.drawn.count("template_icon") == 1
    assert layout.texts == [
        ("Jittered", "NONE"),
        ("20 points", "NONE"),
        ("Even in 2-D", "CHECKMARK"),
        ("Even in 1-D", "X"),
        ("Min Distance", "X"),
        ("Irregular", "CHECKMARK"),
    ]


def test_separate_samplers_are_shown_once_each_with_their_domains():
    rooks = empty_scene().rooks
    rooks.use_separate_samplers = True
    rooks.pixel_sampler = rooks.bsdf_sampler = "RANDOM"
    rooks.lens_sampler, rooks.light_sampler = "REGULAR", "HAMMERSLEY"
    layout = drawn(ui.ROOKS_RENDER_PT_pattern)
    assert layout.drawn.count("template_icon") == 3
    assert [text for text, _ in layout.texts if "(" in text] == [
        "Random (pixel, surface)",
        "Regular (lens)",
        "Hammersley (light)",
    ]


@pytest.mark.parametrize("name", SAMPLERS)
def test_the_panels_draw_with_every_sampler(name):
    rooks = empty_scene().rooks
    rooks.sampler = name.upper()
    assert drawn(ui.ROOKS_RENDER_PT_pattern).texts[0] == (SAMPLERS[name].label, "NONE")
    assert f"{SAMPLERS[name].actual_count(16)} samples per pixel" in drawn(ui.ROOKS_RENDER_PT_sampling).texts[0][0]


def test_the_panel_to_compare_shows_how_far_it_is(monkeypatch):
    empty_scene()
    assert "operator rooks.compare_samplers" in drawn(ui.ROOKS_RENDER_PT_compare).drawn
    worker = SimpleNamespace(share=0.25, doing="Random, 16 samples", is_cancelled=False)
    monkeypatch.setattr(ui.compare_operators, "running", lambda: worker)
    layout = drawn(ui.ROOKS_RENDER_PT_compare)
    assert {"progress", "operator rooks.cancel_comparison"} <= set(layout.drawn)
    assert "operator rooks.compare_samplers" not in layout.drawn


def test_the_samplers_to_compare_are_the_registry_and_bits():
    items = bpy.context.scene.rooks.comparison.bl_rna.properties["samplers"].enum_items_static
    assert {(item.identifier, item.value) for item in items} == {
        (name.upper(), 1 << sampler.number) for name, sampler in SAMPLERS.items()
    }
