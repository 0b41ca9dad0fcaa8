"""Experiments as TOML files, and their setpoints for the controller of a machine.

The TOML has one table, each parameter with its unit in a comment. Setpoints are time and the motion
of each axis as CSV, a ROS 2 trajectory as YAML, or arrays of Structured Text for a PLC.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from twin.entries import near, read_toml, shown
from twin.errors import InputError, at
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import KINDS, kind_of
from twin.experiments.trajectory import AnySetpoint, Setpoint
from twin.export import axis_identifiers, filled
from twin.files import atomic_writer, write_atomically
from twin.model.machine import MachineModel
from twin.model.units import LINEAR, AxisUnits
from twin.numbers import is_number

SUFFIX = ".toml"
ENDING = ".setpoints.csv"


def format_experiment(experiment: Experiment, *comments: str, units: AxisUnits = LINEAR) -> str:
    """The experiment as TOML text, below the comments; units: of the axis that it drives."""
    document = tomlkit.document()
    for comment in comments:
        document.add(tomlkit.comment(comment))
    table = tomlkit.table()
    table["kind"] = tomlkit.item(kind_of(experiment)).comment(experiment.summary)
    metadata = {f.name: f.metadata for f in fields(experiment)}
    for name, value in parameters(experiment).items():
        about = (units(metadata[name].get("unit", "")), metadata[name].get("meaning"))
        item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
        table[name] = item.comment(", ".join(filter(None, about))) if any(about) else item
    document["experiment"] = table
    return tomlkit.dumps(document)


def parameters(experiment: Experiment) -> dict[str, Any]:
    """Name -> value of the parameters that are not at their default, SI units."""
    given = ((f, getattr(experiment, f.name)) for f in fields(experiment))
    return {f.name: v for f, v in given if f.default is MISSING or v != f.default}


def save_experiment(
    experiment: Experiment, path: str | Path, *comments: str, units: AxisUnits = LINEAR
) -> None:
    """Write the experiment, whole or not at all. Raises InputError where the folder is missing."""
    write_atomically(Path(path), format_experiment(experiment, *comments, units=units).encode())


def load_experiment(path: str | Path) -> Experiment:
    """Read an experiment. Raises InputError naming the file, the entry and what is allowed."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such experiment file; `twin plan` writes one, or give a name")
    table = read_toml(path).get("experiment")
    with at(str(path)):
        if not isinstance(table, dict):
            raise InputError("has no [experiment] table; `twin plan` writes one")
        return parse_experiment(table)


def parse_experiment(table: Mapping[str, Any]) -> Experiment:
    """An experiment from its table. Raises InputError for an unknown kind or entry."""
    name = table.get("kind")
    if not isinstance(name, str) or name not in KINDS:
        raise InputError(f"unknown kind {shown(name)} of experiment; {_known(name, KINDS)}")
    known = {f.name: f for f in fields(KINDS[name])}
    given = {key: value for key, value in table.items() if key != "kind"}
    for key, value in given.items():
        if key not in known:
            raise InputError(f"unknown entry '{key}' of kind {name}; {_known(key, known)}")
        several = _several(known[key])
        values = value if several and isinstance(value, list) else [value]
        right = is_number if "unit" in known[key].metadata else lambda v: isinstance(v, str)
        if several != isinstance(value, list) or not all(map(right, values)):
            raise InputError(f"{key} = {shown(value)}: give {_wanted(known[key])}")
    for key, f in known.items():
        if f.default is MISSING and key not in given:
            raise InputError(f"{key} is missing for kind {name}; give {_wanted(f)}")
    return KINDS[name](**{k: tuple(v) if isinstance(v, list) else v for k, v in given.items()})


def _several(f: Field[Any]) -> bool:
    return "tuple" in str(f.type)


def _wanted(f: Field[Any]) -> str:
    if "unit" not in f.metadata:
        return "a name in quotes"
    if not (unit := f.metadata["unit"]):
        return "a whole number"
    return f"a list of numbers in {unit}" if _several(f) else f"a number in {unit}"


def _known(name: object, known: Mapping[str, Any]) -> str:
    return f"{near(str(name), known, cutoff=0.4)}there are {', '.join(known)}"


def in_short(experiment: Experiment, units_of: AxisUnits = LINEAR) -> str:
    """Kind and parameters with the units of the axis that it drives, on one line."""
    units = {f.name: units_of(f.metadata.get("unit", "")) for f in fields(experiment)}
    units = {name: "" if unit == "1" else unit for name, unit in units.items()}  # of a part: none
    values = (f"{k} {_plain(v)} {units[k]}".strip() for k, v in parameters(experiment).items())
    return f"{kind_of(experiment)}: {', '.join(values)}"


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(f"{v:g}" for v in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def setpoint_of(experiment: Experiment, model: MachineModel, seed: int) -> AnySetpoint:
    """The setpoint that ``twin simulate`` runs with this seed. Raises CannotRun, InputError."""
    return experiment.setpoint(model, np.random.default_rng(seed).spawn(3)[0])


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
