"""The report's pictures of results: lines and bars hold the numbers that their labels name."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import numpy as np
import pytest

from identify.dataset.given_logs import Role
from identify.output.report.drawing import (
    BLUE,
    GREY,
    ORANGE,
    settle,
)
from identify.output.report.effects import draw_growth, draw_ranking
from identify.output.report.residual import draw_dependence, draw_maps
from identify.output.report.subject import Subject
from twin.model.units import LINEAR

RNG = np.random.default_rng(8)


def lines_of(axes):
    """Lines of axes by label."""
    return {line.get_label(): line for line in axes.get_lines()}


def subject_of(diagnosis=None, **changes) -> Subject:
    return Subject("t", diagnosis, changes.get("comparison", made.compared()), made.STEPS, ())


# --- growth, ranking, structure -------------------------------------------------------------


def test_the_growth_runs_from_the_first_error_to_the_last():
    figure = draw_growth(made.STEPS[:2], {Role.TRAINING: 1.17, Role.SELECTION: 1.31})
    (axes,) = figure.axes
    lines = lines_of(axes)
    np.testing.assert_allclose(lines["training logs"].get_ydata(), [7.31, 4.57, 2.29])
    np.testing.assert_allclose(lines["selection logs"].get_ydata(), [7.83, 4.91, 2.71])
    np.testing.assert_allclose(lines["noise floor, training logs"].get_ydata(), 1.17)
    np.testing.assert_allclose(lines["noise floor, selection logs"].get_ydata(), 1.31)
    assert [t.get_text() for t in axes.get_xticklabels()] == [
        "at the start", "+ cogging", "+ lugre",
    ]  # fmt: skip
    assert axes.get_ylabel() == "Force error, RMS (N)"
    assert axes.get_yscale() == "log"
    notes = {t.get_text(): t.xy for t in axes.texts}
    points = {"7.31": (0, 7.31), "4.57": (1, 4.57), "2.71": (2, 2.71), "7.83": (0, 7.83)}
    assert points.items() <= notes.items()
    above = {t.get_text(): t.xyann[1] > 0 for t in axes.texts}
    assert above == {
        "7.31": False, "7.83": True, "4.57": False, "4.91": True, "2.29": False, "2.71": True,
    }  # fmt: skip


def test_of_two_equal_errors_one_number_is_above_and_one_below():
    alike = replace(made.STEPS[0], fit_error_before=3.0, holdout_error_before=3.0)
    (axes,) = draw_growth([alike], {}).axes
    sides = [t.xyann[1] > 0 for t in axes.texts if t.get_text() == "3.00"]
    assert sorted(sides) == [False, True]


def test_without_held_out_errors_there_is_one_line():
    small = replace(made.STEPS[2], fit_error_before=0.0341, fit_error_after=0.0313)
    (axes,) = draw_growth([small], {}).axes
    lines = lines_of(axes)
    assert list(lines) == ["training logs"]
    np.testing.assert_allclose(lines["training logs"].get_ydata(), [34.1, 31.3])
    assert axes.get_ylabel() == "Force error, RMS (mN)"
    assert axes.get_xticklabels()[1].get_text() == "replace wear"
    assert all(t.xyann[1] > 0 for t in axes.texts)


def test_no_error_ends_below_the_floor_that_is_drawn():
    """The history of a file may be of other logs, over another noise."""
    (axes,) = draw_growth(made.STEPS[:2], {Role.TRAINING: 2.30, Role.SELECTION: 2.30}).axes
    assert [n for n in lines_of(axes) if "floor" in n] == ["noise floor, selection logs"]


def test_each_axis_has_floors_of_its_own_those_of_the_final_model_where_it_was_diagnosed():
    axes = made.compared().axes
    for name in "xy":
        assert subject_of().floors(name) == {Role.TRAINING: axes[name].floor}
        found = made.diagnosed()
        assert subject_of(found).floors(name) == found.told[name].floors


def test_a_picture_is_laid_out_on_a_grid_once():
    figure = draw_ranking(made.diagnosis_of(), made.told_of(made.diagnosis_of()))
    settle(figure)
    assert figure.get_layout_engine() is None
    places = [axes.get_position().bounds for axes in figure.axes]
    np.testing.assert_allclose(np.array(places) * 1e4, np.rint(np.array(places) * 1e4), atol=1e-7)


def test_a_bar_for_each_candidate_ends_at_its_error():
    worse = replace(made.WEAK, gain=replace(made.WEAK.gain, after=20.0))
    x = made.diagnosis_of(ranking=(made.BEST, made.RIVAL, worse))
    (axes,) = draw_ranking(x, made.told_of(x)).axes
    bars = axes.patches
    end = 1.6 * 7.13
    assert [b.get_width() for b in bars] == pytest.approx([2.17, 2.38, end])
    assert [t.get_text() for t in axes.get_yticklabels()] == [
        "cogging", "quadratic drag", "constant force",
    ]  # fmt: skip
    assert [t.get_text() for t in axes.texts] == ["2.17", "2.38", "bar cut, 20.0"]
    assert [t.get_position() for t in axes.texts] == [(1.0, 0), (1.0, 1), (1.0, 2)]
    from matplotlib.colors import to_rgba

    assert [b.get_facecolor() for b in bars] == [to_rgba(c) for c in (ORANGE, BLUE, GREY)]
    lines = lines_of(axes)
    assert lines["before"].get_xdata() == pytest.approx([7.13, 7.13])
    assert lines["noise floor"].get_xdata() == pytest.approx([2.17, 2.17])
    assert axes.get_xlabel() == "Selection force error, RMS (N)"
    assert axes.get_xlim() == pytest.approx((0.0, 1.15 * end))
    assert axes.yaxis_inverted()


def test_the_longest_share_is_on_top_and_marked():
    structure = replace(
        made.STRUCTURE,
        depends_on="position",
        shares={"time": 0.117, "position": 0.631, "other_axis_velocity": 0.2},
    )
    units = {"position": "rad", "other_axis_velocity": "m/s"}
    (axes,) = draw_dependence(structure, units).axes
    assert [b.get_width() for b in axes.patches] == pytest.approx([63.1, 20.0, 11.7])
    assert [t.get_text() for t in axes.get_yticklabels()] == [
        "angle", "other axis velocity", "time",
    ]  # fmt: skip
    assert len({b.get_facecolor() for b in axes.patches[1:]}) == 1
    assert axes.patches[0].get_facecolor() != axes.patches[1].get_facecolor()
    assert axes.get_xlim()[1] == pytest.approx(1.1 * 63.1)
    assert axes.yaxis_inverted()


# --- maps -----------------------------------------------------------------------------------


def test_the_map_of_each_coordinate_has_its_error_above_its_noise():
    c = made.comparison_of()
    direction = replace(made.map_of("direction", "1", 0.2))
    point = replace(made.map_of("time", "s", 0.3), low=np.full(3, 0.1))
    spectrum = made.map_of("frequency", "Hz", 0.4)
    figure = draw_maps([*c.maps, direction, point, spectrum], c.units)
    first, second, third = figure.axes
    labels = [a.get_xlabel() for a in figure.axes]
    assert labels == ["Position (mm)", "Speed (mm/s)", "Frequency (Hz)"]
    assert (first.get_xscale(), third.get_xscale()) == ("linear", "log")
    for axes, found, size in ((first, c.maps[0], 1e-3), (second, c.maps[1], 1e-3)):
        noise, error = (p.get_data() for p in axes.patches)
        edges = np.append(found.low, found.high[-1])
        np.testing.assert_allclose(noise.edges, edges / size)
        np.testing.assert_allclose(noise.values, found.floor)
        np.testing.assert_allclose(error.values, np.where(found.visited > 0, found.rms, np.nan))
        assert axes.get_yscale() == "log"
    heights = [round(a.get_subplotspec().rowspan.start) for a in figure.axes]
    assert heights == [0, 0, 0]
    # The last bin of the first map was never visited: its error sets no limit, its noise does.
    lowest = min(m.floor.min() for m in c.maps)
    assert first.get_ylim()[0] == pytest.approx(0.5 * lowest)
    assert first.get_ylabel() == "RMS error (N)"


def test_standstill_is_named_not_numbered():
    rest = replace(
        made.map_of("standstill", "1", 0.0), low=np.array([-0.5, 0.5]), high=np.array([0.5, 1.5]),
        rms=np.array([0.2, 0.3]), floor=np.array([0.1, 0.1]), visited=np.ones(2),
    )  # fmt: skip
    (axes,) = draw_maps([rest], LINEAR).axes
    assert [t.get_text() for t in axes.get_xticklabels()] == ["moving", "at rest"]


def test_the_least_error_of_a_bin_that_was_visited_sets_the_limit():
    low = replace(made.comparison_of().maps[0], rms=np.array([0.011, 0.5, 0.0013]))
    figure = draw_maps([low], LINEAR)
    assert figure.axes[0].get_ylim()[0] == pytest.approx(0.5 * 0.011)
