"""Materials: values at and beyond the limits of what a surface can be."""

from __future__ import annotations
