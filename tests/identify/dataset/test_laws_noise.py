"""Laws of the noise floor and of the choice of windows.

White noise of known size is put into command or reading of an exact motion; what a window passes
of it is the sum of its squared weights, which no spectrum is needed for.
"""

from dataclasses import replace

import numpy as np
import pytest
from constructed import effect, log_of, moved, windowed
from noisy_motion import MASS, PLACE, PUSH, RATE, noisy
from scipy.signal import welch

from identify.dataset.dataset import Dataset
from identify.dataset.motion import Blocks, motion_of
from identify.dataset.noise import noise_of, noises_of
from identify.dataset.noise_floor import floor_of, noise_beside, noise_floor
from identify.dataset.prepared_log import on_blocks, total_force
from identify.dataset.spectrum import median_spectrum
from identify.dataset.test_function import TestFunction
from identify.dataset.time_scale import QUIET, TEST_FUNCTIONS, choose_test_function, inertia
from identify.estimation.force_balance import residual
from twin.checks import moves
from twin.effect import LEAST
from twin.model.machine import AxisModel


def passed(window: TestFunction, force: float, reading: float) -> float:
    """RMS (N) of what a window passes of white noise of the force and of the reading."""
    bend = np.diff(np.pad(window.slope, 1)) / window.period
    return float(
        np.hypot(force * np.linalg.norm(window.weights), MASS * reading * np.linalg.norm(bend))
    )


@pytest.mark.parametrize(("force", "reading"), [(0.04, 0.0), (0.02, 3e-9), (0.02, 4e-7)])
def test_the_floor_is_what_the_window_passes_of_the_noise(force, reading):
    axis = AxisModel(MASS)
    log = noisy(1, force, reading)
    found = noise_of(axis, log.motion)
    assert found.force == pytest.approx(2.0 / RATE * force**2, rel=0.2)
    if reading > 1e-8:
        assert found.reading == pytest.approx(2.0 / RATE * reading**2, rel=0.2)
    np.testing.assert_allclose(found.power, found.force + found.reading * found.bend)
    assert floor_of(axis, [log]) == pytest.approx(passed(log.fine, force, reading), rel=0.12)


def test_a_floor_that_what_is_left_refutes_is_that_of_the_residual():
    """As where readings that the log does not hold made the command."""
    axis, log = AxisModel(MASS), noisy(6, 0.02, duration=20.0)
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


def test_the_square_of_a_floor_of_logs_is_the_mean_of_theirs_weighed_by_their_lengths():
    axis = AxisModel(MASS)
    logs = [noisy(4, 0.02, duration=3.0), noisy(5, 0.025, duration=9.0)]
    own = [floor_of(axis, [log]) ** 2 for log in logs]
    parts = [len(log.motion.time) for log in logs]
    assert parts[1] > 2.5 * parts[0]
    wanted = (own[0] * parts[0] + own[1] * parts[1]) / sum(parts)
    assert floor_of(axis, logs) ** 2 == pytest.approx(wanted, rel=1e-9)
    pairs = [(log.motion, log.test_function) for log in logs]
    assert noise_floor(axis, pairs[::-1]) == pytest.approx(floor_of(axis, logs))


def test_what_one_log_has_more_of_in_the_band_is_no_noise():
    """Such as a load that strikes within its play, over which the quiet log knows better."""
    axis = AxisModel(MASS)
    quiet, struck = noisy(4, 0.02), noisy(5, 0.06)
    alone, both = (floor_of(axis, logs) for logs in ([quiet], [struck, quiet]))
    assert both == pytest.approx(alone, rel=0.02)
    assert floor_of(axis, [struck]) > 2.5 * alone


def test_a_log_whose_reading_hides_the_force_leaves_room_for_so_much_noise_of_it():
    axis = AxisModel(MASS)
    hidden, loud = noisy(6, 1e-5, 4e-7), noisy(7, 2.0)
    own = noise_of(axis, hidden.motion)
    assert own.force < 0.5 * own.most
    _, found = noises_of(axis, [hidden.motion, loud.motion])
    assert found.force == own.most


