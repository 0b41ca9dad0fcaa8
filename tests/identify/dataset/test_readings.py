"""Readings: their resolution, the errors that repeat along the track, a velocity beside them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from constructed import log_of, waves
from machines import one_axis

from identify.dataset.dataset import Dataset
from identify.dataset.motion import Blocks, motion_of
from identify.dataset.noise import noise_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.readings import (
    resolution_of,
    ripple,
    ripple_periods,
    ripples_of_widest,
    together,
)
from identify.estimation.fit import fit_axis
from identify.selection.diagnosis import Verdict, diagnose_axis
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted
from twin.signals import between, white_noise
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
STEP = 2.3e-7  # m
DT = 1e-4  # s


@cache
def dataset_of(step: float) -> Dataset:
    axis = STAGE.axes["x"]
    if step:
        effect = CATALOGUE["encoder_quantization"]
        axis = axis.with_effect(Fitted.at_start(effect, {"step": step}))
    machine = replace(STAGE, axes={"x": axis})
    runs = {
        s: simulate(machine, "tracking", seed=s, duration=8.0, simulator=ReducedSimulator)
        for s in (1, 2, 3)
    }
    fit = {f"log {s}": runs[s] for s in (1, 2)}
    return datasets(STAGE, fit, {"log 3": runs[3]})["x"]


@pytest.fixture(scope="module")
def coarse() -> Dataset:
    return dataset_of(STEP)


@pytest.mark.parametrize("step", [0.0, STEP])
def test_the_noise_of_the_force_is_seen_behind_any_rounding(step):
    """What the controller makes of the steps is not noise: it reads them off the same log."""
    hardware = STAGE.axes["x"].hardware
    planted = 2.0 * DT * (hardware.force_constant * hardware.current_noise) ** 2  # N^2/Hz
    for log in dataset_of(step).fit:
        assert log.motion.command_noise == pytest.approx(planted, rel=0.1)
        assert noise_of(STAGE.axes["x"], log.motion).force == pytest.approx(planted, rel=0.25)


FEW = Catalogue(
    CATALOGUE[name] for name in ("encoder_quantization", "encoder_delay", "quadratic_drag")
)


def test_it_is_named_where_it_makes_the_error_noise(coarse):
    found = diagnose_axis(fit_axis(STAGE.axes["x"], coarse.fit), coarse, FEW)
    assert found.named == ("encoder_quantization",)
    assert found.verdict is Verdict.MISSING_EFFECTS
    assert found.best.is_noise
    step = found.final.axis["encoder_quantization"].values["step"]
    assert step == pytest.approx(STEP, rel=1e-3)


@pytest.mark.slow
def test_it_is_named_beside_a_ripple_of_the_encoder(coarse):
    """Rounding is a tone at constant speed; the search for a ripple's period takes its time."""
    near = Catalogue([*FEW.values(), CATALOGUE["encoder_ripple"]])
    found = diagnose_axis(fit_axis(STAGE.axes["x"], coarse.fit), coarse, near)
    assert found.named == ("encoder_quantization",)


def test_it_is_not_named_where_other_noise_is_larger():
    fine = dataset_of(0.0)
    found = diagnose_axis(fit_axis(STAGE.axes["x"], fine.fit), fine, FEW)
    assert found.verdict is Verdict.NOTHING_MISSING


def test_it_is_not_named_for_an_error_it_cannot_make(coarse):
    """The resolution is there, but twice the force error that it could pretend."""
    louder = tuple(_with_more_force(log) for log in coarse.fit)
    dataset = replace(coarse, fit=louder, holdout=tuple(map(_with_more_force, coarse.holdout)))
    found = diagnose_axis(fit_axis(STAGE.axes["x"], louder), dataset, FEW)
    assert "encoder_quantization" not in found.named


def _with_more_force(log: PreparedLog) -> PreparedLog:
    beat = 0.03 * np.sign(np.sin(7.0 * np.sqrt(2.0) * log.motion.time) + 0.3)
    signals = log.motion.signals + np.stack([0.0 * beat, 0.0 * beat, beat])
    samples = log.motion.raw.shape[1] // len(beat)
    raw = log.motion.raw + np.stack([np.zeros(log.motion.raw.shape[1]), np.repeat(beat, samples)])
    motion = replace(log.motion, track=Blocks(signals, raw))
    return PreparedLog.of(motion, log.test_function.length)


TIME = DT * np.arange(60_000)
NOISE = 2e-9  # m
ANGLE = 2.0 * np.pi * 0.4 * TIME


def noise():
    return NOISE * np.random.default_rng(3).standard_normal(len(TIME))


WOBBLE = 2e-5 * np.sin(2.0 * np.pi * 11.0 * TIME)  # m, of a controlled axis
PATHS = {  # m; the first two pass several periods of a ripple in a sample
    "turning": 0.1 * np.sin(ANGLE),
    "two speeds": np.where(TIME < 3.0, 0.1 * TIME, 0.3 - 0.02 * (TIME - 3.0)) + WOBBLE,
    "slow": 2e-3 * np.sin(ANGLE),
}


