"""Joints of a log that are not those of the MuJoCo file: of another sign or unit, or exchanged.

The bodies of a mechanism take other torques of all joints where one of them goes the wrong way. So
each joint is tried the other way round, its position alone or its torque with it, and in degrees,
and each two are exchanged; what the simplest friction leaves of the torques of all joints tells
which is right.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from math import pi

import numpy as np

from identify.analysis.first_model import LENGTHS, friction_left
from identify.dataset.bodies import bodies_along
from identify.dataset.motion import motion_of
from twin.checks import moves
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.signals import Array

SIGNALS = ("position", "force", "current")  # a velocity has a unit and a sign of its own


def misassigned(model: MachineModel, log: Log) -> str | None:
    """What of a log seems to be of another sign, unit or joint, in a sentence; None if nothing.

    model: its axes are joints of a mechanism.
    """
    least_left = 0.01  # of a joint's squared torque: where none leaves as much, all is right
    # 240 s of all joints together, of the log's beginning, tell it
    head = _plain(log.part(0, min(round(240.0 / len(model.joints) / log.period), len(log))))
    going = [axis for axis in model.joints if moves(head, axis)]
    parts = _left(model, head, going)
    if max(parts, default=0.0) < least_left:
        return None
    most_tried = 8  # joints, those that leave most: each asks for the torques of all joints anew
    worst = sorted(zip(parts, going, strict=True), reverse=True)[:most_tried]
    suspects = [axis for axis in going if axis in {a for _, a in worst}]
    tried = ((_left(model, o, going), said) for o, said in _others(model, head, suspects))
    left, said = min(tried, key=lambda pair: float(pair[0].sum()))
    # Joint by joint, as one whose coupling or friction the model lacks may leave most of all.
    falls = np.maximum(left, least_left) / np.maximum(parts, least_left)
    if falls.prod() >= 0.5:  # product over the joints, below which another assignment is believed
        return None
    most = int(np.argmin(falls))
    before, after = (100.0 * float(each[most]) ** 0.5 for each in (parts, left))
    return (
        f"{said}, bodies and friction would leave {after:.0f} % of the torque of {going[most]}, in "
        f"place of {before:.0f} %; correct the import map, or the file"
    )


def _others(model: MachineModel, log: Log, suspects: Sequence[str]) -> Iterator[tuple[Log, str]]:
    for axis in suspects:
        sign = "(sign = -1 in the map)"
        said = f"axis {axis}: with the other sign of its position"
        yield _scaled(log, [axis], -1.0), f"{said} {sign}"
        yield _scaled(log, [axis], -1.0, SIGNALS), f"{said} and torque {sign}"
    turning = [axis for axis in model.joints if model.axes[axis].rotary]
    for axes in (turning, *([axis] for axis in suspects if axis in turning)):
        named = f"ax{'es' if axes[1:] else 'is'} {', '.join(axes)}"
        for unit, factor in (("deg", pi / 180.0), ("rad", 180.0 / pi)):
            said = f'{named}: with positions in {unit} (unit = "{unit}" in the map)'
            yield _scaled(log, axes, factor), said
    for one, other in combinations(suspects, 2):
        if model.axes[one].units == model.axes[other].units:
            swapped = {**log.axes, one: log.axes[other], other: log.axes[one]}
            yield replace(log, axes=swapped), f"axes {one} and {other}: exchanged"


def _plain(log: Log) -> Log:
    """The log with positions and torques alone."""
    axes = {}
    for name, own in log.axes.items():
        kept = {n: own.columns[n] for n in SIGNALS if n in own.columns}
        axes[name] = replace(own, columns=kept)
    return replace(log, axes=axes)


def _scaled(
    log: Log, axes: Collection[str], factor: float, fields: Collection[str] = ("position",)
) -> Log:
    """The log with some signals of some axes times a factor."""
    scaled = {}
    for axis in axes:
        own = log.axes[axis]
        columns = {n: factor * c if n in fields else c for n, c in own.columns.items()}
        scaled[axis] = replace(own, columns=columns)
    return replace(log, axes={**log.axes, **scaled})


def _left(model: MachineModel, log: Log, going: Sequence[str]) -> Array:
    """What is left of the squared torque of each moving joint, as a part of it."""
    bodies, parts = bodies_along(model, log, ""), []
    for axis in going:
        motion = motion_of(log, axis, "", ripples=(), bodies=bodies[axis])
        power = float(np.mean(motion.command**2)) or 1.0
        parts.append(friction_left([motion], LENGTHS[0]) ** 2 / power)
    return np.array(parts)
