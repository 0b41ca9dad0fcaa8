"""Joints of a log that are not those of the MuJoCo file: of another direction, or exchanged.

The bodies of a mechanism take other torques of all joints where one of them goes the wrong way. So
each joint is tried the other way round, its position alone or its torque with it, and each two are
exchanged; what the simplest friction leaves of the torques of all joints tells which is right.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from identify.analysis.first_model import LENGTHS, friction_left
from identify.dataset.motion import bodies_along, motion_of
from twin.checks import moves
from twin.logs import Log
from twin.model.machine import MachineModel

MOTION = ("position", "velocity", "setpoint_position", "setpoint_velocity", "setpoint_acceleration")
REVERSED = {"position": MOTION, "position and torque": (*MOTION, "force", "current")}
LEAST_FALL = 0.5  # of the squared torque that is left, from which another assignment is believed


def misassigned(model: MachineModel, log: Log) -> str | None:
    """What of a log seems to be of another direction or joint, in a sentence; None where nothing.

    model: its axes are joints of a mechanism.
    """
    given = _left(model, log)
    best = min(((_left(model, other), said) for said, other in _others(model, log)), default=None)
    if best is None or best[0] >= LEAST_FALL * given:
        return None
    part = 100.0 * (best[0] / given) ** 0.5
    return (
        f"{best[1]} they would leave {part:.0f} % of the torque that the bodies and friction leave "
        "now; correct the import map, or the file"
    )


def _others(model: MachineModel, log: Log) -> Iterator[tuple[str, Log]]:
    going = [axis for axis in model.joints if moves(log, axis)]
    for axis in going:
        for what, fields in REVERSED.items():
            said = f"axis {axis}: with the other sign of its {what} (sign = -1 in the map)"
            yield said, _reversed(log, axis, fields)
    for one, other in combinations(going, 2):
        if model.axes[one].units == model.axes[other].units:
            swapped = {**log.axes, one: log.axes[other], other: log.axes[one]}
            yield f"axes {one} and {other}: exchanged", replace(log, axes=swapped)


def _reversed(log: Log, axis: str, fields: Sequence[str]) -> Log:
    own = log.axes[axis]
    columns = {n: -c if n in fields else c for n, c in own.columns.items()}
    return replace(log, axes={**log.axes, axis: replace(own, columns=columns)})


def _left(model: MachineModel, log: Log) -> float:
    """What is left of the squared torques of all moving joints, as parts of each, together."""
    bodies, parts = bodies_along(model, log, ""), []
    for axis in filter(lambda name: moves(log, name), model.joints):
        motion = motion_of(log, axis, "", ripples=(), bodies=bodies[axis])
        power = float(np.mean(motion.command**2)) or 1.0
        parts.append(friction_left([motion], LENGTHS[0]) ** 2 / power)
    return float(np.sum(parts))
