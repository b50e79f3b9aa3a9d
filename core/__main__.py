"""`python -m core patterns | score | figures | chart`: the sampling lab, without Blender."""

import sys

from .lab.cli import main

if __name__ == "__main__":
    sys.exit(main())
