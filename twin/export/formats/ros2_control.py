"""ros2_control: the limits of each joint as parameters, its friction in the robot's description.

``joint_limits`` is what the package joint_limits reads. URDF has friction and damping of a joint,
which simulators of ros2_control take from there; it has no place for anything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from twin.export import Exported, Exporter, Held, axis_identifiers, filled, identifier
from twin.export.tables import AxisTables, TableFormat
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """The limits as YAML, and the joints as a piece of a robot's description."""
    made = TableFormat(write, read).exported(model, logs)
    name, names = identifier(model.name), axis_identifiers(model)
    axes = {names[axis]: own for axis, own in model.axes.items()}
    joints = "".join(str(made.files[f"{joint}{JOINT}"]) for joint in axes)
    files: dict[str, str | bytes] = {
        f"{name}_joint_limits.yaml": filled("joint_limits.yaml", axes=axes),
        f"{name}_joints.urdf": filled("joints.urdf", name=name, joints=joints),
    }
    return replace(made, files=files)


JOINT = "_joint.urdf"  # what the description holds of one axis


def write(name: str, axis: AxisModel, of: AxisTables, said: Held) -> dict[str, str]:
    """The joint of an axis, with what URDF holds of a friction.

    That is a constant, and a part in proportion to speed, never less than nothing.
    """
    middle = of.speeds[1:]
    columns = np.stack([np.ones_like(middle), middle], axis=1)
    level, damping = np.linalg.lstsq(columns, of.odd[1:], rcond=None)[0]
    if damping < 0.0:
        level, damping = float(of.odd[1:].mean()), 0.0
    friction = max(float(level), 0.0)
    text = filled("joint.urdf", joint=name, axis=axis, friction=friction, damping=float(damping))
    return {f"{name}{JOINT}": text}


def read(files: Mapping[str, str], name: str, axis: AxisModel) -> AxisTables:
    """The tables of the joint of an axis, which has no place for a mass or a force of position."""
    dynamics = ElementTree.fromstring(files[f"{name}{JOINT}"]).find("dynamics")
    held = {} if dynamics is None else dynamics.attrib
    friction, damping = (float(held.get(part, 0.0)) for part in ("friction", "damping"))
    fast = 1e6  # m/s, beyond any motion, up to which the friction goes on straight
    odd, still = friction + damping * np.array([0.0, fast]), np.zeros(2)
    return AxisTables(0.0, np.arange(2.0), still, np.array([0.0, fast]), odd, -odd, ())


EXPORTER = Exporter(
    "joint limits of ros2_control, friction of the robot's description", export, ".yaml"
)
