"""Force error by frequency: noise alone is the noise band, a planted line stands out of its own."""

import re
from dataclasses import replace

import numpy as np
import pytest
from constructed import windowed
from machines import one_axis
from noisy_motion import MASS, PUSH, RATE, noisy

from identify.output.words.residual import region_in_words
from identify.validation.misfit_maps import misfit_by_frequency
from identify.workflow import compare, fit
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
LINE, HEIGHT = 29.0, 0.02  # Hz, N


def logs(seed: int, **disturbance: float):
    machine = STAGE
    if disturbance:
        pump = Fitted.at_start(CATALOGUE["periodic_disturbance"], disturbance)
        machine = STAGE.with_axis("x", STAGE.axes["x"].with_effect(pump))
    return {
        "run": simulate(machine, "tracking", seed=seed, duration=12.0, simulator=ReducedSimulator)
    }


def test_noise_alone_fills_the_noise_band():
    result = fit(STAGE, logs(3), test_function=0.1)
    found = misfit_by_frequency(result.fits["x"].axis, result.datasets["x"].fit)
    assert found.high[-1] > 100.0
    wide = found.low > 2.0
    assert found.rms[wide] == pytest.approx(found.floor[wide], rel=0.4)
    assert np.mean(found.rms[wide] / found.floor[wide]) == pytest.approx(1.0, abs=0.15)


def test_a_planted_line_has_its_height_in_newtons_in_its_band_alone_which_is_the_worst_region():
    compared = compare(STAGE, logs(3, f=LINE, a=HEIGHT)).axes["x"]
    found = next(m for m in compared.maps if m.coordinate == "frequency")
    hit = (found.low <= LINE) & (found.high > LINE)
    assert hit.sum() == 1
    assert found.rms[hit][0] == pytest.approx(HEIGHT / np.sqrt(2.0), rel=0.03)
    assert (found.rms[~hit] < 3.0 * found.floor[~hit]).all()
    worst = compared.worst[0]
    assert worst.coordinate == "frequency"
    assert worst.low <= LINE < worst.high
    assert re.match("frequency between .* Hz", region_in_words(worst))


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
        found = misfit_by_frequency(AxisModel(MASS), [pumped])
        own = (found.low <= frequency) & (frequency < found.high)
        assert found.rms[own] == pytest.approx(height / np.sqrt(2.0), rel=0.06)
        assert found.rms[~own].max() < 0.2 * found.rms[own][0]
    np.testing.assert_array_equal(found.low[1:], found.high[:-1])
    np.testing.assert_allclose(found.centre**2, found.low * found.high)
    wide = found.low > 1.5
    np.testing.assert_allclose(found.high[wide] / found.low[wide], np.sqrt(2.0))
    width = np.sqrt(found.high - found.low)
    np.testing.assert_allclose(found.floor, width * 1e-3 * np.sqrt(2.0 / RATE), rtol=0.3)
    assert found.share.sum() == pytest.approx(1.0)
    near = (found.low < 1.3) & (found.high > 1.3)
    heavy = misfit_by_frequency(AxisModel(2.0 * MASS), [pumped])
    # The inertia takes up the force of the motion at 1.3 Hz.
    assert found.visited[near][0] < 0.05 * heavy.visited[near][0]
    low = np.sqrt(np.sum(heavy.rms[heavy.low < 4.0] ** 2))
    pushes = PUSH(np.arange(8000) / RATE)
    assert low == pytest.approx(MASS * np.std(pushes), rel=0.1)


def test_the_power_of_logs_is_weighed_by_their_lengths():
    axis = AxisModel(MASS)
    logs = [noisy(15, 0.02, duration=5.0), noisy(16, 0.025, duration=9.0)]
    one, two, both = (misfit_by_frequency(axis, part) for part in (logs[:1], logs[1:], logs))
    ends = [log.motion.time[-1] for log in logs]
    wide = one.low > 10.0
    wanted = (ends[0] * one.rms**2 + ends[1] * two.rms**2) / sum(ends)
    np.testing.assert_allclose(both.rms[wide] ** 2, wanted[wide], rtol=0.02)
    noise = (ends[0] * one.floor**2 + ends[1] * two.floor**2) / sum(ends)
    np.testing.assert_allclose(both.floor[wide] ** 2, noise[wide], rtol=0.02)
