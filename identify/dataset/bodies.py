"""What the bodies of a mechanism take of the forces of its joints, along one log.

Of all joints together: each carries the others. The velocity, of which the momentum is made, is the
difference of the readings, as the weak form integrates it by parts; what depends on it otherwise is
small and of second order, and takes a smooth one.
"""

from __future__ import annotations

import numpy as np

from identify.dataset.motion import Bodies
from identify.dataset.velocity import together
from twin.errors import InputError
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.signals import Array, between, local_parabola

SMOOTHED = 0.02  # s, over which a position is a parabola that tells its velocity
FEWEST = 5  # samples of it


def bodies_along(model: MachineModel, log: Log, name: str) -> dict[str, Bodies]:
    """What the bodies take of each axis that is a joint; none for a machine of plain axes.

    The force residual of a joint is command - force - d/dt(mass x velocity + momentum). name: of
    the log. Raises InputError where the log lacks one of the joints.
    """
    if not model.joints:
        return {}
    from twin.mujoco.mechanism import mechanism_of  # MuJoCo takes long to load

    mechanism = mechanism_of(model.mjcf or "", model.mjcf_name or "", model.joints)
    for axis in mechanism.axes:
        if axis not in log.axes:
            raise InputError(
                f"{name}: has no axis '{axis}', which is a joint of {model.mjcf_name}; the forces "
                "of the others depend on its motion, so log it, or take the joint out of the file"
            )
    told = [log.axes[axis] for axis in mechanism.axes]
    position = np.stack(
        [together(a.position, a.columns.get("velocity"), log.period).position for a in told]
    )
    samples = min(max(round(SMOOTHED / log.period), FEWEST), position.shape[1] - 1)
    samples -= 1 - samples % 2
    smooth = local_parabola(position, samples, derivative=1, period=log.period)
    velocity, speeds = between(position, log.period), _middle(smooth)
    momentum, force = mechanism.along(_middle(position), velocity, speeds)
    load = force + local_parabola(momentum, samples, derivative=1, period=log.period)
    momentum -= mechanism.inertia[:, None] * velocity
    return {
        axis: Bodies(momentum[i], force[i], load[i], speeds, i)
        for i, axis in enumerate(mechanism.axes)
    }


def _middle(signals: Array) -> Array:
    """Means (..., n - 1) of each sample and the next."""
    return np.asarray(0.5 * (signals[..., 1:] + signals[..., :-1]))
