"""What the bodies of a mechanism take of the forces at its joints, along the motion of a log.

Of a log with many joints each signal of all of them is half as large as the log. So only what
every fit needs is held, momentum and force, and it is computed in pieces of time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from identify.dataset.readings import together
from twin.errors import InputError
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.parallel import spread
from twin.signals import Array, between, local_parabola

if TYPE_CHECKING:
    from twin.mujoco.mechanism import Mechanism

PIECE = 1 << 12  # samples whose motion is held at once; of 40 joints it takes 10 MB


@dataclass(frozen=True, eq=False)
class Joints:
    """The motion of all joints of a mechanism over a log.

    readings: m, of each joint (n + 1,), as the log holds them, at the ends of n samples. period: s,
    of the samples.
    """

    readings: tuple[Array, ...]
    period: float

    def along(self, samples: slice) -> tuple[Array, Array, Array]:
        """Positions, velocities and smoothed velocities (n_axes, k) between samples, m and m/s."""
        position = self._at(samples.start, samples.stop + 1)
        velocity, smooth = between(position, self.period), self._smooth(samples)
        return _middle(position), velocity, smooth

    def _smooth(self, samples: slice) -> Array:
        """Velocities (n_axes, k) m/s of the parabolas through the readings around each."""
        count = len(self.readings[0])
        width = _smoothed_over(self.period, count)
        low, high = max(samples.start - width, 0), min(samples.stop + 1 + width, count)
        smooth = local_parabola(self._at(low, high), width, derivative=1, period=self.period)
        return _middle(smooth[:, samples.start - low : samples.stop + 1 - low])

    def _at(self, first: int, end: int) -> Array:
        return np.stack([r[first:end] for r in self.readings])

    @cached_property
    def speeds(self) -> Array:
        """Smoothed velocities (n_axes, n) m/s; few effects read them."""
        return self._smooth(slice(0, len(self.readings[0]) - 1))


@dataclass(frozen=True, eq=False)
class Bodies:
    """What the bodies of a mechanism take of one of its joints, (n,) each between a log's samples.

    momentum: N s, beyond mass x velocity. force: N, what they take beyond the change of momentum.
    joints: the motion of all joints over the log. index: which of them this is. samples: those of
    the log. mass: kg, of which the momentum is not told. mechanism: whose bodies they are.
    """

    momentum: Array
    force: Array
    joints: Joints
    index: int
    samples: slice
    mass: float
    mechanism: Mechanism

    @property
    def readings(self) -> tuple[Array, ...]:
        """Readings (n + 1,) m of each joint, at the ends of the samples."""
        return tuple(r[self.samples.start : self.samples.stop + 1] for r in self.joints.readings)

    @property
    def speeds(self) -> Array:
        """Smoothed velocities (n_axes, n) m/s of all joints."""
        return self.joints.speeds[:, self.samples]

    @cached_property
    def load(self) -> Array:
        """All force (n,) N that they take, smoothed."""
        period = self.joints.period
        momentum = self.momentum + self.mass * between(self.readings[self.index], period)
        width = _smoothed_over(period, len(momentum) + 1)
        return self.force + local_parabola(momentum, width, derivative=1, period=period)

    def along(self) -> tuple[Array, Array, Array]:
        """Positions, velocities and smoothed velocities (n_axes, n) of all joints, m and m/s."""
        return self.joints.along(self.samples)

    def forget(self) -> None:
        """Let go of the load, which is computed again."""
        self.__dict__.pop("load", None)

    def during(self, samples: slice) -> Bodies:
        """The same of some samples, counted from the first of these."""
        first, end, _ = samples.indices(len(self.momentum))
        begun = self.samples.start
        return replace(
            self,
            momentum=self.momentum[first:end],
            force=self.force[first:end],
            samples=slice(begun + first, begun + end),
        )

    def with_more(self, momentum: Array, force: Array) -> Bodies:
        """The same where the bodies take more, (n,) N s and N."""
        return replace(self, momentum=self.momentum + momentum, force=self.force + force)


def bodies_along(model: MachineModel, log: Log, name: str) -> dict[str, Bodies]:
    """What the bodies take of each axis that is a joint; none for a machine of plain axes.

    Of all joints together: each carries the others. The velocity, of which the momentum is made, is
    the difference of the readings, as the weak form integrates it by parts; what depends on it
    otherwise is small and of second order, and takes a smooth one.
    The force residual of a joint is command - force - d/dt(mass x velocity + momentum). name: of
    the log. Raises InputError where the log lacks one of the joints.
    """
    if not model.joints:
        return {}
    from twin.model.bodies import mechanism_in  # MuJoCo takes long to load

    mechanism = mechanism_in(model)
    _require_joints(mechanism.axes, model, log, name)
    told = [log.axes[axis] for axis in mechanism.axes]
    readings = (together(a.position, a.columns.get("velocity"), log.period)[0] for a in told)
    joints = Joints(tuple(readings), log.period)
    count = len(log) - 1
    momentum, force = np.empty((2, len(told), count))

    def take(samples: slice) -> None:
        _, velocity, _ = motion = joints.along(samples)
        momentum[:, samples], force[:, samples] = mechanism.along(*motion)
        momentum[:, samples] -= mechanism.inertia[:, None] * velocity

    spread(take, [slice(k, min(k + PIECE, count)) for k in range(0, count, PIECE)])
    return {
        axis: Bodies(momentum[i], force[i], joints, i, slice(0, count), float(mass), mechanism)
        for i, (axis, mass) in enumerate(zip(mechanism.axes, mechanism.inertia, strict=True))
    }


def _require_joints(axes: Sequence[str], model: MachineModel, log: Log, name: str) -> None:
    for axis in axes:
        if axis not in log.axes:
            raise InputError(
                f"{name}: has no axis '{axis}', which is a joint of {model.mjcf_name}; the forces "
                "of the others depend on its motion, so log it, or take the joint out of the file"
            )


def _smoothed_over(period: float, count: int) -> int:
    """Samples, odd, over which the motion of ``count`` samples of a joint is smoothed."""
    # 0.02 s, over which a joint's position is a parabola that tells its velocity
    samples = min(max(round(0.02 / period), 5), count - 1)
    return samples - (1 - samples % 2)


def _middle(signals: Array) -> Array:
    """Means (..., n - 1) of each sample and the next."""
    return np.asarray(0.5 * (signals[..., 1:] + signals[..., :-1]))
