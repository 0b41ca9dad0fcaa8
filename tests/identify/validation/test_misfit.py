"""Where and how a model misses: maps, frequencies and residual tests, each against a plain loop."""

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset
from constructed import SHORT, dataset_of, effect, log_of, moved, windowed
from machines import CATALOGUE, STAGE, tracked
from noisy_motion import MASS, PUSH, RATE, noisy
from scipy.signal import lfilter

from identify.dataset.blocks import Blocks
from identify.dataset.coordinates import coordinates_of, gathered, since_reversal
from identify.dataset.motion import motion_of
from identify.dataset.noise_floor import floor_of
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.residual_dependence import UNITS
from identify.output.words.fit import region_in_words
from identify.validation.comparison import compare_axis
from identify.validation.misfit_maps import (
    ABOVE_FLOOR,
    LEAST_SHARE,
    MisfitMap,
    misfit_by_frequency,
    misfit_map,
    worst_region,
    worst_regions,
)
from identify.validation.whiteness import Feedback, correlation, loop_of, residual_tests
from identify.workflow import fit
from twin.model.machine import AxisModel, Fitted, MachineModel

LOG = windowed(SHORT)
RNG = np.random.default_rng(41)
MANY = 1e9  # values, of which chance makes nothing


def test_the_distance_since_a_reversal_is_that_of_a_loop():
    v = RNG.normal(size=300) + 1.5 * np.sin(np.arange(300) / 25.0)
    v[40:60] = 0.0  # a rest is no reversal
    v[100:110] = 9e-4 * np.abs(v).max() * -np.sign(v[99])  # nor is a creep
    v[:7] = 0.0
    period, travelled, last, way, wanted = 2e-3, 0.0, 0.0, 0.0, []
    for speed in v:
        if abs(speed) > 1e-3 * np.abs(v).max() and np.sign(speed) != way:
            turned, way = True, np.sign(speed)
        else:
            turned = False
        travelled += abs(speed) * period
        last = travelled if turned else last
        wanted.append(travelled - last)
    np.testing.assert_allclose(since_reversal(v, period), wanted, atol=1e-12)


def test_coordinates_are_windowed_means_in_their_units():
    found, m, w = coordinates_of(LOG), SHORT, LOG.test_function
    assert list(found) == list(UNITS)
    for name, wanted in {
        "position": w.mean(m.position),
        "velocity": w.mean(m.velocity),
        "direction": np.sign(w.mean(m.velocity)),
        "acceleration": LOG.acceleration,
        "time": LOG.time,
        "distance_since_reversal": w.mean(since_reversal(m.velocity, m.period)),
        "other_axis_position": w.mean(m.others[0]),
        "other_axis_velocity": w.mean(m.others[1]),
        "other_axis_acceleration": w.mean(m.others[2]),
    }.items():
        np.testing.assert_array_equal(found[name], wanted)
    alone = replace(LOG, motion=replace(SHORT, others=0.0 * SHORT.others))
    both = gathered([LOG, alone])
    assert list(both) == [n for n in UNITS if not n.startswith("other")]
    np.testing.assert_array_equal(both["time"], np.tile(LOG.time, 2))


def test_a_map_is_the_plain_sum_over_its_bins():
    x, r = RNG.uniform(-0.03, 0.12, 2000), RNG.normal(0.1, 1.0, 2000)
    found = misfit_map("position", r, x, 0.07)
    edges = np.linspace(x.min(), x.max(), 25)
    for i in range(24):
        last = x <= edges[i + 1] if i == 23 else x < edges[i + 1]
        inside = (x >= edges[i]) & last
        assert found.mean[i] == pytest.approx(r[inside].mean())
        assert found.force_error[i] == pytest.approx(np.sqrt(np.mean(r[inside] ** 2)))
        assert found.share[i] == pytest.approx(np.sum(r[inside] ** 2) / np.sum(r**2))
        assert found.visited[i] == pytest.approx(inside.mean())
        assert (found.low[i], found.high[i]) == pytest.approx((edges[i], edges[i + 1]))
    np.testing.assert_allclose(found.centre, 0.5 * (edges[1:] + edges[:-1]))
    assert (found.noise_floor == 0.07).all()
    assert found.coordinate == "position"
    assert (found.unit, misfit_map("roller_phase", r, x, 0.1).unit) == ("m", "m")
    assert misfit_map("velocity", r, x, 0.1).unit == "m/s"
    empty = misfit_map("time", 0.0 * r, np.where(x > 0.0, 1.0, 2.0), 0.1)
    assert empty.share.sum() == 0.0


