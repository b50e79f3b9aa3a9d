"""The lab's style and its drawings of patterns: what is drawn is what the samplers make."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from itertools import combinations
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex, to_rgb
from PIL import Image

from core.errors import OutputError
from core.lab import pattern_drawing, patterns, spectrum, style
from core.lab.cli import main
from core.lab.point_sets import independent_sets
from core.samplers import SAMPLERS

every_sampler = pytest.mark.parametrize("name", SAMPLERS)


# The style

#: What an eye without one kind of cone makes of linear RGB (Machado, Oliveira and Fernandes 2009, severity 1).
EYES = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
XYZ_OF_RGB = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]]
)


def linear(color: str) -> np.ndarray:
    rgb = np.array(to_rgb(color))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIELAB, D65, of linear sRGB."""
    ratio = XYZ_OF_RGB @ rgb.clip(0, 1) / XYZ_OF_RGB.sum(axis=1)
    x, y, z = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def least_distance(colors: list[str], eye: str) -> float:
    seen = [lab(np.array(EYES[eye]) @ linear(color)) for color in colors]
    return min(np.linalg.norm(a - b) for a, b in combinations(seen, 2))


@pytest.mark.parametrize("eye", EYES)
def test_colors_can_be_told_apart(eye):
    assert least_distance(list(style.COLORS), eye) > 16.9
    assert least_distance(list(style.COLORS[:6]), eye) > 27


def test_the_distance_test_can_fail():
    """Red and green of equal lightness, which those who lack a kind of cone confuse."""
    assert least_distance(["#D1605E", "#699E4B"], "normal") > 60
    assert least_distance(["#D1605E", "#699E4B"], "deuteranopia") < 16


def test_colors_stand_out_from_white_paper():
    luminance = [XYZ_OF_RGB[1] @ linear(color) for color in style.COLORS]
    assert min(1.05 / (y + 0.05) for y in luminance) > 2.2


def test_no_two_samplers_share_a_color_or_a_marker():
    assert len({style.color(name) for name in SAMPLERS}) == len(SAMPLERS)
    assert len({style.marker(name) for name in SAMPLERS}) == len(SAMPLERS)


def test_drawing_leaves_matplotlibs_settings_as_they_were():
    before = dict(matplotlib.rcParams)
    with style.drawing():
        assert matplotlib.rcParams["font.size"] == style.RC["font.size"]
        style.figure(4, 3).subplots()
    assert dict(matplotlib.rcParams) == before


def test_a_figure_is_saved_as_png_and_svg_and_always_the_same(tmp_path):
    def draw(name: str) -> bytes:
        with style.drawing():
            figure = style.figure(8, 5)
            figure.subplots().plot([0, 1], label="a")
            paths = style.save(figure, tmp_path / name)
        assert [path.name for path in paths] == [f"{name}.png", f"{name}.svg"]
        return paths[0].read_bytes()

    assert draw("one") == draw("two.5")
    width, height = Image.open(tmp_path / "one.png").size
    assert (width, height) == (int(8 / 2.54 * 200), int(5 / 2.54 * 200))
    assert ElementTree.parse(tmp_path / "one.svg").getroot().tag.endswith("svg")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.png", "one.svg", "two.5.png", "two.5.svg"]


