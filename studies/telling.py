"""How the result of a study is told: tables of its numbers, and pictures of lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter
from numpy.typing import ArrayLike

from identify.output.blocks import Row, TableBlock
from identify.output.numbers import NOTHING, number, pretty, spaced
from studies.drawing import INK, Picture, new_figure, plain_tick

HEIGHT = 2.2  # inches of a row of panels


def tables(found: Any, name: str) -> Iterator[TableBlock]:
    """A table for each group of alike entries of an object of JSON; long columns are left out."""
    items = found if isinstance(found, Mapping) else dict(enumerate(found, 1))
    below = {key: one for key, one in items.items() if isinstance(one, Mapping | list)}
    rows = {
        key: {k: v for k, v in one.items() if not isinstance(v, Mapping | list)}
        for key, one in below.items()
        if isinstance(one, Mapping)
    }
    if any(rows.values()):
        yield table(rows, name)
    for key, one in below.items():
        yield from tables(one, f"{name}, {spaced(str(key))}")


def table(rows: Mapping[Any, Mapping[str, Any]], caption: str) -> TableBlock:
    """Entries by row and column; a column without any entry is left out."""
    known = {k: None for row in rows.values() for k, v in row.items() if v is not None}
    cells = [Row([spaced(str(k)), *(_cell(row.get(c)) for c in known)]) for k, row in rows.items()]
    return TableBlock(["", *map(spaced, known)], cells, caption[:1].upper() + caption[1:])


def _cell(value: Any) -> str:
    if value is None or isinstance(value, str):
        return NOTHING if value is None else pretty(spaced(value)) or "1"
    return str(value).lower() if isinstance(value, bool | int) else number(value)


@dataclass(frozen=True, eq=False)
class Line:
    """Points x, y (n,). half (n,): of their intervals; bars of marks, the band of a line."""

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    color: str = INK
    mark: str = "-"
    half: ArrayLike | None = None
    width: float = 1.2

    def draw(self, axes: Axes) -> None:
        """Into a panel."""
        style: dict[str, Any] = {"color": self.color, "label": self.label or None, "markersize": 4,
                                 "linewidth": self.width}  # fmt: skip
        if self.half is None or self.mark == "-":
            axes.plot(self.x, self.y, self.mark, **style)
        else:
            axes.errorbar(self.x, self.y, self.half, fmt=self.mark, ecolor=INK, elinewidth=0.7,
                          **style)  # fmt: skip
        if self.half is not None and self.mark == "-":
            low, high = np.subtract(self.y, self.half), np.add(self.y, self.half)
            axes.fill_between(self.x, low, high, color=self.color, alpha=0.3, linewidth=0)


class Panel:
    """Lines in one pair of axes. settings: of matplotlib's Axes.set."""

    def __init__(self, *lines: Line, **settings: Any) -> None:
        self.lines, self.settings = lines, settings

    def draw(self, axes: Axes) -> None:
        """Into the axes of a figure."""
        for line in self.lines:
            line.draw(axes)
        axes.set(**self.settings)
        for side in "xy":
            if self.settings.get(f"{side}scale") == "log":
                getattr(axes, f"{side}axis").set_major_formatter(FuncFormatter(plain_tick))
        if any(line.label for line in self.lines):
            axes.legend()


def picture(caption: str, *panels: Panel, across: int = 1, height: float = HEIGHT) -> Picture:
    """Panels row by row, with a sentence that says what to look for."""
    down = -(-len(panels) // across)
    figure = new_figure(height * down)
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        panel.draw(axes)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    return Picture(figure, caption)
