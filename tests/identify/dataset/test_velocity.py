"""A measured velocity beside the position: used where it helps, never where it misleads."""

from __future__ import annotations

import numpy as np
import pytest
from constructed import log_of, waves

from identify.dataset.motion import motion_of
from identify.dataset.noise import noise_of
from identify.dataset.readings import together
from twin.model.machine import AxisModel
from twin.signals import between

RATE = 1000.0
T = np.arange(8001) / RATE
PLACE = waves((0.1, 0.9, 0.3), (0.02, 2.3, 1.1))
READ, TOLD = 2e-4, 2e-2  # m and m/s RMS


def speed(t):
    """The rate of PLACE, m/s, by central differences of a tenth of a sample."""
    return (PLACE(t + 5e-5) - PLACE(t - 5e-5)) / 1e-4


def measured(seed: int, late: float = 0.0, gain: float = 1.0):
    rng = np.random.default_rng(seed)
    x = PLACE(T) + rng.normal(0.0, READ, len(T))
    return x, gain * speed(T - late) + rng.normal(0.0, TOLD, len(T))


@pytest.mark.parametrize("late", [0.0, 4.3e-3])
def test_the_position_that_both_tell_is_nearer_to_the_truth(late):
    x, v = measured(1, late)
    position, weight = together(x, v, RATE**-1)
    # Densities: 2 READ^2/RATE of the readings, 2 TOLD^2/RATE of the velocity.
    assert weight == pytest.approx((READ * RATE / TOLD) ** 2, rel=0.5)
    error = position - PLACE(T)
    assert np.std(error) < 0.5 * READ
    # The rate at one sample is that of the velocity, not of the differenced readings.
    assert np.std(between(error, 1.0 / RATE)) < 1.5 * TOLD
    assert np.std(between(x - PLACE(T), 1.0 / RATE)) > 10.0 * TOLD


def test_a_velocity_that_cannot_be_trusted_is_not_used():
    x, v = measured(2, gain=1.05)
    assert together(x, v, 1.0 / RATE)[1] == 0.0
    x, v = measured(2, late=0.02)
    assert together(x, v, 1.0 / RATE)[1] == 0.0
    x, _ = measured(3)
    copied = np.gradient(x, 1.0 / RATE)  # made of the readings: it holds nothing new
    np.testing.assert_array_equal(together(x, copied, 1.0 / RATE)[0], x)
    assert together(x, None, 1.0 / RATE)[0] is x


def test_the_noise_floor_knows_of_the_velocity():
    x, v = measured(4)
    motion = motion_of(log_of(RATE, x, np.zeros_like(x), velocity=v), "x", "log")
    noise = noise_of(AxisModel(1.0), motion)
    # What m times the rate of the velocity's noise leaves, and what readings alone would.
    k = np.searchsorted(noise.frequency, 60.0)
    turn = (2.0 * np.pi * noise.frequency[k]) ** 2  # 1/s^2
    wanted = 2.0 * TOLD**2 / RATE * turn
    assert noise.power[k] == pytest.approx(wanted, rel=0.5)
    alone = noise_of(AxisModel(1.0), motion_of(log_of(RATE, x, np.zeros_like(x)), "x", "log"))
    assert alone.power[k] == pytest.approx(2.0 * READ**2 / RATE * turn**2, rel=0.5)
