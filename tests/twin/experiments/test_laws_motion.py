"""Setpoints obey kinematics and scale as the units do; limits are met from both sides.

With lengths and limits doubled the motion is twice as large at the same instants; with times
doubled it is the same path at half the speed.
"""

import math

import numpy as np
import pytest

from twin.errors import InputError
from twin.experiments.experiment import machine_limits
from twin.experiments.trajectory import (
    Limits,
    Setpoint,
    concatenate,
    open_loop_sine,
    point_to_point,
)
from twin.experiments.trajectory.limits import require_plateau
from twin.experiments.trajectory.random_tracking import random_tracking
from twin.experiments.trajectory.setpoint import require_length
from twin.model.machine import AxisModel, Hardware, MachineModel

RATE = 2000.0
X = Hardware(travel=(-0.11, 0.17), force_limit=30.0, velocity=0.3, acceleration=4.0, jerk=300.0)
Y = Hardware(travel=(-0.05, 0.09), force_limit=20.0, velocity=0.2, acceleration=3.0, jerk=150.0)
STAGE = MachineModel("s", {"x": AxisModel(3.0, X), "y": AxisModel(5.0, Y)}, sample_rate=RATE)
LIMITS = machine_limits(STAGE)
MIDDLE = (0.03, 0.02)


# --- limits ---------------------------------------------------------------------------------------


def rested(speed: float, a: float, j: float) -> float:
    """Time to a speed by a trapezoid of acceleration, whose area is the speed."""
    peak = min(a, math.sqrt(speed * j))
    return peak / j + speed / peak


@pytest.mark.parametrize("distance", [1e-4, 3e-3, 0.0142, 0.05, 0.2, 9.0])
def test_the_fastest_plateau_is_just_allowed(distance: float) -> None:
    limit = LIMITS[0]
    speed = limit.fastest_plateau(distance)
    require_plateau(LIMITS, 0, speed, distance)
    if speed < limit.velocity:
        assert 2.0 * speed * rested(speed, 4.0, 300.0) == pytest.approx(distance, rel=1e-9)
    with pytest.raises(InputError):
        require_plateau(LIMITS, 0, 1.0001 * speed, distance)


# --- units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("length", "time"), [(2.0, 1.0), (1.0, 2.0), (3.0, 0.5)])
def test_a_motion_in_other_units_is_the_same_motion(length: float, time: float) -> None:
    other = [
        Limits(
            tuple(length * t for t in limit.travel), length / time * limit.velocity,
            length / time**2 * limit.acceleration, length / time**3 * limit.jerk,
        )
        for limit in LIMITS
    ]  # fmt: skip
    way = np.array([[0.0, 0.0], [0.1, -0.04], [0.1002, -0.04], [-0.1, 0.08]])
    one = point_to_point(LIMITS, way, dwell=0.1, sample_rate=RATE)
    two = point_to_point(other, length * way, dwell=0.1 * time, sample_rate=RATE / time)
    n = len(one.position) - 1  # the last sample may fall on either side of the end
    for name, unit in (("position", length), ("velocity", length / time),
                       ("acceleration", length / time**2)):  # fmt: skip
        a, b = getattr(one, name)[:n], getattr(two, name)[:n]
        np.testing.assert_allclose(b, unit * a, rtol=0, atol=1e-7 * unit * np.abs(a).max())


@pytest.mark.parametrize("seed", [1, 2])
def test_tracking_in_other_units_of_length_is_the_same_motion(seed: int) -> None:
    other = [Limits(tuple(2.0 * t for t in lim.travel), 2.0 * lim.velocity, 2.0 * lim.acceleration,
                    2.0 * lim.jerk) for lim in LIMITS]  # fmt: skip
    one, two = (
        random_tracking(lim, 4.0, np.random.default_rng(seed), slowest=s * 5e-4, sample_rate=RATE)
        for lim, s in ((LIMITS, 1.0), (other, 2.0))
    )
    np.testing.assert_allclose(two.position, 2.0 * one.position, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.position[0], MIDDLE, atol=1e-12)


# --- joints ---------------------------------------------------------------------------------------


def test_setpoints_join_only_where_one_ends_and_the_other_begins() -> None:
    def there(end: float) -> Setpoint:
        return point_to_point(LIMITS, [[0.0, 0.0], [end, 0.0]], dwell=0.01, sample_rate=RATE)

    def sine(x: float, y: float = 0.0) -> Setpoint:
        return open_loop_sine(0, duration=0.1, period=0.05, at=(x, y), sample_rate=RATE)

    whole = concatenate(there(0.05), sine(0.05 + 9e-10), sine(0.05))
    assert len(whole.position) == sum(len(p.position) for p in (there(0.05), sine(0.0), sine(0.0)))
    for x, y in ((0.05 + 1.1e-9, 0.0), (0.05, 2e-9)):
        with pytest.raises(InputError, match="jumps"):
            concatenate(there(0.05), sine(x, y))
    moving = there(0.05)
    moving.velocity[-1, 1] = 1.1e-9
    with pytest.raises(InputError, match="moves at"):
        concatenate(moving, sine(0.05))
    moving.velocity[-1, 1] = 0.9e-9
    concatenate(moving, sine(0.05))
    begins = sine(0.05)
    begins.velocity[0, 0] = -1.1e-9
    with pytest.raises(InputError, match="moves at"):
        concatenate(there(0.05), begins)


def test_a_setpoint_holds_one_sample_to_one_hour_of_them() -> None:
    hour = 3600.0 * 1e4
    for samples in (1.0, 1.0 - 1e-10, 7.0, hour):
        require_length(samples / RATE, RATE)
    for samples in (1.0 - 1e-8, 0.6, hour + 1.0):
        with pytest.raises(InputError, match="samples, allowed are 1 to 36000000"):
            require_length(samples / RATE, RATE)
