"""Laws of what actuator and encoder make of a log: known filters, and errors undone."""

import numpy as np
import pytest
from constructed import (
    LAG,
    PAYLOAD,
    RIPPLE,
    SENSING,
    SHORT,
    STICKY,
    effect,
    log_of,
    waves,
    windowed,
)

from identify.dataset.drive import (
    actual_force,
    forces_lessened,
    reading_error,
    true_motion,
)
from identify.dataset.motion import motion_of
from identify.estimation.force_balance import averaged_force
from twin.model.machine import AxisModel


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


def test_a_motor_counts_as_weaker_from_less_than_half_its_force():
    """A saturation that loses all above its limit lowers a constant command by what it says."""

    def motions(*levels):
        return [SHORT.with_force(0.0 * SHORT.raw[1] + v) for v in levels]

    limited = effect("actuator_saturation", {"limit": 1.0, "loss": 1.0})
    axis = AxisModel(1.0, effects=(limited,))
    assert forces_lessened(axis, motions(1.9)) == 1.0
    assert forces_lessened(axis, motions(2.1)) == pytest.approx(1.0 / 2.1)
    assert forces_lessened(axis, motions(4.0, 3.0)) == pytest.approx(np.sqrt(2.0) / 5.0)
    dead = AxisModel(1.0, effects=(effect("actuator_deadband", {"width": 9.0}),))
    assert forces_lessened(dead, motions(4.0)) == 1e-6


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
