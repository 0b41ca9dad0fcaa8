"""ros2_control: the limits of each joint as parameters, its friction in the robot's description.

``joint_limits`` is what the package joint_limits reads. URDF has friction and damping of a joint,
which simulators of ros2_control take from there; it has no place for anything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from xml.sax.saxutils import quoteattr

import numpy as np

from twin.export import Exported, Exporter, axis_identifiers, identifier
from twin.export.tables import AxisTables, exported, judged_axes
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """The limits as YAML, and the joints as a piece of a robot's description."""
    found = judged_axes(model, logs, _straight)
    name, names = identifier(model.name), axis_identifiers(model)
    limits, joints = ["joint_limits:"], []
    for axis, own in model.axes.items():
        limits += [f"  {names[axis]}:", *(f"    {line}" for line in _limits(own))]
        joints.append(_joint(names[axis], own, found[axis].tables))
    described = "\n".join([f"<robot name={quoteattr(name)}>", *joints, "</robot>\n"])
    limited = "\n".join(limits) + "\n"
    return exported({f"{name}_joint_limits.yaml": limited, f"{name}_joints.urdf": described}, found)


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


def _limits(axis: AxisModel) -> list[str]:
    hardware, lines = axis.hardware, []
    if hardware.travel is not None:
        low, high = hardware.travel
        lines += ["has_position_limits: true", f"min_position: {low!r}", f"max_position: {high!r}"]
    for what, value in (
        ("velocity", hardware.velocity), ("acceleration", hardware.acceleration),
        ("jerk", hardware.jerk), ("effort", hardware.force_limit),
    ):  # fmt: skip
        if isfinite(value):
            lines += [f"has_{what}_limits: true", f"max_{what}: {value!r}"]
        else:
            lines.append(f"has_{what}_limits: false")
    return lines


def _joint(name: str, axis: AxisModel, of: AxisTables) -> str:
    """The joint with its limits and its friction; where it is on the robot is left to its user."""
    units, hardware = axis.units, axis.hardware
    kind = ("revolute" if axis.rotary else "prismatic") if hardware.travel else "continuous"
    level = float(of.odd[0])
    damping = float((of.odd[-1] - level) / of.speeds[-1])
    ends = 'lower="{!r}" upper="{!r}" '.format(*hardware.travel) if hardware.travel else ""
    unlimited = 1e9  # N, where the model has no force limit: URDF asks for a number
    effort = min(hardware.force_limit, unlimited)
    return f"""  <joint name="{name}" type="{kind}">
    <limit {ends}velocity="{hardware.velocity!r}" effort="{effort!r}"/>
    <!-- friction {units.force}, damping {units("N s/m")} -->
    <dynamics friction="{level:.9g}" damping="{damping:.9g}"/>
  </joint>"""


EXPORTER = Exporter(
    "joint limits of ros2_control, friction of the robot's description", export, ".yaml"
)
