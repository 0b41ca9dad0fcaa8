"""Setpoints of an experiment for the controller of a machine.

Time and the motion of each axis as CSV, a ROS 2 trajectory as YAML, or arrays of Structured Text
for a PLC.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.experiments.experiment import Experiment
from twin.experiments.file import setpoint_of
from twin.experiments.trajectory import Setpoint
from twin.export import axis_identifiers, filled
from twin.files import atomic_writer, write_atomically
from twin.model.machine import MachineModel

ENDING = ".setpoints.csv"


def write_setpoints(experiment: Experiment, model: MachineModel, seed: int, path: Path) -> None:
    """Write time, position, velocity and acceleration of each axis, units in the header.

    An experiment that adds a force has a column for it. In closed loop the position is followed;
    in open loop the force alone drives the axis. A .yaml file is a ROS 2 trajectory instead
    (trajectory_msgs/JointTrajectory), a .st file arrays for TwinCAT's external setpoint generation.
    Raises InputError where it cannot be written.
    """
    if path.suffix not in (".csv", *TEXTS):
        raise InputError(f"{path}: setpoints are written as .csv, .yaml (ROS 2) or .st (TwinCAT)")
    setpoint = setpoint_of(experiment, model, seed)
    if path.suffix in TEXTS:
        if isinstance(setpoint, Setpoint) and setpoint.force.any():
            raise InputError(f"{path}: it has no place for a force, which drives this; give a .csv")
        whole = setpoint.part(0, len(setpoint))
        write_atomically(path, TEXTS[path.suffix](whole, model).encode())
        return
    forces = setpoint.force if isinstance(setpoint, Setpoint) else np.zeros((1, len(model.axes)))
    driven = np.flatnonzero(forces.any(axis=0))
    names = ["time [s]"]
    for i, (name, axis) in enumerate(model.axes.items()):
        u = axis.units
        names += [f"{name} position [{u.position}]", f"{name} velocity [{u.velocity}]"]
        names += [f"{name} acceleration [{u('m/s^2')}]"]
        names += [f"{name} force [{u.force}]"] if i in driven else []
    with atomic_writer(path) as stream:
        stream.write((",".join(names) + "\n").encode())
        rows = 100_000  # of a CSV, made at once: some 10 MB
        for first in range(0, len(setpoint), rows):
            part = setpoint.part(first, min(first + rows, len(setpoint)))
            columns = [np.arange(first, first + len(part)) / part.sample_rate]
            for i in range(len(model.axes)):
                own = part.columns if i in driven else part.columns[:3]
                columns += [column[:, i] for column in own]
            np.savetxt(stream, np.column_stack(columns), fmt="%.9g", delimiter=",")


def _trajectory(setpoint: Setpoint, model: MachineModel) -> str:
    """The message as YAML, a point a line."""
    # s, between the points of a trajectory, which a controller joins by smooth curves
    points = [
        (
            *divmod(round(1e9 * k / setpoint.sample_rate), 10**9),
            *(x[k] for x in setpoint.columns[:3]),
        )
        for k in _points(setpoint, 0.01)
    ]
    return filled("trajectory.yaml", axes=list(model.axes), points=points)


def _structured_text(setpoint: Setpoint, model: MachineModel) -> str:
    """Arrays as global variables, of a PLC task that takes a point each cycle of 1 ms or more."""
    points, names, arrays = _points(setpoint, 1e-3), axis_identifiers(model), []
    for i, (axis, name) in enumerate(names.items()):
        units = model.axes[axis].units
        position, velocity, acceleration = (x[points, i] for x in setpoint.columns[:3])
        arrays += [
            (f"{name}_Position", "LREAL", "%.9g", position, units.position),
            (f"{name}_Velocity", "LREAL", "%.9g", velocity, units.velocity),
            (f"{name}_Acceleration", "LREAL", "%.9g", acceleration, units("m/s^2")),
            (f"{name}_Direction", "DINT", "%.0f", np.sign(velocity), "1"),
        ]
    cycle = 1e3 * ((points[1] - points[0]) / setpoint.sample_rate)
    return filled(
        "setpoints.st", cycle=cycle, last=len(points) - 1, names=names.values(), arrays=arrays
    )


def _points(setpoint: Setpoint, apart: float) -> list[int]:
    """Samples so many s apart, and the last one."""
    step, last = max(round(apart * setpoint.sample_rate), 1), len(setpoint) - 1
    return [*range(0, last, step), last]


TEXTS = {".yaml": _trajectory, ".st": _structured_text}
