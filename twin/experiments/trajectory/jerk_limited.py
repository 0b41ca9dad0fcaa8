"""Rest-to-rest moves of constant-jerk phases, planned by Ruckig and sampled exactly.

A move is a straight line on which all axes start and end together. One scalar profile along the
line, 0 at the start and 1 at the target, is planned under the limits of every axis and scaled by
each axis's displacement. It is planned with the path length as unit of length and
(path length / jerk)^(1/3) as unit of time, because Ruckig's tolerances are absolute: in metres
they amount to 10 nm, too much for a move of micrometres.

Source of the planner: L. Berscheid and T. Kroeger, "Jerk-limited Real-time Trajectory Generation
with Arbitrary Target States", Robotics: Science and Systems XVII, 2021.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ruckig import InputParameter, Profile, Result, Ruckig, RuckigError, Trajectory

from twin.errors import CannotRun
from twin.experiments.trajectory.limits import FloatArray, Limits

# Samples worked on at once: the temporary arrays stay in the cache.
_BLOCK = 16_384


@dataclass(frozen=True, eq=False)
class Phases:
    """Phases of constant jerk, one after the other.

    Attributes:
        duration: length of each phase, s, shape (n_phases,).
        position, velocity, acceleration, jerk: values at the start of each phase, m, m/s, m/s^2,
            m/s^3, shape (n_phases, n_axes).
    """

    duration: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def total(self) -> float:
        """Time from the first phase to the end of the last, s."""
        return float(self.duration.sum())


def rest(position: FloatArray, duration: float) -> Phases:
    """Standing at `position` (m, shape (n_axes,)) for `duration` seconds."""
    still = np.zeros((1, position.size))
    return Phases(np.array([duration]), position[np.newaxis, :], still, still, still)


def move(limits: Sequence[Limits], start: FloatArray, target: FloatArray) -> Phases:
    """Fastest straight move from rest at `start` to rest at `target`, all axes together.

    Args:
        limits: one per axis; travel is not checked, as a move stays between its ends.
        start, target: m, shape (n_axes,).

    Returns:
        Seven phases, or a rest of no duration where start and target are equal.

    Raises:
        CannotRun: the limits are so far apart in size that no profile can be computed.
    """
    step = target - start
    moving = np.flatnonzero(step)
    if not moving.size:
        return rest(start, 0.0)

    def along_path(of_axes: list[float]) -> float:
        return float((np.array(of_axes)[moving] / np.abs(step[moving])).min())

    jerk = along_path([axis.jerk for axis in limits])
    pace = jerk ** (1.0 / 3.0)  # 1 / s; with 1 / pace as unit of time the jerk limit is 1
    profile = _unit_profile(
        along_path([axis.velocity for axis in limits]) / pace,
        along_path([axis.acceleration for axis in limits]) / pace**2,
    )
    return Phases(
        np.array(profile.t) / pace,
        start + np.outer(profile.p[:7], step),
        np.outer(profile.v[:7], step * pace),
        np.outer(profile.a[:7], step * pace**2),
        np.outer(profile.j, step * pace**3),
    )


def _unit_profile(velocity: float, acceleration: float) -> Profile:
    """Ruckig's profile from 0 to 1 under a jerk limit of 1, all in the units of the path."""
    request = InputParameter(1)
    request.target_position = [1.0]
    request.max_velocity = [velocity]
    request.max_acceleration = [acceleration]
    request.max_jerk = [1.0]
    trajectory = Trajectory(1)
    try:
        solved = Ruckig(1).calculate(request, trajectory) == Result.Working
    except RuckigError:
        solved = False
    if not solved or not math.isfinite(trajectory.duration):
        raise CannotRun(
            "no jerk-limited move fits these velocity, acceleration and jerk limits: they differ "
            "too much in size; check that they are in m/s, m/s^2 and m/s^3"
        )
    return trajectory.profiles[0][0]


def join(parts: Sequence[Phases]) -> Phases:
    """The phases of all parts in a row; each part starts where the one before ended."""
    return Phases(
        np.concatenate([part.duration for part in parts]),
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.velocity for part in parts]),
        np.concatenate([part.acceleration for part in parts]),
        np.concatenate([part.jerk for part in parts]),
    )


def sample(
    phases: Phases, samples: int, sample_rate: float, begin: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position (m), velocity (m/s) and acceleration (m/s^2) at t = k / sample_rate, k from `begin`.

    Each is an exact evaluation of the cubic of the phase that holds at t, shape
    (samples, n_axes); a sample after the end belongs to the last phase.
    """
    starts = np.concatenate([[0.0], np.cumsum(phases.duration)[:-1]])
    shape = (samples, phases.position.shape[1])
    position, velocity, acceleration = np.empty(shape), np.empty(shape), np.empty(shape)
    for first in range(0, samples, _BLOCK):
        block = slice(first, min(first + _BLOCK, samples))
        time = np.arange(begin + block.start, begin + block.stop) / sample_rate
        phase = np.searchsorted(starts, time, side="right") - 1
        t = (time - starts[phase])[:, np.newaxis]
        p, v = phases.position[phase], phases.velocity[phase]
        a, j = phases.acceleration[phase], phases.jerk[phase]
        position[block] = p + t * (v + t * (a / 2.0 + t * (j / 6.0)))
        velocity[block] = v + t * (a + t * (j / 2.0))
        acceleration[block] = a + t * j
    return position, velocity, acceleration
