"""Laws that every setpoint keeps, and the facts of each experiment."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from twin.experiments.trajectory import (
    Limits,
    Setpoint,
    concatenate,
    constant_speed_passes,
    micro_reversals,
    open_loop_sine,
    point_to_point,
    random_tracking,
    velocity_staircase,
)

LIMITS = (
    Limits((-0.15, 0.15), velocity=0.25, acceleration=5.0, jerk=500.0),
    Limits((-0.10, 0.12), velocity=0.20, acceleration=3.0, jerk=200.0),
)
CORNERS = [[0.0, 0.0], [0.15, 0.12], [-0.15, 0.12], [-0.15, 0.119], [-0.150001, 0.119]]
SPEEDS = [0.0001, 0.001, 0.015, 0.1]

SETPOINTS = {
    "point_to_point": lambda: point_to_point(LIMITS, [*CORNERS[:4], [-0.14999, 0.119]], dwell=0.02),
    "no dwell": lambda: point_to_point(LIMITS, [[0.0, 0.0], [0.1, -0.1], [0.0, 0.1]], dwell=0.0),
    "odd rate": lambda: point_to_point(LIMITS, CORNERS[:3], sample_rate=3333.0),
    "constant_speed_passes": lambda: constant_speed_passes(LIMITS, 0, repeats=2),
    "velocity_staircase": lambda: velocity_staircase(
        LIMITS, 1, SPEEDS, span=0.03, longest_plateau=1.0, at=(-0.136, 0.1)
    ),
    "micro_reversals": lambda: micro_reversals(LIMITS, 0, repeats=5, at=(0.1, -0.05)),
    "open_loop_sine": lambda: open_loop_sine(0, offset=-0.4, duration=6.0, at=(0.1, -0.05)),
    "random_tracking": lambda: random_tracking(LIMITS, 20.0, np.random.default_rng(3)),
}


def assert_lawful(setpoint: Setpoint, limits: tuple[Limits, ...] = LIMITS) -> None:
    """Limits kept, position, velocity and acceleration of one motion, at rest at both ends."""
    h = 1.0 / setpoint.sample_rate
    position, velocity = setpoint.position, setpoint.velocity
    acceleration = setpoint.acceleration
    jerk = np.array([axis.jerk for axis in limits])
    for i, axis in enumerate(limits):
        assert axis.travel[0] <= position[:, i].min() <= position[:, i].max() <= axis.travel[1]
        assert np.abs(velocity[:, i]).max() <= axis.velocity * (1 + 1e-12)
        assert np.abs(acceleration[:, i]).max() <= axis.acceleration * (1 + 1e-12)
    assert (np.abs(np.diff(acceleration, axis=0)) <= jerk * h + 1e-10).all()
    # The trapezoidal rule on a signal whose slope changes at most by twice the jerk.
    dv = np.diff(velocity, axis=0) - h * (acceleration[1:] + acceleration[:-1]) / 2
    assert (np.abs(dv) <= jerk * h**2 / 4 + 1e-13).all()
    dp = np.diff(position, axis=0) - h * (velocity[1:] + velocity[:-1]) / 2
    assert (np.abs(dp) <= jerk * h**3 / 4 + 1e-15).all()
    for end in (0, -1):
        assert np.abs(velocity[end]).max() < 1e-12
        assert np.abs(acceleration[end]).max() < 1e-9


@pytest.mark.parametrize("name", SETPOINTS)
def test_every_setpoint_keeps_the_laws(name: str) -> None:
    assert_lawful(SETPOINTS[name]())


@pytest.mark.parametrize(
    "fault",
    [
        lambda s: replace(s, position=s.position + 0.2),
        lambda s: replace(s, velocity=np.roll(s.velocity, 1, axis=0)),
        lambda s: replace(s, acceleration=s.acceleration * 1.01),
        lambda s: replace(s, position=s.position + 1e-8 * (s.position > 0.05)),
        lambda s: replace(s, sample_rate=s.sample_rate * 1.001),
        lambda s: replace(
            s,
            position=s.position[:2000],
            velocity=s.velocity[:2000],
            acceleration=s.acceleration[:2000],
            force=s.force[:2000],
        ),
    ],
)
def test_the_laws_notice_a_planted_fault(fault: Callable[[Setpoint], Setpoint]) -> None:
    planned = point_to_point(LIMITS, [[0.0, 0.0], [0.1, 0.1]], dwell=0.05)
    setpoint = planned.part(0, len(planned))
    assert_lawful(setpoint)
    with pytest.raises(AssertionError):
        assert_lawful(fault(setpoint))


# The experiments.


def plateaus(velocity: np.ndarray, speed: float) -> list[int]:
    """Numbers of samples of the stretches at +-speed, signed by direction."""
    level = np.where(np.isclose(np.abs(velocity), speed, rtol=1e-12, atol=0), np.sign(velocity), 0)
    edges = np.flatnonzero(np.diff(level, prepend=0, append=0))
    return [int((b - a) * level[a]) for a, b in pairwise(edges) if level[a]]


def test_point_to_point_rests_at_every_waypoint() -> None:
    setpoint = point_to_point(LIMITS, CORNERS[:3], dwell=0.1)
    for corner in CORNERS[:3]:
        at = np.isclose(setpoint.position, corner, rtol=0, atol=1e-15).all(axis=1)
        assert at.sum() >= 1000
    np.testing.assert_array_equal(setpoint.position[[0, -1]], [CORNERS[0], CORNERS[2]])
    assert not setpoint.force.any()


def test_axes_start_and_end_together_on_a_straight_line() -> None:
    setpoint = point_to_point(LIMITS, [[0.1, 0.05], [-0.1, 0.06]], dwell=0.1)
    moving = [np.flatnonzero(np.abs(setpoint.velocity[:, i]) > 1e-12) for i in range(2)]
    assert moving[0][0] == moving[1][0]
    assert moving[0][-1] == moving[1][-1]
    share = (setpoint.position - [0.1, 0.05]) / [-0.2, 0.01]
    np.testing.assert_allclose(share[:, 0], share[:, 1], rtol=0, atol=1e-13)


def test_passes_hold_the_speed_both_ways_and_leave_the_other_axis_alone() -> None:
    setpoint = constant_speed_passes(LIMITS, 0, span=0.3, speed=0.1, repeats=3, at=(0.0, 0.07))
    runs = plateaus(setpoint.velocity[:, 0], 0.1)
    assert [np.sign(run) for run in runs] == [1, -1] * 3
    ramps = 0.1 * LIMITS[0].ramp_time(0.1)
    assert np.abs(runs) / 1e4 == pytest.approx((0.3 - ramps) / 0.1, abs=2e-4)
    assert np.ptp(setpoint.position[:, 0]) == pytest.approx(0.3, abs=1e-12)
    assert (setpoint.position[:, 1] == 0.07).all()
    assert not setpoint.velocity[:, 1].any()


def test_rounding_does_not_carry_a_pass_out_of_the_travel() -> None:
    assert 0.1 + 0.05 > 0.15  # in floating point
    setpoint = constant_speed_passes(LIMITS, 0, span=0.1, speed=0.05, repeats=1, at=(0.1, 0.0))
    assert setpoint.position[:, 0].max() == 0.15


def test_staircase_holds_every_speed_over_half_of_its_move() -> None:
    span, longest = 0.03, 1.0
    setpoint = velocity_staircase(
        LIMITS, 1, SPEEDS, span=span, longest_plateau=longest, at=(-0.136, 0.1)
    )
    for speed in SPEEDS:
        forward, back = plateaus(setpoint.velocity[:, 1], speed)
        assert forward == pytest.approx(-back, abs=1)
        held = speed * forward / 1e4
        move_length = min(span, held + speed * LIMITS[1].ramp_time(speed))
        assert held >= 0.5 * move_length
        assert forward / 1e4 <= longest + 2e-4
        # The plateau lies around the place of the experiment, whatever the speed.
        at_speed = setpoint.position[np.isclose(setpoint.velocity[:, 1], speed, rtol=1e-12), 1]
        assert (at_speed.min() + at_speed.max()) / 2 == pytest.approx(0.1, abs=speed * 1e-4)
    assert (setpoint.position[:, 0] == -0.136).all()


def test_micro_reversals_turn_at_the_amplitude() -> None:
    setpoint = micro_reversals(LIMITS, 0, amplitude=4e-6, repeats=50, dwell=0.02, at=(0.1, 0.0))
    x = setpoint.position[:, 0] - 0.1
    assert x.max() == pytest.approx(4e-6, abs=1e-15)
    assert x.min() == pytest.approx(-4e-6, abs=1e-15)
    direction = np.sign(setpoint.velocity[np.abs(setpoint.velocity[:, 0]) > 1e-6, 0])
    assert np.count_nonzero(np.diff(direction)) == 99


def test_open_loop_sine_is_force_alone() -> None:
    setpoint = open_loop_sine(
        1, amplitude=0.21, period=3.0, offset=-0.4, duration=30.0, at=(0.1, -0.05)
    )
    assert setpoint.position.shape == (300_000, 2)
    assert (setpoint.position == [0.1, -0.05]).all()
    assert not setpoint.velocity.any()
    assert not setpoint.force[:, 0].any()
    assert setpoint.force[0, 1] == -0.4
    assert setpoint.force[7500, 1] == pytest.approx(-0.4 + 0.21, abs=1e-12)
    np.testing.assert_allclose(setpoint.force[30_000:, 1], setpoint.force[:-30_000, 1], atol=1e-12)


# Random tracking.


def test_random_tracking_is_reproduced_by_its_seed() -> None:
    a, b, c = (random_tracking(LIMITS, 5.0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.position, b.position)
    assert not np.array_equal(a.position, c.position)


@pytest.mark.parametrize("duration", [0.0001, 0.03, 0.2, 1.2345, 7.0])
@pytest.mark.parametrize("seed", range(3))
def test_random_tracking_lasts_exactly_as_long_as_asked(duration: float, seed: int) -> None:
    setpoint = random_tracking(LIMITS, duration, np.random.default_rng(seed))
    assert setpoint.position.shape[0] == round(duration * 1e4)
    assert_lawful(setpoint)


@pytest.mark.parametrize("seed", range(3))
def test_random_tracking_excites_speeds_reversals_and_travel(seed: int) -> None:
    setpoint = random_tracking(LIMITS, 60.0, np.random.default_rng(seed), sample_rate=1000.0)
    for i, axis in enumerate(LIMITS):
        velocity = setpoint.velocity[:, i]
        moving = velocity[np.abs(velocity) > 1e-12]
        speed = np.abs(moving)
        assert np.ptp(setpoint.position[:, i]) > 0.75 * (axis.travel[1] - axis.travel[0])
        assert speed.max() > 0.8 * axis.velocity
        for low, high in pairwise([5e-4, 2e-3, 1e-2, 5e-2, axis.velocity]):
            assert ((speed > low) & (speed <= high)).mean() > 0.03
        assert np.count_nonzero(np.diff(np.sign(moving))) >= 15
    assert (np.abs(setpoint.velocity) < 1e-12).all(axis=1).mean() < 0.2


# Concatenation.


def test_concatenate_keeps_every_sample_and_the_laws() -> None:
    there = point_to_point(LIMITS, [[0.0, 0.0], [0.1, -0.05]])
    sine = open_loop_sine(0, duration=1.0, at=(0.1, -0.05))
    back = point_to_point(LIMITS, [[0.1, -0.05], [0.0, 0.0]])
    whole = concatenate(there, sine, back)
    assert_lawful(whole)
    assert whole.duration == pytest.approx(there.duration + sine.duration + back.duration)
    start = there.position.shape[0]
    np.testing.assert_array_equal(whole.force[start : start + 10_000], sine.force)
    np.testing.assert_array_equal(whole.position[start + 10_000 :], back.position)
