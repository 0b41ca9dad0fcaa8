"""The look of the pictures of a study, and their way into the page.

Figures are made without pyplot, so that no global state and no display is involved.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from identify.output.blocks import Block

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

Array = NDArray[np.float64]

INK = "#1b2a38"
MEASURED = "#a9b4bf"
BLUE = "#2f6db3"  # the model
ORANGE = "#d9722e"  # the model with the named effect
GREY = "#8996a3"
FLOOR = "#c9d1d9"  # noise floor, as a band
WIDTH = 9.6  # in, all pictures
RESOLUTION = 170  # dots per inch of what is rasterised

STYLE: dict[RcKeyType, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["Segoe UI", "Helvetica Neue", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 9.0,
    "text.color": INK,
    "text.parse_math": False,  # a name with a dollar sign is a name
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#e7ebef",
    "grid.linewidth": 0.7,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "svg.fonttype": "none",
    "svg.hashsalt": "twin",  # the same report is the same file
}


@dataclass(frozen=True, eq=False)
class Picture(Block):
    """A figure on a page, with a sentence that says what to look for."""

    figure: Figure
    caption: str

    @property
    def uri(self) -> str:
        """The figure as a link that holds it."""
        return data_uri(self.figure)


@contextmanager
def drawing_style() -> Iterator[None]:
    """Inside, figures are made and rendered in the style of a page."""
    with matplotlib.rc_context(STYLE):
        yield


def new_figure(height: float) -> Figure:
    """An empty figure of the page's width; height in inches."""
    return Figure(figsize=(WIDTH, height))


def data_uri(figure: Figure) -> str:
    """The figure as an SVG picture inside a link, without date and without outside references."""
    settle(figure)
    buffer = io.BytesIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    figure.savefig(buffer, format="svg", dpi=RESOLUTION, metadata=nothing)
    content = buffer.getvalue()
    # What comes before refers to the document type on the web.
    content = content[content.index(b"<svg") :]
    return "data:image/svg+xml;base64," + base64.b64encode(content).decode("ascii")


def settle(figure: Figure) -> None:
    """Lay the figure out, once, on a grid: the solver's last digits differ from run to run.

    A figure that has a layout engine would be drawn three times, twice of them to lay it out.
    """
    ConstrainedLayoutEngine().execute(figure)
    for axes in figure.axes:
        axes.set_position(tuple(np.round(axes.get_position().bounds, 4)))


def plain_tick(value: float, _: int) -> str:
    """Label of a logarithmic scale without mathematical notation, which is not parsed."""
    return f"{value:g}"
