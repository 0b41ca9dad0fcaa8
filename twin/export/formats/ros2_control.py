"""ros2_control: the limits of each joint as parameters, its friction in the robot's description.

``joint_limits`` is what the package joint_limits reads. URDF has friction and damping of a joint,
which simulators of ros2_control take from there; it has no place for anything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from twin.export import Exported, Exporter, axis_identifiers, filled, identifier
from twin.export.tables import AxisTables, judged_axes
from twin.logs import Log
from twin.model.machine import MachineModel


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """The limits as YAML, and the joints as a piece of a robot's description."""
    found = judged_axes(model, logs, _straight)
    name, names = identifier(model.name), axis_identifiers(model)
    axes = {names[axis]: own for axis, own in model.axes.items()}
    tables = {names[axis]: own.tables for axis, own in found.items()}
    files: dict[str, str | bytes] = {
        f"{name}_{file}": filled(file, name=name, axes=axes, tables=tables)
        for file in ("joint_limits.yaml", "joints.urdf")
    }
    return Exported(files, found)


def _straight(of: AxisTables) -> AxisTables:
    """What URDF holds of a friction: a constant, and a part in proportion to speed, never less."""
    middle = of.speeds[1:]
    columns = np.stack([np.ones_like(middle), middle], axis=1)
    level, damping = np.linalg.lstsq(columns, of.odd[1:], rcond=None)[0]
    if damping < 0.0:
        level, damping = float(of.odd[1:].mean()), 0.0
    odd = max(level, 0.0) + damping * of.speeds
    still = np.zeros_like(of.along)
    return replace(of, along=still, forwards=odd, backwards=-odd, periodic=())


EXPORTER = Exporter(
    "joint limits of ros2_control, friction of the robot's description", export, ".yaml"
)
