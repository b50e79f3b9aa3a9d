"""`python -m addon render FILE.blend --output PATH …`: rendering without a window, on Blender's Python module."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
