"""Counts of samples: odd ones, huge ones, and sets that are cut short."""

from __future__ import annotations
