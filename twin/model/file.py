"""Machine models as TOML files: values with their units in comments, and the history."""

from __future__ import annotations

import difflib
import math
import os
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import tomlkit

from twin.effects import Catalogue
from twin.errors import InputError
from twin.model.intervals import ENTRY, intervals_table, read_intervals
from twin.model.machine import AxisModel, Fitted, Hardware, HistoryStep, MachineModel
from twin.model.units import LINEAR, ROTARY, AxisUnits

# Of a linear axis; ``hardware_unit`` gives those of any.
HARDWARE_UNITS = {
    "travel": "m",
    "force_constant": "N/A",
    "force_limit": "N",
    "encoder_resolution": "m",
    "encoder_noise": "m rms",
    "current_noise": "A rms",
    "velocity": "m/s, fastest move",
    "acceleration": "m/s^2, fastest move",
    "jerk": "m/s^3, fastest move",
    "bandwidth": "Hz, position loop",
}


def hardware_unit(key: str, units: AxisUnits) -> str:
    """Unit of a hardware entry on an axis with these units, and what it is where that helps."""
    unit, comma, meaning = HARDWARE_UNITS[key].partition(",")
    return f"{units(unit)}{comma}{meaning}"


def models_folder() -> Path:
    """Folder of the models that travel with the package."""
    package = Path(__file__).parent.parent
    installed = package / "models"
    return installed if installed.is_dir() else package.parent / "models"


def find_model(name: str | Path) -> Path:
    """The model file of that path, or of that name among the package's own.

    Raises InputError where there is none.
    """
    path = Path(name)
    if path.is_file():
        return path
    own = models_folder() / path.with_suffix(".toml").name
    if path.parent in (Path(), Path("models")) and own.is_file():
        return own
    near = difflib.get_close_matches(
        path.name, [p.name for p in models_folder().glob("*.toml")], n=1, cutoff=0.3
    )
    hint = f"; the package has {near[0]}" if near else ""
    raise InputError(f"{path}: no such model file{hint}; give the path of a .toml machine model")


def load_model(name: str | Path, catalogue: Catalogue) -> MachineModel:
    """Read a machine model. Raises InputError naming the file, the entry and what is allowed."""
    path = find_model(name)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not a TOML file: {error}") from error
    mjcf_name = document.get("mujoco")
    mjcf = _read_beside(path, mjcf_name) if mjcf_name else None
    return parse_model(document, catalogue, mjcf, str(path))


def _read_beside(path: Path, name: str) -> str:
    for folder in (path.parent, models_folder()):
        if (folder / name).is_file():
            return (folder / name).read_text(encoding="utf-8")
    raise InputError(f"{path}: mujoco = '{name}' is not beside it; copy the MJCF file there")


