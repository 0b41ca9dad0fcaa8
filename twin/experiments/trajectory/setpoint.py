"""The sampled setpoint of the controller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from twin.errors import CannotRun, InputError
from twin.experiments.trajectory.jerk_limited import Phases, join, sample
from twin.experiments.trajectory.limits import FloatArray, axis_name, require_positive

SAMPLE_RATE = 10_000.0  # Hz, of the motion platform

_MOST_SAMPLES = 36_000_000  # one hour at 10 kHz
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
        return len(self) / self.sample_rate

    def __len__(self) -> int:
        return self.position.shape[0]

    def part(self, first: int, stop: int) -> Setpoint:
        """Its samples from number `first` to before `stop`."""
        span = slice(first, stop)
        return Setpoint(
            self.position[span],
            self.velocity[span],
            self.acceleration[span],
            self.force[span],
            self.sample_rate,
        )


@dataclass(frozen=True, eq=False)
class PlannedSetpoint:
    """A closed-loop setpoint that is sampled where it is asked for: half an hour takes no memory.

    Attributes:
        phases: the motion.
        samples: how many.
        sample_rate: Hz.
    """

    phases: Phases
    samples: int
    sample_rate: float

    @property
    def duration(self) -> float:
        """Number of samples / sample rate, s."""
        return self.samples / self.sample_rate

    def __len__(self) -> int:
        return self.samples

    def part(self, first: int, stop: int) -> Setpoint:
        """Its samples from number `first` to before `stop`."""
        count = min(stop, self.samples) - first
        columns = sample(self.phases, count, self.sample_rate, first)
        return Setpoint(*columns, np.zeros_like(columns[0]), self.sample_rate)

    @cached_property
    def _sampled(self) -> Setpoint:
        return self.part(0, self.samples)

    @property
    def position(self) -> FloatArray:
        """m, shape (n, n_axes)."""
        return self._sampled.position

    @property
    def velocity(self) -> FloatArray:
        """m/s, shape (n, n_axes)."""
        return self._sampled.velocity

    @property
    def acceleration(self) -> FloatArray:
        """m/s^2, shape (n, n_axes)."""
        return self._sampled.acceleration

    @property
    def force(self) -> FloatArray:
        """N, shape (n, n_axes): zero."""
        return self._sampled.force


AnySetpoint = Setpoint | PlannedSetpoint


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


def whole_motion(parts: Sequence[Phases], sample_rate: float) -> PlannedSetpoint:
    """All parts in a row; the last sample is at the end of the last part.

    Raises:
        CannotRun: the motion is longer than an hour at 10 kHz, or takes no time at all.
    """
    phases = join(parts)
    require_length(phases.total, sample_rate)
    return PlannedSetpoint(phases, math.ceil(phases.total * sample_rate) + 1, sample_rate)


def concatenate(*setpoints: AnySetpoint) -> Setpoint:
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


def _require_joint(before: AnySetpoint, after: AnySetpoint, where: str) -> None:
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