@pytest.mark.parametrize(("path", "period"), [("turning", 7.3e-6), ("two speeds", 2.2e-5)])
def test_a_ripple_is_found_at_any_speed_and_taken_off(path, period):
    turn = 2.0 * np.pi * PATHS[path] / period
    error = 2.3e-8 * np.sin(turn + 1.0)
    readings = PATHS[path] + error + noise()
    found = ripple_periods(readings)
    cycles = np.ptp(PATHS[path]) / period
    assert min(abs(p / period - 1.0) for p in found) < 0.1 / cycles
    assert white_noise(readings) > 1.5 * NOISE
    left = readings - ripple(readings, found)
    assert white_noise(left) == pytest.approx(NOISE, rel=0.1)
    assert np.std(left - PATHS[path] - noise()) < 0.2 * np.std(error)


def test_the_log_with_the_longest_travel_tells_the_ripples_of_all():
    period = 2.2e-5
    paths = (1e-5 * np.sin(ANGLE), PATHS["turning"])
    read = [p + 2.3e-8 * np.sin(2.0 * np.pi * p / period) + noise() for p in paths]
    logs = [SimpleNamespace(axes={"x": SimpleNamespace(position=r)}) for r in read]
    logs.append(SimpleNamespace(axes={"y": SimpleNamespace(position=1e3 * read[0])}))
    assert ripple_periods(read[0]) == ()
    assert ripples_of_widest(logs, "x") == ripple_periods(read[1]) != ()
    assert ripples_of_widest(logs, "z") == ()


def test_a_vibration_at_constant_speed_is_none():
    """It repeats along the track there, but not on the way to that speed."""
    speed = 0.05 * np.clip(TIME / 3.0, 0.0, 1.0)
    path = DT * np.cumsum(speed)
    shaken = path + 2e-8 * np.sin(2.0 * np.pi * 900.0 * TIME) + noise()
    assert ripple_periods(shaken) == ()


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("step", [0.0, 3e-6])
def test_noise_and_rounding_are_none(path, step):
    readings = PATHS[path] + noise()
    if step:
        readings = step * np.rint(readings / step)
    assert ripple_periods(readings) == ()


@pytest.mark.parametrize(("fine", "path"), [(2.1e-8, "turning"), (7.7e-8, "slow")])
def test_a_coarse_step_is_found_beside_a_fine_one(path, fine):
    """The encoder rounds, its noise is added, and the log rounds again."""
    step = 3.16e-7
    readings = step * np.rint(PATHS[path] / step) + noise()
    readings = fine * np.rint(readings / fine)
    assert resolution_of(np.diff(readings)) == pytest.approx(step, rel=2e-3)


def test_speeds_that_are_multiples_of_one_are_no_step():
    speed = np.repeat([0.01, 0.02, 0.03, 0.04], len(TIME) // 4)
    assert resolution_of(np.diff(DT * np.cumsum(speed) + noise())) == 0.0


RATE = 1000.0
T = np.arange(8001) / RATE
PLACE = waves((0.1, 0.9, 0.3), (0.02, 2.3, 1.1))
READ, TOLD = 2e-4, 2e-2  # m and m/s RMS


def speed(t):
    return (PLACE(t + 5e-5) - PLACE(t - 5e-5)) / 1e-4


def measured(seed: int, late: float = 0.0, gain: float = 1.0):
    rng = np.random.default_rng(seed)
    x = PLACE(T) + rng.normal(0.0, READ, len(T))
    return x, gain * speed(T - late) + rng.normal(0.0, TOLD, len(T))


@pytest.mark.parametrize("late", [0.0, 4.3e-3])
def test_the_position_that_both_tell_is_nearer_to_the_truth(late):
    x, v = measured(1, late)
    position, weight = together(x, v, RATE**-1)
    # Densities: 2 READ^2/RATE of the readings, 2 TOLD^2/RATE of the velocity.
    assert weight == pytest.approx((READ * RATE / TOLD) ** 2, rel=0.5)
    error = position - PLACE(T)
    assert np.std(error) < 0.5 * READ
    # The rate at one sample is that of the velocity, not of the differenced readings.
    assert np.std(between(error, 1.0 / RATE)) < 1.5 * TOLD
    assert np.std(between(x - PLACE(T), 1.0 / RATE)) > 10.0 * TOLD


def test_a_velocity_that_cannot_be_trusted_is_not_used():
    x, v = measured(2, gain=1.05)
    assert together(x, v, 1.0 / RATE)[1] == 0.0
    x, v = measured(2, late=0.02)
    assert together(x, v, 1.0 / RATE)[1] == 0.0
    x, _ = measured(3)
    copied = np.gradient(x, 1.0 / RATE)  # made of the readings: it holds nothing new
    np.testing.assert_array_equal(together(x, copied, 1.0 / RATE)[0], x)
    assert together(x, None, 1.0 / RATE)[0] is x


def test_the_noise_floor_knows_of_the_velocity():
    x, v = measured(4)
    motion = motion_of(log_of(RATE, x, np.zeros_like(x), velocity=v), "x", "log")
    noise = noise_of(AxisModel(1.0), motion)
    # What m times the rate of the velocity's noise leaves, and what readings alone would.
    k = np.searchsorted(noise.frequency, 60.0)
    turn = (2.0 * np.pi * noise.frequency[k]) ** 2  # 1/s^2
    wanted = 2.0 * TOLD**2 / RATE * turn
    assert noise.power[k] == pytest.approx(wanted, rel=0.5)
    alone = noise_of(AxisModel(1.0), motion_of(log_of(RATE, x, np.zeros_like(x)), "x", "log"))
    assert alone.power[k] == pytest.approx(2.0 * READ**2 / RATE * turn**2, rel=0.5)
