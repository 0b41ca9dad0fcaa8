"""How a result is told: plain tables of alike entries, pictures whose lines are data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from matplotlib.figure import Figure

from identify.output.answers import plain
from studies.drawing import BLUE, drawing_style
from studies.telling import Line, Panel, picture, tables


def readable(figure: Figure) -> None:
    """Every line and mark can be seen, and a row of axes is neither flat nor tall."""
    rows = max((axes.get_subplotspec().get_gridspec().nrows for axes in figure.axes), default=1)
    assert 0.9 <= figure.get_figheight() / rows <= 4.3, "inches a row"
    for axes in figure.axes:
        for line in axes.get_lines():
            drawn = line.get_linestyle() != "None"
            marked = line.get_marker() not in ("None", None, "")
            assert drawn or marked
            assert not drawn or 0.4 <= line.get_linewidth() <= 5.0
            assert not marked or 2.0 <= line.get_markersize() <= 7.0
        for artist in (*axes.get_lines(), *axes.collections, *axes.patches):
            assert artist.get_alpha() is None or 0.1 <= artist.get_alpha() <= 1.0


@dataclass(frozen=True)
class Spike:
    centre: float
    width: float


FOUND = {
    "trials": np.int64(3), "position": np.array([0.1, 0.2]), "unit": "m",
    "parameters": {
        "sigma0": {"true": 260.0, "mean": 259.99, "printed": None, "unit": "N/m"},
        "sigma1": {"true": 0.6, "mean": -0.0612, "printed": None, "unit": "N s/m"},
    },
    "spikes": (Spike(0.011, 0.002), Spike(-0.022, 0.0019)),
    "white": {"first_fit": {"passes": True, "over": np.array([1.0, 2.0])}},
}  # fmt: skip


def test_alike_entries_are_a_table_each() -> None:
    parameters, spikes, white = tables(plain(FOUND), "cable")
    assert [*parameters.titles] == ["", "true", "mean", "unit"]
    assert [tuple(row.cells) for row in parameters.rows] == [
        ("sigma0", "260", "260", "N/m"), ("sigma1", "0.600", "-0.0612", "N·s/m"),
    ]  # fmt: skip
    assert [tuple(row.cells) for row in spikes.rows] == [
        ("1", "0.0110", "0.00200"), ("2", "-0.0220", "0.00190")
    ]  # fmt: skip
    assert (parameters.caption, spikes.caption) == ("Cable, parameters", "Cable, spikes")
    assert [tuple(row.cells) for row in white.rows] == [("first fit", "true")]


def test_a_picture_draws_its_lines_under_their_names() -> None:
    x, y = np.arange(1.0, 5.0), np.array([1.0, 10.0, 100.0, 1000.0])
    with drawing_style():
        one = Panel(Line(x, y, "found", BLUE, half=0.1 * y), xlabel="Speed (m/s)", yscale="log")
        other = Panel(Line(x, y, "marks", BLUE, "o", 0.1 * y))
        figure = picture("Look.", one, other, Panel(Line(x, y)), across=2).figure
    readable(figure)
    first, second, third, hidden = figure.axes
    (line,) = first.get_lines()
    np.testing.assert_array_equal(line.get_data(), [x, y])
    assert (line.get_label(), line.get_color()) == ("found", BLUE)
    assert first.get_xlabel() == "Speed (m/s)"
    band = first.collections[0].get_paths()[0].vertices
    assert (band[:, 1].min(), band[:, 1].max()) == pytest.approx((0.9, 1100.0))
    assert len(second.containers) == 1  # with bars
    assert third.get_legend() is None
    assert not hidden.get_visible()
    ticks = [label.get_text() for label in first.get_yticklabels()]
    assert "100" in ticks
