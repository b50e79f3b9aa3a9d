"""Fireflies: pixels that are far too bright, where they come from, and what clamping them costs."""

from __future__ import annotations
