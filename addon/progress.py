"""What the status line says of a render: what is being done, how far it is, how fast, and how long it will take."""

from __future__ import annotations

import time

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core

#: Translations of the samplers' names stand under this: Blender knows some of the words in another sense.
SAMPLERS_CONTEXT = "Rooks Samplers"
#: What the user knows the domains as.
DOMAIN_LABELS = {"pixel": n_("pixel"), "lens": n_("lens"), "light": n_("light"), "bsdf": n_("surface")}


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
        memory = iface_("{megabytes:.0f} MB").format(megabytes=self._tile.memory / 1e6)
        parts = [self.intention, memory, iface_("{done} of {total} tiles").format(done=done, total=total)]
        seconds = time.monotonic() - self._started
        if self._pixels > 0 and seconds > 0:
            left = clock_text(seconds / (done - 1) * (total - done))
            parts += [speed_text(self._pixels * self._samples / seconds), iface_("{time} left").format(time=left)]
        return ", ".join(parts)

    def finished(self, film: core.Film) -> str:
        """What has been done in the end."""
        outcome = iface_("stopped") if film.cancelled else speed_text(film.samples_per_second)
        return f"{self.intention}, {outcome}"


def speed_text(samples_per_second: float) -> str:
    return iface_("{millions:.1f} million samples/s").format(millions=samples_per_second / 1e6)


def finished_lines(film: core.Film) -> list[str]:
    """What is worth knowing of a render that is over, a line each."""
    times = iface_("Last render: {setup:.1f} s to set up, {trace:.1f} s to trace").format(
        setup=film.setup_seconds, trace=film.seconds
    )
    if film.cancelled:
        share = film.finished_pixels / (film.width * film.height)
        times += ", " + iface_("stopped at {share:.0%}").format(share=share)
    memory = iface_("Memory: {megabytes:.0f} MB and the picture's own").format(megabytes=film.memory / 1e6)
    return [times, memory, *losses(film)]


def losses(film: core.Film | core.progressive.Progressive) -> list[str]:
    """What of the picture could not be kept as it was computed."""
    found = []
    if film.dropped_samples:
        text = rpt_("{count} samples were not finite numbers and were left out")
        found.append(text.format(count=film.dropped_samples))
    if film.negative_pixels:
        text = rpt_("{count} pixels were negative, by lamps or emission below 0, and are black instead")
        found.append(text.format(count=film.negative_pixels))
    if film.blocked_samples:
        text = rpt_(
            "{count} samples passed as many transparent surfaces as Light Paths allow, and see the next one black: "
            "raise Transparent there"
        )
        found.append(text.format(count=film.blocked_samples))
    return found


def clock_text(seconds: float) -> str:
    """Minutes and seconds, hours where there are any: 1:05 or 2:00:00."""
    minutes, second = divmod(round(seconds), 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours}:{minute:02}:{second:02}" if hours else f"{minute}:{second:02}"


def sampler_label(name: str) -> str:
    return iface_(core.samplers.SAMPLERS[name].label, SAMPLERS_CONTEXT)


def sampler_text(settings: core.settings.RenderSettings) -> str:
    """The samplers by their names: one, or one for each domain."""
    labels = {domain: sampler_label(name) for domain, name in settings.samplers.items()}
    if len(set(labels.values())) == 1:
        return labels["pixel"]
    return ", ".join(f"{label} ({iface_(DOMAIN_LABELS[domain])})" for domain, label in labels.items())


def sample_text(settings: core.settings.RenderSettings) -> str:
    """The samples per pixel that are taken, and those asked for where they differ."""
    taken = settings.sample_count
    text = iface_("1 sample per pixel") if taken == 1 else iface_("{count} samples per pixel").format(count=taken)
    if taken == settings.samples:
        return text
    return f"{text} ({iface_('{count} asked for').format(count=settings.samples)})"
