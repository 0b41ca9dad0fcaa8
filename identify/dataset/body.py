"""A body of a mechanism: what a change of its inertia does to the forces at the joints.

What the bodies take of these is linear in the ten inertial parameters of each body (C. G. Atkeson,
C. H. An, J. M. Hollerbach, Int. J. Robotics Research 5, 1986).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from identify.dataset.bodies import Joints
from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog
from twin.signals import Array

if TYPE_CHECKING:
    from twin.mujoco.mechanism import Mechanism

# Relative, of what a file says of masses, centres and torque constants: two models of one machine
# by its own makers differ by as much.
ACCURACY = 0.1
LINK_MASS = "link_mass"  # by which `twin add` knows it, as it knows an effect by its name
INERTIAL = {
    "mass": "kg", "first moment x": "kg m", "first moment y": "kg m", "first moment z": "kg m",
    "inertia xx": "kg m^2", "inertia yy": "kg m^2", "inertia zz": "kg m^2",
    "inertia xy": "kg m^2", "inertia xz": "kg m^2", "inertia yz": "kg m^2",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Body:
    """The body that an axis of a mechanism moves."""

    mechanism: Mechanism
    index: int

    @property
    def name(self) -> str:
        """As in the file."""
        return self.mechanism.bodies[self.index]

    @property
    def axis(self) -> str:
        """That moves it."""
        return self.mechanism.axes[self.index]

    @property
    def axes(self) -> tuple[str, ...]:
        """Whose forces it changes."""
        return tuple(self.mechanism.axes[i] for i in self.mechanism.moved_by(self.index))

    @cached_property
    def inertial(self) -> Array:
        """Its parameters (10,) in the file."""
        return self.mechanism.inertial(self.index)

    @cached_property
    def scale(self) -> Array:
        """Of its parameters (10,), how far a file may be off: as much as the body itself."""
        mass, first, about = self.inertial[0], self.inertial[1:4], self.inertial[4:7]
        size = max(float(np.sqrt(about.sum() / mass)), float(np.linalg.norm(first)) / mass)
        return np.repeat([mass, mass * size, mass * size**2], [1, 3, 6])

    @cached_property
    def _known(self) -> dict[tuple[int, int], tuple[Array, Array]]:
        return {}

    def forget(self) -> None:
        """Let go of what it has computed for its forces."""
        self._known.clear()

    def _per_unit(self, log: PreparedLog) -> tuple[Array, Array]:
        """Times (k,) in samples, and momentum and force (2, 10, n_axes, k) by each of INERTIAL.

        At the rate that a mechanism's motion needs, of readings that are as far apart.
        """
        bodies = log.motion.bodies
        assert bodies is not None
        # The joints of a log share their motion, unless they begin at other instants.
        first, period = bodies.readings[0], bodies.joints.period
        key = (first.__array_interface__["data"][0], len(first))
        if key not in self._known:
            # 4 ms: inertia and weight are smooth over it, and half as much would tell no more
            every = max(round(0.004 / period), 1)
            apart = Joints(tuple(r[::every] for r in bodies.readings), every * period)
            count = len(apart.readings[0]) - 1
            told = self.mechanism.per_unit(self.index, *apart.along(slice(0, count)))
            times = every * (np.arange(count, dtype=float) + 0.5) - 0.5
            self._known[key] = times, told[:, :, self.mechanism.moved_by(self.index)]
        return self._known[key]

    def forces(self, log: PreparedLog) -> Array:
        """Change (n, 10) of the force residual, N per unit of each parameter."""
        if log.motion.axis not in self.axes:
            return np.zeros((len(log), len(INERTIAL)))
        bodies = log.motion.bodies
        assert bodies is not None
        times, told = self._per_unit(log)
        own, samples = told[:, :, self.axes.index(log.motion.axis)], np.arange(len(bodies.force))
        momentum, force = (
            np.stack([np.interp(samples, times, each) for each in part]) for part in own
        )
        return -(log.fine.mean(force) + log.fine.acceleration(momentum)).T

    def corrected(self, dataset: Dataset, change: Array) -> Dataset:
        """A dataset in whose bodies this one is changed by so much (10,)."""

        def of(log: PreparedLog) -> PreparedLog:
            motion = log.motion
            assert motion.bodies is not None
            both = self.mechanism.by_change(self.index, change, *motion.bodies.along())
            momentum, force = both[:, self.mechanism.axes.index(motion.axis)]
            bodies = motion.bodies.with_more(momentum, force)
            command = log.command - log.fine.mean(force) - log.fine.acceleration(momentum)
            return replace(log, motion=replace(motion, bodies=bodies), command=command)

        return dataset.with_logs(map(of, dataset.logs)) if dataset.axis in self.axes else dataset
