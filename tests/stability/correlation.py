"""Correlation: domains, pixels and frames that share their points."""

from __future__ import annotations
