"""Processes: cancelling, killing, forking, full disks, broken files, and a thousand renders in a row."""

from __future__ import annotations
