"""Motions, windows, actuators and encoders: exact, or of the order that they must be."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from arms import ARM, arm_log
from constructed import (
    LAG,
    PAYLOAD,
    RIPPLE,
    SENSING,
    SHORT,
    STICKY,
    effect,
    log_of,
    moved,
    waves,
    windowed,
)

from identify.analysis.first_model import first_model
from identify.dataset.blocks import Blocks, Columns
from identify.dataset.bodies import PIECE, bodies_along
from identify.dataset.coordinates import excitation
from identify.dataset.drive import actual_force, reading_error, true_motion
from identify.dataset.motion import SMOOTHED, Motion, motion_of
from identify.dataset.prepared_log import motor_gain
from identify.dataset.test_function import TestFunction
from identify.estimation.force_balance import averaged_force, residual, unbalanced
from identify.workflow import fit
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.knee import Imitated
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel
from twin.mujoco.mechanism import mechanism_of
from twin.signals import local_parabola

RATE = 4000.0
PLACE = waves((0.03, 2.3, 0.4), (0.004, 7.1, 1.0))
FORCE = waves((3.0, 3.7, 0.2), (1.1, 17.0, 1.9))
T = np.arange(round(1.3 * RATE) + 1) / RATE
SMOOTH = motion_of(log_of(RATE, PLACE(T), FORCE(T), 2.0 * PLACE(T + 0.1)), "x", "smooth")


@pytest.mark.parametrize(("length", "period"), [(0.02, 7e-4), (0.0081, 1e-3)])
def test_windows_have_unit_sum_their_length_and_a_quarters_stride(length, period):
    window = TestFunction.of_length(length, period)
    n = round(length / period)
    assert len(window.weights) == len(window.slope) == n
    assert window.length == pytest.approx(n * period)
    assert window.stride == n // 4  # four windows cover one instant
    every = (window, window.refined(3), window.sharpened(5))
    for one in every:
        assert one.weights.sum() == pytest.approx(1.0)
        assert one.slope.sum() == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_allclose(one.weights, one.weights[::-1])
        np.testing.assert_allclose(one.slope, -one.slope[::-1], atol=1e-9 * one.slope.max())
    assert every[1].period == pytest.approx(period / 3.0)
    assert every[1].stride == 3 * window.stride
    assert every[1].length == pytest.approx(window.length)
    assert (every[2].period, every[2].stride) == (period, window.stride)


@pytest.mark.parametrize("parts", [1, 5])
def test_a_force_in_sharpened_windows_is_the_acceleration_of_the_readings(parts):
    """A smooth force, mean over each block, against the second difference of the positions.

    Without sharpening the two differ by the second order of the block; with it by a higher one.
    """
    errors = []
    for period in (2e-3, 1e-3):
        blocks = TestFunction.of_length(0.06, period)
        edges = period / parts * np.arange(round(0.5 / period) * parts + 1)
        velocity = np.diff(np.sin(90.0 * edges + 0.3)) / period * parts
        wanted = blocks.refined(parts).acceleration(velocity)
        force = np.diff(90.0 * np.cos(90.0 * edges[::parts] + 0.3)) / period
        both = (blocks, blocks.sharpened(parts))
        errors.append([np.abs(w.mean(force) - wanted).max() for w in both])
    plain, sharp = np.array(errors[0]) / np.array(errors[1])
    assert 3.5 < plain < 4.5
    assert sharp > 6.5  # the bell's second derivative jumps at its ends, which costs an order
    assert errors[1][1] < 0.1 * errors[1][0]


def test_a_motion_has_the_means_of_its_blocks():
    """With a = the reading at t_k: the middle's position, the sample's mean speed and command."""
    block = round(SMOOTH.period * RATE)
    n = SMOOTH.signals.shape[1]
    x, u = PLACE(T), FORCE(T)
    assert (block, n) == (4, (len(T) - 1) // 4)
    for row, samples in (
        (SMOOTH.position, 0.5 * (x[1:] + x[:-1])),
        (SMOOTH.velocity, np.diff(x) * RATE),
        (SMOOTH.command, u[:-1]),
    ):
        wanted = [np.mean(samples[k * block : (k + 1) * block]) for k in range(n)]
        np.testing.assert_allclose(row, wanted, rtol=1e-12)
    np.testing.assert_allclose(SMOOTH.raw[0], np.diff(x)[: n * block] * RATE)
    np.testing.assert_allclose(SMOOTH.raw[1], u[: n * block])
    np.testing.assert_allclose(SMOOTH.time, (np.arange(n) + 0.5) * block / RATE)
    t = SMOOTH.time
    np.testing.assert_allclose(SMOOTH.others[0], 2.0 * PLACE(t + 0.1), atol=2e-6)
    h = 1e-4
    speed = (PLACE(t + h + 0.1) - PLACE(t - h + 0.1)) / h
    np.testing.assert_allclose(SMOOTH.others[1], speed, atol=1e-4)
    rate = (PLACE(t + h + 0.1) - 2.0 * PLACE(t + 0.1) + PLACE(t - h + 0.1)) * 2.0 / h**2
    np.testing.assert_allclose(SMOOTH.others[2][1:-1], rate[1:-1], atol=2e-2)
    assert (SMOOTH.name, SMOOTH.axis, SMOOTH.sample_period) == ("smooth", "x", 1.0 / RATE)
    assert SMOOTH.time_origin == 0.0
    alone = motion_of(log_of(RATE, x, u), "x", "alone")
    assert alone.others.shape == alone.signals.shape
    assert not alone.others.any()


def test_smoothing_keeps_parabolas_and_averages_noise():
    bent = motion_of(log_of(1000.0, np.linspace(0, 1, 1501) ** 2, np.zeros(1501)), "x", "")
    np.testing.assert_allclose(
        bent.smoothed_position, np.linspace(0, 1, 1501)[:1500] ** 2, atol=1e-12
    )
    rng = np.random.default_rng(3)
    x = np.linspace(0, 1, 9001) + rng.normal(0, 1e-6, 9001)
    rough = motion_of(log_of(9000.0, x, np.zeros(9001)), "x", "")
    left = rough.smoothed_position - np.linspace(0, 1, 9001)[: rough.raw.shape[1]]
    m = SMOOTHED // 2  # variance of a parabola's value in the middle of 2 m + 1 points
    shrunk = 3.0 * (3 * m**2 + 3 * m - 1) / ((2 * m + 3) * (2 * m + 1) * (2 * m - 1))
    assert np.std(left) == pytest.approx(1e-6 * np.sqrt(shrunk), rel=0.1)


def test_a_force_moved_ahead_is_that_of_later():
    shift = 3.0 / RATE
    found = SMOOTH.with_force_ahead(shift)
    np.testing.assert_allclose(found.raw[1][:-3], SMOOTH.raw[1][3:])
    np.testing.assert_allclose(found.raw[1][-3:], SMOOTH.raw[1][-1])
    np.testing.assert_array_equal(found.raw[0], SMOOTH.raw[0])
    np.testing.assert_allclose(found.command, found.raw[1].reshape(-1, 4).mean(axis=1))
    np.testing.assert_array_equal(found.signals[:2], SMOOTH.signals[:2])
    half = SMOOTH.with_force_ahead(-0.5 / RATE).raw[1]
    np.testing.assert_allclose(half[1:], 0.5 * (SMOOTH.raw[1][1:] + SMOOTH.raw[1][:-1]))


def test_logs_that_tell_nothing_are_refused():
    x, u = PLACE(T), FORCE(T)
    with pytest.raises(InputError, match="no axis 'z'; it has x"):
        motion_of(log_of(RATE, x, u), "z", "n")
    with pytest.raises(InputError, match="stands still"):
        motion_of(log_of(RATE, 0.0 * x + 1.0, u), "x", "n")
    with pytest.raises(InputError, match=r"lasts 0.499 s; identification needs 0.5 s"):
        motion_of(log_of(1000.0, x[:499], u[:499]), "x", "n")
    assert motion_of(log_of(1000.0, x[:500], u[:500]), "x", "n").period == 1e-3
    with pytest.raises(InputError, match=r"0.007 s is shorter than 8 .* at least 0.008 s"):
        TestFunction.of_length(7e-3, 1e-3)


def test_the_noise_of_a_command_is_what_its_controller_did_not_make_of_the_readings():
    """A gain on the last speeds makes force of the encoder's noise; it does not count."""
    rng = np.random.default_rng(5)
    n, size = 16_000, 0.03
    x = PLACE(np.arange(n) / RATE) + rng.normal(0, 1e-7, n)
    own = rng.normal(0, size, n)
    answered = -900.0 * np.concatenate([[0.0], np.diff(x)]) * RATE
    for made in (0.0, answered):
        motion = motion_of(log_of(RATE, x, own + made), "x", "")
        assert motion.command_noise == pytest.approx(2.0 * size**2 / RATE, rel=0.1)


