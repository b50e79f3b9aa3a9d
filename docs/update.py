"""Write the parts of README.md that are made from the code: `make docs`. A test checks that they are up to date."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from core.samplers import SAMPLERS, Sampler  # noqa: E402 - the path comes first


def samplers_table() -> str:
    """A row for each sampler of the registry, in its order."""
    head = (
        "| sampler | from | even in 2-D | even in 1-D | minimum distance | irregular | counts | |\n"
        "|---|---|:-:|:-:|:-:|:-:|---|---|\n"
    )
    return head + "".join(_row(sampler) for sampler in SAMPLERS.values())


def _row(sampler: Sampler) -> str:
    marks = " | ".join("✓" if met else "–" for met in sampler.criteria)
    counts = "any" if all(sampler.actual_count(n) == n for n in range(1, 100)) else "rows × columns"
    return f"| {sampler.label} `{sampler.name}` | {sampler.origin} | {marks} | {counts} | {sampler.description} |\n"


def updated(readme: str) -> str:
    """The README's text with its generated parts made anew."""
    return re.sub(
        r"(<!-- samplers:begin -->\n).*(<!-- samplers:end -->)",
        lambda match: match[1] + samplers_table() + match[2],
        readme,
        flags=re.DOTALL,
    )


if __name__ == "__main__":
    README.write_text(updated(README.read_text()))
