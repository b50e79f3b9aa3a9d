"""Plates: pictures in rows with their captions, laid out to the dot.

A picture enlarged by anything but a whole number gets rows and columns of unequal width: the printed page would alias
by itself. So all is measured in dots of the PNG, and a pixel is `scale` × `scale` of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Rectangle
from matplotlib.textpath import text_to_path

from . import style
from .tone import display

#: All in dots: a panel's usual width, the margin around a plate, the gap between panels, a line of text, a frame.
PANEL, MARGIN, GAP, LINE, FRAME = 384, 30, 30, 30, 2
#: Of all text, in points.
TEXT_SIZE = 7
#: What is pointed out, in a colour that no sampler has.
HIGHLIGHT = "#E6007E"


@dataclass(frozen=True)
class Panel:
    """A part of a plate, `width` × `height` dots, that `draw` fills; `lines` stand below it, the first one bold."""

    width: int
    height: int
    lines: tuple[str, ...]
    draw: Callable[[Axes], None]
    framed: bool = True


def picture_panel(
    picture: np.ndarray, *lines: str, width: int = PANEL, decorate: Callable[[Axes], None] | None = None
) -> Panel:
    """A panel that shows a linear picture (h, w, 3), bottom row first, each pixel as large as `width` dots allow."""
    rows, columns = picture.shape[:2]
    scale = max(1, width // columns)

    def draw(axes: Axes) -> None:
        # "none" is nearest-neighbour, and in an SVG the pixels themselves, marked to be shown as squares.
        axes.imshow(display(picture), interpolation="none", aspect="auto", extent=(0, columns, 0, rows))
        if decorate is not None:
            decorate(axes)

    return Panel(columns * scale, rows * scale, lines, draw)


@dataclass(frozen=True)
class Plate:
    """A figure: `rows` of panels over a caption. `numbers` is all that it states, for the JSON."""

    name: str
    rows: Sequence[Sequence[Panel]]
    caption: str
    numbers: dict[str, object]

    @property
    def width(self) -> int:
        return 2 * MARGIN + max(sum(panel.width for panel in row) + GAP * (len(row) - 1) for row in self.rows)

    @property
    def height(self) -> int:
        rows = sum(_row_height(row) + GAP for row in self.rows)
        return 2 * MARGIN + rows + LINE * len(self._caption_lines())

    def figure(self) -> Figure:
        return sheet([self], [(0, 0)])

    def draw(self, page: Page) -> None:
        y = MARGIN
        for row in self.rows:
            x = MARGIN
            for panel in row:
                axes = page.axes(x, y, panel.width, panel.height)
                if panel.framed:
                    page.frame(x, y, panel.width, panel.height)
                panel.draw(axes)
                for number, line in enumerate(panel.lines):
                    weight = "bold" if number == 0 else "normal"
                    page.text(x, y + panel.height + LINE * (number + 1), line, weight)
                x += panel.width + GAP
            y += _row_height(row) + GAP
        for number, line in enumerate(self._caption_lines()):
            page.text(MARGIN, y + LINE * number + LINE // 2, line)

    def _caption_lines(self) -> list[str]:
        return wrap(self.caption, self.width - 2 * MARGIN)


def wrap(text: str, width: float) -> list[str]:
    """The lines into which `text` breaks, at plain spaces, to be at most `width` dots wide."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip(" ")
        if lines[-1] and text_width(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def text_width(text: str) -> float:
    """The width of plain text in dots."""
    font = FontProperties(family=style.RC["font.family"], size=TEXT_SIZE)
    points, _, _ = text_to_path.get_text_width_height_descent(text, font, ismath=False)
    return points * style.DPI / 72


def _row_height(row: Sequence[Panel]) -> int:
    return max(panel.height + LINE * len(panel.lines) for panel in row)


@dataclass(frozen=True)
class Page:
    """The part of `figure` to the right of and below (`left`, `top`), in dots."""

    figure: Figure
    left: int
    top: int

    def axes(self, x: int, y: int, width: int, height: int) -> Axes:
        """Empty axes without ticks."""
        axes = self.figure.add_axes(self._share(x, y, width, height))
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_visible(False)
        return axes

    def frame(self, x: int, y: int, width: int, height: int) -> None:
        """A frame around a rectangle that covers nothing of it: only what is drawn outside of the axes is seen."""
        left, bottom, *size = self._share(x - FRAME, y - FRAME, width + 2 * FRAME, height + 2 * FRAME)
        self.figure.add_artist(Rectangle((left, bottom), *size, color=style.INK, linewidth=0, zorder=-1))

    def text(self, x: int, y: int, text: str, weight: str = "normal") -> None:
        left, bottom, _, _ = self._share(x, y, 0, 0)
        self.figure.text(left, bottom, text, size=TEXT_SIZE, weight=weight, va="center", ha="left")

    def _share(self, x: int, y: int, width: int, height: int) -> tuple[float, float, float, float]:
        """matplotlib's (left, bottom, width, height) as shares of the figure."""
        across, down = self.figure.bbox.size / self.figure.dpi * style.DPI
        bottom = down - self.top - y - height
        return (self.left + x) / across, bottom / down, width / across, height / down


def sheet(plates: Sequence[Plate], corners: Sequence[tuple[int, int]]) -> Figure:
    """A figure with all `plates`, the upper left corner of each at its (x, y) of `corners`."""
    width = max(x + plate.width for plate, (x, _) in zip(plates, corners, strict=True))
    height = max(y + plate.height for plate, (_, y) in zip(plates, corners, strict=True))
    with style.drawing():
        figure = style.figure(width / style.DPI * style.CM_PER_INCH, height / style.DPI * style.CM_PER_INCH)
        figure.set_layout_engine("none")  # it would move what is placed to the dot
        for plate, (x, y) in zip(plates, corners, strict=True):
            plate.draw(Page(figure, x, y))
    return figure


def in_grid(rows: Sequence[Sequence[Plate]]) -> Iterator[tuple[Plate, tuple[int, int]]]:
    """Each plate of `rows`, which have as many plates each, and the corner where it goes on a sheet."""
    widths = [max(plate.width for plate in column) for column in zip(*rows, strict=True)]
    y = 0
    for row in rows:
        for number, plate in enumerate(row):
            yield plate, (sum(widths[:number]), y)
        y += max(plate.height for plate in row)
