"""Build the Blender extension: one zip for each platform, in dist/.

Fetches the wheels that Rooks needs inside Blender into build/wheels/, in the versions that pyproject.toml pins; stages
the extension's files in build/extension/; packs them with Blender's own builder, which comes with the bpy wheel.

    .venv/bin/python .ci/build_extension.py [PLATFORM...]
"""

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
WHEELS = ROOT / "build" / "wheels"
STAGE = ROOT / "build" / "extension"
DIST = ROOT / "dist"

#: What a zip holds beside the manifest.
FILES = ("__init__.py", "LICENSE", "README.md")
PACKAGES = ("addon", "core")
NOT_SHIPPED = ("__pycache__", ".*")

#: What Blender does not bring itself, numpy apart: compiled for each Python, and such as runs on any.
COMPILED = ("numba", "llvmlite", "embreex", "matplotlib", "contourpy", "kiwisolver", "pillow")
PURE = (
    *("rich", "markdown-it-py", "mdurl", "Pygments"),
    *("cycler", "fonttools", "packaging", "pyparsing", "python-dateutil", "tzdata"),
)
#: Blender up to 5.0 runs Python 3.11 and from 5.1 on 3.13.
PYTHONS = ("3.11", "3.13")


class Platform(NamedTuple):
    """The names of the wheels that run on a platform, the best first, and the Pythons that Blender has there."""

    tags: list[str]
    pythons: tuple[str, ...] = PYTHONS


#: By Blender's names. Left out are macos-x64, for which the last wheels of numba and llvmlite are 0.62.1 and 0.45.1,
#: and windows-arm64 and linux-arm64, for which embreex has none.
PLATFORMS = {
    # A glibc not above 2.28. Debian builds Blender for its own Python: 3.13, 3.14.
    "linux-x64": Platform([f"manylinux_2_{minor}_x86_64" for minor in range(28, 4, -1)], (*PYTHONS, "3.14")),
    "windows-x64": Platform(["win_amd64"]),
    # embreex asks for macOS 13.
    "macos-arm64": Platform([f"macosx_{version}_0_arm64" for version in range(13, 10, -1)]),
}


def main() -> None:
    """Build the zips of the platforms named on the command line, or of all."""
    parser = argparse.ArgumentParser(description="Build the Blender extension into dist/.")
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help=f"one of {', '.join(PLATFORMS)}; default: all")
    platforms = parser.parse_args().platforms or list(PLATFORMS)
    if unknown := set(platforms) - set(PLATFORMS):
        parser.error(f"no such platform: {', '.join(sorted(unknown))}. There are: {', '.join(PLATFORMS)}")
    for platform in platforms:
        compiled = [fetch(name, platform, python) for python in PLATFORMS[platform].pythons for name in COMPILED]
        stage(platform, compiled + [fetch_pure(name) for name in PURE])
        pack(platform)


def fetch(name: str, platform: str, python: str) -> Path:
    """Return the pinned wheel of a package for one platform and Python, downloaded where it is not there yet."""
    options = [option for tag in PLATFORMS[platform].tags for option in ("--platform", tag)]
    return download(name, WHEELS / platform / python, [*options, "--python-version", python])


def fetch_pure(name: str) -> Path:
    """Return the pinned wheel of a package that is the same for all platforms and Pythons."""
    # The oldest Python: from it on all can run the wheel.
    options = ["--platform", "any", "--implementation", "py", "--abi", "none", "--python-version", PYTHONS[0]]
    return download(name, WHEELS / "any", options)


def download(name: str, folder: Path, options: list[str]) -> Path:
    version = pinned(name)
    # As names of files have it.
    pattern = f"{name.lower().replace('-', '_')}-{version}-*.whl"
    if not list(folder.glob(pattern)):
        print(f"fetching {name} {version} into {folder.relative_to(ROOT)}", flush=True)
        always = ["--quiet", "--no-deps", "--only-binary=:all:", "--dest", str(folder)]
        command = [sys.executable, "-m", "pip", "download", *always, *options, f"{name}=={version}"]
        subprocess.run(command, check=True)
    (wheel,) = folder.glob(pattern)
    return wheel


def pinned(name: str) -> str:
    """Return the version of a package that pyproject.toml pins."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
    pins = dict(requirement.split("==") for requirement in groups["lab"] + groups["run"])
    return pins[name]


def stage(platform: str, wheels: list[Path]) -> None:
    """Lay out in `STAGE` what goes into the zip, the manifest completed."""
    shutil.rmtree(STAGE, ignore_errors=True)
    (STAGE / "wheels").mkdir(parents=True)
    for name in FILES:
        shutil.copy(ROOT / name, STAGE)
    for name in PACKAGES:
        shutil.copytree(ROOT / name, STAGE / name, ignore=shutil.ignore_patterns(*NOT_SHIPPED))
    for wheel in wheels:
        (STAGE / "wheels" / wheel.name).hardlink_to(wheel)
    listed = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in wheels)
    # Keys of the whole file must stand before its first table.
    keys, bracket, tables = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8").partition("\n[")
    manifest = f'{keys}\nplatforms = ["{platform}"]\nwheels = [\n{listed}]\n{bracket}{tables}'
    (STAGE / "blender_manifest.toml").write_text(manifest, encoding="utf-8")


def pack(platform: str) -> None:
    """Turn `STAGE` into a zip in `DIST`, and let Blender's builder judge it."""
    manifest = tomllib.loads((STAGE / "blender_manifest.toml").read_text(encoding="utf-8"))
    target = DIST / f"{manifest['id']}-{manifest['version']}-{platform.replace('-', '_')}.zip"
    DIST.mkdir(exist_ok=True)
    builder = [sys.executable, str(blender_builder())]
    subprocess.run(
        [*builder, "build", "--source-dir", str(STAGE), "--output-filepath", str(target)],
        check=True,
    )
    subprocess.run([*builder, "validate", str(target)], check=True)
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e6:.0f} MB")


def blender_builder() -> Path:
    """Return the program behind `blender --command extension`, which runs on its own."""
    spec = importlib.util.find_spec("bpy")
    (program,) = Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    return program


if __name__ == "__main__":
    main()
