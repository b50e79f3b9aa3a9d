"""What the status line says of a render: what is being done, how far it is, how fast, and how long it will take."""

from __future__ import annotations

import time

from ._core import core


class Progress:
    """Follows the tiles of one render."""

    def __init__(self, settings: core.settings.RenderSettings) -> None:
        self.intention = f"{sampler_text(settings)}, {sample_text(settings)}"
        self._samples = settings.sample_count
        self._pixels = 0
        self._started = 0.0
        self._tile: core.Tile | None = None

    def add(self, tile: core.Tile) -> None:
        """A tile is finished. Time counts from the first one on, which had to wait for the kernels."""
        if self._tile is None:
            self._started = time.monotonic()
        else:
            self._pixels += tile.width * tile.height
        self._tile = tile

    @property
    def text(self) -> str:
        """What has been done so far, and what is left to do."""
        if self._tile is None:
            return self.intention
        done, total = self._tile.done, self._tile.total
        text = f"{self.intention}, {done} of {total} tiles"
        seconds = time.monotonic() - self._started
        if self._pixels == 0 or seconds == 0:
            return text
        left = seconds / (done - 1) * (total - done)
        return f"{text}, {speed_text(self._pixels * self._samples / seconds)}, {clock_text(left)} left"

    def finished(self, film: core.Film) -> str:
        """What has been done in the end."""
        return f"{self.intention}, {'stopped' if film.cancelled else speed_text(film.samples_per_second)}"


def speed_text(samples_per_second: float) -> str:
    return f"{samples_per_second / 1e6:.1f} million samples/s"


def finished_lines(film: core.Film) -> list[str]:
    """What is worth knowing of a render that is over, a line each."""
    share = film.finished_pixels / (film.width * film.height)
    stopped = f", stopped at {share:.0%}" if film.cancelled else ""
    return [
        f"Last render: {film.setup_seconds:.1f} s to set up, {film.seconds:.1f} s to trace{stopped}",
        f"Memory: {film.memory / 1e6:.0f} MB and the picture's own",
    ]


def clock_text(seconds: float) -> str:
    """Minutes and seconds, hours where there are any: 1:05 or 2:00:00."""
    minutes, second = divmod(round(seconds), 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours}:{minute:02}:{second:02}" if hours else f"{minute}:{second:02}"


def sampler_text(settings: core.settings.RenderSettings) -> str:
    """The samplers by their names: one, or one for each domain."""
    labels = {domain: core.samplers.SAMPLERS[name].label for domain, name in settings.samplers.items()}
    if len(set(labels.values())) == 1:
        return labels["pixel"]
    return ", ".join(f"{label} ({domain})" for domain, label in labels.items())


def sample_text(settings: core.settings.RenderSettings) -> str:
    """The samples per pixel that are taken, and those asked for where they differ."""
    taken = settings.sample_count
    asked = "" if taken == settings.samples else f" ({settings.samples} asked for)"
    return f"{taken} sample{'s' * (taken != 1)} per pixel{asked}"
