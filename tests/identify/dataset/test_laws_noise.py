"""Laws of the noise floor and of the choice of windows.

White noise of known size is put into command or reading of an exact motion; what a window passes
of it is the sum of its squared weights, which no spectrum is needed for.
"""

from dataclasses import replace

import numpy as np
import pytest
from constructed import STICKY, effect, log_of, moved, windowed
from noisy_motion import MASS, PLACE, PUSH, RATE, noisy
from scipy.signal import welch

from identify.dataset.dataset import Dataset, datasets
from identify.dataset.floor import noise_beside
from identify.dataset.motion import motion_of
from identify.dataset.noise_floor import (
    _at_rest,
    _between_samples,
    floor_of,
    median_spectrum,
    noise_floor,
    noise_of,
    noises_of,
    together,
)
from identify.dataset.prepared_log import REST_SPEED, PreparedLog, on_blocks, total_force
from identify.dataset.test_function import TestFunction
from identify.dataset.time_scale import QUIET, TEST_FUNCTIONS, choose_test_function, inertia
from identify.dataset.whittle import _underneath, fitted_levels
from identify.estimation.force_balance import residual
from twin.checks import moves
from twin.effect import LEAST
from twin.errors import InputError
from twin.model.machine import AxisModel, MachineModel


def passed(window: TestFunction, force: float, reading: float) -> float:
    """RMS (N) of what a window passes of white noise of the force and of the reading."""
    bend = np.diff(np.pad(window.slope, 1)) / window.period
    return float(
        np.hypot(force * np.linalg.norm(window.weights), MASS * reading * np.linalg.norm(bend))
    )


# --- the floor ----------------------------------------------------------------------------------


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


def test_the_floor_is_in_proportion_to_the_noise_and_falls_with_the_window():
    """Of the force by the square root of its length, of the reading by its power 5/2."""
    axis = AxisModel(MASS)
    quiet, loud = noisy(2, 0.02), noisy(2, 0.04)
    assert floor_of(axis, [loud]) == pytest.approx(2.0 * floor_of(axis, [quiet]), rel=0.02)
    longer = PreparedLog.of(quiet.motion, 0.08)
    ratio = floor_of(axis, [quiet]) / floor_of(axis, [longer])
    assert ratio == pytest.approx(np.sqrt(2.0), rel=0.02)
    short, long = (noisy(3, 1e-5, 4e-7, length=n) for n in (0.1, 0.2))
    assert floor_of(axis, [short]) / floor_of(axis, [long]) == pytest.approx(2.0**2.5, rel=0.05)


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


def test_logs_weigh_by_how_long_they_last_not_by_their_blocks():
    short, long = noisy(7, 0.02, duration=3.0), noisy(8, 0.04, duration=9.0)
    coarse = replace(long.motion, period=10.0 * long.motion.period)
    assert together([1.0, 4.0], [short.motion, coarse]) ** 2 == pytest.approx(
        (1.0 * 3.0 + 4.0 * 90.0) / 93.0, rel=1e-2
    )


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
    near = noisy(5, 0.024)  # within what estimates scatter each log keeps its own
    each = [floor_of(axis, [log]) ** 2 for log in (near, quiet)]
    assert floor_of(axis, [near, quiet]) ** 2 == pytest.approx(np.mean(each), rel=1e-9)


def test_a_log_whose_reading_hides_the_force_leaves_room_for_so_much_noise_of_it():
    axis = AxisModel(MASS)
    hidden, loud = noisy(6, 1e-5, 4e-7), noisy(7, 2.0)
    own = noise_of(axis, hidden.motion)
    assert own.force < 0.5 * own.most
    _, found = noises_of(axis, [hidden.motion, loud.motion])
    assert found.force == own.most


def test_logs_of_unlike_rates_have_noise_of_their_own():
    """As large a noise of each sample has more power below half the rate where that is lower."""
    axis = AxisModel(MASS)
    t = np.arange(2000) / (0.25 * RATE)
    u = MASS * PUSH(t + 2.0 / RATE) + np.random.default_rng(8).normal(0.0, 0.02, len(t))
    slow = windowed(motion_of(log_of(0.25 * RATE, PLACE(t), u), "x", "", ripples=()), 0.04)
    fast = noisy(4, 0.02)
    apart = [noise_of(axis, log.motion).force for log in (slow, fast)]
    assert apart[0] > 3.0 * apart[1]
    assert [n.force for n in noises_of(axis, [slow.motion, fast.motion])] == apart


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
    motion = replace(motion, raw=raw)
    known, unknown = (noise_of(a, motion).force for a in (axis, AxisModel(MASS)))
    assert known < 1.5 * 2.0 / 1000.0 * 0.01**2
    assert unknown > 20.0 * known
    lagging = AxisModel(MASS, effects=(effect("actuator_lag", {"tau": 2e-3}),))
    assert noise_of(lagging, noisy(6, 0.04, duration=2.0).motion).force < 0.5 * 2.0 / RATE * 0.04**2


def test_rounding_of_the_readings_adds_what_it_pretends():
    step, t = 4e-5, np.arange(24_000) / RATE
    exact = 0.05 * PLACE(t)
    rng = np.random.default_rng(7)
    u = MASS * 0.05 * PUSH(t + 0.5 / RATE) + rng.normal(0.0, 1e-3, len(t))
    log = windowed(motion_of(log_of(RATE, step * np.rint(exact / step), u), "x", ""), 0.2)
    rounding = log.motion.rounding
    pretended = MASS * log.fine.acceleration(np.diff(rounding) * RATE)
    blind = AxisModel(MASS)
    knowing = AxisModel(MASS, effects=(effect("encoder_quantization"),))
    added = floor_of(knowing, [log]) ** 2 - floor_of(blind, [log]) ** 2
    assert np.sqrt(added) == pytest.approx(np.sqrt(np.mean(pretended**2)), rel=0.3)


