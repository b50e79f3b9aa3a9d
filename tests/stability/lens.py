"""Lenses: apertures and focus distances at their limits, and what stands in the lens's way."""

from __future__ import annotations
