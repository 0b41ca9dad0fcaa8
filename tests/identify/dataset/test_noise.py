"""The noise floor told before a fit, against what windows pass and what the true model leaves."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import effect, log_of, moved, waves, windowed
from machines import CATALOGUE, STAGE, tracked
from noisy_motion import MASS as WINDOW_MASS
from noisy_motion import PLACE, PUSH, noisy
from noisy_motion import RATE as WINDOW_RATE
from planted_logs import RATE, SLIDE, Ride, having, logged
from scipy.signal import welch

from benchmarks.second_simulator.machine import drawn, run
from identify import workflow
from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.noise import noise_of, noises_of
from identify.dataset.noise_floor import floor_of, noise_beside, rounding_in
from identify.dataset.prepared_log import PreparedLog, moving, on_blocks, sticks, total_force
from identify.dataset.readings import white_rounding
from identify.dataset.spectrum import fitted_levels, median_spectrum
from identify.dataset.test_function import TestFunction
from identify.dataset.time_scale import (
    QUIET,
    TEST_FUNCTIONS,
    choose_length,
    choose_test_function,
    inertia,
)
from identify.estimation.force_balance import residual
from twin.checks import moves
from twin.effect import LEAST
from twin.logs import AxisLog
from twin.model.machine import AxisModel, Fitted, MachineModel

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


def log_of_drive(name, seed=2, duration=8.0):
    rate, resolution, encoder, current = DRIVES[name]
    machine = drawn(
        np.random.default_rng(seed), 10e3, rate,
        resolution=resolution, encoder_noise=encoder, current_noise=current,
    )  # fmt: skip
    return run(machine, seed, duration)


@pytest.mark.parametrize("length", [0.1, 0.2])
@pytest.mark.parametrize("drive", DRIVES)
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


def test_rounding_at_even_speed_is_no_aliasing():
    """A tone of rounding beside another looks like the dip of a thinned log; below it is quiet."""
    stage = STAGE
    axis = stage.axes["x"]
    quiet = replace(axis.hardware, current_noise=1e-5, encoder_noise=1e-10)
    steps = Fitted.at_start(CATALOGUE["encoder_quantization"], {"step": 2.3e-7})
    machine = replace(stage, axes={"x": replace(axis, hardware=quiet).with_effect(steps)})
    log = tracked(machine, 1, 8.0, "moves")
    fit = workflow.fit(stage, {"log": log}, test_function=0.1).fits["x"]
    floor = noise_beside(fit.axis.with_effect(steps), fit.logs)
    assert floor.parts["aliasing"] == 0.0
    assert floor.value == pytest.approx(fit.error, rel=0.2)


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


def test_a_length_is_chosen_at_which_the_steps_of_the_readings_are_quiet():
    def chosen(step: float) -> float:
        logs = [logged(SLIDE, Ride(seed, fast=0.05), noise=0.0).axes["x"] for seed in (100, 101)]
        motions = tuple(
            motion_of(
                log_of(RATE, step * np.rint(g.position / step), g.force), "x", "r", ripples=()
            )
            for g in logs
        )
        return choose_length(lambda length: (motions, ()))

    assert chosen(1e-8) == TEST_FUNCTIONS[0]
    assert chosen(3e-6) > TEST_FUNCTIONS[0]


def test_rounding_is_not_taken_for_noise_of_the_force():
    """Less of it in the band than white noise has does not show what it has below."""
    log = rounded(5e-7, 10e3, 0.1, 2e-4, 1.0, force=1e-4)
    planted = 2.0 / 10e3 * 1e-4**2
    found = noise_of(PLAIN, log.motion)
    assert found.force == pytest.approx(planted, rel=0.3)
    assert found.most >= 3.0 * white_rounding(5e-7, 1e-4)


# Laws of the noise floor and of the choice of windows.
#
# White noise of known size is put into command or reading of an exact motion; what a window passes
# of it is the sum of its squared weights, which no spectrum is needed for.


def passed(window: TestFunction, force: float, reading: float) -> float:
    """RMS (N) of what a window passes of white noise of the force and of the reading."""
    bend = np.diff(np.pad(window.slope, 1)) / window.period
    return float(
        np.hypot(
            force * np.linalg.norm(window.weights), WINDOW_MASS * reading * np.linalg.norm(bend)
        )
    )


@pytest.mark.parametrize(("force", "reading"), [(0.04, 0.0), (0.02, 3e-9), (0.02, 4e-7)])
def test_the_floor_is_what_the_window_passes_of_the_noise(force, reading):
    axis = AxisModel(WINDOW_MASS)
    log = noisy(1, force, reading)
    found = noise_of(axis, log.motion)
    assert found.force == pytest.approx(2.0 / WINDOW_RATE * force**2, rel=0.2)
    if reading > 1e-8:
        assert found.reading == pytest.approx(2.0 / WINDOW_RATE * reading**2, rel=0.2)
    np.testing.assert_allclose(found.power, found.force + found.reading * found.bend)
    assert floor_of(axis, [log]) == pytest.approx(passed(log.fine, force, reading), rel=0.12)


def test_a_floor_that_what_is_left_refutes_is_that_of_the_residual():
    """As where readings that the log does not hold made the command."""
    axis, log = AxisModel(WINDOW_MASS), noisy(6, 0.02, duration=20.0)
    left = residual(axis, [log])
    floor = noise_beside(axis, [log], [left])
    assert floor.value == pytest.approx(floor_of(axis, [log]), rel=0.1)
    assert floor.value <= np.sqrt(np.mean(left**2)) * (1.0 + 1e-9)
    assert floor.low < floor.value < floor.high < 1.3 * floor.value
    # A log that seems five times as noisy as what is left of it.
    loud = noisy(6, 0.1, duration=20.0)
    known = noise_beside(axis, [loud])
    assert known.value == pytest.approx(5.0 * floor.value, rel=0.05)
    less = noise_beside(axis, [loud], [left])
    assert less.value == pytest.approx(floor.value, rel=0.15)
    assert less.high == known.high
    # What a model lacks is slower than the noise, and stays above the floor.
    slow = 2.0 * floor.value * np.sin(2.0 * np.pi * np.arange(len(left)) / 64.0)
    assert noise_beside(axis, [loud], [left + slow]).value == pytest.approx(floor.value, rel=0.15)


def test_what_one_log_has_more_of_in_the_band_is_no_noise():
    """Such as a load that strikes within its play, over which the quiet log knows better."""
    axis = AxisModel(WINDOW_MASS)
    quiet, struck = noisy(4, 0.02), noisy(5, 0.06)
    alone, both = (floor_of(axis, logs) for logs in ([quiet], [struck, quiet]))
    assert both == pytest.approx(alone, rel=0.02)
    assert floor_of(axis, [struck]) > 2.5 * alone


def test_a_log_whose_reading_hides_the_force_leaves_room_for_so_much_noise_of_it():
    axis = AxisModel(WINDOW_MASS)
    hidden, loud = noisy(6, 1e-5, 4e-7), noisy(7, 2.0)
    own = noise_of(axis, hidden.motion)
    assert own.force < 0.5 * own.most
    _, found = noises_of(axis, [hidden.motion, loud.motion])
    assert found.force == own.most


def test_what_the_model_explains_is_no_noise():
    """A force that follows a wildly moving other axis, in the command with the other sign."""
    rng = np.random.default_rng(6)
    t = np.arange(6000) / 1000.0
    u = WINDOW_MASS * PUSH(t + 5e-4) + rng.normal(0.0, 0.01, len(t))
    motion = motion_of(log_of(1000.0, PLACE(t), u), "x", "")
    others = rng.normal(0.0, 1.0, motion.others.shape)
    axis = AxisModel(WINDOW_MASS, effects=(effect("axis_coupling", {"mass": 0.0, "damping": 0.3}),))
    motion = replace(motion, others=others)
    acts = total_force(on_blocks(axis), motion)
    assert np.std(acts) > 0.2
    middles = (np.arange(motion.raw.shape[1]) + 0.5) * motion.sample_period
    raw = motion.raw - np.stack([np.zeros(len(middles)), np.interp(middles, motion.time, acts)])
    motion = replace(motion, track=Blocks(motion.signals, raw))
    known, unknown = (noise_of(a, motion).force for a in (axis, AxisModel(WINDOW_MASS)))
    assert known < 1.5 * 2.0 / 1000.0 * 0.01**2
    assert unknown > 20.0 * known
    lagging = AxisModel(WINDOW_MASS, effects=(effect("actuator_lag", {"tau": 2e-3}),))
    assert (
        noise_of(lagging, noisy(6, 0.04, duration=2.0).motion).force
        < 0.5 * 2.0 / WINDOW_RATE * 0.04**2
    )


@pytest.mark.parametrize(("segment", "n"), [(256, 5000), (255, 3000)])
def test_the_median_spectrum_is_that_of_welch(segment, n):
    signal = np.random.default_rng(8).normal(1.0, 2.0, n) + np.linspace(0.0, 30.0, n)
    found = median_spectrum(signal, segment, 2e-3, np.zeros(n, bool))
    wanted = welch(signal, 500.0, nperseg=segment, average="median", detrend="linear")
    np.testing.assert_allclose(found[0], wanted[0])
    np.testing.assert_allclose(found[1], wanted[1], rtol=1e-9)


def test_segments_of_rest_are_left_out_but_a_quarter_is_kept():
    rng = np.random.default_rng(9)
    signal = rng.normal(0.0, 1.0, 8192)
    loud = np.arange(8192) >= 2600
    signal[loud] *= 30.0
    _, power = median_spectrum(signal, 256, 1e-3, loud)
    assert np.mean(power) == pytest.approx(2e-3, rel=0.2)
    _, blind = median_spectrum(signal, 256, 1e-3, ~loud)
    assert np.mean(blind) == pytest.approx(900.0 * 2e-3, rel=0.2)


def test_heads_are_the_first_seconds_of_each_log():
    logs = tuple(windowed(moved(np.random.default_rng(k), 5.0, 1000.0)) for k in range(5))
    dataset = Dataset("x", logs, (), None)
    assert [len(w.motion.time) for w in dataset.heads] == [2000] * 5
    assert len(dataset.in_heads) == sum(map(len, logs))
    for head, log, own in zip(dataset.heads, logs, np.split(dataset.in_heads, 5), strict=True):
        np.testing.assert_array_equal(log.command[own], head.command)
    few = Dataset("x", logs[:3], (), None)
    assert [len(w.motion.time) for w in few.heads] == [pytest.approx(8000 / 3, abs=1)] * 3


def test_the_rough_mass_is_exact_beside_dry_and_viscous_friction():
    m = moved(np.random.default_rng(11), 2.0, 1000.0)
    rate = np.gradient(m.velocity, m.period)
    u = 2.3 * rate + 0.7 * np.sign(m.velocity) + 0.4 * m.velocity - 0.9
    pushed = replace(m, track=Blocks(np.stack([m.position, m.velocity, u]), m.raw))
    assert inertia([pushed, pushed]) == pytest.approx(2.3, rel=2e-3)
    pulled = replace(m, track=Blocks(np.stack([m.position, m.velocity, -u]), m.raw))
    assert inertia([pulled]) == pytest.approx(LEAST)  # the least mass that a model may have


def test_the_square_of_a_floor_of_logs_is_the_mean_of_theirs_weighed_by_their_lengths():
    axis = AxisModel(WINDOW_MASS)
    logs = [noisy(4, 0.02, duration=3.0), noisy(5, 0.025, duration=9.0)]
    own = [floor_of(axis, [log]) ** 2 for log in logs]
    parts = [len(log.motion.time) for log in logs]
    assert parts[1] > 2.5 * parts[0]
    wanted = (own[0] * parts[0] + own[1] * parts[1]) / sum(parts)
    assert floor_of(axis, logs) ** 2 == pytest.approx(wanted, rel=1e-9)


def test_the_shortest_window_that_is_quiet_is_chosen():
    """Quiet: a floor below a hundredth of what the inertia leaves, here a force of 0.5 N rms."""
    quiet = None
    for size in (1e-4, 0.022, 0.05, 0.4):
        log = noisy(12, size, duration=5.0)
        t = np.arange(log.motion.raw.shape[1]) / WINDOW_RATE
        pulled = np.stack([log.motion.raw[0], log.motion.raw[1] + np.sqrt(0.5) * np.sin(8.0 * t)])
        signals = log.motion.signals.copy()
        signals[2] = pulled[1].reshape(len(log.motion.time), -1).mean(axis=1)
        motion = replace(log.motion, track=Blocks(signals, pulled))
        fine = [TestFunction.of_length(n, 1.0 / WINDOW_RATE) for n in TEST_FUNCTIONS]
        calm = [passed(w, size, 0.0) < QUIET * 0.5 for w in fine]
        wanted = TEST_FUNCTIONS[calm.index(True)] if any(calm) else TEST_FUNCTIONS[-1]
        assert choose_test_function([motion]) == wanted, size
        quiet = quiet or motion
    slow = replace(motion, period=6.3e-3)
    assert choose_test_function([quiet]) == TEST_FUNCTIONS[0]
    assert choose_test_function([quiet], [slow]) == TEST_FUNCTIONS[2]


def test_an_axis_moves_where_its_noise_does_not_cover_its_travel():
    t, rng = np.arange(4001) / 1000.0, np.random.default_rng(13)
    for x, wanted in (
        (2e-3 * np.sin(300.0 * t), True),
        (2e-3 * np.sin(3.0 * t), True),
        (1e-6 * t, True),
        (1e-3 * np.clip(2.0 * (t - 2.0), 0.0, 1.0), True),  # rests before and after
        (3e-7 * np.exp(-t / 0.02) + rng.normal(0, 1e-9, len(t)), False),  # settles
        (np.where(t < 2.0, 0.0, 1e-3), False),  # a step of the encoder
        (rng.normal(0, 1e-6, len(t)), False),
        (0.0 * t, False),
    ):
        assert moves(log_of(1000.0, x, x), "x") is wanted


@pytest.mark.parametrize("effect", ["flexible_mode", "base_vibration"])
def test_what_a_resonance_makes_of_the_noise_of_readings_is_noise(effect: str) -> None:
    """0.2 um at 1 kHz leave several times what the mass alone would make of them."""
    share = {"flexible_mode": "load", "base_vibration": "recoil"}[effect]
    axis = having(SLIDE, effect, **{share: 0.6, "frequency": 40.0, "damping": 0.02})
    model, ride = MachineModel("m", {"x": axis}, RATE), logged(axis, Ride(5, 20.0))
    own = ride.axes["x"]
    noise = 2e-7 * np.random.default_rng(3).standard_normal(len(own.columns["position"]))
    noisy = AxisLog({**own.columns, "position": own.columns["position"] + noise}, own.units)
    log = replace(ride, axes={"x": noisy})
    found = workflow.fit(model, {"ride": log}, test_function=0.03)
    known = found.datasets["x"].with_force_noise(0.0).training  # what no sensor makes is left out
    fitted = found.fits["x"]
    # 20 s of a resonance that is 2.5 Hz wide tell its level to a sixth
    assert floor_of(fitted.axis, known) == pytest.approx(fitted.error, rel=0.3)
