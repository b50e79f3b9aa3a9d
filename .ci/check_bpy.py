"""Import bpy, and where a system library is missing say in one line which, and how to get it."""

import re
import sys
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"

try:
    import bpy  # noqa: F401
except ImportError as error:
    missing = re.search(r"lib[^\s:/]*\.so[.\d]*", str(error))
    if missing is None:
        sys.exit(f"Blender's Python module does not start: {error}")
    packages = re.search(r"apt-get install (.*\blibx11-6\b.*)", README.read_text(encoding="utf-8"))
    advice = f" (Debian, Ubuntu: apt-get install {packages[1]})" if packages else ""
    sys.exit(f"Blender's Python module needs the system library {missing[0]}, which is missing{advice}")
