"""Laws of the force error by frequency."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import windowed
from noisy_motion import MASS, PUSH, RATE, noisy

from identify.validation.misfit_maps import _edges, bands
from twin.model.machine import AxisModel


def test_the_error_by_frequency_is_the_residual_in_its_band():
    """A sine of known height in the command stands in the band of its frequency alone."""
    log = noisy(14, 1e-3, duration=12.0)
    t = (np.arange(log.motion.raw.shape[1]) + 0.5) / RATE
    for frequency, height in ((7.0, 0.3), (61.0, 0.02)):
        line = height * np.sin(2.0 * np.pi * frequency * t)
        raw = log.motion.raw + np.stack([0.0 * line, line])
        signals = log.motion.signals.copy()
        signals[2] = raw[1].reshape(signals.shape[1], -1).mean(axis=1)
        pumped = windowed(replace(log.motion, raw=raw, signals=signals))
        found = bands(AxisModel(MASS), [pumped])
        own = (found.low <= frequency) & (frequency < found.high)
        assert found.error[own] == pytest.approx(height / np.sqrt(2.0), rel=0.06)
        assert found.error[~own].max() < 0.2 * found.error[own][0]
    width = np.sqrt(found.high - found.low)
    np.testing.assert_allclose(found.noise, width * 1e-3 * np.sqrt(2.0 / RATE), rtol=0.3)
    explain = found.to_explain[(found.low < 1.3) & (found.high > 1.3)]
    assert explain[0] < 0.05  # the inertia takes it up
    heavy = bands(AxisModel(2.0 * MASS), [pumped])
    low = np.sqrt(np.sum(heavy.to_explain[heavy.low < 4.0] ** 2))
    pushes = PUSH(np.arange(8000) / RATE)
    assert low == pytest.approx(MASS * np.std(pushes), rel=0.1)


def test_the_power_of_logs_is_weighed_by_their_lengths():
    axis = AxisModel(MASS)
    logs = [noisy(15, 0.02, duration=5.0), noisy(16, 0.025, duration=9.0)]
    one, two, both = (bands(axis, part) for part in (logs[:1], logs[1:], logs))
    ends = [log.motion.time[-1] for log in logs]
    wide = one.low > 10.0
    wanted = (ends[0] * one.error**2 + ends[1] * two.error**2) / sum(ends)
    np.testing.assert_allclose(both.error[wide] ** 2, wanted[wide], rtol=0.02)
    noise = (ends[0] * one.noise**2 + ends[1] * two.noise**2) / sum(ends)
    np.testing.assert_allclose(both.noise[wide] ** 2, noise[wide], rtol=0.02)


def test_bands_cover_all_frequencies_once_in_half_octaves():
    frequency = 0.25 * np.arange(1, 700)
    edges = _edges(frequency)
    assert edges[0] == 0.125
    assert edges[-1] == pytest.approx(frequency[-1] + 0.125)
    counts, _ = np.histogram(frequency, edges)
    assert counts.min() >= 1
    assert counts.sum() == len(frequency)
    wide = edges[edges > 1.5]
    np.testing.assert_allclose(wide[1:] / wide[:-1], np.sqrt(2.0))
