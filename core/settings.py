"""How a picture is rendered: the samplers, how many samples, how many threads."""

from __future__ import annotations

import operator
import os
from dataclasses import dataclass
from typing import Literal

from .errors import SettingsError
from .limits import MAX_BOUNCES, MAX_SAMPLES, MAX_SEED, MAX_TRANSPARENT_BOUNCES
from .samplers import SAMPLERS


@dataclass(frozen=True)
class RenderSettings:
    """The settings of one render, checked when made.

    A domain's own sampler (`pixel_sampler`, `lens_sampler`, `light_sampler`, `bsdf_sampler`) overrides `sampler`.
    `samples` is the count asked for; `sample_count` is the one that all chosen samplers can make.
    `max_bounces` 0 is direct light only; a path also ends after its own kind's limit of reflections by diffuse or
    glossy lobes, of transmissions, or of surfaces that it passed straight through (`transparent_bounces`). The ray that
    is one too many still gathers what it meets.
    `clamp_indirect` limits what one sample's bounced light may add to the mean of its channels, 0: not at all. It is a
    bias: the picture lacks what was cut off. `border` is (left, bottom, right, top) in pixels of the full frame, from
    its lower left corner, the right and top edges outside. `denoising_albedo` asks for the pass of that name, which
    takes time of its own and leaves the others as they are. `threads` 0 means one per core; neither it nor
    `tile_size` nor `batch_packets` changes the picture.

    Raises:
        SettingsError: a value is out of range or names no sampler.
    """

    samples: int = 16
    sampler: str = "multi_jittered"
    pixel_sampler: str | None = None
    lens_sampler: str | None = None
    light_sampler: str | None = None
    bsdf_sampler: str | None = None
    seed: int = 0
    max_bounces: int = 0
    diffuse_bounces: int = 4
    glossy_bounces: int = 4
    transmission_bounces: int = 12
    transparent_bounces: int = 8
    clamp_indirect: float = 0.0
    pixel_filter: Literal["box", "blackman_harris"] = "box"
    filter_width: float = 1.5
    film_transparent: bool = False
    border: tuple[int, int, int, int] | None = None
    denoising_albedo: bool = False
    threads: int = 0
    tile_size: int = 64
    batch_packets: int = 32

    def __post_init__(self) -> None:
        for name in self.samplers.values():
            if name not in SAMPLERS:
                raise SettingsError(f"unknown sampler {name!r}: choose one of {', '.join(SAMPLERS)}")
        _check_integer("samples", self.samples, 1, MAX_SAMPLES)
        _check_integer("seed", self.seed, 0, MAX_SEED)
        for kind in ("max", "diffuse", "glossy", "transmission"):
            _check_integer(f"{kind} bounces", getattr(self, f"{kind}_bounces"), 0, MAX_BOUNCES)
        _check_integer("transparent bounces", self.transparent_bounces, 0, MAX_TRANSPARENT_BOUNCES)
        _check_range("clamp indirect", self.clamp_indirect, 0, float("inf"))
        _check_integer("threads", self.threads, 0, 1024)
        _check_integer("tile size", self.tile_size, 4, 4096)
        _check_integer("batch packets", self.batch_packets, 1, 4096)
        for edge in self.border or ():
            _check_integer("border", edge, 0, 1 << 20)
        _check_range("filter width", self.filter_width, 0.01, 10)
        if self.pixel_filter not in ("box", "blackman_harris"):
            raise SettingsError(f"unknown pixel filter {self.pixel_filter!r}: choose box or blackman_harris")

    @property
    def samplers(self) -> dict[str, str]:
        """The sampler of each domain: keys "pixel", "lens", "light", "bsdf"."""
        return {
            "pixel": self.pixel_sampler or self.sampler,
            "lens": self.lens_sampler or self.sampler,
            "light": self.light_sampler or self.sampler,
            "bsdf": self.bsdf_sampler or self.sampler,
        }

    @property
    def sample_count(self) -> int:
        """The samples per pixel that are really taken: the smallest count, not below `samples`, that all can make."""
        count = self.samples
        while (larger := max(SAMPLERS[name].actual_count(count) for name in self.samplers.values())) > count:
            count = larger
        return count

    @property
    def thread_count(self) -> int:
        return self.threads or available_cores()


def available_cores() -> int:
    """The cores that this process may use, which a container or `taskset` can make fewer than the machine has."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _check_integer(name: str, value: int, low: int, high: int) -> None:
    try:
        operator.index(value)
    except TypeError:
        raise SettingsError(f"{name} must be a whole number, not {value!r}") from None
    _check_range(name, value, low, high)


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise SettingsError(f"{name} must be between {low} and {high}, not {value}")
