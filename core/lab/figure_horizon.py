"""Figures 5.19 to 5.21: the checkerboard to the horizon, each of the six samplers with one and with 256 samples."""

from __future__ import annotations

from ..scene import Scene
from .figure_plates import Plate, picture_panel
from .figure_shots import Reference, Shot, Studio, letters

COUNTS = (1, 256)
PANEL = 512
#: The two samplers of each figure, and what is seen in it; {0} and {1} are their last errors relative to random's.
FIGURES = {
    "5.19": (
        ("regular", "random"),
        "Towards the horizon one regular sample turns the checks into patterns that are not there, one random sample "
        "into noise. With more, both fade to the grey that is right, but at {count} the patterns still make {0:.2f} "
        "times the error of the noise.",
    ),
    "5.20": (
        ("jittered", "n_rooks"),
        "One sample of either is one random point. At {count} the error is {0:.2f} times that of random points with "
        "jittered ones and {1:.2f} times with n-rooks: far checks are nearly level lines in a pixel, and there even "
        "projections count as much as an even plane.",
    ),
    "5.21": (
        ("multi_jittered", "hammersley"),
        "One multi-jittered sample is one random point; Hammersley's one is the pixel's corner, which makes patterns "
        "as the centre does. At {count} the error is {0:.2f} and {1:.2f} times that of random points.",
    ),
}
RENDERS = len(COUNTS) * sum(len(samplers) for samplers, _ in FIGURES.values())


def make(studio: Studio, scene: Scene, reference: Reference) -> list[Plate]:
    """The three figures, of the checkerboard `scene` whose converged picture is `reference`."""
    names = [name for samplers, _ in FIGURES.values() for name in samplers]
    shots = {name: [studio.shoot(scene, name, count) for count in COUNTS] for name in names}
    errors = {name: reference.judge(shots[name][-1].picture)["rmse"] for name in names}
    plates = []
    for number, (samplers, seen) in FIGURES.items():
        ratios = [errors[name] / errors["random"] for name in samplers]
        caption = f"Figure {number}. {seen.format(*ratios, count=COUNTS[-1])} {reference.sentence()}"
        parts = [shot for name in samplers for shot in shots[name]]
        plates.append(_plate(f"figure_{number.replace('.', '_')}", parts, caption, reference))
    return plates


def _plate(name: str, shots: list[Shot], caption: str, reference: Reference) -> Plate:
    panels, numbers = [], []
    for mark, shot in zip(letters(len(shots)), shots, strict=True):
        samples = "1 sample" if shot.samples == 1 else f"{shot.samples} samples"
        judged = reference.judge(shot.picture)
        title = f"{mark} {shot.label}, {samples} per pixel"
        panels.append(picture_panel(shot.picture, title, f"RMSE {judged['rmse']:.4f}", width=PANEL))
        numbers.append({"part": mark} | shot.numbers() | judged)
    rows = [panels[:2], panels[2:]]
    return Plate(name, rows, caption, {"panels": numbers, "reference": reference.numbers()})
