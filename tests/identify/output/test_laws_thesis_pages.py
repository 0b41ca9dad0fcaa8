"""Pages of the reproduced study: each number of a chapter's result arrives in its own place."""

from __future__ import annotations

from dataclasses import replace

import built_chapters as made
import chapter_pages
import numpy as np
import pytest
from chapter_pages import Page, band, holds
from report_cases import readable

from identify.output.report.blocks import Tone
from identify.output.report.drawing import BLUE, ORANGE, drawing_style
from identify.output.report.thesis import models as models_page
from identify.output.report.thesis import residuals as residuals_page
from identify.output.report.units import number, percent, quantity


@pytest.fixture(scope="module")
def pages() -> dict[str, Page]:
    return chapter_pages.pages()


def test_every_chapter_has_its_section_under_its_own_name(pages) -> None:
    assert {name: page.section.anchor for name, page in pages.items()} == {
        name: name for name in made.CHAPTERS
    }


def test_every_picture_can_be_read(pages) -> None:
    for page in pages.values():
        for figure in page.figures:
            readable(figure)
            for legend in (*figure.legends, *(axes.get_legend() for axes in figure.axes)):
                if legend is not None:
                    assert legend._ncols in (1, len(legend.get_texts())), "one row, or one column"


def test_the_cables_numbers_and_its_bands(pages) -> None:
    page, found, result = pages["cable"], made.CABLE_FOUND, made.CABLE
    error = found.force - result.planted
    assert page.tiles["RMS error"] == quantity(np.sqrt(np.mean(error**2)), "N")
    with_all = np.sqrt(np.mean((found.with_all - result.planted) ** 2))
    assert page.tiles["with the spikes in"] == quantity(with_all, "N")
    within = np.mean(np.abs(error) <= found.band)
    assert 0.0 < within < 1.0
    assert page.tiles["inside the 90 % band"] == f"{100 * within:.0f} %"
    assert page.tiles["pitch of the spikes"] == "34.068 mm"
    assert page.remarks[-1] == "+0.0680 mm off the planted one"
    assert page.cells(0) == [
        ("1", "11.30", "2.10", "31.00", "17.00"), ("2", "−22.70", "1.90", "23.00", "−13.00"),
    ]  # fmt: skip
    place = 1e3 * found.position
    upper, lower = page.figures[0].axes
    holds(upper, "forwards", place, found.passes.forwards.mean(axis=0))
    holds(lower, "backwards", place, found.passes.backwards.mean(axis=0))
    for axes in (upper, lower):  # a spike is shaded: the two places together, and the lone one
        shaded = np.concatenate([p.vertices[:, 0] for p in axes.collections[0].get_paths()])
        assert set(np.round(shaded, 9)) <= set(np.round(place[~found.kept], 9))
    upper, lower = page.figures[1].axes
    holds(upper, "planted", place, result.planted)
    holds(upper, "found", place, found.force)
    holds(lower, "error", place, 1e3 * error)
    holds(lower, "spikes left in", place, 1e3 * (found.with_all - result.planted))
    assert {tuple(c) for c in np.round(band(lower), 6)} == {
        tuple(np.round((x, y), 6)) for side in (-1, 1)
        for x, y in zip(place, 1e3 * (error + side * found.band), strict=True)
    }  # fmt: skip
    reach = max(np.abs(line.get_ydata()).max() for line in lower.get_lines())
    reach = 1.1 * max(reach, np.abs(band(lower)[:, 1]).max())
    assert lower.get_ylim() == pytest.approx((-reach, reach))


def test_the_cable_of_real_passes_is_drawn_within_its_band() -> None:
    page, found = Page(made.CABLE_OF_LOGS), made.CABLE_FOUND
    assert page.answer.tiles == []
    assert "3 passes each way over 240 mm" in page.answer.sentence
    (axes,) = page.figures[1].axes
    holds(axes, "found", 1e3 * found.position, found.force)
    assert {tuple(c) for c in np.round(band(axes), 9)} == {
        tuple(np.round((1e3 * x, f + side * b), 9)) for side in (-1, 1)
        for x, f, b in zip(found.position, found.force, found.band, strict=True)
    }  # fmt: skip


