"""Laws of clocks: a force channel is moved by as much as it is off, time origins by a line."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import dataset_of, effect, fit_of, log_of, moved, ridden, waves, windowed
from machines import one_axis

from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.estimation.alignment import (
    depends_on_time_origin,
    fit_aligned,
    misalignment,
    moved_by,
    phases_found,
    realigned,
    synchronised,
    time_origins,
    with_time_origins,
    without_timed_forces,
)
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import residual
from identify.output.words.fit import channel_delay_in_words
from identify.rules import RULE
from identify.selection.diagnosis import Verdict, diagnose_axis
from identify.workflow import compare, fit
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted
from twin.simulator import ReducedSimulator

RATE, MASS = 1000.0, 1.7
PLACE = waves((0.03, 1.3, 0.4), (0.006, 5.1, 1.0), (0.0007, 19.0, 2.0))


def aligned(samples: float, seed: int = 5, noise: float = 1e-3, duration: float = 5.0):
    """A log whose force channel was stamped so many samples late."""
    t = np.arange(round(duration * RATE)) / RATE
    s = t + (0.5 - samples) / RATE
    push = MASS * (PLACE(s + 1e-4) - 2.0 * PLACE(s) + PLACE(s - 1e-4)) / 1e-8
    force = push + np.random.default_rng(seed).normal(0.0, noise, len(t))
    return windowed(motion_of(log_of(RATE, PLACE(t), force), "x", f"log {seed}", ripples=()), 0.02)


def test_a_fit_moves_the_force_by_as_much_as_it_is_off():
    dataset = dataset_of(aligned(1.4), holdout=(aligned(1.4, 6),))
    axis = AxisModel(1.5)
    found, fit = fit_aligned(axis, dataset)
    assert found.channel_delay == pytest.approx(1.4e-3, rel=0.02)
    assert fit.axis.mass == pytest.approx(MASS, rel=3e-3)
    assert fit.begun.mass == 1.5
    np.testing.assert_array_equal(fit.logs[0].command, found.fit[0].command)
    wanted = realigned(dataset, found.channel_delay)
    np.testing.assert_allclose(found.fit[0].command, wanted.fit[0].command, atol=0.05)
    np.testing.assert_allclose(found.holdout[0].command, wanted.holdout[0].command, atol=0.05)
    still, fit = fit_aligned(axis, dataset_of(aligned(0.0)))
    assert still.channel_delay == 0.0
    assert fit.axis.mass == pytest.approx(MASS, rel=3e-3)


def test_a_larger_model_moves_the_force_on_or_back():
    axis = AxisModel(MASS)
    late = dataset_of(aligned(1.4))
    assert moved_by(fit_of(axis, *late.fit), late).channel_delay == pytest.approx(1.4e-3, rel=0.05)
    part = realigned(late, 0.6e-3)
    assert moved_by(fit_of(axis, *part.fit), part).channel_delay == pytest.approx(1.4e-3, rel=0.05)
    right = dataset_of(aligned(0.0))
    assert moved_by(fit_of(axis, *right.fit), right) is None
    wrong = realigned(right, 0.9e-3)
    assert moved_by(fit_of(axis, *wrong.fit), wrong).channel_delay == 0.0
    # back only where that takes a tenth of the square away
    base = fit_axis(axis, right.fit)
    for part_, told in ((1.05, True), (0.95, False)):
        error = part_ * base.error / np.sqrt(1.0 - RULE.least_fall)
        scaled = replace(base, residual=base.residual * error / base.error)
        found = moved_by(scaled, replace(right, channel_delay=1e-9))
        assert (found is not None) == told


def test_a_force_that_acts_late_or_hardly_early_is_no_fault_of_the_log():
    axis = AxisModel(1.7)
    for samples, told in ((0.0, 0), (-1.0, 0), (0.042, 0), (0.058, 1), (2.7, 1), (3.6, 0)):
        log = aligned(samples, noise=1e-4)
        found = misalignment(fit_of(axis, log), dataset_of(log))
        assert (found > 0.0) == bool(told), samples
    log = aligned(0.058, noise=3.0)  # lost in the noise
    assert misalignment(fit_of(axis, log), dataset_of(log)) == 0.0


def test_a_shift_is_said_in_samples():
    log = aligned(0.0)
    assert channel_delay_in_words(dataset_of(log)) is None
    said = channel_delay_in_words(dataset_of(log, channel_delay=1.5e-3))
    assert said.startswith("the force acts 1500 µs (1.50 samples) before")
    half = channel_delay_in_words(dataset_of(log, channel_delay=0.53 * log.motion.sample_period))
    assert "(0.53 samples)" in half
    assert "read at the same instant" in half


PUMP = effect("periodic_disturbance", {"f": 23.7, "a": 0.05, "b": 0.02})
STAGE = AxisModel(1.3, effects=(effect("coulomb_viscous", {"Fc": 0.7, "Fs": 0.7, "sigma2": 0.9}),))
REST = effect("cable_slab", {"offset": 0.2, "k1": -3.0, "k3": 40.0})


def started(late: float, seed: int = 0, f: float = 23.7):
    """A log that began so long after the pump; the pump pushes, so the command has to hold."""
    turn = lambda t: 2.0 * np.pi * f * (t + late)  # noqa: E731
    rng = np.random.default_rng(seed)
    motion = ridden(
        lambda m: -0.05 * np.sin(turn(m.time)) - 0.02 * np.cos(turn(m.time))
        + rng.normal(0.0, 0.01, len(m.time))
    )  # fmt: skip
    return windowed(replace(motion, name=f"{late}"), 0.02)


def turns(found, f=23.7):
    return np.mod(time_origins(found) * f + 0.5, 1.0) - 0.5


LATE = np.array([0.0, 0.0131, 0.0347])


@pytest.fixture(scope="module")
def dataset():
    logs = [started(late, seed) for seed, late in enumerate(LATE)]
    return dataset_of(*logs[:2], holdout=(logs[2],))


def test_a_log_begun_later_has_its_clock_later_modulo_the_period(dataset):
    axis = STAGE.with_effect(REST)
    wanted = np.mod(LATE * 23.7 + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(turns(with_time_origins(axis, dataset)), wanted, atol=0.01)
    # by the model's own pump: the clock of the first is zero too, for it began with the pump
    np.testing.assert_allclose(
        turns(with_time_origins(axis.with_effect(PUMP), dataset)), wanted, atol=0.01
    )
    early = {**PUMP.values, "a": -0.02, "b": 0.05}  # a quarter of a turn ahead
    ahead = axis.with_effect(effect("periodic_disturbance", early))
    shifted = np.mod(wanted - 0.25 + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(turns(with_time_origins(ahead, dataset)), shifted, atol=0.01)
    late = (
        time_origins(with_time_origins(ahead, dataset_of(*dataset.fit, started(0.0211, 3)))) * 23.7
    )
    assert (np.abs(late) <= 0.5).all()  # the nearest of all turns alike
    assert not time_origins(with_time_origins(axis, dataset_of(dataset.fit[0]))).any()
    near = dataset_of(started(0.0), started(0.015 / 23.7, 1))
    assert not time_origins(with_time_origins(axis, near)).any()  # within two hundredths of a turn


def test_the_effects_that_read_the_clock_are_told(dataset):
    axis = STAGE.with_effect(PUMP)
    assert without_timed_forces(axis, dataset.fit[0]).names == STAGE.names
    assert without_timed_forces(STAGE, dataset.fit[0]) == STAGE
    assert depends_on_time_origin(axis, dataset)
    assert not depends_on_time_origin(STAGE, dataset)
    assert phases_found(axis, "periodic_disturbance", dataset) == 0
    known = with_time_origins(axis, dataset)
    set_ = sum(log.motion.time_origin != 0.0 for log in known.fit)
    assert phases_found(axis, "periodic_disturbance", known) == set_ == 1
    assert phases_found(axis, "coulomb_viscous", known) == 0


LOGS = [windowed(moved(np.random.default_rng(s), 6.0, 1000.0), 0.02) for s in range(4)]
N, F = len(LOGS[0]), 23.7  # F: Hz


def pushed(heights, size=1.0):
    """Logs that leave white residuals with a line of those heights, each with its own phase."""
    return [
        replace(w, command=w.command - residual(AxisModel(1.7), [w]) + size * (
            np.random.default_rng(90 + k).normal(size=N) + a * np.cos(2 * np.pi * F * w.time + k)
        ))
        for k, (w, a) in enumerate(zip(LOGS, heights, strict=True))
    ]  # fmt: skip


@pytest.mark.parametrize("size", [1e-6, 1e4])
def test_a_fit_is_synchronised_unless_it_reads_the_clock(size):
    logs = pushed([0.8, 0.5, 0.7, 0.6], size)
    dataset = dataset_of(*logs)
    found, fit = synchronised(fit_of(AxisModel(1.7), *logs), dataset)
    np.testing.assert_allclose(turns(found), np.arange(4) / (2.0 * np.pi), atol=0.05)
    assert fit.logs is found.fit
    pump = AxisModel(1.7, effects=(effect("periodic_disturbance", {"f": F, "a": 0.01}),))
    own = fit_of(pump, *logs)
    assert synchronised(own, dataset) == (dataset, own)


def test_a_line_of_less_evidence_than_its_phases_cost_is_chance():
    """Samples x gain must exceed two numbers a log: in all logs it does, in one it does not."""
    height = 11.5 / np.sqrt(N)
    needed = 2 * 4 * np.log(4 * N) + RULE.least_bic
    assert 0.5 * height**2 * N < needed < 4.0 * 0.5 * height**2 * N
    alone = dataset_of(*pushed([height, 0.0, 0.0, 0.0]))
    assert not time_origins(with_time_origins(AxisModel(1.7), alone)).any()
    every = dataset_of(*pushed([height] * 4))
    assert time_origins(with_time_origins(AxisModel(1.7), every)).any()


CATALOGUE = load_catalogue()
SLIDE = one_axis(load_model("proton_xy", CATALOGUE))
BESIDE = Fitted.at_start(CATALOGUE["periodic_disturbance"], {"f": 23.7, "a": 0.02, "b": 0.01})
FEW = Catalogue(CATALOGUE[n] for n in ("periodic_disturbance", "cogging", "quadratic_drag"))
BEGUN = (0.0, 0.313, 0.871)  # s


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    """Logs of a stage beside a pump that had run for a while when each began."""
    out = []
    for i, late in enumerate(BEGUN):
        phase = 2.0 * np.pi * BESIDE.values["f"] * late
        turned = (BESIDE.values["a"] + 1j * BESIDE.values["b"]) * np.exp(1j * phase)
        values = {**BESIDE.values, "a": turned.real, "b": turned.imag}
        axis = SLIDE.axes["x"].with_effect(Fitted.at_start(BESIDE.effect, values))
        machine = replace(SLIDE, axes={"x": axis})
        out.append(simulate(machine, "tracking", seed=i, duration=8.0, simulator=ReducedSimulator))
    return out


def test_a_pump_is_named_whatever_its_phase_in_each_log(logs):
    simulated = datasets(SLIDE, {"a": logs[0], "b": logs[1]}, {"c": logs[2]})["x"]
    known = with_time_origins(SLIDE.axes["x"], simulated)
    found = diagnose_axis(fit_axis(SLIDE.axes["x"], known.fit), known, FEW)
    assert found.verdict is Verdict.MISSING_EFFECTS
    assert found.named == ("periodic_disturbance",)
    values = found.final.axis["periodic_disturbance"].values
    assert values["f"] == pytest.approx(23.7, rel=1e-4)
    assert np.hypot(values["a"], values["b"]) == pytest.approx(np.hypot(0.02, 0.01), rel=0.02)


WITH_PUMP = replace(SLIDE, axes={"x": SLIDE.axes["x"].with_effect(BESIDE)})


@pytest.mark.slow
def test_a_model_with_the_pump_meets_each_log_at_its_phase(logs):
    assert fit(WITH_PUMP, {str(i): log for i, log in enumerate(logs)}).fits["x"].ratio < 1.2
    alone = fit(WITH_PUMP, {"b": logs[1]})
    assert alone.fits["x"].ratio < 1.2
    found = compare(WITH_PUMP, {"b": logs[1], "c": logs[2]}).axes["x"]
    assert found.ratio < 1.2
