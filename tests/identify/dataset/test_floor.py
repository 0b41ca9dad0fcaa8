"""The noise floor told before a fit, and what rounding adds, against what the true model leaves."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import CATALOGUE, effect, log_of, waves, windowed
from machines import one_axis
from planted_logs import RATE, SLIDE, Ride, logged

from benchmarks.second_simulator.machine import drawn, run
from identify import workflow
from identify.dataset.motion import motion_of
from identify.dataset.noise import noise_of
from identify.dataset.noise_floor import floor_of, noise_beside, rounding_in
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.readings import white_rounding
from identify.dataset.spectrum import fitted_levels
from identify.estimation.force_balance import residual
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted
from twin.simulator import ReducedSimulator

STAGE = one_axis(load_model("proton_xy", CATALOGUE))
# log's rate Hz of a control at 10 kHz, encoder's resolution m and noise m, current's noise A
DRIVES = {
    "white": (10e3, 0.0, 5e-8, 2e-3),
    "rounded": (10e3, 5e-7, 5e-8, 2e-3),
    "every 2nd": (5e3, 0.0, 1e-7, 2e-4),
    "every 5th": (2e3, 0.0, 1e-7, 2e-3),
    "every 5th, rounded": (2e3, 5e-7, 1e-7, 2e-3),
    "every 5th, rounded, current known well": (2e3, 5e-7, 1e-7, 0.0),
    "every 10th": (1e3, 0.0, 1e-7, 2e-3),
}
QUICK = ("white", "rounded", "every 5th, rounded", "every 10th")


def log_of_drive(name, seed=2, duration=8.0):
    rate, resolution, encoder, current = DRIVES[name]
    machine = drawn(
        np.random.default_rng(seed), 10e3, rate,
        resolution=resolution, encoder_noise=encoder, current_noise=current,
    )  # fmt: skip
    return run(machine, seed, duration)


@pytest.mark.parametrize("length", [0.1, pytest.param(0.2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "drive",
    [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in DRIVES],
)
def test_the_floor_is_what_the_true_model_leaves(drive, length):
    fit = workflow.fit(STAGE, {"log": log_of_drive(drive)}, test_function=length).fits["x"]
    floor = noise_beside(fit.axis, fit.logs)
    assert 0.8 * floor.low < fit.error < floor.high
    if length == 0.1 and "known" not in drive:  # else less is sure of so short a log
        assert floor.value == pytest.approx(fit.error, rel=0.2)
    assert fit.floor == fit.noise.value
    assert 0.8 * fit.error < fit.floor <= fit.error * (1.0 + 1e-9)
    assert sum(part**2 for part in floor.parts.values()) == pytest.approx(floor.value**2)
    thinned = floor.parts["aliasing"] > 0.8 * floor.value
    assert thinned is drive.startswith("every")
    assert floor.follows_motion is thinned
    if not thinned:
        assert floor.parts["aliasing"] == 0.0


def test_steps_of_the_readings_are_a_part_where_the_axis_has_them():
    machine = drawn(np.random.default_rng(3), 10e3, resolution=5e-7, encoder_noise=0.0)
    fit = workflow.fit(STAGE, {"log": run(machine, 3, 8.0)}, test_function=0.1).fits["x"]
    steps = Fitted.at_start(CATALOGUE["encoder_quantization"], {"step": 5e-7})
    blind = noise_beside(fit.axis, fit.logs)
    knowing = noise_beside(fit.axis.with_effect(steps), fit.logs)
    assert blind.parts["rounding"] == 0.0
    assert knowing.parts["rounding"] > 0.5 * blind.value
    assert blind.high > knowing.value


def test_the_coherence_of_a_dip_is_found_and_independent_noises_have_none():
    turn = np.linspace(0.05, 1.4, 200)
    white, bend = np.cos(0.5 * turn) ** 2, 1e3 * (2.0 - 2.0 * np.cos(turn)) ** 2
    chance = np.random.default_rng(1).gamma(60.0, 1.0 / 60.0, len(turn))
    for coherence in (0.0, 0.7, 0.9):
        both = 0.7 * white + 0.02 * bend
        both -= 2.0 * coherence * np.sqrt(0.7 * white * 0.02 * bend)
        shapes = np.stack([white, bend, -np.sqrt(white * bend)], axis=1)
        level, reading, dip = fitted_levels(shapes, both * chance)
        assert 0.5 * dip / np.sqrt(level * reading) == pytest.approx(coherence, abs=0.15)
        if coherence:
            assert level == pytest.approx(0.7, rel=0.3)


MASS = 1.7
PLAIN = AxisModel(MASS)
KNOWING = PLAIN.with_effect(effect("encoder_quantization"))
# step m, rate Hz, length of the test functions s, amplitude m and frequency Hz of the motion
MOTIONS = {
    "few steps, at the turns": (1e-6, 2000.0, 0.2, 2e-4, 0.2),
    "slow": (1e-5, 4000.0, 0.1, 2e-3, 0.3),
    "a step a sample": (1e-6, 4000.0, 0.1, 2e-3, 0.3),
    "ten steps a sample": (1e-7, 4000.0, 0.1, 2e-3, 0.3),
    "fast": (1e-6, 1000.0, 0.05, 0.03, 0.5),
    "fast, short": (1e-6, 4000.0, 0.02, 0.03, 1.3),
    "fast, often sampled": (1e-6, 10e3, 0.05, 0.03, 1.3),
}


def rounded(step, rate, length, amplitude, often, reading=0.0, force=0.0, duration=8.0):
    """A log of an exact motion with white noise of reading (m) and force (N), then rounded."""
    rng, t = np.random.default_rng(1), np.arange(round(duration * rate)) / rate
    terms = ((amplitude, often, 0.4), (0.13 * amplitude, 2.4 * often, 1.0))
    pull = waves(*((-MASS * a * (2.0 * np.pi * f) ** 2, f, p) for a, f, p in terms))
    x = waves(*terms)(t) + rng.normal(0.0, 1.0, len(t)) * reading
    u = pull(t + 0.5 / rate) + rng.normal(0.0, 1.0, len(t)) * force
    x = step * np.rint(x / step) if step else x
    return windowed(motion_of(log_of(rate, x, u), "x", "log", ripples=()), length)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("motion", "reading"),  # the latter in steps
    [*((m, 0.0) for m in MOTIONS), *((m, 0.5) for m in ("slow", "a step a sample", "fast"))],
)
def test_the_floor_with_the_step_is_what_rounding_and_noise_leave(motion, reading):
    log = rounded(*MOTIONS[motion], reading=reading * MOTIONS[motion][0])
    assert floor_of(KNOWING, [log]) == pytest.approx(rms(residual(PLAIN, [log])), rel=0.2)


def test_moves_of_even_speed_have_rounding_where_their_speed_puts_it():
    """As white noise most of these logs would be told 1.75 times too large.

    Of a single log no more is sure: a tone that its test functions pass is as large as it is near
    to zero, and there nothing tells it from a motion.
    """
    ratios = []
    for seed in range(100, 124):
        log = logged(SLIDE, Ride(seed, fast=0.05), noise=0.0).axes["x"]
        steps = 3e-6 * np.rint(log.position / 3e-6)
        motion = motion_of(log_of(RATE, steps, log.force), "x", "ride", ripples=())
        one = PreparedLog.of(motion, 0.1)
        rate = np.diff(steps - log.position)[: motion.raw.shape[1]] * RATE
        true = SLIDE.mass * rms(one.fine.acceleration(rate)[moving([one], sticks(SLIDE))])
        ratios.append(rounding_in(SLIDE, [one]) / true)
    assert np.median(ratios) == pytest.approx(1.0, abs=0.2)


def test_rounding_is_not_taken_for_noise_of_the_force():
    """Less of it in the band than white noise has does not show what it has below."""
    log = rounded(5e-7, 10e3, 0.1, 2e-4, 1.0, force=1e-4)
    planted = 2.0 / 10e3 * 1e-4**2
    found = noise_of(PLAIN, log.motion)
    assert found.force == pytest.approx(planted, rel=0.3)
    assert found.most >= 3.0 * white_rounding(5e-7, 1e-4)


def test_rounding_at_even_speed_is_no_aliasing():
    """A tone of rounding beside another looks like the dip of a thinned log; below it is quiet."""
    stage = one_axis(load_model("proton_xy", CATALOGUE))
    axis = stage.axes["x"]
    quiet = replace(axis.hardware, current_noise=1e-5, encoder_noise=1e-10)
    steps = Fitted.at_start(CATALOGUE["encoder_quantization"], {"step": 2.3e-7})
    machine = replace(stage, axes={"x": replace(axis, hardware=quiet).with_effect(steps)})
    log = simulate(machine, "moves", seed=1, duration=8.0, simulator=ReducedSimulator)
    fit = workflow.fit(stage, {"log": log}, test_function=0.1).fits["x"]
    floor = noise_beside(fit.axis.with_effect(steps), fit.logs)
    assert floor.parts["aliasing"] == 0.0
    assert floor.value == pytest.approx(fit.error, rel=0.2)