def test_the_step_of_rounded_readings_is_found_and_undone():
    step = 6.3e-5
    t = np.arange(8000) / RATE
    exact = 0.05 * PLACE(t)
    motion = motion_of(log_of(RATE, step * np.rint(exact / step), FORCE(t)), "x", "")
    assert motion.resolution == pytest.approx(step, rel=1e-3)
    ramp = 1.37e-6 * np.arange(8000)  # m, 1.37 um a sample: known to a sample's travel
    climbed = motion_of(log_of(RATE, step * np.rint(ramp / step), FORCE(t)), "x", "")
    assert climbed.resolution == pytest.approx(step)
    made = (step * np.rint(ramp / step) - ramp)[: len(climbed.rounding)]
    inner = slice(60, -60)
    assert np.abs(climbed.rounding - made)[inner].max() < 0.6 * 1.37e-6
    assert len(climbed.rounding) == climbed.raw.shape[1] + 1
    assert np.abs(motion.rounding).max() < 1.5 * step
    smooth = motion_of(log_of(RATE, exact, FORCE(t)), "x", "")
    assert smooth.resolution == 0.0
    assert not smooth.rounding.any()
    assert len(smooth.rounding) == smooth.raw.shape[1] + 1


def test_the_excitation_covers_all_motions():
    first, second = SMOOTH, replace(moved(np.random.default_rng(6), 1.2), name="b")
    found = excitation([first, second], None)
    position, velocity = (
        np.concatenate([getattr(m, k) for m in (first, second)]) for k in ("position", "velocity")
    )
    assert (found.position_low, found.position_high) == (position.min(), position.max())
    assert found.speed_max == np.abs(velocity).max()
    assert found.duration == pytest.approx(len(first.time) * 1e-3 + len(second.time) * 1e-3)
    assert found.force_max == max(np.abs(m.command).max() for m in (first, second))
    wide = excitation([first], (-0.5, 0.02))
    assert (wide.position_low, wide.position_high) == (-0.5, first.position.max())
    assert wide.period == first.period


