"""What chart.json holds: everything that a chart can be drawn from again, as plain dicts and lists.

{"format": 2,
 "settings": what was asked for, "machine": threads, cores …, "versions": Python, numpy, a digest of the sources,
 "compile_seconds": of the kernels, left out of all times,
 "subjects": {name: {"label", "kind": "integrand" or "scene", "expected": slope by sampler, "expected_note",
                     "resolution": of a scene's pictures, "bounces": of a scene that is measured at several,
                     "references": [{"sampler", "judges", "samples", "seeds", "standard_error"}],
                     "cells": [the fields of `measure.Cell`]}}}
"""

from __future__ import annotations

import csv
import hashlib
import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..errors import OutputError
from ..files import replacing
from ..samplers import SAMPLERS
from ..settings import available_cores
from .measure import Cell, Laboratory, Reference, assign_references

FORMAT = 2


def new_data(settings: dict, threads: int) -> dict:
    """Nothing measured yet, under these conditions."""
    sources = hashlib.blake2b(digest_size=8)
    lab = Path(__file__).parent
    measuring = [lab / f"{name}.py" for name in ("chess_rook", "integrands", "measure", "scenes")]
    for path in sorted([*lab.parent.glob("*.py"), *lab.parent.glob("samplers/*.py"), *measuring]):
        sources.update(path.read_bytes())
    return {
        "format": FORMAT,
        "settings": settings,
        "machine": {
            "threads": threads,
            "cores": available_cores(),
            "processor": platform.machine(),
            "system": platform.system(),
        },
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "sources": sources.hexdigest()},
        "compile_seconds": None,
        "subjects": {},
    }


def new_subject(
    label: str,
    kind: str,
    expected: Mapping[str, float],
    note: str,
    resolution: Sequence[int] | None = None,
    bounces: int | None = None,
) -> dict:
    return {
        "label": label,
        "kind": kind,
        "expected": dict(expected),
        "expected_note": note,
        "resolution": resolution and list(resolution),
        "bounces": bounces,
        "references": [],
        "cells": [],
    }


def has(subject: dict, sampler: str, count: int) -> bool:
    return any(cell["sampler"] == sampler and cell["count"] == count for cell in subject["cells"])


def cells_done(data: dict) -> int:
    return sum(len(subject["cells"]) for subject in data["subjects"].values())


def measure_scene(
    data: dict, name: str, laboratory: Laboratory, on_cell: Callable[[Cell, np.ndarray, Reference], None]
) -> None:
    """Measure the cells that subject `name` does not have yet. `on_cell` gets each, its pictures and its reference.

    References are made again where cells are lacking: the same settings make the same ones.

    Raises:
        measure.Cancelled: as the laboratory does.
    """
    subject, study = data["subjects"][name], laboratory.study
    if all(has(subject, sampler, count) for sampler, _, count in study.cells()):
        return
    # The first scene of a process has the kernels compiled or loaded: later ones find them there.
    data["compile_seconds"] = max(data["compile_seconds"] or 0.0, laboratory.warm_up())
    assigned = assign_references(study.samplers)
    references, records = {}, []
    for maker in dict.fromkeys(assigned.values()):
        judges = [sampler for sampler, its in assigned.items() if its == maker]
        reference = references[maker] = laboratory.make_reference(maker, judges)
        records.append(
            {
                "sampler": maker,
                "judges": judges,
                "samples": reference.samples,
                "seeds": reference.seeds,
                "standard_error": reference.standard_error,
            }
        )
    subject["references"] = records
    for sampler, requested, count in study.cells():
        if has(subject, sampler, count):
            laboratory.skip_cell(sampler, count)
            continue
        reference = references[assigned[sampler]]
        cell, pictures = laboratory.measure_cell(sampler, requested, count, reference)
        subject["cells"].append(asdict(cell))
        on_cell(cell, pictures, reference)


def load(file: Path) -> dict:
    """The measurements in a chart.json.

    Raises:
        OutputError: there is no such file, or it is none of ours.
    """
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise OutputError(f"there is no {file}: measure first, without --redraw") from None
    except (OSError, ValueError) as error:
        raise OutputError(f"cannot read {file}: {error}") from None
    if not _is_ours(data):
        raise OutputError(f"{file} holds no chart of this version: choose another --output, or --restart to replace it")
    return data


def _is_ours(data: object) -> bool:
    """Whether all is there that drawing and resuming read, of samplers that there are."""
    try:
        subjects = data["subjects"].values()
        cells = [Cell(**cell) for subject in subjects for cell in subject["cells"]]
        return (
            data["format"] == FORMAT
            and all(isinstance(data[part], dict) for part in ("settings", "machine", "versions"))
            and all(subject.keys() >= new_subject("", "", {}, "").keys() for subject in subjects)
            and all(cell.sampler in SAMPLERS for cell in cells)
        )
    except (AttributeError, KeyError, TypeError):
        return False


def save(data: dict, file: Path) -> None:
    """Write the measurements, whole or not at all."""
    with replacing(file) as temporary:
        temporary.write_text(json.dumps(data, separators=(",", ":")), encoding="utf-8")


def write_csv(data: dict, path: Path) -> Path:
    """One row per subject, sampler, count and seed."""
    columns = ("seeds", "rmse", "setup_seconds", "seconds")
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(("subject", "sampler", "requested", "count", "seed", "rmse", "setup_seconds", "seconds"))
        for name, subject in data["subjects"].items():
            for cell in subject["cells"]:
                for row in zip(*(cell[column] for column in columns), strict=True):
                    writer.writerow((name, cell["sampler"], cell["requested"], cell["count"], *row))
    return path