def test_the_dynamic_parts_by_both_ways_and_the_motion(pages) -> None:
    page, result = pages["dynamic"], made.DYNAMIC
    assert page.tiles == {
        "first period, from rest": "0.510 mm", "beginning estimated": "17.0 nm",
        "sigma0": "+0.050 %", "sigma1": "+0.550 %",
    }  # fmt: skip
    assert page.heads(0)[3:] == ["90 % interval of sigma0", "90 % interval of sigma1"]
    shut, opened = page.cells(0)
    assert shut[1:] == ("12.3 mN", "45.7 mN", "± 310 %", "± 770 %")
    assert opened[1:] == ("211 mN", "45.9 mN", "± 1.30 %", "± 2.90 %")
    assert ("closed" in shut[0], "open" in opened[0]) == (True, True)
    assert page.cells(1) == [
        ("sigma0 (N/m)", "260", "252.2 to 278.2", "259.74 to 260.52"),
        ("sigma1 (N·s/m)", "0.6", "0.9 to 1.14", "0.6024 to 0.6042"),
    ]
    assert "2 places" in page.tables[1].caption
    t = result.trace
    upper, middle, lower = page.figures[0].axes
    mean = t.measured.mean()
    holds(upper, "measured", t.time, 1e3 * (t.measured - mean))
    holds(upper, "from rest", t.time, 1e3 * (t.from_rest - mean), ORANGE)
    holds(upper, "beginning estimated", t.time, 1e3 * (t.from_estimate - mean), BLUE)
    for axes, motion, size in ((middle, t.from_rest, 1e3), (lower, t.from_estimate, 1e9)):
        error, end = axes.get_lines()
        np.testing.assert_allclose(error.get_ydata(), size * (motion - t.measured))
        assert set(end.get_xdata()) == {3.0}  # the period of the thesis's sine
    reach = 1.1e3 * np.abs(t.from_rest - t.measured).max()
    assert middle.get_ylim() == pytest.approx((-reach, reach))


def test_one_place_has_no_range() -> None:
    one = replace(made.DYNAMIC, fitted={"sigma0": made.recovered("N/m", 0.1, true=-20.0)})
    assert Page(one).cells(1) == [("sigma0 (N/m)", "-20", "252.2 to 278.2", "−22")]


def test_the_numbers_of_future_work(pages) -> None:
    page, result = pages["future"], made.FUTURE
    assert page.tiles == {
        "elements": "4", "with physics": "2.27 mN", "drift": "2.10 mN/m",
    }  # fmt: skip
    assert page.remarks == ["chosen, of 4 planted", "RMS on the test log", "± 200 µN/m, warm"]
    assert page.cells(0) == [
        ("1", "0", "7.30"), ("4", "913", "1.07"), ("6", "871", "1.11"),
    ]  # fmt: skip
    assert [r.tone for r in page.tables[0].rows] == [Tone.PLAIN, Tone.STRONG, Tone.PLAIN]
    assert page.cells(1) == [
        ("lugre", "0", "41.3 mN", "43.7 mN", number(0.0437 / 0.00211)),
        ("with empirical map", "31", "27.9 mN", "29.1 mN", number(0.0291 / 0.00211)),
        ("with learned residual", "27", "25.3 mN", "26.7 mN", number(0.0267 / 0.00211)),
        ("gms in its place", "3", "2.13 mN", "2.27 mN", number(0.00227 / 0.00211)),
    ]
    s = result.slow
    assert page.cells(2) == [
        (quantity(v, "m/s"), quantity(t, "N"), quantity(m, "N"), percent((m - t) / t, 2),
         quantity(f, "N"), percent((f - t) / t, 2))
        for v, t, m, f in zip(s.speed, s.planted, s.mapped, s.fitted, strict=True)
    ]  # fmt: skip
    assert page.cells(3) == [
        ("wear.rate (1/m)", "0.002", "0.00206", "± 0.000130"),
        ("thermal_drift.share (1)", "0.25", "0.24", "–"),
    ]  # fmt: skip
    assert "1.17 times the noise floor" in page.tables[3].caption


def test_a_drift_is_drawn_with_its_intervals_and_its_truth(pages) -> None:
    (axes,) = pages["future"].figures[0].axes
    aging = made.FUTURE.aging
    truths = [line for line in axes.get_lines() if line.get_linewidth() == 3.0]
    for way, truth, bars in zip((aging.level, aging.steady), truths, axes.containers, strict=True):
        np.testing.assert_allclose(truth.get_xdata(), way.distance)
        np.testing.assert_allclose(truth.get_ydata(), 1e3 * way.truth)
        points, _, (ends,) = bars
        np.testing.assert_allclose(points.get_xdata(), way.distance)
        np.testing.assert_allclose(points.get_ydata(), 1e3 * way.found)
        spans = np.array([np.ptp(s[:, 1]) for s in ends.get_segments()])
        np.testing.assert_allclose(spans, 2e3 * way.half)
    assert [bars.get_label() for bars in axes.containers] == ["warms and wears", "does not"]
    drawn = 1e3 * np.concatenate(
        [x for d in (aging.level, aging.steady) for x in (d.truth, d.found)]
    )
    low, high = axes.get_ylim()
    assert (low + high) / 2.0 == pytest.approx((drawn.min() + drawn.max()) / 2.0)
    assert high - low == pytest.approx(1.2 * np.ptp(drawn))  # no point lies outside


