"""The one door to the renderer: `from ._core import core`.

This package is imported under two names: as `addon`, beside the top-level package `core` (the repository, the command
line, the tests), and as `bl_ext.<repository>.rooks.addon`, beside `bl_ext.<repository>.rooks.core` (the installed
extension). A relative `from ..core import …` fails under the first name, an absolute `import core` under the second;
here the name of the sibling is worked out once.

The renderer's parts load when they are first used (`core/__init__.py`), so that this costs Blender's start nothing.
"""

from __future__ import annotations

from importlib import import_module

_parent = __package__.rpartition(".")[0]

core = import_module(f"{_parent}.core" if _parent else "core")
