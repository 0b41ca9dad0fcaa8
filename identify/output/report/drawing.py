"""The look of all pictures, and their way into the page.

Figures are made without pyplot, so that no global state and no display is involved.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

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


@contextmanager
def drawing_style() -> Iterator[None]:
    """Inside, figures are made and rendered in the style of the report."""
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


def plain_decades(axis: Axis) -> None:
    """A logarithmic axis with a plain number at each decade."""
    axis.set_major_locator(LogLocator(subs=(1.0,)))
    axis.set_major_formatter(FuncFormatter(plain_tick))
    axis.set_minor_locator(NullLocator())


def draw_bars(
    axes: Axes, names: Sequence[str], lengths: Sequence[float], colors: Sequence[str]
) -> BarContainer:
    """Horizontal bars beside their names, the first at the top."""
    bars = axes.barh(names, lengths, color=colors, height=0.62)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    return bars


def noise_band(axes: Axes, floor: float) -> None:
    """The noise floor (RMS) as a band about zero."""
    axes.axhspan(-floor, floor, color=FLOOR, alpha=0.7, linewidth=0, label="noise floor (± RMS)")


def binned_mean(x: Array, y: Array) -> tuple[Array, Array]:
    """Bin centres (k,) and means (k,) of y over bins of equal width of x; nan where few are.

    x, y (n,); a y that is not a number is left out.
    """
    known = np.isfinite(y)
    x, y = x[known], y[known]
    if not len(x):
        return x, y
    bins = int(np.clip(len(x) // SAMPLES_A_BIN, *BINS))
    edges = np.linspace(x.min(), x.max(), bins + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    mean = np.bincount(index, y, bins) / np.maximum(count, 1)
    return 0.5 * (edges[1:] + edges[:-1]), np.where(count >= LEAST_IN_BIN, mean, np.nan)


SAMPLES_A_BIN = 25  # on average
BINS = (20, 140)  # fewest and most
LEAST_IN_BIN = 4  # samples below which a mean says little


def symmetric_limit(floor: float, *values: Array) -> float:
    """Limit (N) that shows the noise and all but the two in a thousand furthest from zero."""
    joined = np.abs(np.concatenate(values))
    known = joined[np.isfinite(joined)]
    reach = 1.15 * np.quantile(known, 0.998) if len(known) else 0.0
    return float(max(reach, 1.3 * floor, SMALLEST_LIMIT))


SMALLEST_LIMIT = 1e-12  # N
