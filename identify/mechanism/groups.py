"""What of a mechanism may be another than in its model: groups of parameters that go together.

Of each joint the body that it moves, the rotor, the torque constant of the motor, the growth of the
dry friction by the load, and a torque that is a smooth curve of its angle, such as that of a spring
or a counterbalance. Each is some columns of the force residual of all joints.

The regressor of a torque constant is the torque: as measured it would explain its own noise, so it
is what a regression predicts of it (``regression``). The load of a friction is that of the model's
bodies, never the measured torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.body import INERTIAL, Body
from identify.dataset.prepared_log import PreparedLog, Reach
from identify.selection.what import What
from twin.model.machine import AxisModel
from twin.signals import Array

ORDER = 3  # of the curve of a joint's angle


@dataclass(frozen=True, eq=False)
class Group:
    """Parameters that move away from the model together, or not at all.

    axis: of the joint. body: where it is one. scale (k,): how far each may be off by itself, in its
    own unit; infinite where nothing is known of that. least (k,): the least change of each that is
    possible. unstated: whether the file says nothing of what is there for sure, as of a motor's
    rotor. reach: positions (rad or m) of the joint on the training logs. corrected (k,): by which a
    body was changed already.
    """

    what: What
    axis: str
    scale: Array
    least: Array
    body: Body | None = None
    reach: Reach = (-1.0, 1.0)
    unstated: bool = False
    corrected: Array | float = 0.0

    @property
    def place(self) -> str:
        """The body or the joint."""
        return self.body.name if self.body else self.axis

    @property
    def count(self) -> int:
        """Of its parameters."""
        return len(self.scale)

    def columns(self, log: PreparedLog) -> Array:
        """Change (n, k) of the force residual of a log, N per unit of each parameter.

        Of a gain none: what a regression predicts takes their place.
        """
        if self.body is not None:
            return self.body.forces(log)
        if log.motion.axis != self.axis or self.what is What.GAIN:
            return np.zeros((len(log), self.count))
        if self.what is What.ROTOR:
            return -log.acceleration[:, None]
        if self.what is What.LOAD:
            _, velocity, _, load, *_ = log.motion.joint_signals
            return -log.test_function.mean(np.sign(velocity) * np.abs(load))[:, None]
        return self._curve(log)

    def _curve(self, log: PreparedLog) -> Array:
        """Powers of the position over its reach."""
        low, high = self.reach
        place = (log.motion.position - 0.5 * (low + high)) / (0.5 * (high - low) or 1.0)
        return log.test_function.mean(np.stack([place**k for k in range(1, ORDER + 1)])).T


def groups_of(
    bodies: Sequence[Body], axes: Mapping[str, AxisModel], reaches: Mapping[str, Reach]
) -> list[Group]:
    """The groups of the joints that moved.

    bodies: of these joints. axes, reaches: by joint its model and the positions that it reached.
    """
    unknown, free = np.full(1, np.inf), np.full(1, -np.inf)
    out = []
    for body in bodies:
        axis, own = body.axis, axes[body.axis]
        rotor = own.weighed.mass - own.mass
        out += [
            Group(What.BODY, axis, body.scale, np.full(len(INERTIAL), -np.inf), body),
            Group(What.ROTOR, axis, unknown, np.array([-rotor]), unstated=rotor == 0.0),
            Group(What.GAIN, axis, unknown, free),
            Group(What.LOAD, axis, unknown, np.zeros(1)),
            Group(
                What.CURVE, axis, np.full(ORDER, np.inf), np.full(ORDER, -np.inf),
                reach=reaches[axis],
            ),
        ]  # fmt: skip
    return out
