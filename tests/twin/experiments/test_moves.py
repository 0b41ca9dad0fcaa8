"""Single moves against Ruckig's own evaluation and closed forms; limits met from both sides."""

import math

import numpy as np
import pytest
from ruckig import InputParameter, Ruckig, Synchronization, Trajectory

from twin.errors import CannotRun, InputError
from twin.experiments.trajectory import (
    Limits,
    join,
    move,
    point_to_point,
    require_length,
    rest,
    sample,
)

LIMITS = (
    Limits((-0.15, 0.15), velocity=0.25, acceleration=5.0, jerk=500.0),
    Limits((-0.10, 0.12), velocity=0.20, acceleration=3.0, jerk=200.0, name="y"),
)


@pytest.mark.parametrize("target", [(0.1, -0.03), (0.15, 0.0)])
def test_samples_equal_ruckigs_own_evaluation(target: tuple[float, float]) -> None:
    limits = LIMITS[0]
    request = InputParameter(2)
    request.target_position = list(target)
    request.max_velocity = [limits.velocity] * 2
    request.max_acceleration = [limits.acceleration] * 2
    request.max_jerk = [limits.jerk] * 2
    request.synchronization = Synchronization.Phase
    reference = Trajectory(2)
    Ruckig(2).calculate(request, reference)

    phases = move([limits, limits], np.zeros(2), np.array(target))
    assert phases.total == pytest.approx(reference.duration, rel=1e-12)
    count = int(phases.total * 1e4)
    ours = sample(phases, count, 1e4)
    for k in range(0, count, 37):
        for signal, expected in zip(ours, reference.at_time(k / 1e4), strict=True):
            np.testing.assert_allclose(signal[k], expected, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("distance", [1e-9, 0.3])
def test_moves_of_every_size_end_on_their_target(distance: float) -> None:
    target = np.array([0.05 + distance, -0.05 + distance / 3])
    phases = move(LIMITS, np.array([0.05, -0.05]), target)
    end, _, _ = sample(phases, 2, 1.0 / phases.total)
    np.testing.assert_allclose(end[1], target, rtol=0, atol=1e-16 + 1e-14 * distance)


@pytest.mark.parametrize("seed", range(2))
def test_moves_keep_limits_of_any_proportion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(100):
        limits = [Limits((-1.0, 1.0), *10.0 ** rng.uniform(-4, 4, 3)) for _ in range(2)]
        step = 10.0 ** rng.uniform(-8, 0, 2) * rng.choice([-1, 0, 1], 2)
        phases = move(limits, np.zeros(2), step)
        assert (phases.duration >= 0).all()
        for i, axis in enumerate(limits):
            assert np.abs(phases.velocity[:, i]).max() <= axis.velocity * (1 + 1e-12)
            assert np.abs(phases.acceleration[:, i]).max() <= axis.acceleration * (1 + 1e-12)
            assert np.abs(phases.jerk[:, i]).max() <= axis.jerk * (1 + 1e-12)
            assert (phases.position[:, i] * np.sign(step[i]) >= -1e-15).all()
            assert (np.abs(phases.position[:, i]) <= abs(step[i]) * (1 + 1e-12)).all()


def test_sampling_does_not_depend_on_its_blocks() -> None:
    parts = [rest(np.zeros(2), 1.0), move(LIMITS, np.zeros(2), np.array([0.1, 0.1]))]
    phases = join([*parts, rest(np.array([0.1, 0.1]), 3.0)])
    fine, coarse = sample(phases, 50_000, 1e4), sample(phases, 500, 1e2)
    for a, b in zip(fine, coarse, strict=True):
        np.testing.assert_allclose(a[::100], b, rtol=0, atol=1e-10)


def test_axes_start_and_end_together_on_a_straight_line_and_rest_at_every_waypoint() -> None:
    places = np.array([[0.1, 0.05], [-0.1, 0.06], [-0.1, 0.12]])
    planned = point_to_point(LIMITS, places, 0.1, 1e4)
    setpoint = planned.part(0, len(planned))
    np.testing.assert_array_equal(setpoint.position[[0, -1]], places[[0, 2]])
    for place in places:
        at = np.isclose(setpoint.position, place, rtol=0, atol=1e-15).all(axis=1)
        assert at.sum() >= 1000
    first = setpoint.part(0, int(np.argmax(setpoint.position[:, 1] > 0.06 + 1e-12)))
    moving = [np.flatnonzero(np.abs(first.velocity[:-1, i]) > 1e-12) for i in range(2)]
    assert moving[0][0] == moving[1][0]
    share = (first.position - places[0]) / (places[1] - places[0])
    np.testing.assert_allclose(share[:, 0], share[:, 1], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("length", "time"), [(2.0, 1.0), (3.0, 0.5)])
def test_a_motion_in_other_units_is_the_same_motion(length: float, time: float) -> None:
    other = [
        Limits(
            (length * limit.travel[0], length * limit.travel[1]), length / time * limit.velocity,
            length / time**2 * limit.acceleration, length / time**3 * limit.jerk,
        )
        for limit in LIMITS
    ]  # fmt: skip
    way = np.array([[0.0, 0.0], [0.1, -0.04], [0.1002, -0.04], [-0.1, 0.08]])
    one = point_to_point(LIMITS, way, 0.1, 2000.0)
    two = point_to_point(other, length * way, 0.1 * time, 2000.0 / time)
    n = len(one) - 1  # the last sample may fall on either side of the end
    units = (length, length / time, length / time**2)
    pairs = zip(one.part(0, n).columns[:3], two.part(0, n).columns[:3], units, strict=True)
    for a, b, unit in pairs:
        np.testing.assert_allclose(b, unit * a, rtol=0, atol=1e-7 * unit * np.abs(a).max())


def rested(speed: float, a: float, j: float) -> float:
    """Time to a speed by a trapezoid of acceleration, whose area is the speed."""
    peak = min(a, math.sqrt(speed * j))
    return peak / j + speed / peak


@pytest.mark.parametrize("distance", [1e-5, 3e-3, 0.05, 9.0])
def test_the_fastest_plateau_is_just_allowed(distance: float) -> None:
    limit = LIMITS[0]
    speed = limit.fastest_plateau(distance)
    limit.require_plateau(speed, distance)
    if speed < limit.velocity:
        assert 2.0 * speed * rested(speed, 5.0, 500.0) == pytest.approx(distance, rel=1e-9)
    with pytest.raises(CannotRun):
        limit.require_plateau(1.0001 * speed, distance)


def test_a_setpoint_holds_one_sample_to_one_hour_of_them() -> None:
    hour, rate = 3600.0 * 1e4, 2000.0
    for samples in (1.0, 1.0 - 1e-10, 7.0, hour):
        require_length(samples / rate, rate)
    for samples in (1.0 - 1e-8, 0.6, hour + 1.0):
        with pytest.raises(CannotRun, match="samples, allowed are 1 to 36000000"):
            require_length(samples / rate, rate)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (((0.1, -0.1), 1.0, 1.0, 1.0), "lowest position first"),
        (((-1.0, math.inf), 1.0, 1.0, 1.0), "not finite"),
        (((-1.0, 1.0), 0.0, 1.0, 1.0), "velocity limit 0 m/s"),
        (((-1.0, 1.0), 1.0, -1.0, 1.0), r"acceleration limit -1 m/s\^2"),
        (((-1.0, 1.0), 1.0, 1.0, math.nan), r"jerk limit nan m/s\^3"),
    ],
)
def test_limits_that_are_none_are_refused(limits, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Limits(*limits)


def test_limits_too_far_apart_for_a_profile_are_told() -> None:
    with pytest.raises(CannotRun, match="differ too much in size"):
        move([Limits((0.0, 1.0), 1.0, 1e-30, 1e60)], np.zeros(1), np.ones(1))