def test_a_direction_has_two_bins():
    v, r = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, 0.0]), np.array([3.0, 1.0, 5.0, 6.0, 7.0, 2.0])
    found = misfit_map("direction", r, v, 0.1)
    np.testing.assert_allclose(found.mean, [2.0, 5.0])
    np.testing.assert_allclose(found.visited, [2.0 / 6.0, 4.0 / 6.0])
    turned = misfit_map("direction", np.array([9.0, 8.0, 1, 1, 1, 1]), v, 0.1)
    for one, said in (
        (found, "moving forwards: 5.34 N RMS, 53.4 times the noise floor, 92 %"),
        (turned, "moving backwards"),
    ):
        assert region_in_words(worst_regions([one], MANY)[0]).startswith(said)


def bare_map(name, rms_, share_, visited, floor=1.0) -> MisfitMap:
    low = np.arange(len(rms_)) * 1.0
    return MisfitMap(name, "m", low + 0.5, low, low + 1.0, low, np.array(rms_, float),
                     np.array(share_), np.array(visited), np.full(len(rms_), floor))  # fmt: skip


def test_regions_are_told_above_floor_and_share_the_largest_excess_first():
    above, below = 1.01 * ABOVE_FLOOR, 0.99 * ABOVE_FLOOR
    assert worst_regions([bare_map("a", [below, 0.1], [0.9, 0.1], [0.1, 0.9])], MANY) == []
    assert len(worst_regions([bare_map("a", [above, 0.1], [0.9, 0.1], [0.1, 0.9])], MANY)) == 1
    for excess, told in ((1.05 * LEAST_SHARE, 1), (0.95 * LEAST_SHARE, 0)):
        parts = [0.5 + excess, 0.5 - excess]
        assert len(worst_regions([bare_map("a", [9.0, 9.0], parts, [0.5, 0.5])], MANY)) == told
    maps = [
        bare_map(n, [9.0, 9.0], [0.5 - e, 0.5 + e], [0.5, 0.5])
        for n, e in (("a", 0.1), ("b", 0.3), ("c", 0.2), ("d", 0.25))
    ]
    found = worst_regions(maps, MANY)
    assert [r.coordinate for r in found] == ["b", "d", "c"]
    assert [r.low for r in found] == [1.0, 1.0, 1.0]
    assert found[0].share_of_error == pytest.approx(0.8)
    assert [r.coordinate for r in worst_regions(maps, MANY, 1)] == ["b"]


def test_a_comparison_gathers_what_the_residual_says():
    rng = np.random.default_rng(42)
    logs = [windowed(replace(moved(rng, 1.5, 1000.0), name=n, position_noise=s))
            for n, s in (("a", 1e-7), ("b", 4e-7))]  # fmt: skip
    friction = effect("coulomb_viscous", {"Fc": 0.4, "Fs": 0.4})
    axis = AxisModel(1.7, effects=(friction, effect("roller_spikes", {"pitch": 0.021})))
    dataset = dataset_of(*logs)
    found = compare_axis(MachineModel("s", {"x": axis}), dataset, {"a": 1e-6}, {"a": 2e-7})
    kept = moving(logs, True)
    np.testing.assert_array_equal(found.residual, residual(axis, logs)[kept])
    for log in logs:
        own = residual(axis, [log])[moving([log], sticks(axis))]
        assert found.force_error[log.motion.name] == pytest.approx(rms(own))
    assert found.floor == floor_of(axis, logs)
    assert found.total_error == pytest.approx(rms(found.residual))
    assert found.ratio == pytest.approx(found.total_error / found.floor)
    assert (found.position_error, found.position_drift_of_noise) == ({"a": 1e-6}, {"a": 2e-7})
    names = [*UNITS, "command", "standstill", "roller_spikes_phase", "frequency"]
    assert [m.coordinate for m in found.maps] == names
    where = found.coordinates
    np.testing.assert_allclose(where["roller_spikes_phase"], np.mod(where["position"], 0.021))
    command = np.concatenate([log.command for log in logs])
    np.testing.assert_array_equal(where["command"], command[kept])
    worst = worst_regions(found.maps, effective_samples(found.residual))
    assert [r.coordinate for r in found.worst] == [r.coordinate for r in worst]
    assert found.tests.loop is Feedback.UNKNOWN


