"""How the extension comes and goes in a real Blender: over an older version, disabled, removed, and what is left.

The checks are those of `real_blender.py`, which runs them.
"""

import re
import tomllib
import zipfile
from pathlib import Path

from blender_runs import EXTENSION, Blender, CheckError, installs

OLDER = "0.0.1"
#: A folder of kernels as an older version names it, by a digest of its sources.
OLDER_KERNELS = "0123456789abcdef"

#: Enable, disable, and look for what is still there. Handlers, classes and menus are known by their modules.
DISABLE = f"""
import addon_utils, bpy, sys, threading
assert "{EXTENSION}" in bpy.context.preferences.addons, "the extension is not enabled"
bpy.context.scene.render.engine = "ROOKS"
addon_utils.disable("{EXTENSION}", default_set=True)
bpy.ops.wm.save_userpref()

def is_ours(thing):
    return (getattr(thing, "__module__", None) or "").startswith("{EXTENSION}")

left = [f"class {{name}}" for name in dir(bpy.types) if is_ours(getattr(bpy.types, name))]
for name in dir(bpy.app.handlers):
    handlers = getattr(bpy.app.handlers, name)
    left += [f"handler {{name}}" for handler in handlers if is_ours(handler)] if isinstance(handlers, list) else []
for owner in (bpy.types.Scene, bpy.types.ViewLayer, bpy.types.Object, bpy.types.Material, bpy.types.WindowManager):
    left += [f"property {{owner.__name__}}.{{name}}" for name in owner.bl_rna.properties.keys() if "rooks" in name]
for name in dir(bpy.types):
    menu = getattr(getattr(bpy.types, name), "draw", None)
    left += [f"part of menu {{name}}" for draw in getattr(menu, "_draw_funcs", ()) if is_ours(draw)]
    if "ROOKS" in getattr(getattr(bpy.types, name), "COMPAT_ENGINES", ()):
        left.append(f"the engine in panel {{name}}")
left += [f"thread {{thread.name}}" for thread in threading.enumerate() if thread.name.startswith("rooks")]
if "ROOKS" in {{engine.identifier for engine in bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items}}:
    left.append("the engine")
print("left behind:", ", ".join(left) or "nothing", flush=True)
"""


def comes_after_an_older_version(blender: Blender, home: Path, zip_file: str) -> None:
    """Installed over an older version, the extension takes its place."""
    older = home / "older.zip"
    write_older(Path(zip_file), older)
    installs(blender, str(older))
    older.unlink()
    if OLDER not in installed_version(home):
        raise CheckError("the older version was not installed")
    installs(blender, zip_file)
    if OLDER in installed_version(home):
        raise CheckError("the older version was not replaced")
    old = own_folder(home) / "kernels" / OLDER_KERNELS
    old.mkdir(parents=True)
    (old / "kernel.nbc").touch()
    print("ok: takes the place of an older version", flush=True)


def installed_version(home: Path) -> str:
    manifest = extensions(home) / "user_default/rooks/blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]


def write_older(zip_file: Path, older: Path) -> None:
    """The same extension with an older version's number. Not compressed, which would take a minute."""
    with zipfile.ZipFile(zip_file) as source, zipfile.ZipFile(older, "w") as target:
        for item in source.infolist():
            data = source.read(item)
            if item.filename.endswith("blender_manifest.toml"):
                data = re.sub(rb'(?m)^version = ".*"$', f'version = "{OLDER}"'.encode(), data)
            target.writestr(item.filename, data)


def extensions(home: Path) -> Path:
    """Blender's folder of extensions, and of what they keep."""
    return next(home.glob(".config/blender/*/extensions"))


def own_folder(home: Path) -> Path:
    """The one folder where the extension may write."""
    return extensions(home) / ".user/user_default/rooks"


def keeps_its_kernels(home: Path) -> None:
    """After a first render, the kernels are in the extension's own folder, and those of an older version are gone."""
    kernels = own_folder(home) / "kernels"
    folders = [folder.name for folder in kernels.iterdir()]
    if len(folders) != 1 or folders == [OLDER_KERNELS] or not list(kernels.glob("*/complete-*")):
        raise CheckError(f"{kernels} should hold the kernels of this version, and has: {', '.join(folders)}")
    if strays := [path for path in (home / ".cache/rooks", *home.glob("rooks-cache-*")) if path.exists()]:
        raise CheckError(f"kernels are kept outside of the extension's own folder: {', '.join(map(str, strays))}")
    print("ok: keeps its kernels in its own folder, and none of an older version", flush=True)


def goes(blender: Blender, home: Path) -> None:
    """Disabled, the extension leaves nothing in Blender; removed, no file."""
    printed = blender.succeed("--background", "--python-exit-code", "9", "--python-expr", DISABLE)
    if "left behind: nothing" not in printed:
        raise CheckError(f"disabling leaves something behind:\n{printed}")
    is_loaded = f"import sys; print('loaded:', '{EXTENSION}' in sys.modules)"
    if "loaded: False" not in (printed := blender.succeed("--background", "--python-expr", is_loaded)):
        raise CheckError(f"the extension was disabled, and Blender loads it at its next start:\n{printed}")
    blender.succeed("--command", "extension", "remove", "rooks")
    config = extensions(home).parent
    if left := [str(path) for path in config.rglob("*") if path.is_file() and came_with_rooks(path, config)]:
        raise CheckError(f"removing leaves behind: {', '.join(left)}")
    print("ok: disabled, it leaves nothing in Blender; removed, no file", flush=True)


def came_with_rooks(path: Path, config: Path) -> bool:
    """Whether a file has to do with the extension: by its name, or as part of a package that the extension brought."""
    parts = path.relative_to(config).parts
    return any("rooks" in part for part in parts) or "site-packages" in parts
