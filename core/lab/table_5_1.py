"""Table 5.1 of the textbook (Suffern 2007), corrected: the radical inverses in base 2 of 1 to 8."""

from __future__ import annotations

import numpy as np
from rich import box
from rich.table import Table

from ..samplers.hammersley import radical_inverse

#: Φ₂(i) as the textbook prints it: those of 5 and 6 are wrong.
PRINTED = (0.5, 0.25, 0.75, 0.125, 0.635, 0.325, 0.875, 0.0625)


def rows() -> list[dict]:
    """For each i: its binary digits, the sum that their mirror image means, Φ₂(i), and what the textbook prints."""
    table = []
    for i, printed in enumerate(PRINTED, start=1):
        binary = f"{i:b}"
        powers = [f"1/{2**place}" for place, digit in enumerate(reversed(binary), start=1) if digit == "1"]
        value = float(radical_inverse(np.array([i]))[0])
        table.append({"i": i, "binary": binary, "sum": " + ".join(powers), "value": value, "printed": printed})
    return table


def drawn() -> Table:
    """The table for a terminal, with a star where the textbook is wrong."""
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("i", "binary", "mirrored", "sum", "Φ₂(i)"):
        table.add_column(heading, justify="right" if heading in ("i", "binary") else "left")
    for row in rows():
        star = "" if row["value"] == row["printed"] else " *"
        table.add_row(str(row["i"]), row["binary"], f".{row['binary'][::-1]}", row["sum"], f"{row['value']:g}{star}")
    return table


def errata() -> str:
    """One sentence on the entries that the textbook has wrong."""
    wrong = [f"{row['printed']} for i = {row['i']}" for row in rows() if row["value"] != row["printed"]]
    return f"The textbook prints {' and '.join(wrong)}."
