"""The report's pictures of forces and residuals: lines hold the numbers that their labels name."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built_fit

from identify.output.numbers import Scale
from identify.output.report.drawing import BLUE, ORANGE, binned_mean, noise_band, symmetric_limit
from identify.output.report.effects import curves
from identify.output.report.residual import (
    LogForces,
    Panel,
    draw_forces,
    draw_residuals,
    draw_tests,
    forces,
    forces_by_log,
    panels,
    reasons,
    residuals,
    whiteness,
)
from identify.output.report.subject import Subject
from identify.output.words.residual import correlation_in_words, loop_in_words
from twin.model.machine import Fitted
from twin.model.units import LINEAR

RNG = np.random.default_rng(8)


def lines_of(axes):
    """Lines of axes by label."""
    return {line.get_label(): line for line in axes.get_lines()}


def subject_of(diagnosis=None, **changes) -> Subject:
    return Subject("t", diagnosis, changes.get("comparison", made.compared()), made.STEPS, ())


# --- forces ---------------------------------------------------------------------------------


def view_of(comparison, diagnosis=None):
    axes = {**made.compared().axes, "x": comparison}
    subject = subject_of(diagnosis, comparison=replace(made.compared(), axes=axes))
    return next(view for view in subject.views if view.name == "x")


def test_forces_add_up_to_the_command_minus_mass_times_acceleration():
    final = built_fit(0.5, kept=KEPT, residual=SMALL)
    c = replace(made.comparison_of(), residual=LARGE, kept=KEPT)
    view = view_of(c, made.diagnosed(made.diagnosis_of(final=final)))
    for i, found in enumerate(forces_by_log(view)):
        log = c.logs[i]
        span = slice(0, len(log)) if i == 0 else slice(len(c.logs[0]), None)
        np.testing.assert_allclose(found.explain, log.command - 5.3 * log.acceleration)
        for force, left in ((found.model, LARGE), (found.found, SMALL)):
            every = np.full(len(KEPT), np.nan)
            every[KEPT] = left
            np.testing.assert_allclose(found.explain - force, every[span])
        assert found.name == log.motion.name
        np.testing.assert_array_equal(found.time, log.time)
    assert np.isnan(forces_by_log(view_of(c))[0].model[:10]).all()  # at rest, it tells nothing
    assert forces_by_log(view_of(c))[0].found is None


SAMPLES = sum(len(log) for log in made.DATASET.fit)
KEPT = np.arange(SAMPLES) >= 10
LARGE, SMALL = RNG.standard_normal((2, SAMPLES - 10))
TIME = np.arange(0.0, 20.0, 0.01)


def forces_of(scale: float, named: bool = True) -> LogForces:
    wave = np.sin(TIME)
    explain = 3.0 * wave + scale * 0.1
    return LogForces("log", TIME, explain, 3.0 * wave, 3.0 * wave + 0.03 if named else None)


def test_measured_and_modelled_force_are_drawn_whole_and_in_part():
    forces, span = forces_of(1.0), slice(300, 700)
    figure = draw_forces(forces, span, 0.02, "the effect")
    whole, stretch, left = figure.axes
    for axes, part in ((whole, slice(None)), (stretch, span)):
        lines = lines_of(axes)
        np.testing.assert_allclose(
            lines["measured force minus mass x acceleration"].get_ydata(), forces.explain[part]
        )
        np.testing.assert_allclose(lines["model"].get_ydata(), forces.model[part])
        np.testing.assert_allclose(lines["model with the effect"].get_ydata(), forces.found[part])
        np.testing.assert_allclose(lines["model"].get_xdata(), TIME[part])
        wide = lines["measured force minus mass x acceleration"].get_linewidth()
        assert wide > lines["model"].get_linewidth()  # a model that hides it is seen to fit
    own, named = left.get_lines()
    assert (own.get_color(), named.get_color()) == (BLUE, ORANGE)
    scale = Scale.of("N", [0.115])
    np.testing.assert_allclose(own.get_ydata(), scale(0.1), rtol=1e-9)
    np.testing.assert_allclose(named.get_ydata(), scale(0.07), rtol=1e-9)
    limit = symmetric_limit(0.02, np.full(4, 0.1))
    assert left.get_ylim() == pytest.approx((-scale(limit), scale(limit)))
    band = left.patches[0]
    assert band.get_y() == pytest.approx(-scale(0.02))
    assert band.get_height() == pytest.approx(2 * scale(0.02))
    shaded = whole.patches[0]
    assert (shaded.get_x(), shaded.get_width()) == pytest.approx((TIME[300], TIME[699] - TIME[300]))
    bare = draw_forces(forces_of(1.0, named=False), span, 0.02, "")
    assert len(bare.axes[0].get_lines()) == 2


def test_the_log_shown_is_the_one_nearest_to_the_whole_error():
    c = made.comparison_of()
    sizes = np.repeat([3.0, 1.2], [len(log) for log in c.logs])
    c = replace(c, residual=sizes * np.where(np.arange(SAMPLES) % 2, 1.0, -1.0))
    (picture,) = forces(view_of(c))
    shown = min((3.0, "run 1"), (1.2, "run 2"), key=lambda one: abs(one[0] - c.total_error))
    assert f"Log {shown[1]}:" in picture.caption
    assert len(picture.figure.axes[0].get_lines()) == 2
    final = built_fit(0.5, residual=np.full(SAMPLES, 0.5), kept=np.ones(SAMPLES, dtype=bool))
    (picture,) = forces(view_of(c, made.diagnosed(made.diagnosis_of(final=final))))
    assert "model with all that was found" in lines_of(picture.figure.axes[0])


def test_the_residual_is_seen_against_time_speed_position_and_phase():
    c = replace(made.comparison_of(), kept=KEPT, periods={"roller_spikes_phase": 0.034})
    views = panels(view_of(c))
    assert [(v.quantity.split(",")[0], v.unit) for v in views] == [
        ("Time", "s"), ("Speed", "m/s"), ("Position", "m"), ("Roller spikes phase", "m"),
    ]  # fmt: skip
    assert views[1].values is c.coordinates["velocity"]
    assert views[2].values is c.coordinates["position"]
    assert views[3].values is c.coordinates["roller_spikes_phase"]
    first, second = c.logs
    both = np.concatenate([first.time, second.time + first.motion.time[-1]])
    np.testing.assert_allclose(views[0].values, both[KEPT])
    short = replace(c, coordinates={**c.coordinates, "position": np.linspace(0.0, 0.0339, 9)})
    assert len(panels(view_of(short))) == 3


def test_dots_and_means_of_the_residual():
    n = 4000
    x = np.linspace(-0.08, 0.08, n)
    means = {"mean": 0.02 * np.sign(x), "mean with it": np.full(n, 0.007)}
    figure = draw_residuals([Panel(x, "Position", "m")] * 3, means, 0.004)
    assert len(figure.axes) == 3
    axes = figure.axes[0]
    lines = lines_of(axes)
    np.testing.assert_allclose(lines["single test functions"].get_xdata(), 1e3 * x)
    np.testing.assert_allclose(lines["single test functions"].get_ydata(), 20.0 * np.sign(x))
    mean = lines["mean"]
    np.testing.assert_allclose(mean.get_ydata(), 20.0 * np.sign(mean.get_xdata()), atol=1e-9)
    np.testing.assert_allclose(lines["mean with it"].get_ydata(), 7.0)
    assert axes.get_ylim() == pytest.approx((-23.0, 23.0))
    assert axes.patches[0].get_height() == pytest.approx(8.0)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Position (mm)", "Unexplained force (mN)")
    wide = Panel(RNG.uniform(size=25_000), "Time", "s")
    many = draw_residuals([wide], {"mean": RNG.standard_normal(25_000)}, 1.0)
    dots = lines_of(many.axes[0])["single test functions"]
    assert len(dots.get_xdata()) == -(-25_000 // 3)


def test_the_residual_of_the_final_model_is_on_the_same_test_functions():
    all_kept = np.ones(SAMPLES, dtype=bool)
    final = built_fit(0.5, residual=np.arange(SAMPLES) * 1e3, kept=all_kept)
    found = made.diagnosed(made.diagnosis_of(final=final))
    c = made.comparison_of()
    coordinates = {name: values[KEPT] for name, values in c.coordinates.items()}
    c = replace(c, residual=LARGE, kept=KEPT, coordinates=coordinates)
    (picture,) = residuals(view_of(c, found))
    drawn = lines_of(picture.figure.axes[0])["mean with all that was found"].get_ydata()
    assert np.nanmax(drawn) > 100.0 * np.nanmax(np.abs(LARGE))  # of the final model, in its order
    assert np.all(np.diff(drawn[np.isfinite(drawn)]) > 0.0)


# --- whiteness and shape --------------------------------------------------------------------


def test_the_histogram_and_correlations_have_their_bounds():
    tests = made.whiteness_of()
    figure = draw_tests(tests, LINEAR)
    bars, *rest = figure.axes
    data = bars.patches[0].get_data()
    scale = Scale.of("N", tests.edges)
    np.testing.assert_allclose(data.edges, tests.edges / scale.size)
    # The area of the bars is the same in any unit.
    area = np.sum(data.values * np.diff(data.edges))
    assert area == pytest.approx(np.sum(tests.density * np.diff(tests.edges)))
    x, y = bars.get_lines()[0].get_data()
    assert np.trapezoid(y, x) == pytest.approx(1.0, abs=1e-3)
    sigma = np.sqrt(np.trapezoid(y * x**2, x)) * scale.size
    assert sigma == pytest.approx(tests.floor, rel=1e-2)
    for axes, test in zip(rest, tests.correlations, strict=True):
        band = axes.patches[0]
        assert (band.get_y(), band.get_height()) == pytest.approx((-test.bound, 2 * test.bound))
        drawn = np.concatenate([[s[1][1] for s in c.get_segments()] for c in axes.collections])
        order = np.concatenate([test.value[test.tested], test.value[~test.tested]])
        np.testing.assert_allclose(drawn, order)
        lags = np.concatenate([[s[0][0] for s in c.get_segments()] for c in axes.collections])
        both = np.concatenate([test.lag[test.tested], test.lag[~test.tested]])
        np.testing.assert_allclose(lags, both / Scale.of("s", test.lag).size)
        reach = 1.15 * max(2 * test.bound, np.abs(test.value).max())
        assert axes.get_ylim() == pytest.approx((-reach, reach))
    assert rest[0].get_xlabel() == "Lag (ms)"
    assert rest[1].get_xlabel() == "Lag, command first where positive (ms)"
    assert rest[2].get_ylabel() == "Correlation with speed (1)"
    assert rest[0].get_ylabel() == "Autocorrelation (1)"


def test_the_tests_of_each_axis_are_in_words_and_their_reason_once():
    subject = subject_of()
    (reason,) = reasons(subject)
    assert reason.items == (loop_in_words(made.whiteness_of().loop),)
    for view in subject.views:
        picture, listing = whiteness(view)
        assert "The force residual on 387 test functions" in picture.caption
        words = [correlation_in_words(c) for c in view.axis.tests.correlations]
        assert listing.items == [f"F{w[1:]}." for w in words]


def test_a_description_is_drawn_forwards_and_backwards():
    effect = CATALOGUE["empirical_map"]
    names = [p.name for part in effect.parts for p in effect.strengths if p.name in part.strengths]
    values = dict(zip(names, RNG.uniform(0.05, 0.2, len(names)), strict=True))
    description = Fitted.at_start(effect, values)
    c = made.comparison_of()
    along = RNG.uniform(0.1, 0.3, sum(len(log.motion.position) for log in c.logs))
    c = replace(c, curves={effect.name: along})
    model = replace(made.MODEL, axes={"x": axis_of(description), "y": PLAIN})
    axes = {"x": c, "y": made.comparison_of("y")}
    subject = subject_of(comparison=replace(made.compared(), model=model, axes=axes))
    heading, picture, _ = curves(subject.views[0])
    left, right = picture.figure.axes
    assert left.get_xlabel() == "Position (mm)"
    assert right.get_xlabel() in ("Speed (m/s)", "Speed (mm/s)")
    forwards, backwards = (lines_of(right)[n].get_xdata() for n in ("forwards", "backwards"))
    assert backwards.max() <= 0.0 <= forwards.min()
    assert heading.text == "Empirical map on x"
    assert curves(subject_of().views[0]) == []


# --- drawing --------------------------------------------------------------------------------


def test_a_mean_by_bins_is_the_mean_of_the_samples_there():
    x = RNG.uniform(-2.0, 5.0, 1000)
    y = x**2
    centre, mean = binned_mean(x, y)
    assert len(centre) == 40  # 25 a bin
    edges = np.linspace(x.min(), x.max(), 41)
    np.testing.assert_allclose(centre, 0.5 * (edges[1:] + edges[:-1]))
    for i in range(40):
        last = i == 39
        inside = (x >= edges[i]) & ((x <= edges[i + 1]) if last else (x < edges[i + 1]))
        assert mean[i] == pytest.approx(y[inside].mean())
    assert [len(binned_mean(x[:n], y[:n])[0]) for n in (10, 499, 550)] == [20, 20, 22]
    assert len(binned_mean(np.arange(9e3), np.arange(9e3))[0]) == 140
    few = np.concatenate([np.zeros(100), [1.0, 1.0, 1.0]])
    assert np.isnan(binned_mean(few, few)[1][-1])
    assert binned_mean(np.append(few, 1.0), np.append(few, 1.0))[1][-1] == 1.0
    assert len(binned_mean(few, np.full(103, np.nan))[0]) == 0


def test_limits_show_the_noise_and_nearly_all_values():
    values = np.concatenate([np.linspace(-1.0, 1.0, 999), [50.0]])
    assert 1.1 < symmetric_limit(0.1, values, np.array([np.nan])) < 1.2
    assert symmetric_limit(4.0, values) == pytest.approx(5.2)
    assert symmetric_limit(0.0, np.full(5, np.nan)) > 0.0


def test_a_noise_band_lies_about_zero():
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    noise_band(axes, 0.3)
    assert (axes.patches[0].get_y(), axes.patches[0].get_height()) == pytest.approx((-0.3, 0.6))


def test_a_stretch_at_rest_comes_last():
    error = np.where(TIME < 10.0, np.nan, 1.0)
    span = LogForces("l", TIME, error, np.zeros_like(error), None).representative(4.0)
    assert np.isfinite(error[span]).any()
