"""Chart the error of each sampler against time and against samples.

Two kinds of subject: integrands with a closed-form integral, and rendered scenes, each of which leaves one domain of
sampling to chance (see `scenes`) or, the last, all of them. Every cell (subject, sampler, count) is written to
chart.json as soon as it is measured: an interrupted chart goes on where it stopped, and can be drawn again from that
file alone. Measurements with other settings, on another kind of machine or with other sources are never mixed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .. import command_line as kinds
from ..errors import OutputError, SettingsError
from ..files import check_writable, replacing
from ..samplers import SAMPLERS
from ..scene import Scene
from ..settings import RenderSettings, available_cores
from . import chart_drawing, chart_tables, depth, integrands, scenes, style
from .chart_data import cells_done, has, load, measure_scene, new_data, new_subject, save, write_csv
from .measure import Cell, Laboratory, Study

#: Not only powers of two, which flatter some samplers.
SCENE_COUNTS = (1, 4, 9, 16, 36, 64, 144, 256)
#: For scenes in which a sample takes long.
SLOW_COUNTS = (4, 16, 36, 64, 256)
INTEGRAND_COUNTS = (1, 4, 9, 16, 36, 64, 144, 256, 576, 1024, 2304, 4096)

MEASURED = "measured with 1000 trials at 16, 64 … 4096 points"


@dataclass(frozen=True)
class RenderedSubject:
    """A scene, the settings that leave one domain to chance, and the integrand whose slopes are to be expected.

    `bounces` is the longest path's where one scene is measured with several. `counts` are measured unless others are
    asked for.
    """

    label: str
    make: Callable[[tuple[int, int]], Scene]
    settings: dict
    expect: str | None
    note: str
    bounces: int | None = None
    counts: tuple[int, ...] = SCENE_COUNTS

    @property
    def expected(self) -> dict[str, float]:
        """The slope to be expected, by sampler. Sets without chance see edges of one angle alone, where it is not."""
        if self.expect is None:
            return {"random": -0.5}
        slopes = integrands.EXPECTED_SLOPES[self.expect]
        return {name: slope for name, slope in slopes.items() if name not in ("regular", "hammersley")}


#: So narrow that a pixel's samples all go through its middle: the pixel then has no variance of its own.
_POINT_PIXEL = {"pixel_filter": "blackman_harris", "filter_width": 0.01}
_EDGE = "that of a straight edge, for sets left to chance"
_BENT = "that of a straight edge, which bent ones have as well, for sets left to chance"
#: Narrow enough that small pictures have work for several threads.
_SMALL_TILE = {"tile_size": 8}


def _smaller(make: Callable[[tuple[int, int]], Scene], divisor: int) -> Callable[[tuple[int, int]], Scene]:
    """Scenes in which a sample takes long: the chart takes smaller pictures of them."""
    return lambda resolution: make(tuple(max(side // divisor, 1) for side in resolution))


RENDERED = {
    "pixel": RenderedSubject("Pixel: checkerboard to the horizon", scenes.checkerboard, {}, None, "of Random alone"),
    "lens": RenderedSubject("Lens: edge out of focus", scenes.defocus, _POINT_PIXEL, "half_plane", _EDGE),
    "light": RenderedSubject("Light: penumbra", scenes.penumbra, _POINT_PIXEL, "half_plane", _EDGE),
    **{
        make.__name__: RenderedSubject(
            label, _smaller(make, 2), _POINT_PIXEL | _SMALL_TILE, "half_plane", _BENT, counts=SLOW_COUNTS
        )
        for label, make in (("BSDF: matt floor", scenes.hemisphere), ("BSDF: glossy floor", scenes.lobe))
    },
    **{
        f"box{bounces}": RenderedSubject(
            f"Path: room, {depth.bounces_text(bounces)}",
            _smaller(scenes.box, 3),
            _POINT_PIXEL | _SMALL_TILE | {"max_bounces": bounces, "diffuse_bounces": bounces},
            None,
            "of Random alone",
            bounces,
            SLOW_COUNTS,
        )
        for bounces in (1, 2, 4, 8)
    },
    "all": RenderedSubject("Pixel, lens, lights and surfaces", scenes.everything, {}, None, "of Random alone"),
}
SUBJECTS = (*integrands.INTEGRANDS, *RENDERED)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--subjects",
        nargs="+",
        choices=SUBJECTS,
        default=list(SUBJECTS),
        metavar="NAME",
        help=f"what to measure, all if not given. Integrands: {', '.join(integrands.INTEGRANDS)}; "
        f"scenes: {', '.join(RENDERED)}",
    )
    parser.add_argument(
        "--samplers",
        nargs="+",
        type=kinds.sampler,
        default=list(SAMPLERS),
        metavar="NAME",
        help=f"the samplers, all if not given: {', '.join(SAMPLERS)}",
    )
    parser.add_argument(
        "--counts",
        nargs="+",
        type=kinds.integer(1, 1 << 14),
        metavar="N",
        help=f"samples; if not given, {' '.join(map(str, SCENE_COUNTS))} per pixel of a scene, "
        f"{' '.join(map(str, SLOW_COUNTS))} where that is slow, and "
        f"{' '.join(map(str, INTEGRAND_COUNTS))} of an integrand",
    )
    parser.add_argument(
        "--seeds", type=kinds.integer(2, 1000), default=20, metavar="N", help="measurements of each cell (20)"
    )
    parser.add_argument(
        "--trials",
        type=kinds.integer(1, 1_000_000),
        default=50,
        metavar="N",
        help="places of an integrand for each seed (50)",
    )
    parser.add_argument(
        "--resolution", type=kinds.resolution, default=(96, 64), metavar="WxH", help="of the scenes' pictures (96x64)"
    )
    parser.add_argument(
        "--threads", type=kinds.integer(0, 1024), default=0, metavar="N", help="for scenes; 0 is one per core (0)"
    )
    parser.add_argument("--seed", type=kinds.integer(0, 2**30 - 1), default=0, metavar="N", help="the first seed (0)")
    parser.add_argument(
        "--output", type=Path, default=Path("out/chart"), metavar="FOLDER", help="where to save (out/chart)"
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--restart", action="store_true", help="throw away what FOLDER holds and measure all anew")
    what.add_argument("--redraw", action="store_true", help="measure nothing: draw what FOLDER/chart.json holds")


def run(options: argparse.Namespace) -> int:
    style.make_folder(options.output)
    file = options.output / "chart.json"
    check_writable(file)
    if options.redraw:
        data = load(file)
    else:
        data = _begin(options, file)
        try:
            measure_all(data, lambda: save(data, file))
        except KeyboardInterrupt:
            print(f"{kinds.PROGRAM}: interrupted: {_kept(data, file, options.restart)}", file=sys.stderr)
            return 130
    written = draw(data, options.output)
    for line in chart_tables.claim(data):
        print(line)
    print(f"{len(written)} files in {options.output}: {', '.join(sorted(path.name for path in written))}")
    return 0


def _kept(data: dict, file: Path, restarted: bool) -> str:
    if not cells_done(data):
        return "nothing had been measured yet"
    command = "the same command without --restart" if restarted else "the same command"
    return f"{cells_done(data)} cells are kept in {file}, {command} goes on from there"


def _begin(options: argparse.Namespace, file: Path) -> dict:
    """What FOLDER holds already, if it was measured in the same way; else nothing yet."""
    data = new_data(_settings(options), options.threads or available_cores())
    if options.restart or not file.exists():
        return data
    kept = load(file)
    differences = [
        f"{name} {_brief(kept[part].get(name))}, now {_brief(value)}"
        for part in ("settings", "machine", "versions")
        for name, value in data[part].items()
        if kept[part].get(name) != value
    ]
    if differences:
        raise SettingsError(
            f"{file} was measured otherwise ({'; '.join(differences)}): "
            "choose another --output, or --restart to replace it"
        )
    return kept


def _settings(options: argparse.Namespace) -> dict:
    return {
        "subjects": [name for name in SUBJECTS if name in options.subjects],
        "samplers": [name for name in SAMPLERS if name in options.samplers],
        "counts": options.counts and sorted(set(options.counts)),
        "seeds": options.seeds,
        "trials": options.trials,
        "resolution": list(options.resolution),
        "seed": options.seed,
    }


def _brief(value: object) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


# Measuring


def measure_all(data: dict, keep: Callable[[], None]) -> None:
    """Add to `data` what its settings ask for and it does not have yet, and call `keep` after each cell."""
    chosen = data["settings"]["subjects"]
    with _progress() as on_progress:
        _measure_integrands(data, [name for name in chosen if name in integrands.INTEGRANDS], keep, on_progress)
        for name in chosen:
            if name in RENDERED:
                _measure_scene(data, name, keep, on_progress)


@contextmanager
def _progress() -> Iterator[Callable[[str, float, str], None]]:
    """A bar per task on a terminal, nothing elsewhere: a function of the task, its share done and what is done now."""
    screen = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    times = (TimeElapsedColumn(), TimeRemainingColumn(), TextColumn("{task.fields[now]}"))
    with Progress(*columns, *times, console=screen, disable=not screen.is_terminal) as progress:
        tasks = {}

        def on_progress(name: str, share: float, now: str) -> None:
            if name not in tasks:
                tasks[name] = progress.add_task(name, total=1, now=now)
            progress.update(tasks[name], completed=share, now=now)

        yield on_progress


def _measure_integrands(data: dict, names: list[str], keep: Callable[[], None], on_progress: Callable) -> None:
    settings = data["settings"]
    seeds = [settings["seed"] + i for i in range(settings["seeds"])]
    counts = settings["counts"] or INTEGRAND_COUNTS
    wanted = {(name, SAMPLERS[name].actual_count(n)): n for n in counts[::-1] for name in settings["samplers"]}
    for name in names:
        label, expected = integrands.INTEGRANDS[name].label, integrands.EXPECTED_SLOPES[name]
        data["subjects"].setdefault(name, new_subject(label, "integrand", expected, MEASURED))
    done = 0
    for (sampler, count), requested in sorted(wanted.items(), key=lambda item: item[0][1]):
        lacking = [name for name in names if not has(data["subjects"][name], sampler, count)]
        if lacking:
            on_progress("integrands", done / sum(n for _, n in wanted), f"{SAMPLERS[sampler].label}, {count} points")
            trials = [integrands.measure(SAMPLERS[sampler], count, settings["trials"], seed) for seed in seeds]
            for name in lacking:
                cell = integrand_cell(sampler, requested, count, seeds, [t[name] for t in trials])
                data["subjects"][name]["cells"].append(asdict(cell))
            keep()
        done += count
    if names:
        on_progress("integrands", 1, "done")


def integrand_cell(sampler: str, requested: int, count: int, seeds: list[int], trials: list[integrands.Trials]) -> Cell:
    """The cell of an integrand: each seed's RMSE is over its trials and both of their sets."""
    errors = np.stack([t.errors for t in trials])  # (seeds, 2, trials)
    bias = (errors[:, 0] * errors[:, 1]).mean(axis=1)
    return Cell(
        sampler,
        requested,
        count,
        seeds,
        np.sqrt((errors**2).mean(axis=(1, 2))).tolist(),
        [t.setup_seconds for t in trials],
        [t.seconds for t in trials],
        float(bias.mean()),
        float(bias.std(ddof=1) / np.sqrt(len(seeds))),
        float(((errors[:, 0] - errors[:, 1]) ** 2).mean() / 2),
    )