def parse_model(
    document: Mapping[str, Any], catalogue: Catalogue, mjcf: str | None, where: str
) -> MachineModel:
    """A machine model from its TOML document; ``where`` names the file in messages."""
    if not document.get("axes"):
        raise InputError(f"{where}: has no [axes.<name>] table; a machine model has at least one")
    rate = document.get("sample_rate", 10_000.0)
    if not (isinstance(rate, int | float) and math.isfinite(rate) and rate > 0):
        raise InputError(f"{where}: sample_rate = {rate}: must be a positive number of Hz")
    try:
        axes = {name: _axis(entry, catalogue) for name, entry in document["axes"].items()}
        return MachineModel(
            name=document.get("name", Path(where).stem),
            axes=axes,
            sample_rate=float(rate),
            mjcf=mjcf,
            mjcf_name=document.get("mujoco"),
            history=tuple(_history_step(step) for step in document.get("history", ())),
            intervals=read_intervals(document, axes),
        )
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _axis(entry: Mapping[str, Any], catalogue: Catalogue) -> AxisModel:
    known = {f.name for f in fields(Hardware)}
    for key in entry:
        if key not in known | {*MASS_NAMES, "effects", "fixed"}:
            near = difflib.get_close_matches(key, {*known, *MASS_NAMES}, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise InputError(f"unknown entry '{key}' of an axis{hint}")
    units = _units(entry)
    given = {k: entry[k] for k in known & set(entry)}
    for key, value in given.items():
        numbers = value if key == "travel" else [value]
        if not all(isinstance(n, int | float) and not math.isnan(n) for n in numbers):
            raise InputError(f"{key} = {value}: must be a number in {hardware_unit(key, units)}")
    if "travel" in given:
        given["travel"] = tuple(given["travel"])
    return AxisModel(
        mass=_mass(entry, units),
        hardware=Hardware(**given),
        effects=tuple(_fitted(catalogue[n], v, units) for n, v in entry.get("effects", {}).items()),
        mass_fixed=units.mass_name in entry.get("fixed", ()),
        rotary=units.rotary,
    )


MASS_NAMES = {kind.mass_name: kind for kind in (LINEAR, ROTARY)}


def _units(entry: Mapping[str, Any]) -> AxisUnits:
    """Linear for an axis with a mass, rotary for one with an inertia."""
    kinds = [kind for name, kind in MASS_NAMES.items() if name in entry]
    if len(kinds) > 1:
        raise InputError(
            "an axis has both mass and inertia; give mass in kg for a linear axis, or inertia in "
            "kg m^2 for a rotary one"
        )
    if not kinds:
        raise InputError(
            "an axis has no mass; give mass in kg (a rough value will do for a fit), or inertia in "
            "kg m^2 for a rotary axis"
        )
    return kinds[0]


def _mass(entry: Mapping[str, Any], units: AxisUnits) -> float:
    mass = entry[units.mass_name]
    if isinstance(mass, bool) or not isinstance(mass, int | float):
        raise InputError(f"{units.mass_name} = {mass}: must be a number in {units.mass}")
    return float(mass)


def _fitted(effect: Any, entry: Mapping[str, Any], units: AxisUnits) -> Fitted:
    fitted = Fitted.at_start(effect, {k: v for k, v in entry.items() if k != "fixed"}, units)
    if "fixed" not in entry:
        return fitted
    unknown = set(entry["fixed"]) - set(fitted.values)
    if unknown:
        raise InputError(f"effect '{effect.name}': fixed names unknown {', '.join(unknown)}")
    return replace(fitted, fixed=frozenset(entry["fixed"]))


def _history_step(entry: Mapping[str, Any]) -> HistoryStep:
    known = {f.name for f in fields(HistoryStep)}
    values = {k: v for k, v in entry.items() if k in known}
    values["notes"] = tuple(values.get("notes", ()))
    for optional in ("holdout_error_before", "holdout_error_after"):
        values.setdefault(optional, None)
    return HistoryStep(**values)


def format_model(model: MachineModel) -> str:
    """The machine model as TOML text, each value with its unit in a comment."""
    document = tomlkit.document()
    document["name"] = model.name
    if model.mjcf_name:
        document["mujoco"] = model.mjcf_name
    document["sample_rate"] = tomlkit.item(model.sample_rate).comment("Hz")
    axes = tomlkit.table(is_super_table=True)
    for name, axis in model.axes.items():
        axes[name] = _axis_table(axis)
    document["axes"] = axes
    if model.intervals:
        document[ENTRY] = intervals_table(model)
    if model.history:
        steps = tomlkit.aot()
        for step in model.history:
            steps.append(
                tomlkit.item({k: v for k, v in asdict(step).items() if v is not None and v != ()})
            )
        document["history"] = steps
    return tomlkit.dumps(document)


def _axis_table(axis: AxisModel) -> tomlkit.items.Table:
    table = tomlkit.table()
    units, mass = axis.units, axis.mass_parameter
    table[mass.name] = tomlkit.item(axis.mass).comment(f"{units(mass.unit)}, {mass.meaning}")
    if axis.mass_fixed:
        table["fixed"] = [mass.name]
    for key in HARDWARE_UNITS:
        value = getattr(axis.hardware, key)
        if value is not None:
            table[key] = tomlkit.item(list(value) if key == "travel" else value).comment(
                hardware_unit(key, units)
            )
    effects = tomlkit.table(is_super_table=True)
    for fitted in axis.effects:
        entry = tomlkit.table()
        for p in fitted.effect.parameters:
            entry[p.name] = tomlkit.item(float(fitted.values[p.name])).comment(
                f"{units(p.unit)}, {p.meaning}"
            )
        entry["fixed"] = sorted(fitted.fixed)
        effects[fitted.effect.name] = entry
    table["effects"] = effects
    return table


def save_model(model: MachineModel, path: str | Path) -> None:
    """Write the model, and its MJCF beside it where that is not there yet."""
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(f"{path}: its folder does not exist; create {path.parent} first")
    write_atomically(path, format_model(model).encode())
    if model.mjcf and model.mjcf_name:
        beside = path.parent / model.mjcf_name
        if not beside.exists():
            write_atomically(beside, model.mjcf.encode())


def write_atomically(path: Path, content: bytes) -> None:
    """Write to a temporary name, then rename, so that the file is never half written."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
