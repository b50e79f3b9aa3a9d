"""The registry of samplers: every module of this package that defines a `SAMPLER` is in it.

Adding a sampler is adding one file. `SAMPLERS` maps each lower-case name to its `Sampler`, in order of `number`.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from .sampler import Criteria, Sampler

__all__ = ["SAMPLERS", "TEXTBOOK", "Criteria", "Sampler"]


def _discover() -> dict[str, Sampler]:
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    found = sorted((m.SAMPLER for m in modules if hasattr(m, "SAMPLER")), key=lambda sampler: sampler.number)
    assert len({s.number for s in found}) == len({s.name for s in found}) == len(found), "two samplers share a name"
    return {sampler.name: sampler for sampler in found}


SAMPLERS: dict[str, Sampler] = _discover()

#: The names of the six that the textbook teaches (Suffern 2007, ch. 5); the others are there to measure them with.
TEXTBOOK = tuple(name for name, sampler in SAMPLERS.items() if sampler.number <= 5)
