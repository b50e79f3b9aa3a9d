"""The four marks as numbers: closed forms, independent implementations, and the table of figures that the docs quote.

Seeds are fixed. A statistical test rejects a right figure with a probability of at most 1e-3, shared out among the
comparisons that it makes (Šidák).
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import stats

from core.lab import claims, criteria, score, spectrum, table_5_1
from core.lab.cli import main
from core.lab.point_sets import independent_sets
from core.samplers import SAMPLERS

SIGNIFICANCE = 1e-3
COUNTS = (16, 64, 256)
SETS = 100

every_sampler = pytest.mark.parametrize("name", SAMPLERS)


def limit(comparisons: int) -> float:
    """How many standard errors one of so many comparisons may be off."""
    return stats.norm.isf((1 - (1 - SIGNIFICANCE) ** (1 / comparisons)) / 2)


def random_sets(sets: int, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((sets, count, 2))


# Closed forms


@pytest.mark.parametrize("root", [2, 3, 4, 8, 16])
def test_marks_of_a_square_lattice(root):
    count = root * root
    marks = criteria.measure(SAMPLERS["regular"], count, SETS, seed=1)
    assert marks.sets == 1
    assert marks.unevenness.value == pytest.approx(1 / count, rel=1e-5)
    assert marks.star.value == pytest.approx(root / 2, rel=1e-5)
    assert marks.filled.value == pytest.approx(1 / root)
    assert marks.distance.value == pytest.approx(np.sqrt(np.sqrt(3) / 2), rel=1e-6)
    assert marks.peak == (pytest.approx(1), None)
    assert marks.regularity == pytest.approx(1)


def test_the_densest_lattice_has_the_largest_distance():
    """In it every other row is shifted by half a step, and rows are √3/2 of a step apart: 26 × 30 points nearly are."""
    columns, rows = 26, 30
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    points = np.stack(((i + j % 2 / 2) / columns, j / rows), axis=-1).reshape(1, -1, 2)
    assert criteria.smallest_distance(points)[0] == pytest.approx(1, abs=2e-3)


def test_random_points_have_the_unevenness_of_one_and_fill_what_chance_fills():
    comparisons = 2 * len(COUNTS)
    for count in COUNTS:
        points = random_sets(400, count, seed=count)
        for mark, expected in (
            (criteria.unevenness, 1),
            (criteria.share_filled, 1 - (1 - 1 / count) ** count),
        ):
            values = mark(points)
            z = (values.mean() - expected) / (values.std() / np.sqrt(len(values)))
            assert abs(z) < limit(comparisons), (mark.__name__, count)


def test_independent_points_have_no_regularity():
    """Their power is exponentially distributed, 1 on average; a peak of its mean stays below what chance allows."""
    for count in COUNTS:
        marks = criteria.measure(SAMPLERS["random"], count, 400, seed=2)
        frequencies = (2 * spectrum.reach(count) + 1) ** 2 / 2
        highest = stats.gamma(400, scale=1 / 400).isf(SIGNIFICANCE / frequencies)
        assert 0 < marks.regularity < (highest - 1) / (count - 1)


def test_points_thrown_until_none_fits_keep_a_distance_by_this_measure():
    """Random disks that may not overlap come to a stop when they cover 0.547 of the plane (Feder 1980)."""
    rng, radius, points = np.random.default_rng(3), 0.06, np.empty((0, 2))
    for dart in rng.random((30_000, 2)):
        away = np.abs(points - dart)
        if not len(points) or (np.hypot(*np.minimum(away, 1 - away).T) >= radius).all():
            points = np.append(points, [dart], axis=0)
    measured = criteria.smallest_distance(points[np.newaxis])[0]
    assert measured == pytest.approx(np.sqrt(0.547 / (np.pi / np.sqrt(12))), abs=0.04)
    assert measured > criteria.LEAST_DISTANCE


# Independent implementations


def test_the_unevenness_is_the_double_sum_of_its_definition():
    points = random_sets(3, 40, seed=4)
    apart = np.abs(points[:, :, np.newaxis] - points[:, np.newaxis])
    kernel = apart**2 - apart + 1 / 6
    expected = 36 / 40 * kernel.prod(axis=-1).sum(axis=(1, 2))
    np.testing.assert_allclose(criteria.unevenness(points), expected, rtol=1e-9)


def test_the_unevenness_is_a_mean_of_the_periodogram_off_the_axes():
    points, highest = random_sets(3, 40, seed=5), 300
    frequencies = np.abs(np.arange(-highest, highest + 1.0))
    weights = np.divide(1, frequencies**2, out=np.zeros_like(frequencies), where=frequencies > 0)
    weights = np.outer(weights, weights) * 36 / (2 * np.pi**2) ** 2
    assert weights.sum() == pytest.approx(1, abs=0.005)  # of all frequencies exactly 1
    expected = (spectrum.periodograms(points, highest) * weights).sum(axis=(1, 2))
    np.testing.assert_allclose(criteria.unevenness(points), expected, atol=0.01)


def test_the_periodogram_of_points_on_a_raster_is_that_of_the_fast_fourier_transform():
    size, count = 32, 20
    cells = np.random.default_rng(6).integers(size, size=(2, count, 2))
    power = spectrum.periodograms(cells / size, size // 2 - 1)
    for mine, (x, y) in zip(power, cells.transpose(0, 2, 1), strict=True):
        picture = np.zeros((size, size))
        np.add.at(picture, (y, x), 1)
        expected = np.fft.fftshift(np.abs(np.fft.fft2(picture)) ** 2 / count)[1:, 1:]
        expected[size // 2 - 1, size // 2 - 1] = 0
        np.testing.assert_allclose(mine, expected, atol=1e-9)


def test_the_smallest_distance_goes_round_the_ends_of_the_square():
    points = np.array([[[0.01, 0.5], [0.99, 0.5], [0.5, 0.02], [0.5, 0.2]]])
    assert criteria.smallest_distance(points)[0] == pytest.approx(0.02 / np.sqrt(2 / (np.sqrt(3) * 4)))


# The docs' table: means of 100 sets at n = 16, 64, 256. One figure stands for the mean of the three.

TABLE = {
    "regular": {
        "discrepancy": "114 28 7.1",
        "star": "2 4 8",
        "filled": ".25 .12 .06",
        "distance": ".93 .93 .93",
        "peak": "1",
    },
    "random": {"discrepancy": "253 60 15.5", "star": "3.4 6.6 13.8", "filled": ".64", "distance": ".16 .08 .04"},
    "jittered": {"discrepancy": "67 8.1 1.0", "star": "2.2 3.4 5.5", "filled": ".66", "distance": ".30 .18 .12"},
    "n_rooks": {"discrepancy": "32 5.3 1.2", "star": "1", "filled": "1", "distance": ".30 .15 .07"},
    "multi_jittered": {"discrepancy": "23 2.0 .20", "star": "1", "filled": "1", "distance": ".34 .22 .13"},
    "hammersley": {
        "discrepancy": "43 3.6 .30",
        "star": "1",
        "filled": "1",
        "distance": ".33 .16 .08",
        "peak": ".67 .32 .29",
    },
    "correlated_multi_jittered": {
        "discrepancy": "23 2.0 .20",
        "star": "1",
        "filled": "1",
        "distance": ".51 .39 .30",
        "peak": ".24 .16 .08",
    },
    "sobol_owen": {"discrepancy": "22 1.6 .11", "star": "1", "filled": "1", "distance": ".36 .24 .17"},
}
#: Where the table only says that no peak is higher.
PEAK_AT_MOST = {"random": 0.08, "jittered": 0.08, "n_rooks": 0.08, "multi_jittered": 0.09, "sobol_owen": 0.09}


@pytest.fixture(scope="module")
def measured() -> dict[str, list[criteria.Marks]]:
    return {
        name: [criteria.measure(sampler, count, SETS, seed=1) for count in COUNTS] for name, sampler in SAMPLERS.items()
    }


@pytest.mark.parametrize("name", TABLE)
def test_figures_are_those_of_the_docs(name, measured):
    """Within the standard errors of two means of 100 sets and half a unit of the last digit quoted."""
    comparisons = sum(len(row.split()) for rows in TABLE.values() for row in rows.values())
    for mark, row in TABLE[name].items():
        means = [getattr(marks, mark) for marks in measured[name]]
        quoted = row.split()
        if len(quoted) == 1:
            error = np.sqrt(sum((mean.error or 0) ** 2 for mean in means)) / len(means)
            means = [criteria.Mean(np.mean([mean.value for mean in means]), error)]
        for mean, text in zip(means, quoted, strict=True):
            digit = 0.5 * 10.0 ** -len(text.partition(".")[2])
            chance = limit(comparisons) * np.sqrt(2) * (mean.error or 0)
            assert mean.value == pytest.approx(float(text), abs=digit + chance + 1e-9), (mark, text)


@pytest.mark.parametrize(("name", "highest"), PEAK_AT_MOST.items())
def test_peaks_are_no_higher_than_the_docs_have_them(name, highest, measured):
    for marks in measured[name]:
        chance = limit(len(PEAK_AT_MOST) * len(COUNTS)) * np.sqrt(2) * marks.peak.error
        assert marks.peak.value < highest + 0.005 + chance


# Verdicts


@every_sampler
@pytest.mark.parametrize("seed", [1, 2])
def test_a_sampler_has_the_marks_that_it_says_it_has(name, seed):
    for count in COUNTS:
        marks = criteria.measure(SAMPLERS[name], SAMPLERS[name].actual_count(count), SETS, seed)
        assert marks.criteria == SAMPLERS[name].criteria, (count, marks)


def test_n_rooks_is_as_uneven_in_the_plane_as_random_though_its_discrepancy_is_small(measured):
    for rooks, chance in zip(measured["n_rooks"], measured["random"], strict=True):
        assert rooks.discrepancy.value < chance.discrepancy.value / 5
        error = np.hypot(rooks.unevenness.error, chance.unevenness.error)
        assert abs(rooks.unevenness.value - chance.unevenness.value) < limit(len(COUNTS)) * error


def test_hammersley_points_come_ever_closer_so_that_they_are_not_well_distributed(measured):
    shares = [marks.distance.value for marks in measured["hammersley"]]
    np.testing.assert_allclose(np.divide(shares[1:], shares[:-1]), 0.5, rtol=1e-3)
    sentence = claims.findings({"hammersley": measured["hammersley"]})[0]
    assert "well distributed" in sentence
    assert "does not hold" in sentence
    assert "3 ✗ the smallest distance is 0.33/0.16/0.08" in sentence


def test_the_claims_follow_the_figures(measured):
    sentences = " ".join(claims.findings(measured))
    assert '"N-rooks is no better than random in 2-D": holds' in sentences
    assert "all four marks are met by: none" in sentences
    pretended = {**measured, "hammersley": measured["fibonacci"], "n_rooks": measured["jittered"]}
    sentences = " ".join(claims.findings(pretended))
    assert '"Hammersley samples are well distributed", that is, have marks 1 to 3: holds' in sentences
    assert '"N-rooks is no better than random in 2-D": does not hold' in sentences
    assert claims.findings({"random": measured["random"]}) == []


@every_sampler
def test_sets_are_independent_and_depend_on_nothing_else(name):
    count = SAMPLERS[name].actual_count(20)
    sets = independent_sets(SAMPLERS[name], count, 30, seed=1)
    assert np.array_equal(sets[:5], independent_sets(SAMPLERS[name], count, 5, seed=1))
    assert len(np.unique(sets.reshape(len(sets), -1), axis=0)) == len(sets)
    assert len(sets) == (1 if name in ("regular", "hammersley") else 30)


# Table 5.1


def test_table_5_1_is_the_mirror_image_of_binary_numbers():
    for row in table_5_1.rows():
        mirrored = sum(int(digit) / 2**place for place, digit in enumerate(f"{row['i']:b}"[::-1], start=1))
        assert row["value"] == mirrored
        assert sum(1 / int(term.partition("/")[2]) for term in row["sum"].split(" + ")) == mirrored
    assert table_5_1.errata() == "The textbook prints 0.635 for i = 5 and 0.325 for i = 6."


# The command


def test_the_output_is_complete_where_it_is_no_terminal(capsys):
    assert main(["score", "--sets", "10"]) == 0
    out = capsys.readouterr().out
    for name in SAMPLERS:
        rows = [line.split() for line in out.splitlines() if line.split()[:1] == [name]]
        assert [len(row) for row in rows if row[1].isdigit()] == [12] * len(COUNTS)  # 8 columns and 4 verdicts
    assert "…" not in out
    assert out.count("✗") >= len(SAMPLERS)
    assert "0.625 *" in out
    assert "0.375 *" in out


def test_a_rounded_count_is_told(capsys):
    assert main(["score", "--samplers", "regular", "random", "--counts", "17", "--sets", "10"]) == 0
    assert "regular makes 20 points where 17 are asked for" in capsys.readouterr().out


def test_the_json_has_what_it_takes_to_repeat_it(tmp_path, capsys):
    path = tmp_path / "score.json"
    arguments = ["score", "--samplers", "N_Rooks", "hammersley", "--counts", "16", "--sets", "12", "--seed", "5"]
    assert main([*arguments, "--json", str(path)]) == 0
    written = json.loads(path.read_text(encoding="utf-8"))
    rooks, hammersley = written["scores"]
    again = criteria.measure(SAMPLERS["n_rooks"], rooks["count"], rooks["sets"], written["seed"])
    assert rooks["discrepancy"] == {"value": again.discrepancy.value, "error": again.discrepancy.error}
    assert rooks["verdict"] == again.criteria._asdict()
    assert hammersley["sets"] == 1
    assert hammersley["peak"]["error"] is None
    assert written["limits"].keys() == {"unevenness", "filled", "distance", "regularity"}
    assert [row["value"] for row in written["table_5_1"]][4:6] == [0.625, 0.375]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--samplers", "rook"], "unknown sampler 'rook'"),
        (["--counts", "1"], "must be between 2 and 4096, not 1"),
        (["--sets", "1"], "must be between 10 and 10000, not 1"),
        (["--seed", "x"], "'x' is not a whole number"),
    ],
)
def test_a_wrong_command_is_one_line_and_status_2(arguments, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["score", *arguments])
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_file_that_cannot_be_written_is_told_before_anything_is_measured(tmp_path, capsys):
    assert main(["score", "--json", str(tmp_path / "no" / "score.json")]) == 1
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith("rooks: cannot write")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("mean", "text"),
    [((231.4, 14.6), "231±15"), ((0.1098, 0.0003), "0.1098±0.0003"), ((43.129, None), "43.1"), ((1.0, 0.0), "1")],
)
def test_a_figure_ends_with_the_first_digit_of_its_error(mean, text):
    assert score.figure(criteria.Mean(*mean)) == text
