"""Numbers: sizes, distances, meshes and rays at the limits of float32."""

from __future__ import annotations
