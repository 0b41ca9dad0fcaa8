"""Laws of where and how a model misses: maps and frequencies, each against a plain loop."""

import re
from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset
from constructed import SHORT, dataset_of, effect, moved, windowed
from machines import one_axis
from noisy_motion import MASS, PUSH, RATE, noisy

from identify.dataset.coordinates import coordinates_of, gathered, since_reversal
from identify.dataset.motion import Blocks
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
from identify.validation.whiteness import Loop
from identify.workflow import compare, fit
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import ReducedSimulator

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
        assert found.rms[i] == pytest.approx(np.sqrt(np.mean(r[inside] ** 2)))
        assert found.share[i] == pytest.approx(np.sum(r[inside] ** 2) / np.sum(r**2))
        assert found.visited[i] == pytest.approx(inside.mean())
        assert (found.low[i], found.high[i]) == pytest.approx((edges[i], edges[i + 1]))
    np.testing.assert_allclose(found.centre, 0.5 * (edges[1:] + edges[:-1]))
    assert (found.floor == 0.07).all()
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
    assert found[0].share == pytest.approx(0.8)
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
    assert (found.position_error, found.position_floor) == ({"a": 1e-6}, {"a": 2e-7})
    names = [*UNITS, "command", "standstill", "roller_spikes_phase", "frequency"]
    assert [m.coordinate for m in found.maps] == names
    where = found.coordinates
    np.testing.assert_allclose(where["roller_spikes_phase"], np.mod(where["position"], 0.021))
    command = np.concatenate([log.command for log in logs])
    np.testing.assert_array_equal(where["command"], command[kept])
    worst = worst_regions(found.maps, effective_samples(found.residual))
    assert [r.coordinate for r in found.worst] == [r.coordinate for r in worst]
    assert found.tests.loop is Loop.UNKNOWN


def test_it_is_where_the_force_is_that_the_model_lacks() -> None:
    place, dataset = 0.015, built_dataset("one", "two")
    fit = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    assert worst_region(fit, dataset) is None

    def bumped(log):
        bump = np.exp(-(((log.motion.position - place) / 0.002) ** 2))
        return replace(log, command=log.command + log.test_function.mean(0.5 * bump))

    there = replace(dataset, fit=tuple(map(bumped, dataset.fit)))
    region = worst_region(finished(PLAIN, PLAIN, there.fit, Outcome.CONVERGED), there)
    assert region is not None
    assert (region.coordinate, region.unit) == ("position", "m")
    assert abs(0.5 * (region.low + region.high) - place) < 0.004
    assert region.ratio > 2.0


CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
LINE, HEIGHT = 29.0, 0.02  # Hz, N


def logs(seed: int, **disturbance: float):
    machine = STAGE
    if disturbance:
        pump = Fitted.at_start(CATALOGUE["periodic_disturbance"], disturbance)
        machine = STAGE.with_axis("x", STAGE.axes["x"].with_effect(pump))
    return {
        "run": simulate(machine, "tracking", seed=seed, duration=12.0, simulator=ReducedSimulator)
    }


def test_noise_alone_fills_the_noise_band():
    result = fit(STAGE, logs(3), test_function=0.1)
    found = misfit_by_frequency(result.fits["x"].axis, result.datasets["x"].fit)
    assert found.high[-1] > 100.0
    wide = found.low > 2.0
    assert found.rms[wide] == pytest.approx(found.floor[wide], rel=0.4)
    assert np.mean(found.rms[wide] / found.floor[wide]) == pytest.approx(1.0, abs=0.15)


def test_a_planted_line_has_its_height_in_newtons_in_its_band_alone_which_is_the_worst_region():
    compared = compare(STAGE, logs(3, f=LINE, a=HEIGHT)).axes["x"]
    found = next(m for m in compared.maps if m.coordinate == "frequency")
    hit = (found.low <= LINE) & (found.high > LINE)
    assert hit.sum() == 1
    assert found.rms[hit][0] == pytest.approx(HEIGHT / np.sqrt(2.0), rel=0.03)
    assert (found.rms[~hit] < 3.0 * found.floor[~hit]).all()
    worst = compared.worst[0]
    assert worst.coordinate == "frequency"
    assert worst.low <= LINE < worst.high
    assert re.match("frequency between .* Hz", region_in_words(worst))


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
        assert found.rms[own] == pytest.approx(height / np.sqrt(2.0), rel=0.06)
        assert found.rms[~own].max() < 0.2 * found.rms[own][0]
    np.testing.assert_array_equal(found.low[1:], found.high[:-1])
    np.testing.assert_allclose(found.centre**2, found.low * found.high)
    wide = found.low > 1.5
    np.testing.assert_allclose(found.high[wide] / found.low[wide], np.sqrt(2.0))
    width = np.sqrt(found.high - found.low)
    np.testing.assert_allclose(found.floor, width * 1e-3 * np.sqrt(2.0 / RATE), rtol=0.3)
    assert found.share.sum() == pytest.approx(1.0)
    near = (found.low < 1.3) & (found.high > 1.3)
    heavy = misfit_by_frequency(AxisModel(2.0 * MASS), [pumped])
    # The inertia takes up the force of the motion at 1.3 Hz.
    assert found.visited[near][0] < 0.05 * heavy.visited[near][0]
    low = np.sqrt(np.sum(heavy.rms[heavy.low < 4.0] ** 2))
    pushes = PUSH(np.arange(8000) / RATE)
    assert low == pytest.approx(MASS * np.std(pushes), rel=0.1)


def test_the_power_of_logs_is_weighed_by_their_lengths():
    axis = AxisModel(MASS)
    logs = [noisy(15, 0.02, duration=5.0), noisy(16, 0.025, duration=9.0)]
    one, two, both = (misfit_by_frequency(axis, part) for part in (logs[:1], logs[1:], logs))
    ends = [log.motion.time[-1] for log in logs]
    wide = one.low > 10.0
    wanted = (ends[0] * one.rms**2 + ends[1] * two.rms**2) / sum(ends)
    np.testing.assert_allclose(both.rms[wide] ** 2, wanted[wide], rtol=0.02)
    noise = (ends[0] * one.floor**2 + ends[1] * two.floor**2) / sum(ends)
    np.testing.assert_allclose(both.floor[wide] ** 2, noise[wide], rtol=0.02)