def test_the_dry_level_is_half_the_gap_between_the_directions():
    def pushed(velocity, command) -> Motion:
        signals = np.stack([np.linspace(0, 1, len(velocity)), velocity, command])
        return replace(SHORT, track=Blocks(signals, signals[1:]))

    velocity = np.concatenate([np.full(300, 0.4), np.full(200, -0.4), np.full(500, 0.0079)])
    command = np.concatenate([np.full(300, 1.7), np.full(200, -0.5), np.full(500, 55.0)])
    assert excitation([pushed(velocity, command)], None).dry_level == pytest.approx(1.1)
    one_way = pushed(np.abs(velocity), command)
    assert excitation([one_way], None).dry_level == pytest.approx(np.median(np.abs(command)))


def test_a_lag_follows_its_equation_at_the_logs_own_rate():
    """tau u' + u = command, held over a sample: a decay by exp(-dt/tau) towards it."""
    command, dt, tau = SHORT.raw[1], SHORT.sample_period, 1.7e-3
    u, wanted = command[0], []
    decay = np.exp(-dt / tau)
    for c in command:
        begin, u = u, c + (u - c) * decay
        wanted.append(c + (begin - c) * (1.0 - decay) * tau / dt)  # the mean over the sample
    found = actual_force(AxisModel(1.0, effects=(LAG,)), SHORT)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    np.testing.assert_array_equal(actual_force(AxisModel(1.0, effects=(STICKY,)), SHORT), command)


