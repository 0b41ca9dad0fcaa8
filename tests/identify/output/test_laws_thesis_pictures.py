"""Pages of the reproduced study: the chapters that are tables beside pictures."""

from __future__ import annotations

from dataclasses import replace

import built_chapters as made
import chapter_pages
import numpy as np
import pytest
from chapter_pages import Page, drawn, holds

from identify.output.report.drawing import BLUE, ORANGE
from identify.output.report.thesis import simulation as simulation_page
from identify.output.report.thesis import twin as twin_page
from identify.output.report.units import number, percent, pretty, with_minus


@pytest.fixture(scope="module")
def pages() -> dict[str, Page]:
    return chapter_pages.pages()


def test_the_simulation_study_beside_the_printed_means(pages) -> None:
    page, result = pages["simulation"], made.SIMULATION
    assert page.tiles == {
        "largest error of a mean": "3 %", "of sigma2 in the thesis": "0.56 %", "trials": "2",
    }  # fmt: skip
    assert page.remarks == ["v0, here", "printed mean", "at 60 dB"]
    rows = {}
    for name, planted, thesis, mean, sd, error, off in page.cells(0):
        rows[name] = (planted, thesis, mean, sd, error, off)
    for name, r in result.parameters.items():
        unit = pretty(r.unit).replace("/", "\u2060/\u2060")
        mean, sd = np.mean(r.values), np.std(r.values, ddof=1)
        assert rows[f"{name} ({unit})"] == (
            f"{r.true:g}", "–" if r.printed is None else f"{r.printed:.4f}", f"{mean:.6g}",
            number(sd), percent(mean / r.true - 1.0, 4),
            "–" if r.printed is None else percent((r.printed - r.true) / r.true, 4),
        )  # fmt: skip


def test_the_pictures_of_the_simulation_study(pages) -> None:
    result = made.SIMULATION
    curve, trials, growth, sensitivity = (f.axes for f in pages["simulation"].figures)
    v, f = result.map.velocity, result.map.friction
    holds(curve[0], "forwards", v[[0, 4, 2]], f[[0, 4, 2]], BLUE)
    holds(curve[0], "backwards", -v[[1, 3]], f[[1, 3]], ORANGE)
    speed, friction, _ = drawn(curve[0], "planted")
    assert (speed.min(), speed.max()) == pytest.approx((0.01, 0.2))
    np.testing.assert_allclose(friction, result.true(speed))
    assert [axes.get_title("left") for axes in trials] == list(result.parameters)
    for name, r in result.parameters.items():
        errors = [100.0 * np.sqrt(np.mean((by[name].values / r.true - 1.0) ** 2))
                  for by in result.by_snr.values()]  # fmt: skip
        holds(growth[0], name, list(result.by_snr), errors)
    assert growth[0].xaxis_inverted()
    for axes, names in zip(sensitivity, (simulation_page.STATIC, simulation_page.DYNAMIC),
                           strict=True):  # fmt: skip
        assert [line.get_label() for line in axes.get_lines()] == list(names)
        for name in names:
            holds(axes, name, result.sensitivity.factors, 1e3 * result.sensitivity.force[name])


@pytest.mark.parametrize(("size", "unit", "part"), [(0.9e-3, "ppm", 1e-6), (1.1e-3, "%", 1e-2)])
def test_a_histogram_of_trials_is_of_parts_of_the_planted_value(size, unit, part) -> None:
    from matplotlib.figure import Figure

    r = made.recovered("N", size, -0.5 * size, 0.2 * size, true=4.0, printed=4.0 * (1 + size / 2))
    axes = Figure().subplots()
    simulation_page._histogram(axes, "Fc", r)
    assert f"({unit})" in axes.get_xlabel()
    left, right = axes.patches[0].get_x(), axes.patches[-1].get_x() + axes.patches[-1].get_width()
    assert (left, right) == pytest.approx((-0.5 * size / part, size / part))
    planted, printed = axes.get_lines()
    assert set(planted.get_xdata()) == {0.0}
    assert printed.get_xdata()[0] == pytest.approx(size / 2 / part)
    far = made.recovered("N", size, -size, true=4.0, printed=4.0 * (1.0 + 3.0 * size))
    axes = Figure().subplots()
    simulation_page._histogram(axes, "Fc", far)
    assert len(axes.get_lines()) == 1


def test_the_parameters_along_the_track_by_direction_and_way(pages) -> None:
    page, result = pages["track"], made.TRACK
    assert page.tiles == {
        "Fc, thesis's map": "5 %", "Fs, thesis's map": "6 %", "Fc, fit": "0.5 %",
        "Fs, fit": "0.6 %",
    }  # fmt: skip
    assert page.answer.headline.endswith("within 0.6 %")
    for figure, way in zip(page.figures, (1.0, -1.0), strict=True):
        assert [axes.get_title("left") for axes in figure.axes] == list(made.UNITS)
        for axes, (name, unit) in zip(figure.axes, made.UNITS.items(), strict=True):
            assert axes.get_ylabel() == f"{name} ({pretty(unit)})"
            mapped, fitted = result.maps[way][name], result.fits[way][name]
            planted = next(line for line in axes.get_lines() if line.get_linewidth() == 3.0)
            np.testing.assert_allclose(planted.get_xdata(), 1e3 * made.PLACES)
            np.testing.assert_allclose(planted.get_ydata(), mapped.planted)
            for bars, found, side in zip(axes.containers, (mapped, fitted), (-1, 1), strict=True):
                points, _, (ends,) = bars
                np.testing.assert_allclose(points.get_xdata(), 1e3 * made.PLACES + 0.75 * side)
                np.testing.assert_allclose(points.get_ydata(), found.found)
                half = np.array([np.ptp(s[:, 1]) for s in ends.get_segments()]) / 2.0
                np.testing.assert_allclose(half, found.half)


def test_machine_and_twin_side_by_side(pages) -> None:
    page, result = pages["twin"], made.TWIN
    assert page.answer.headline == "Machine and twin agree"
    assert page.tiles == {
        "closed loop, position": "0.00230 %", "closed loop, velocity": "0.410 %",
        "closed loop, acceleration": "11.7 %", "closed loop, force": "5.30 %",
    }  # fmt: skip
    assert page.answer.remarks == ["Of a machine with 0.153 kg more these differ: p0, p2."]
    same = result.alike.axes["x"].differences
    assert page.cells(0) == [
        (d.label, f"{d.a:.6g}", f"{d.b:.6g}", number(d.standard_error), pretty(d.unit))
        for d in same
    ]
    for axes, ratios in zip(page.figures[0].axes, ((0.7, -1.9, 2.3), (8.0, -1.3, -4.7)),
                            strict=True):  # fmt: skip
        marks = next(line for line in axes.get_lines() if line.get_marker() == "o")
        np.testing.assert_allclose(marks.get_xdata(), ratios)  # at the edge where beyond
        np.testing.assert_allclose(marks.get_ydata(), [2, 1, 0])
        labels = dict(zip(axes.get_yticks(), axes.get_yticklabels(), strict=True))
        assert [labels[i].get_text() for i in (2, 1, 0)] == ["p0", "p1", "p2"]
        allowed = axes.patches[0]
        assert (allowed.get_x(), allowed.get_width()) == pytest.approx((-3.1, 6.2))
        assert axes.get_xlim() == pytest.approx((-8.8, 8.8))
    differing = replace(result, alike=result.changed)
    assert Page(differing).answer.headline == "Machine and twin differ"
    assert twin_page._differences(result.alike) == list(same)
    assert with_minus("-1") == "−1"
