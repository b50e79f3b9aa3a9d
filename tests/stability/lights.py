"""Lights: at the limits of size, distance, angle and power, and where sampling them by area fails."""

from __future__ import annotations

import math

from core import SunLight
from tests.scenes import irradiance

from .case import Record, case


@case(
    "A sun of no and of any angle",
    happens="The sun's disk is a point, or half the sky.",
    why="1 − cos θ loses all digits in float32 at a small angle; the radiance of a disk without size is infinite.",
    rooks="Samples the disk by its solid angle, computed as s²/(1 + c); a sun of angle 0 is a direction.",
)
def sun_of_any_angle(record: Record) -> None:
    """The irradiance that a sun's strength means is that of its middle, cos θ, at every angle below the horizon's."""
    for degrees in (0.0, 1e-4, 0.01, 0.526, 30.0):
        sun = SunLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), math.radians(degrees))
        found = irradiance([sun], samples=64, seeds=8)
        record.claim(f"relative error at {degrees:g}°", abs(float(found.mean) - 1.0), at_most=2e-3)
