"""Setpoints as a table, for the controller of a machine: time and the motion of each axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from twin.experiments.experiment import Experiment
from twin.experiments.trajectory.setpoint import AnySetpoint, Setpoint
from twin.files import replacing
from twin.model.machine import MachineModel

ENDING = ".setpoints.csv"
ROWS = 100_000  # made at once


def setpoint_of(experiment: Experiment, model: MachineModel, seed: int) -> AnySetpoint:
    """The setpoint that ``twin simulate`` runs with this seed. Raises CannotRun, InputError."""
    return experiment.setpoint(model, np.random.default_rng(seed).spawn(3)[0])


def write_setpoints(experiment: Experiment, model: MachineModel, seed: int, path: Path) -> None:
    """Write time, position, velocity and acceleration of each axis, units in the header.

    An experiment that adds a force has a column for it. In closed loop the position is followed;
    in open loop the force alone drives the axis. Raises InputError where it cannot be written.
    """
    setpoint = setpoint_of(experiment, model, seed)
    driven = [i for i in range(len(model.axes)) if _drives(setpoint, i)]
    names = ["time [s]"]
    for i, (name, axis) in enumerate(model.axes.items()):
        u = axis.units
        names += [f"{name} position [{u.position}]", f"{name} velocity [{u.velocity}]"]
        names += [f"{name} acceleration [{u('m/s^2')}]"]
        names += [f"{name} force [{u.force}]"] if i in driven else []
    with replacing(path) as stream:
        stream.write((",".join(names) + "\n").encode())
        for first in range(0, len(setpoint), ROWS):
            part = setpoint.part(first, min(first + ROWS, len(setpoint)))
            np.savetxt(stream, _table(part, first, driven), fmt="%.9g", delimiter=",")


def _drives(setpoint: AnySetpoint, axis: int) -> bool:
    return isinstance(setpoint, Setpoint) and bool(setpoint.force[:, axis].any())


def _table(part: Setpoint, first: int, driven: list[int]) -> np.ndarray:
    """(n, columns) of some samples, of which the first has that number."""
    columns = [np.arange(first, first + len(part)) / part.sample_rate]
    for i in range(part.position.shape[1]):
        columns += [part.position[:, i], part.velocity[:, i], part.acceleration[:, i]]
        columns += [part.force[:, i]] if i in driven else []
    return np.column_stack(columns)
