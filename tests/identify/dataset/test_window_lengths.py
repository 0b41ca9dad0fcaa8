"""Test functions are as long as the logs ask for, and a hanging beginning is left out."""

from __future__ import annotations

import numpy as np
import pytest
from check_drive import BIAS, COULOMB, DAMPING, drive
from check_drive import MASS as DRIVEN
from constructed import effect, log_of
from machines import CATALOGUE

from identify.analysis.first_model import first_model
from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.dataset.test_function import LEAST_BLOCKS
from identify.dataset.time_scale import FOREIGN, HELD, AtLength, beginnings
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.output.words.fit import prepared_in_words
from identify.workflow import compare, fit
from twin.errors import InputError
from twin.model.machine import AxisModel, MachineModel

FREE_RATE = 1000.0
FREE_MASS = 2.0
FREE_PLAIN = MachineModel("plain", {"x": AxisModel(FREE_MASS)}, sample_rate=FREE_RATE)


def passes(seed: int, cogging: float, noise: float, hang: float = 0.0, extra: float = 0.0):
    """A log of fast passes, 0.5 m/s back and forth, with cogging of 10 mm pitch (N), a noisy
    encoder (m) and for the first ``hang`` s a force (N) that moves nothing."""
    rng = np.random.default_rng(seed)
    t = np.arange(8001) / FREE_RATE
    x = 0.25 * np.sin(2.0 * t)
    force = (
        -4.0 * FREE_MASS * x + np.sign(np.cos(2.0 * t)) + cogging * np.sin(2.0 * np.pi * x / 0.01)
    )
    force[t < hang] += extra
    return log_of(FREE_RATE, x + rng.normal(0.0, noise, len(t)), force)


def test_what_a_quiet_length_averages_away_asks_for_a_shorter_one():
    noise = 2e-5  # m
    still = datasets(FREE_PLAIN, {"log": passes(1, 0.0, noise)}, {})["x"].test_function_length
    fast = datasets(FREE_PLAIN, {"log": passes(1, 1.5, noise)}, {})["x"].test_function_length
    assert fast < still
    # At 0.5 m/s a pitch is passed in 20 ms; the quiet length averages it away.
    motion = motion_of(passes(1, 1.5, noise), "x", "log", longest_block=fast / 8.0)
    short, long = (AtLength.of(length, [motion]) for length in (fast, still))
    assert short.shows_more_than(long)
    assert not long.shows_more_than(short)


def test_a_log_in_which_readings_are_held_has_the_blocks_of_the_others():
    """They look like noise; blocks as long as that asks for would smear every reversal."""

    def held(columns):
        at = np.arange(len(columns["position"]))
        columns["position"] = columns["position"][at - (at % 3 == 2)]

    whole, lossy = drive(5000.0), drive(5000.0, change=held)
    logs = {str(k): whole.part(4000 * k, 4000 * (k + 1)) for k in range(3)}
    friction = effect("coulomb_viscous", {"Fc": COULOMB, "Fs": COULOMB, "sigma2": DAMPING})
    axis = AxisModel(DRIVEN, effects=(friction, effect("constant_force", {"F0": -BIAS})))
    model = MachineModel("drive", {"x": axis}, 5000.0)
    found = datasets(model, logs, {"lossy": lossy.part(12_000, 16_000)}, 0.1)["x"]
    (other,) = found.selection
    assert other.motion.position_noise > 10.0 * found.training[0].motion.position_noise
    assert other.motion.period == found.training[0].motion.period
    assert rms(error_on(axis, found.selection)) < 0.02 * COULOMB


def test_a_beginning_in_which_a_force_moves_nothing_is_left_out():
    hanging = passes(2, 0.0, 1e-7, hang=0.5, extra=9.0)
    free = passes(3, 0.0, 1e-7)
    found = datasets(FREE_PLAIN, {"hanging": hanging, "free": free}, {})["x"]
    assert list(found.begun) == ["hanging"]
    assert found.begun["hanging"] == pytest.approx(0.5, abs=0.16)
    assert len(found.training[0]) < len(found.training[1])
    assert "hanging" in prepared_in_words(found)[0]
    # Its positions are those of the log from there on.
    at = round(found.begun["hanging"] * FREE_RATE)
    first = found.training[0].motion.position[0]
    assert first == pytest.approx(hanging.axes["x"].position[at], abs=2e-3)


def test_no_beginning_is_left_out_where_the_force_is_ordinary():
    def told(extra: float, hang: float = 0.5):
        log = passes(4, 0.3, 1e-7, hang=hang, extra=extra)
        return beginnings([motion_of(log, "x", "log")])

    assert told(9.0)
    assert not told(0.0)
    assert not told(0.2)  # not foreign beside the cogging
    assert not told(9.0, hang=3.0)  # no beginning
    assert FOREIGN > 1.0 > HELD


def slow(rate: float, seconds: float, hang: float = 0.0):
    """A log of a few samples a second, whose force belongs to the middle of each."""
    t = np.arange(round(seconds * rate)) / rate
    middle = t + 0.5 / rate
    x = 0.1 * np.sin(1.1 * t) + 0.02 * np.sin(3.7 * t)
    force = -FREE_MASS * (0.121 * np.sin(1.1 * middle) + 0.2738 * np.sin(3.7 * middle))
    force[t < hang] += 9.0
    return log_of(rate, x + np.random.default_rng(1).normal(0.0, 1e-6, len(t)), force)


def test_a_slow_log_is_fitted_with_test_functions_as_short_as_its_samples_allow():
    rate = 20.0
    shortest = LEAST_BLOCKS / rate
    result = fit(FREE_PLAIN, {"log": slow(rate, 20.0)})
    assert result.model.axes["x"].mass == pytest.approx(FREE_MASS, rel=0.01)
    assert result.datasets["x"].test_function_length == pytest.approx(max(0.2, shortest))
    with pytest.raises(InputError, match=f"give at least {shortest:g} s"):
        fit(FREE_PLAIN, {"log": slow(rate, 20.0)}, test_function=0.1)
    fit(FREE_PLAIN, {"log": slow(rate, 20.0)}, test_function=shortest)
    assert first_model({"log": slow(rate, 20.0)}, "new", CATALOGUE).axes["x"].mass > 0.0
    begun = datasets(FREE_PLAIN, {"log": slow(rate, 60.0, hang=0.3)}, {})["x"].begun
    assert 0.3 < begun["log"] < 0.3 + 2.0 * shortest
    least = f"log: it lasts 1.2 s, and identification needs {64 / rate:.3g} s at {rate:g} Hz"
    with pytest.raises(InputError, match=least):
        fit(FREE_PLAIN, {"log": slow(rate, 1.2)})
    compare(FREE_PLAIN, {"log": slow(rate, 64 / rate)})
