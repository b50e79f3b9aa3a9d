"""Aliasing: detail finer than the pixels, met by points of each sampler."""

from __future__ import annotations
