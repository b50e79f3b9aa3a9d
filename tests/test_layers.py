"""Who may import whom: core stands alone, one module knows Embree, and loading Rooks costs little."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CORE = sorted((ROOT / "core").rglob("*.py"))
ADDON = sorted((ROOT / "addon").rglob("*.py"))

every_core_file = pytest.mark.parametrize("path", CORE, ids=lambda path: str(path.relative_to(ROOT)))
every_addon_file = pytest.mark.parametrize("path", ADDON, ids=lambda path: str(path.relative_to(ROOT)))


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """Each import of a file, also inside functions, as (level, module); level 0 is absolute."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"), str(path))):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or ""


def top(module: str) -> str:
    return module.partition(".")[0]


def depth(path: Path, package: str) -> int:
    """How many leading dots an import in this file may have without leaving its package."""
    return len(path.relative_to(ROOT / package).parts)


def test_there_is_something_to_check():
    assert len(CORE) > 15


@every_core_file
def test_core_knows_nothing_of_blender(path):
    assert not {top(module) for _, module in imports(path)} & {"bpy", "mathutils", "addon", "bl_ext", "gpu", "bgl"}


@every_core_file
def test_core_imports_itself_relatively_and_nothing_above_it(path):
    for level, module in imports(path):
        assert level <= depth(path, "core"), f"{module} is outside of core"
        assert level or top(module) != "core", f"import {module} relatively: in Blender core has another name"


@every_core_file
def test_only_one_module_knows_embree(path):
    if path.name in ("embree.py", "embree_run.py"):
        return
    source = path.read_text("utf-8")
    assert "embreex" not in {top(module) for level, module in imports(path) if not level}
    assert "embreex" not in source
    names = {node.id for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Name)}
    assert not {name for name in names if name.startswith("rtc")}


@every_core_file
def test_kernels_are_where_the_compile_cache_looks_for_changes(path):
    """`core.kernel_cache` names its folder after the contents of the files beside it, not of those in folders below."""
    in_sight = path.parent == ROOT / "core"
    assert in_sight or "numba" not in {top(module) for _, module in imports(path)}
    assert in_sight or not {module for level, module in imports(path) if level and module == "jit"}


@every_core_file
def test_only_the_lab_needs_its_extra(path):
    if path.parent != ROOT / "core" / "lab":
        assert not {top(module) for level, module in imports(path) if not level} & {"matplotlib", "scipy"}
        assert not {top(module) for level, module in imports(path) if level} & {"lab"} or path.name == "__main__.py"


@every_addon_file
def test_the_addon_renders_nothing_itself(path):
    assert not {top(module) for level, module in imports(path) if not level} & {"numba", "llvmlite", "embreex"}


@every_core_file
def test_no_star_imports(path):
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        assert not (isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names))


@pytest.mark.parametrize("module", ["core", "core.samplers", "core.settings", "core.scene"])
def test_loading_core_does_not_load_the_compiler_or_embree(module):
    code = f"import {module}, json, sys; print(json.dumps(sorted({{name.partition('.')[0] for name in sys.modules}})))"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(json.loads(run.stdout))
    assert module != "core" or "numpy" not in loaded
    assert not loaded & {"numba", "llvmlite", "embreex", "bpy", "OpenEXR", "scipy", "matplotlib", "rich"}
