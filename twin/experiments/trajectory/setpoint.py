"""The sampled setpoint of the controller."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twin.errors import CannotRun, InputError
from twin.experiments.trajectory.jerk_limited import Phases, join, sample
from twin.experiments.trajectory.limits import FloatArray, axis_name, require_positive

SAMPLE_RATE = 10_000.0  # Hz, of the motion platform

_MOST_SAMPLES = 36_000_000  # one hour at 10 kHz; two axes then take 2.3 GB
_SAME_PLACE = 1e-9  # m
_AT_REST = 1e-9  # m/s


@dataclass(frozen=True, eq=False)
class Setpoint:
    """Setpoint of all axes, sampled.

    Attributes:
        position, velocity, acceleration: m, m/s, m/s^2, shape (n, n_axes).
        force: open-loop force to command, N, shape (n, n_axes); zero in closed loop.
        sample_rate: Hz.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    sample_rate: float

    def __post_init__(self) -> None:
        shapes = {a.shape for a in (self.position, self.velocity, self.acceleration, self.force)}
        if len(shapes) > 1 or self.position.ndim != 2:
            raise InputError(
                f"setpoint arrays of shapes {sorted(shapes)} do not belong together: "
                "give all four the shape (samples, axes)"
            )

    @property
    def duration(self) -> float:
        """Number of samples / sample rate, s."""
        return self.position.shape[0] / self.sample_rate


def require_length(duration: float, sample_rate: float) -> None:
    """Raise CannotRun unless `duration` (s) holds one sample to one hour of them."""
    require_positive("sample rate", sample_rate, "Hz")
    require_positive("duration", duration, "s")
    samples = duration * sample_rate
    if samples < 1.0 - 1e-9 or samples > _MOST_SAMPLES:
        raise CannotRun(
            f"duration {duration:g} s at {sample_rate:g} Hz is {samples:g} samples, allowed are "
            f"1 to {_MOST_SAMPLES}: change the duration, the repeats or the sample rate"
        )


def closed_loop(phases: Phases, samples: int, sample_rate: float) -> Setpoint:
    """The first `samples` samples of the phases, without open-loop force."""
    position, velocity, acceleration = sample(phases, samples, sample_rate)
    return Setpoint(position, velocity, acceleration, np.zeros_like(position), sample_rate)


def whole_motion(parts: Sequence[Phases], sample_rate: float) -> Setpoint:
    """All parts in a row; the last sample is at the end of the last part.

    Raises:
        CannotRun: the motion is too long to hold in memory, or takes no time at all.
    """
    phases = join(parts)
    require_length(phases.total, sample_rate)
    return closed_loop(phases, math.ceil(phases.total * sample_rate) + 1, sample_rate)


def concatenate(*setpoints: Setpoint) -> Setpoint:
    """One setpoint after the other; each must start at rest where the one before ended at rest.

    Raises:
        InputError: different sample rates or numbers of axes, or a jump at a joint.
    """
    if not setpoints:
        raise InputError("no setpoints given: give at least one to concatenate")
    for number, (before, after) in enumerate(pairwise(setpoints), 1):
        _require_joint(before, after, f"between setpoints {number} and {number + 1}")
    return Setpoint(
        np.concatenate([part.position for part in setpoints]),
        np.concatenate([part.velocity for part in setpoints]),
        np.concatenate([part.acceleration for part in setpoints]),
        np.concatenate([part.force for part in setpoints]),
        setpoints[0].sample_rate,
    )


def _require_joint(before: Setpoint, after: Setpoint, where: str) -> None:
    if before.sample_rate != after.sample_rate:
        raise InputError(
            f"sample rates {before.sample_rate:g} and {after.sample_rate:g} Hz {where} differ: "
            "generate both at the same rate"
        )
    if before.position.shape[1] != after.position.shape[1]:
        raise InputError(
            f"{before.position.shape[1]} and {after.position.shape[1]} axes {where} do not go "
            "together: generate both for the same axes"
        )
    for axis in range(before.position.shape[1]):
        ends, starts = before.position[-1, axis], after.position[0, axis]
        if not abs(starts - ends) <= _SAME_PLACE:
            raise InputError(
                f"axis {axis_name(axis)} jumps from {ends:.9g} to {starts:.9g} m {where}: "
                "put a point_to_point move between them"
            )
        fastest = max(abs(before.velocity[-1, axis]), abs(after.velocity[0, axis]))
        if not fastest <= _AT_REST:
            raise InputError(
                f"axis {axis_name(axis)} moves at {fastest:g} m/s {where}: "
                "join setpoints where they are at rest"
            )