def test_what_the_model_explains_is_no_noise():
    """A force that follows a wildly moving other axis, in the command with the other sign."""
    rng = np.random.default_rng(6)
    t = np.arange(6000) / 1000.0
    u = MASS * PUSH(t + 5e-4) + rng.normal(0.0, 0.01, len(t))
    motion = motion_of(log_of(1000.0, PLACE(t), u), "x", "")
    others = rng.normal(0.0, 1.0, motion.others.shape)
    axis = AxisModel(MASS, effects=(effect("axis_coupling", {"mass": 0.0, "damping": 0.3}),))
    motion = replace(motion, others=others)
    acts = total_force(on_blocks(axis), motion)
    assert np.std(acts) > 0.2
    middles = (np.arange(motion.raw.shape[1]) + 0.5) * motion.sample_period
    raw = motion.raw - np.stack([np.zeros(len(middles)), np.interp(middles, motion.time, acts)])
    motion = replace(motion, track=Blocks(motion.signals, raw))
    known, unknown = (noise_of(a, motion).force for a in (axis, AxisModel(MASS)))
    assert known < 1.5 * 2.0 / 1000.0 * 0.01**2
    assert unknown > 20.0 * known
    lagging = AxisModel(MASS, effects=(effect("actuator_lag", {"tau": 2e-3}),))
    assert noise_of(lagging, noisy(6, 0.04, duration=2.0).motion).force < 0.5 * 2.0 / RATE * 0.04**2


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


def test_the_rough_mass_is_exact_beside_dry_and_viscous_friction():
    m = moved(np.random.default_rng(11), 2.0, 1000.0)
    rate = np.gradient(m.velocity, m.period)
    u = 2.3 * rate + 0.7 * np.sign(m.velocity) + 0.4 * m.velocity - 0.9
    pushed = replace(m, track=Blocks(np.stack([m.position, m.velocity, u]), m.raw))
    assert inertia([pushed, pushed]) == pytest.approx(2.3, rel=2e-3)
    pulled = replace(m, track=Blocks(np.stack([m.position, m.velocity, -u]), m.raw))
    assert inertia([pulled]) == pytest.approx(LEAST)  # the least mass that a model may have


def test_the_shortest_window_that_is_quiet_is_chosen():
    """Quiet: a floor below a hundredth of what the inertia leaves, here a force of 0.5 N rms."""
    quiet = None
    for size in (1e-4, 0.022, 0.05, 0.4):
        log = noisy(12, size, duration=5.0)
        t = np.arange(log.motion.raw.shape[1]) / RATE
        pulled = np.stack([log.motion.raw[0], log.motion.raw[1] + np.sqrt(0.5) * np.sin(8.0 * t)])
        signals = log.motion.signals.copy()
        signals[2] = pulled[1].reshape(len(log.motion.time), -1).mean(axis=1)
        motion = replace(log.motion, track=Blocks(signals, pulled))
        fine = [TestFunction.of_length(n, 1.0 / RATE) for n in TEST_FUNCTIONS]
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


def test_heads_are_the_first_seconds_of_each_log():
    logs = tuple(windowed(moved(np.random.default_rng(k), 5.0, 1000.0)) for k in range(5))
    dataset = Dataset("x", logs, (), None)
    assert [len(w.motion.time) for w in dataset.heads] == [2000] * 5
    assert len(dataset.in_heads) == sum(map(len, logs))
    for head, log, own in zip(dataset.heads, logs, np.split(dataset.in_heads, 5), strict=True):
        np.testing.assert_array_equal(log.command[own], head.command)
    few = Dataset("x", logs[:3], (), None)
    assert [len(w.motion.time) for w in few.heads] == [pytest.approx(8000 / 3, abs=1)] * 3
