"""The planner of single moves against Ruckig's own evaluation and against closed forms."""

import numpy as np
import pytest
from ruckig import InputParameter, Ruckig, Synchronization, Trajectory

from twin.experiments.trajectory.jerk_limited import join, move, rest, sample
from twin.experiments.trajectory.limits import Limits

LIMITS = (
    Limits((-0.15, 0.15), velocity=0.25, acceleration=5.0, jerk=500.0),
    Limits((-0.10, 0.12), velocity=0.20, acceleration=3.0, jerk=200.0),
)


@pytest.mark.parametrize("target", [(0.1, -0.03), (0.15, 0.0), (0.002, 0.004)])
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


def test_move_takes_the_shortest_time_its_limits_allow() -> None:
    limits = LIMITS[0]
    phases = move([limits], np.array([0.0]), np.array([0.12]))
    assert phases.total == pytest.approx(0.12 / 0.25 + limits.ramp_time(0.25), rel=1e-12)
    tiny = move([limits], np.array([0.1]), np.array([0.1 + 4e-6]))
    assert tiny.total == pytest.approx((32 * 4e-6 / limits.jerk) ** (1 / 3), rel=1e-9)


@pytest.mark.parametrize("distance", [1e-9, 4e-6, 1e-3, 0.3])
def test_moves_of_every_size_end_on_their_target(distance: float) -> None:
    target = np.array([0.05 + distance, -0.05 + distance / 3])
    phases = move(LIMITS, np.array([0.05, -0.05]), target)
    end, _, _ = sample(phases, 2, 1.0 / phases.total)
    np.testing.assert_allclose(end[1], target, rtol=0, atol=1e-16 + 1e-14 * distance)


@pytest.mark.parametrize("seed", range(5))
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


@pytest.mark.parametrize("span", [1e-5, 1e-3, 0.01, 0.1, 10.0])
def test_fastest_plateau_is_the_speed_at_which_ramps_take_half(span: float) -> None:
    speed = LIMITS[0].fastest_plateau(span)
    if speed == LIMITS[0].velocity:
        assert speed * LIMITS[0].ramp_time(speed) <= span / 2
    else:
        assert speed * LIMITS[0].ramp_time(speed) == pytest.approx(span / 2, rel=1e-9)
