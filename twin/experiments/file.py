"""Experiments as TOML files: one table, each parameter with its unit in a comment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from twin.entries import read_toml, shown
from twin.errors import InputError, at, near
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import KINDS, kind_of
from twin.experiments.trajectory import AnySetpoint
from twin.files import write_atomically
from twin.model.machine import MachineModel
from twin.model.units import LINEAR, AxisUnits
from twin.numbers import is_number

SUFFIX = ".toml"


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
        raise InputError(f"{path}: no such experiment file; `twin plan` writes one")
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