def test_an_actuation_adds_the_mean_of_what_it_makes_of_the_command_to_the_residual():
    log = windowed(SHORT)
    for chain in (LAG, RIPPLE):
        axis = AxisModel(1.0, effects=(chain,))
        added = log.fine.mean(actual_force(axis, SHORT) - SHORT.raw[1])
        found = averaged_force(axis, [log])
        np.testing.assert_allclose(found, added, atol=5e-3 * np.std(added))
    pushed = AxisModel(1.0, effects=(LAG, effect("constant_force", {"F0": 0.4})))
    np.testing.assert_allclose(
        averaged_force(pushed, [log]), 0.4 + averaged_force(AxisModel(1.0, effects=(LAG,)), [log])
    )


def test_an_error_is_told_in_the_force_as_it_was_logged():
    """A saturation that loses all above its limit lowers a constant command by what it says."""

    def logs(*levels):
        return [windowed(SHORT.with_force(0.0 * SHORT.raw[1] + v)) for v in levels]

    limited = effect("actuator_saturation", {"limit": 1.0, "loss": 1.0})
    axis = AxisModel(1.0, effects=(limited,))
    assert motor_gain(AxisModel(1.0), logs(2.1)) == 1.0
    assert motor_gain(axis, logs(1.25)) == pytest.approx(0.8)
    assert motor_gain(axis, logs(4.0, 3.0)) == pytest.approx(np.sqrt(2.0) / 5.0)
    left = residual(axis, logs(1.25)) * 0.8
    np.testing.assert_allclose(left, residual(AxisModel(1.0), logs(1.0)))
    more = AxisModel(1.0, effects=(effect("torque_constant", {"error": 0.25}),))
    np.testing.assert_allclose(unbalanced(more, logs(2.0)), 1.25 * residual(more, logs(2.0)))
    dead = AxisModel(1.0, effects=(effect("actuator_deadband", {"width": 9.0}),))
    assert np.isfinite(residual(dead, logs(4.0))).all()


def test_a_late_reading_is_undone():
    """What was read is x(t - tau): the true motion is the reading tau later."""
    axis = AxisModel(1.0, effects=(SENSING[0], PAYLOAD))
    tau, dt = 7.3e-4, SHORT.sample_period
    true, rate = true_motion(axis, SHORT)
    at = np.arange(len(rate), dtype=float)
    ahead = np.interp(at + tau / dt, at, SHORT.raw[0])
    inner = slice(20, -20)
    np.testing.assert_allclose(true.raw[0][inner], ahead[inner], atol=2e-3 * np.ptp(ahead))
    np.testing.assert_allclose(true.raw[0] + rate, SHORT.raw[0], atol=1e-12)
    np.testing.assert_array_equal(true.raw[1], SHORT.raw[1])
    assert rate[-1] == 0.0  # nothing is known of what follows
    means = rate.reshape(len(SHORT.time), -1).mean(axis=1)
    np.testing.assert_allclose(SHORT.velocity - true.velocity, means, atol=1e-12)
    seen = SHORT.at_samples(0.0)[0]
    error = (seen - np.interp(at + tau / dt, at, seen)).reshape(len(means), -1).mean(axis=1)
    np.testing.assert_allclose((SHORT.position - true.position)[9:-9], error[9:-9], atol=2e-6)
    np.testing.assert_array_equal(true.command, SHORT.command)


def test_a_ripple_of_the_encoder_is_undone():
    """reading = x + e(x) of a known x gives e(x) back, also where smoothing takes a ripple off."""
    rate = 2000.0
    x = waves((3e-3, 1.3, 0.4), (6e-4, 5.1, 1.0))
    t = np.arange(3000) / rate
    fastest = np.abs(np.diff(x(t))).max()
    period = float(12.0 * fastest)  # 12 samples at the highest speed
    sizes = {n: period * v / 15 for n, v in {"a1": 0.4, "b1": -0.3, "a2": 0.2, "b2": 0.1}.items()}
    ripple = effect("encoder_ripple", {"period": period, **sizes})
    turn = 2.0 * np.pi * x(t) / period
    error = sum(
        sizes[f"a{k}"] * np.sin(k * turn) + sizes[f"b{k}"] * np.cos(k * turn) for k in (1, 2)
    )
    motion = motion_of(log_of(rate, x(t) + error, 0.0 * t), "x", "")
    found, _ = reading_error(AxisModel(1.0, effects=(ripple,)), motion)
    inner = slice(30, len(found) - 30)
    np.testing.assert_allclose(found[inner], error[inner], atol=0.03 * np.abs(error).max())