# --- its spectra --------------------------------------------------------------------------------


@pytest.mark.parametrize(("segment", "n"), [(256, 5000), (255, 3000), (256, 900)])
def test_themedian_spectrum_is_that_of_welch(segment, n):
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


def test_levels_are_found_beneath_what_stands_out():
    k = np.linspace(0.02, 1.0, 400)
    shapes = np.stack([np.cos(0.3 * np.pi * k) ** 2, 1e3 * k**4], axis=1)
    flat = shapes @ [0.7, 0.02]
    np.testing.assert_allclose(fitted_levels(shapes, flat), [0.7, 0.02], rtol=1e-6)
    peak = flat * (1.0 + 300.0 * np.exp(-(((k - 0.3) / 0.02) ** 2)))
    np.testing.assert_allclose(fitted_levels(shapes, peak), [0.7, 0.02], rtol=0.05)
    only = fitted_levels(shapes, 5.0 * shapes[:, 1])
    np.testing.assert_allclose(only, [0.0, 5.0], atol=1e-3)
    under = _underneath(np.concatenate([np.full(50, 9.0), np.full(50, 2.0), np.full(50, 5.0)]))
    assert (under[:90] == 2.0).all()
    assert (np.diff(under) >= 0.0).all()
    assert under[-1] == 5.0


def test_between_blocks_a_force_goes_straight_and_rest_is_that_of_the_block():
    motion = noisy(10, 0.01, duration=1.0).motion
    line = 3.0 * motion.time + 0.2
    found = _between_samples(line, motion)
    samples = np.arange(1, motion.raw.shape[1]) / RATE
    inner = (samples > motion.time[0]) & (samples < motion.time[-1])
    np.testing.assert_allclose(found[inner], 3.0 * samples[inner] + 0.2)
    velocity = np.where(np.arange(len(motion.time)) < 300, 0.99 * REST_SPEED, 1.0) * -0.7
    velocity[500] = 1.01 * REST_SPEED * 0.7
    still = replace(motion, signals=np.stack([motion.position, velocity, motion.command]))
    held = _at_rest(AxisModel(1.0, effects=(effect("coulomb_viscous"),)), still)
    np.testing.assert_array_equal(np.flatnonzero(held), np.arange(300 * 4 - 1))
    assert not _at_rest(AxisModel(1.0, effects=(STICKY,)), still).any()


# --- choosing logs and windows ------------------------------------------------------------------


def test_the_rough_mass_is_exact_beside_dry_and_viscous_friction():
    m = moved(np.random.default_rng(11), 2.0, 1000.0)
    rate = np.gradient(m.velocity, m.period)
    u = 2.3 * rate + 0.7 * np.sign(m.velocity) + 0.4 * m.velocity - 0.9
    pushed = replace(m, signals=np.stack([m.position, m.velocity, u]))
    assert inertia([pushed, pushed]) == pytest.approx(2.3, rel=2e-3)
    pulled = replace(m, signals=np.stack([m.position, m.velocity, -u]))
    assert inertia([pulled]) == pytest.approx(LEAST)  # the least mass that a model may have


def test_the_shortest_window_that_is_quiet_is_chosen():
    """Quiet: a floor below a hundredth of what the inertia leaves, here a force of 0.5 N rms."""
    quiet = None
    for size in (1e-4, 0.022, 0.032, 0.05, 0.4):
        log = noisy(12, size, duration=5.0)
        t = np.arange(log.motion.raw.shape[1]) / RATE
        pulled = np.stack([log.motion.raw[0], log.motion.raw[1] + np.sqrt(0.5) * np.sin(8.0 * t)])
        signals = log.motion.signals.copy()
        signals[2] = pulled[1].reshape(len(log.motion.time), -1).mean(axis=1)
        motion = replace(log.motion, raw=pulled, signals=signals)
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


def test_studies_are_of_the_axes_that_move():
    stage = MachineModel("s", {"x": AxisModel(1.0), "y": AxisModel(1.0)}, RATE)
    t = np.arange(8000) / RATE
    log = log_of(RATE, PLACE(t), PUSH(t), 0.0 * t)
    other = log_of(RATE, PLACE(t[:5000] + 1.0), PUSH(t[:5000]))
    found = datasets(stage, {"a": log}, {"b": other}, 0.05)
    assert list(found) == ["x"]
    assert [w.motion.name for w in (*found["x"].fit, *found["x"].holdout)] == ["a", "b"]
    assert found["x"].test_function_length == pytest.approx(0.05)
    assert found["x"].excitation.position_high == found["x"].fit[0].motion.position.max()
    with pytest.raises(InputError, match=r"no axis of the model \(x, y\) moves"):
        datasets(stage, {"a": log_of(RATE, 0.0 * t, t)}, {})


def test_heads_are_the_first_seconds_of_each_log():
    logs = tuple(windowed(moved(np.random.default_rng(k), 5.0, 1000.0)) for k in range(5))
    dataset = Dataset("x", logs, (), None)
    assert [len(w.motion.time) for w in dataset.heads] == [2000] * 5
    assert len(dataset.in_heads) == sum(map(len, logs))
    for head, log, own in zip(dataset.heads, logs, np.split(dataset.in_heads, 5), strict=True):
        np.testing.assert_array_equal(log.command[own], head.command)
    few = Dataset("x", logs[:3], (), None)
    assert [len(w.motion.time) for w in few.heads] == [pytest.approx(8000 / 3, abs=1)] * 3