def test_a_figure_for_a_folder_that_is_not_there_is_an_error_for_the_user(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        style.save(style.figure(4, 3), tmp_path / "no" / "figure")


# What is drawn


def drawn_points(axes) -> np.ndarray:
    (points,) = [c for c in axes.collections if isinstance(c, PathCollection)]
    return np.asarray(points.get_offsets())


def ticks(axes) -> np.ndarray:
    (lines,) = axes.collections
    return np.array(lines.get_segments())


@every_sampler
def test_the_points_of_the_first_set_are_drawn_with_their_projections(name):
    sampler = SAMPLERS[name]
    count = sampler.actual_count(20)
    square, below, beside, periodogram, _ = pattern_drawing.pattern(sampler, count, seed=3).axes
    sets = independent_sets(sampler, count, pattern_drawing.SETS, seed=3)
    np.testing.assert_allclose(drawn_points(square), sets[0])
    assert {to_hex(c, keep_alpha=False).upper() for c in square.collections[-1].get_facecolor()} == {style.color(name)}
    assert np.array_equal(ticks(below)[:, 0, 0].astype(np.float32), sets[0, :, 0])
    assert np.array_equal(ticks(beside)[:, 0, 1].astype(np.float32), sets[0, :, 1])
    assert (ticks(below)[..., 1] == [0, 1]).all()
    assert (ticks(beside)[..., 0] == [0, 1]).all()
    highest = spectrum.reach(count)
    power = spectrum.periodograms(sets, highest).mean(axis=0)
    (image,) = periodogram.images
    np.testing.assert_allclose(image.get_array(), power, atol=1e-8)
    assert tuple(image.get_extent()) == (-highest - 0.5, highest + 0.5, -highest - 0.5, highest + 0.5)


def grids(axes) -> list[tuple[int, int]]:
    """(rows, columns) of each grid behind the points."""
    found = []
    for collection in axes.collections:
        if isinstance(collection, LineCollection):
            segments = np.array(collection.get_segments())
            upright = segments[:, 0, 0] == segments[:, 1, 0]
            found.append(((~upright).sum() + 1, upright.sum() + 1))
    return found


@every_sampler
@pytest.mark.parametrize("asked", [4, 12, 16, 64])
def test_each_cell_of_a_grid_that_is_drawn_holds_one_point(name, asked):
    sampler = SAMPLERS[name]
    count = sampler.actual_count(asked)
    square = pattern_drawing.pattern(sampler, count, seed=4).axes[0]
    x, y = drawn_points(square).T
    for rows, columns in grids(square):
        row, column = np.floor(y * rows).astype(int), np.floor(x * columns).astype(int)
        if rows * columns == count:
            assert len(set(zip(row, column, strict=True))) == count
        else:
            assert rows == columns == count
            assert sorted(row) == sorted(column) == list(range(count))


def test_the_techniques_that_have_a_grid_show_it():
    shown = {name: grids(pattern_drawing.pattern(SAMPLERS[name], 16, seed=1).axes[0]) for name in SAMPLERS}
    assert shown["regular"] == shown["jittered"] == [(4, 4)]
    assert shown["n_rooks"] == [(16, 16)]
    assert shown["multi_jittered"] == shown["correlated_multi_jittered"] == [(16, 16), (4, 4)]
    assert shown["random"] == shown["hammersley"] == shown["fibonacci"] == []


def test_squares_are_square():
    figure = pattern_drawing.pattern(SAMPLERS["random"], 16, seed=1)
    for axes in (figure.axes[0], figure.axes[3]):
        box = axes.get_window_extent()
        assert box.width == pytest.approx(box.height)


@pytest.mark.parametrize("count", [1, 2, 16, 256])
def test_nothing_is_cut_off_at_the_figures_edge(count):
    figure = pattern_drawing.pattern(SAMPLERS["correlated_multi_jittered"], count, seed=1)
    with style.drawing():
        tight = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert tight.x0 > 0
    assert tight.y0 > 0
    assert tight.x1 < width
    assert tight.y1 < height


# The textbook's figures


def test_the_initial_arrangement_of_multi_jittered_points_steps_through_the_fine_grid():
    shuffled = independent_sets(SAMPLERS["multi_jittered"], 16, 1, seed=1)[0]
    initial = patterns.canonical(shuffled)
    for axis in (0, 1):
        assert np.array_equal(np.sort(initial[:, axis]), np.sort(shuffled[:, axis]))
    cells = {tuple(cell) for cell in np.floor(initial * 16).astype(int)}
    assert cells == {(4 * i + j, 4 * j + i) for i in range(4) for j in range(4)}


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("regular", [16, 256]),
        ("random", [16, 256]),
        ("jittered", [16, 256]),
        ("n_rooks", [16, 16, 256]),
        ("multi_jittered", [16, 16, 256]),
        ("hammersley", [16, 64, 256]),
    ],
)
def test_the_textbooks_figures_have_its_panels(name, counts):
    title, draw = patterns.BOOK_FIGURES[name]
    assert title.startswith("textbook_")
    figure = draw(1)
    squares = figure.axes[::3]
    assert [len(drawn_points(square)) for square in squares] == counts
    captions = [text.get_text() for text in figure.texts if text.get_text().startswith("(")]
    assert [caption[:3] for caption in captions] == ["(a)", "(b)", "(c)"][: len(counts)]


def test_n_rooks_are_on_the_diagonal_before_the_shuffle():
    squares = patterns.BOOK_FIGURES["n_rooks"][1](1).axes[::3]
    before, after = (np.floor(drawn_points(square) * 16).astype(int) for square in squares[:2])
    assert (before[:, 0] == before[:, 1]).all()
    assert not (after[:, 0] == after[:, 1]).all()


# The command


def test_the_command_draws_what_is_asked_for_and_tells_what_it_rounds(tmp_path, capsys):
    folder = tmp_path / "new" / "patterns"
    assert main(["patterns", "--samplers", "Regular", "z_sobol", "--counts", "5", "6", "--output", str(folder)]) == 0
    out, error = capsys.readouterr()
    names = ["regular_6", "textbook_regular", "z_sobol_8"]
    assert sorted(path.name for path in folder.iterdir()) == [f"{n}.{kind}" for n in names for kind in ("png", "svg")]
    assert out == f"3 figures, each as .png and .svg, are in {folder}\n"
    assert "regular: 6 points for 5, since it fills a grid" in error


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--samplers", "rook"], "unknown sampler 'rook'"),
        (["--counts", "0"], "must be between 1 and"),
        (["--counts", "1000000"], "1000000 points fill the square with ink: draw 4096 at most"),
    ],
)
def test_a_wrong_command_is_one_line_and_status_2(arguments, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["patterns", *arguments])
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_folder_that_cannot_be_made_is_one_line_and_status_1(tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("kept")
    assert main(["patterns", "--output", str(file)]) == 1
    error = capsys.readouterr().err
    assert error.startswith("rooks: cannot")
    assert error.count("\n") == 1
    assert file.read_text() == "kept"


def test_drawing_works_in_a_thread_and_never_loads_pyplot_or_scipy(tmp_path):
    """As inside Blender: pyplot wants the main thread, and scipy is not there."""
    program = f"""
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from core.lab import pattern_drawing, style
from core.samplers import SAMPLERS
def draw(i):
    style.save(pattern_drawing.pattern(SAMPLERS["jittered"], 16, seed=i % 2), Path({str(tmp_path)!r}) / str(i))
with ThreadPoolExecutor(4) as pool:
    list(pool.map(draw, range(4)))
print({{"matplotlib.pyplot", "scipy"}} & set(sys.modules))
"""
    root = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "set()\n"
    first, other, again, _ = ((tmp_path / f"{i}.png").read_bytes() for i in range(4))
    assert first == again
    assert first != other
