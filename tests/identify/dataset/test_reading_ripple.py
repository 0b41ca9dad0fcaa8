"""Errors of the reading that repeat along the track: told from its noise, and from its rounding."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.dataset.readings import resolution_of, ripple, ripple_periods, ripples_of_widest
from twin.signals import white_noise

DT = 1e-4  # s
TIME = DT * np.arange(60_000)
NOISE = 2e-9  # m
ANGLE = 2.0 * np.pi * 0.4 * TIME


def noise():
    return NOISE * np.random.default_rng(3).standard_normal(len(TIME))


WOBBLE = 2e-5 * np.sin(2.0 * np.pi * 11.0 * TIME)  # m, of a controlled axis
PATHS = {  # m; the first two pass several periods of a ripple in a sample
    "turning": 0.1 * np.sin(ANGLE),
    "two speeds": np.where(TIME < 3.0, 0.1 * TIME, 0.3 - 0.02 * (TIME - 3.0)) + WOBBLE,
    "slow": 2e-3 * np.sin(ANGLE),
}


@pytest.mark.parametrize(("path", "period"), [("turning", 7.3e-6), ("two speeds", 2.2e-5)])
def test_a_ripple_is_found_at_any_speed_and_taken_off(path, period):
    turn = 2.0 * np.pi * PATHS[path] / period
    error = 2.3e-8 * np.sin(turn + 1.0)
    readings = PATHS[path] + error + noise()
    found = ripple_periods(readings)
    cycles = np.ptp(PATHS[path]) / period
    assert min(abs(p / period - 1.0) for p in found) < 0.1 / cycles
    assert white_noise(readings) > 1.5 * NOISE
    left = readings - ripple(readings, found)
    assert white_noise(left) == pytest.approx(NOISE, rel=0.1)
    assert np.std(left - PATHS[path] - noise()) < 0.2 * np.std(error)


def test_the_log_with_the_longest_travel_tells_the_ripples_of_all():
    """A log that hardly moves shows none, and all are of one encoder."""
    period = 2.2e-5
    paths = (1e-5 * np.sin(ANGLE), PATHS["turning"])
    read = [p + 2.3e-8 * np.sin(2.0 * np.pi * p / period) + noise() for p in paths]
    logs = [SimpleNamespace(axes={"x": SimpleNamespace(position=r)}) for r in read]
    logs.append(SimpleNamespace(axes={"y": SimpleNamespace(position=1e3 * read[0])}))
    assert ripple_periods(read[0]) == ()
    assert ripples_of_widest(logs, "x") == ripple_periods(read[1]) != ()
    assert ripples_of_widest(logs, "z") == ()


def test_a_vibration_at_constant_speed_is_none():
    """It repeats along the track there, but not on the way to that speed."""
    speed = 0.05 * np.clip(TIME / 3.0, 0.0, 1.0)
    path = DT * np.cumsum(speed)
    shaken = path + 2e-8 * np.sin(2.0 * np.pi * 900.0 * TIME) + noise()
    assert ripple_periods(shaken) == ()


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("step", [0.0, 3e-6])
def test_noise_and_rounding_are_none(path, step):
    readings = PATHS[path] + noise()
    if step:
        readings = step * np.rint(readings / step)
    assert ripple_periods(readings) == ()


@pytest.mark.parametrize(("fine", "path"), [(2.1e-8, "turning"), (7.7e-8, "slow")])
def test_a_coarse_step_is_found_beside_a_fine_one(path, fine):
    """The encoder rounds, its noise is added, and the log rounds again."""
    step = 3.16e-7
    readings = step * np.rint(PATHS[path] / step) + noise()
    readings = fine * np.rint(readings / fine)
    assert resolution_of(np.diff(readings)) == pytest.approx(step, rel=2e-3)


def test_speeds_that_are_multiples_of_one_are_no_step():
    speed = np.repeat([0.01, 0.02, 0.03, 0.04], len(TIME) // 4)
    assert resolution_of(np.diff(DT * np.cumsum(speed) + noise())) == 0.0