def test_it_is_where_the_force_is_that_the_model_lacks() -> None:
    place, dataset = 0.015, built_dataset("one", "two")
    fit = finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED)
    assert worst_region(fit, dataset) is None

    def bumped(log):
        bump = np.exp(-(((log.motion.position - place) / 0.002) ** 2))
        return replace(log, command=log.command + log.test_function.mean(0.5 * bump))

    there = replace(dataset, training=tuple(map(bumped, dataset.training)))
    region = worst_region(finished(PLAIN, PLAIN, there.training, Outcome.CONVERGED), there)
    assert region is not None
    assert (region.coordinate, region.coordinate_unit) == ("position", "m")
    assert abs(0.5 * (region.low + region.high) - place) < 0.004
    assert region.over_noise_floor > 2.0


def logs(seed: int, **disturbance: float):
    machine = STAGE
    if disturbance:
        pump = Fitted.at_start(CATALOGUE["periodic_disturbance"], disturbance)
        machine = STAGE.with_axis("x", STAGE.axes["x"].with_effect(pump))
    return {"run": tracked(machine, seed, 12.0)}


def test_the_error_by_frequency_is_the_residual_in_its_band():
    log = noisy(14, 1e-3, duration=12.0)
    t = (np.arange(log.motion.raw.shape[1]) + 0.5) / RATE
    for frequency, height in ((7.0, 0.3), (61.0, 0.02)):
        line = height * np.sin(2.0 * np.pi * frequency * t)
        raw = log.motion.raw + np.stack([0.0 * line, line])
        signals = log.motion.signals.copy()
        signals[2] = raw[1].reshape(signals.shape[1], -1).mean(axis=1)
        pumped = windowed(replace(log.motion, track=Blocks(signals, raw)))
        found = misfit_by_frequency(AxisModel(MASS), [pumped])
        own = (found.low <= frequency) & (frequency < found.high)
        assert found.force_error[own] == pytest.approx(height / np.sqrt(2.0), rel=0.06)
        assert found.force_error[~own].max() < 0.2 * found.force_error[own][0]
    np.testing.assert_array_equal(found.low[1:], found.high[:-1])
    np.testing.assert_allclose(found.centre**2, found.low * found.high)
    wide = found.low > 1.5
    np.testing.assert_allclose(found.high[wide] / found.low[wide], np.sqrt(2.0))
    width = np.sqrt(found.high - found.low)
    np.testing.assert_allclose(found.noise_floor, width * 1e-3 * np.sqrt(2.0 / RATE), rtol=0.3)
    assert found.share.sum() == pytest.approx(1.0)
    near = (found.low < 1.3) & (found.high > 1.3)
    heavy = misfit_by_frequency(AxisModel(2.0 * MASS), [pumped])
    # The inertia takes up the force of the motion at 1.3 Hz.
    assert found.visited[near][0] < 0.05 * heavy.visited[near][0]
    low = np.sqrt(np.sum(heavy.force_error[heavy.low < 4.0] ** 2))
    pushes = PUSH(np.arange(8000) / RATE)
    assert low == pytest.approx(MASS * np.std(pushes), rel=0.1)


def test_the_power_of_logs_is_weighed_by_their_lengths():
    axis = AxisModel(MASS)
    logs = [noisy(15, 0.02, duration=5.0), noisy(16, 0.025, duration=9.0)]
    one, two, both = (misfit_by_frequency(axis, part) for part in (logs[:1], logs[1:], logs))
    ends = [log.motion.time[-1] for log in logs]
    wide = one.low > 10.0
    wanted = (ends[0] * one.force_error**2 + ends[1] * two.force_error**2) / sum(ends)
    np.testing.assert_allclose(both.force_error[wide] ** 2, wanted[wide], rtol=0.02)
    noise = (ends[0] * one.noise_floor**2 + ends[1] * two.noise_floor**2) / sum(ends)
    np.testing.assert_allclose(both.noise_floor[wide] ** 2, noise[wide], rtol=0.02)


# Residual tests: white stays within the bounds, what is coloured or knows the input does not