def _measure_scene(data: dict, name: str, keep: Callable[[], None], on_progress: Callable) -> None:
    rendered = RENDERED[name]
    study = _study(data, rendered)
    subject = new_subject(
        rendered.label, "scene", rendered.expected, rendered.note, study.scene.camera.resolution, rendered.bounces
    )
    data["subjects"].setdefault(name, subject)
    laboratory = Laboratory(study, lambda share, now: on_progress(name, share, now))
    measure_scene(data, name, laboratory, lambda *_: keep())
    on_progress(name, 1, "done")


def _study(data: dict, rendered: RenderedSubject) -> Study:
    settings = data["settings"]
    return Study(
        rendered.make(tuple(settings["resolution"])),
        RenderSettings(seed=settings["seed"], threads=data["machine"]["threads"], **rendered.settings),
        settings["samplers"],
        settings["counts"] or rendered.counts,
        settings["seeds"],
    )


# Drawing and writing


def draw(data: dict, folder: Path) -> list[Path]:
    """Everything that chart.json alone is enough for: pictures, tables and CSV. Returns the paths written.

    Raises:
        OutputError: nothing has been measured yet, or a file cannot be written.
    """
    if not cells_done(data):
        raise OutputError(f"{folder} holds no measurement yet: run the command without --redraw")
    written = []
    for name in [name for name, subject in data["subjects"].items() if subject["cells"]]:
        written += style.save(chart_drawing.draw_subject(data, name), folder / name)
    written += style.save(chart_drawing.draw_overview(data), folder / "overview")
    if depth.table(data)[1]:
        written += style.save(chart_drawing.draw_depth(data), folder / "depth")
    tables = folder / "chart.md"
    with replacing(tables) as temporary:
        temporary.write_text(chart_tables.markdown(data), encoding="utf-8")
    return [*written, tables, write_csv(data, folder / "chart.csv")]