# Of a machine of many joints little is held beside its log, and what is let go of comes back


LOG = arm_log(1)
MODEL = first_model({"1": LOG}, "arm", load_catalogue(), ("arm.xml", ARM))
SIGNALS = ("signals", "raw", "force", "net", "joint_signals", "smoothed_position")


@pytest.mark.parametrize("samples", [1, 3])
@pytest.mark.parametrize("blocks", [slice(None), slice(7), slice(5, None), slice(9, 9)])
def test_signals_made_of_columns_are_those_that_are_kept(samples, blocks):
    rng = np.random.default_rng(3)
    columns = Columns(*(rng.normal(size=n) for n in (20 * samples + 1, 20 * samples)), samples, 0.1)
    made, kept = columns.during(blocks), columns.kept.during(blocks)
    for name in ("signals", "raw"):
        np.testing.assert_array_equal(getattr(made, name), getattr(kept, name))
    before = made.signals
    made.forget()
    assert made.signals is not before
    np.testing.assert_array_equal(made.signals, before)


def test_bodies_are_the_same_in_pieces_of_time_as_at_once():
    log = arm_log(2, duration=20.0)
    assert len(log) > 2 * PIECE
    found = bodies_along(MODEL, log, "log")
    mechanism = mechanism_of(ARM, "arm.xml", MODEL.joints)
    x = np.stack([log.axes[axis].position for axis in mechanism.axes])
    smooth = local_parabola(x, 9, derivative=1, period=log.period)  # over less than 20 ms
    place, speed = (0.5 * (s[:, 1:] + s[:, :-1]) for s in (x, smooth))
    between = np.diff(x) / log.period
    momentum, force = mechanism.along(place, between, speed)
    load = force + local_parabola(momentum, 9, derivative=1, period=log.period)
    for i, axis in enumerate(mechanism.axes):
        own = found[axis]
        np.testing.assert_allclose(own.force, force[i], rtol=1e-9)
        np.testing.assert_allclose(own.momentum + own.mass * between[i], momentum[i], rtol=1e-9)
        np.testing.assert_allclose(own.load, load[i], rtol=1e-6, atol=1e-9)
        np.testing.assert_array_equal(own.during(slice(70, 5000)).speeds, speed[:, 70:5000])


@pytest.mark.slow
def test_a_fit_of_joints_holds_little_beside_their_log_and_its_signals_come_back():
    size = sum(axis.columns[n].nbytes for axis in LOG.axes.values() for n in ("position", "force"))
    fit(MODEL, {"1": LOG})  # loads what is compiled
    tracemalloc.start()
    found = fit(MODEL, {"1": LOG})
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 2.0 * size  # momentum and bias force are one, signals would be one and a half
    for dataset in found.datasets.values():
        motion = dataset.training[0].motion
        before = {name: getattr(motion, name) for name in SIGNALS}
        motion.forget()
        for name, values in before.items():
            np.testing.assert_array_equal(getattr(motion, name), values)


def test_the_count_of_an_encoder_outlasts_a_resampling():
    """Straight lines between uneven samples of a coarse encoder hide its count, not from this."""
    rng = np.random.default_rng(2)
    uneven = np.cumsum(rng.uniform(0.004, 0.007, 1500))
    even = np.arange(uneven[0], uneven[-1], 0.005)
    counted = np.round(0.5 * np.sin(2.0 * uneven) / 0.006) * 0.006
    x = np.interp(even, uneven, counted)
    own = AxisLog({"position": x, "force": np.cos(2.0 * even)})
    motion = motion_of(Log(200.0, {"x": own}), "x", "a")
    assert motion.count == pytest.approx(0.006, rel=0.01)
    covered = excitation([motion], None)
    law = load_catalogue()["dahl"]
    fine = {**law.starts(), "Fc": 1.0, "sigma0": 1.0 / 0.004}  # a reach of two thirds of a count
    assert law.imitation(fine, covered).of is Imitated.DRY_FRICTION
    assert law.imitation({**fine, "sigma0": 1.0 / 0.01}, covered) is None