SPACING = 0.02  # s
N = 1500


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """White noise, and a smooth command that knows nothing of it."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=N), lfilter([1.0], [1.0, -0.95], rng.normal(size=N))


def test_of_a_white_residual_a_tenth_leaves_the_bounds_and_nearly_all_pass():
    for name in ("residual", "command"):
        drawings = (
            (white, white if name == "residual" else c) for white, c in map(drawn, range(60))
        )
        tests = [correlation(name, [a], [b], SPACING, Feedback.CLOSED) for a, b in drawings]
        assert np.mean([t.share_outside for t in tests]) == pytest.approx(0.1, abs=0.03)
        assert np.mean([t.passed for t in tests]) > 0.94
        assert tests[0].bound_90 == pytest.approx(1.645 / np.sqrt(N), rel=1e-3)


def test_what_feedback_does_to_the_command_is_no_fault_of_the_model():
    """A command that answers the residual comes after it: not tested where the loop is closed."""
    white, _ = drawn(3)
    answer = -0.5 * np.roll(white, 4) + drawn(4)[0]
    assert correlation("command", [white], [answer], SPACING, Feedback.CLOSED).passed
    opened = correlation("command", [white], [answer], SPACING, Feedback.OPEN)
    assert not opened.passed
    assert opened.lag[np.argmax(np.abs(opened.value))] == pytest.approx(-4 * SPACING)


def test_gaps_and_the_seams_between_logs_do_not_count():
    white, command = drawn(5)
    holed = white.copy()
    holed[200:700] = np.nan
    test = correlation(
        "command", [holed, white[:300]], [command, command[:300]], SPACING, Feedback.OPEN
    )
    assert np.isfinite(test.value).all()
    assert test.passed
    assert test.bound_90 == pytest.approx(1.645 / np.sqrt(N - 500 + 300), rel=1e-3)


def test_the_twins_own_log_passes_and_a_model_that_lacks_an_effect_fails():
    logs = {"run": tracked(STAGE, 3, 12.0)}

    def tested(stage):
        result = fit(stage, logs)
        found, dataset = result.fits["x"], result.datasets["x"]
        force = residual(found.axis, dataset.training)
        return residual_tests(
            dataset.training, force, found.kept, found.floor, loop_of(dataset.training)
        )

    found = tested(STAGE)
    assert found.passed
    assert found.loop is Feedback.CLOSED
    assert found.share_within_90 == pytest.approx(0.9, abs=0.06)
    assert np.sum(found.density * np.diff(found.edges)) == pytest.approx(1.0, abs=0.02)
    poor = tested(STAGE.with_axis("x", STAGE.axes["x"].without("cable_slab")))
    assert not any(c.passed for c in poor.correlations)
    assert poor.share_within_90 < 0.3


def test_correlations_are_the_plain_sums_at_their_lags():
    rng = np.random.default_rng(51)
    logs = [rng.normal(0.3, 1.0, n) for n in (200, 170)]
    signals = [rng.normal(-2.0, 3.0, n) for n in (200, 170)]
    for name, other in (("command", signals), ("residual", logs)):
        found = correlation(name, logs, other, 0.02, Feedback.OPEN)
        a, b = (np.concatenate(rows).mean() for rows in (logs, other))
        a, b = [r - a for r in logs], [r - b for r in other]
        size = np.sqrt(sum(np.sum(r**2) for r in a) * sum(np.sum(r**2) for r in b))
        lags = np.rint(found.lag / 0.02).astype(int)
        assert lags.tolist() == list(range(1 if name == "residual" else -40, 41))
        sums = np.zeros(len(lags))
        for x, y in zip(a, b, strict=True):
            every = range(len(x))
            sums += [sum(x[k] * y[k - lag] for k in every if k - lag in every) for lag in lags]
        np.testing.assert_allclose(found.value, sums / size)
        assert found.tested.all()
    short = correlation(
        "command", [*logs, logs[0][:40]], [*signals, signals[0][:40]], 1.0, Feedback.OPEN
    )
    assert np.abs(short.lag).max() == 10


def test_a_loop_is_closed_where_the_position_follows_its_setpoint():
    t = np.arange(4000) / 1000.0
    a, b = np.sin(6.0 * t), np.random.default_rng(51).normal(size=len(t))
    b -= a * (a @ b) / (a @ a)
    b *= np.std(a) / np.std(b)

    def log(setpoint=None):
        more = {} if setpoint is None else {"setpoint_position": setpoint}
        return windowed(motion_of(log_of(1000.0, a, t, **more), "x", "l"))

    for angle, wanted in ((0.24, Feedback.CLOSED), (0.26, Feedback.OPEN), (1.0, Feedback.CLOSED)):
        mixed = np.cos(np.pi * angle) * a + np.sin(np.pi * angle) * b
        assert loop_of([log(mixed)]) is wanted
    assert loop_of([log(0.0 * a)]) is Feedback.OPEN
    assert loop_of([log()]) is Feedback.UNKNOWN
    assert loop_of([log(a), log()]) is Feedback.UNKNOWN
    assert loop_of([log(0.0 * a), log(a)]) is Feedback.CLOSED
