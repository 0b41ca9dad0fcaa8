"""Laws of a fit that moves the force channel: by as much as it is off, kept where it helps."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import dataset_of, fit_of, log_of, waves, windowed

from identify.dataset.motion import motion_of
from identify.estimation.alignment import fit_aligned, misalignment, moved_by, realigned
from identify.estimation.fit import fit_axis
from identify.output.words.fit import channel_delay_in_words
from identify.rules import RULE
from twin.model.machine import AxisModel

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


@pytest.mark.parametrize("samples", [0.3, 2.4])
def test_a_force_that_acts_before_its_stamp_is_found_by_so_many_samples(samples):
    log = aligned(samples)
    axis = AxisModel(1.7)
    found = misalignment(fit_of(axis, log), dataset_of(log))
    assert found == pytest.approx(samples * 1e-3, rel=0.05)
    dataset = realigned(dataset_of(log, holdout=(log,)), found)
    assert dataset.channel_delay == found
    left = [fit_of(axis, *logs).error for logs in ((log,), dataset.fit, dataset.holdout)]
    assert left[1] < 0.15 * left[0]
    assert left[1] == left[2]
    assert dataset.test_function_length == pytest.approx(0.02)
    back = realigned(dataset, 0.0)
    assert back.channel_delay == 0.0
    np.testing.assert_allclose(back.fit[0].command[9:-9], log.command[9:-9], atol=0.1)


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