def test_the_models_by_machine_law_and_behaviour(pages) -> None:
    page, result = pages["models"], made.MODELS
    rms = np.sqrt(np.nanmean(result.ratios**2, axis=2))
    laws = result.laws
    assert page.heads(0) == ["Machine with", *laws]
    assert page.cells(0) == [
        (law, *(number(rms[i, j]) for j in range(3))) for i, law in enumerate(laws)
    ]
    assert page.heads(1) == ["Fitted", "map", "drift"]
    usual = {  # of two other machines the mean is the median; one of them stands still
        "dahl": (36.0, 40.0), "gms": (6.2, 6.1), "lugre": (1.705, 2.11),
    }  # fmt: skip
    assert page.cells(1) == [(law, *(number(v) for v in usual[law])) for law in laws]
    assert page.cells(2) == [
        ("dahl", "100 %", "310 ms", "21.0 ns", "17.1 mN"),
        ("gms", "50 %", "470 ms", "37.0 ns", "0 N"),
        ("lugre", "62 %", "0.620 s", "53.0 ns", "23.3 mN"),
    ]
    assert page.tables[2].caption.startswith("8 random starts")
    assert page.tiles == {
        "on its own data": number(np.diag(rms).max()),
        "nearest two laws": number(rms[1, 2]),  # but for lugre, which contains dahl
        "of random starts": "71 %",
    }
    assert page.remarks[1] == "lugre fitted to gms"


def test_the_loops_of_each_law(pages) -> None:
    for figure, loops in zip(
        pages["models"].figures, (made.MODELS.loops, made.MODELS.nested), strict=True
    ):
        shown = [axes for axes in figure.axes if axes.get_visible()]
        for axes, (law, loop) in zip(shown, loops.items(), strict=True):
            (line,) = axes.get_lines()
            np.testing.assert_allclose(line.get_xdata(), 1e3 * loop.position)
            np.testing.assert_allclose(line.get_ydata(), 1e3 * loop.friction)
            assert axes.get_title("left") == law


@pytest.mark.parametrize(("count", "shape"), [(2, (1, 2)), (4, (1, 4)), (5, (2, 4)), (9, (3, 4))])
def test_loops_stand_four_in_a_row(count, shape) -> None:
    with drawing_style():
        figure = models_page._loops({f"law_{i}": made.drawn(0.0) for i in range(count)})
    assert figure.axes[0].get_gridspec().get_geometry() == shape
    assert sum(axes.get_visible() for axes in figure.axes) == count


def test_the_residuals_before_and_after(pages) -> None:
    page, result = pages["residuals"], made.RESIDUALS
    assert page.tiles == {
        "with lugre": "43.1 mN", "with what is named": "2.19 mN", "noise floor": "2.07 mN",
    }  # fmt: skip
    assert page.answer.headline == "The missing memory is named"
    shown = result.ranking[:8]
    assert page.cells(0) == [
        (f"effect {i}", number(c.over_floor), number(c.delta_bic)) for i, c in enumerate(shown)
    ]
    assert page.tables[0].caption.startswith("The first 8 of 9")
    assert page.cells(len(page.tables) - 1) == [
        ("Fc", "0.31", "0.31124", "N", "+0.40 %"), ("v0", "0.012", "0.01176", "m/s", "−2.00 %"),
    ]  # fmt: skip


@pytest.mark.parametrize("named", [(), ("gms", "wear"), ("wear",)])
def test_another_answer_than_the_planted_memory_is_said(named, monkeypatch) -> None:
    monkeypatch.setattr(residuals_page, "residual_test_blocks", lambda tests, units: [])
    page = Page(replace(made.RESIDUALS, named=named, values={}))
    assert page.answer.headline == "The missing memory is not named alone"
    headings = [b.text for b in page.section.blocks if type(b).__name__ == "Heading"]
    said = [f"With {', '.join(named)}"] if named else []
    assert [h for h in headings if h.startswith("With ")] == ["With lugre", *said]


def test_the_row_of_what_is_named_is_strong(monkeypatch) -> None:
    monkeypatch.setattr(residuals_page, "residual_test_blocks", lambda tests, units: [])
    page = Page(replace(made.RESIDUALS, named=("effect_3",)))
    assert [i for i, r in enumerate(page.tables[0].rows) if r.tone is Tone.STRONG] == [3]
