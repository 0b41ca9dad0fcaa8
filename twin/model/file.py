"""Machine models as TOML files: values with their units in comments, the history, the intervals."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tomlkit

from twin.effect import Effect
from twin.effects import Catalogue, load_catalogue
from twin.entries import read_entries, read_toml
from twin.errors import InputError, Unwritten, at
from twin.files import write_atomically
from twin.model.machine import AxisIntervals, AxisModel, Fitted, Hardware, MachineModel
from twin.model.parameters import all_parameters, read
from twin.model.schema import AxisEntry, EffectTable, ModelFile
from twin.model.units import LINEAR, ROTARY, AxisUnits

if TYPE_CHECKING:
    from twin.mujoco.mechanism import Joint


def models_folder() -> Path:
    """Folder of the models that travel with the package."""
    package = Path(__file__).parent.parent
    installed = package / "models"
    return installed if installed.is_dir() else package.parent / "models"


def find_model(name: str | Path) -> Path:
    """The model file of that path, or of that name among the package's own.

    Raises InputError where there is none.
    """
    found = next(iter(model_files(name)), None)
    if found is not None:
        return found
    path = Path(name)
    near = difflib.get_close_matches(
        path.stem, [p.stem for p in models_folder().glob("*.toml")], n=1
    )
    hint = f"; the package has {near[0]}.toml" if near else ""
    raise InputError(f"{path}: no such model file{hint}; give the path of a .toml machine model")


def model_files(name: str | Path) -> list[Path]:
    """The file of that path and that of that name among the package's own, where they exist."""
    path = Path(name)
    own = models_folder() / path.with_suffix(".toml").name
    known = [path] if path.parent not in (Path(), Path("models")) else [path, own]
    return [file for file in known if file.is_file()]


def load_model(name: str | Path, catalogue: Catalogue | None = None) -> MachineModel:
    """Read a machine model from a TOML file, given by its path or, of the package's, by its name.

    catalogue: the effects that the file may name; those of the package where None. Raises
    InputError, in one line that names file and entry, for a file that is none and for a value that
    is not allowed.
    """
    path = find_model(name)
    catalogue = load_catalogue() if catalogue is None else catalogue
    entries, mjcf = _checked(read_toml(path), str(path)), None
    if beside := entries.mujoco:
        folders = [f for f in (path.parent, models_folder()) if (f / beside).is_file()]
        if not folders:
            raise InputError(
                f"{path}: mujoco = '{beside}' is not beside it; copy the MJCF file there"
            )
        mjcf = read_mjcf(folders[0] / beside)
    return _model(entries, catalogue, mjcf, str(path))


def as_model(given: MachineModel | str | Path, catalogue: Catalogue | None = None) -> MachineModel:
    """The model itself, or that of a file. Raises InputError for anything else."""
    if isinstance(given, MachineModel):
        return given
    if not isinstance(given, str | Path):
        raise InputError(
            f"model: a {type(given).__name__} is no machine model; give a MachineModel, the path "
            "of its file or the name of one of the package, such as 'proton_xy'"
        )
    return load_model(given, catalogue)


def read_mjcf(path: Path) -> str:
    """The text of an MJCF or URDF file; raises InputError where there is none."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not an MJCF file: {error}") from error


def parse_model(
    document: Mapping[str, Any], catalogue: Catalogue, mjcf: str | None, where: str
) -> MachineModel:
    """A machine model from its TOML document; ``where`` names the file in messages."""
    return _model(_checked(document, where), catalogue, mjcf, where)


def _checked(document: Mapping[str, Any], where: str) -> ModelFile:
    if not document.get("axes"):
        raise InputError(f"{where}: has no [axes.<name>] table; a machine model has at least one")
    with at(where):
        return read_entries(ModelFile, document)


def _model(entries: ModelFile, catalogue: Catalogue, mjcf: str | None, where: str) -> MachineModel:
    with at(where):
        bodies = _bodies(entries, mjcf)
        axes = {n: _axis(n, entry, catalogue, bodies) for n, entry in entries.axes.items()}
        return MachineModel(
            name=Path(where).stem if entries.name is None else entries.name,
            axes=axes,
            sample_rate=float(entries.sample_rate),
            mjcf=mjcf,
            mjcf_name=entries.mujoco,
            history=tuple(entry.step() for entry in entries.history),
            intervals=read_intervals(entries.intervals, axes),
        )


def _bodies(entries: ModelFile, mjcf: str | None) -> dict[str, Joint]:
    """Of each axis that is a joint what the bodies of the MuJoCo file are to it."""
    joints = {name: e.joint for name, e in entries.axes.items() if e.joint is not None}
    if not joints:
        return {}
    plain = [name for name in entries.axes if name not in joints]
    if plain:
        raise InputError(
            f"axes.{plain[0]}: has no joint, but {', '.join(joints)} has; give each axis its joint "
            "of the MuJoCo file, or none"
        )
    if mjcf is None or entries.mujoco is None:
        raise InputError('joint: is given without its file; give mujoco = "robot.xml" as well')
    from twin.mujoco.mechanism import joints_of  # MuJoCo takes long to load

    return joints_of(mjcf, entries.mujoco, joints)


def _axis(
    name: str, entry: AxisEntry, catalogue: Catalogue, bodies: Mapping[str, Joint]
) -> AxisModel:
    with at(f"axes.{name}"):
        units = ROTARY if name in bodies and bodies[name].rotary else LINEAR
        if name not in bodies:
            units = _units(entry)
        elif entry.mass is not None or entry.inertia is not None:
            raise InputError(
                f"{units.mass_name} and joint are both given; the bodies of the joint have their "
                f"inertia in the MuJoCo file, so leave {units.mass_name} out"
            )
        unknown = set(entry.fixed or ()) - {units.mass_name}
        if unknown:
            raise InputError(f"fixed = {entry.fixed}: give ['{units.mass_name}'], or leave it out")
        given = {key: getattr(entry, key) for key in Hardware.entries()}
        return AxisModel(
            mass=bodies[name].inertia if name in bodies else float(getattr(entry, units.mass_name)),
            hardware=Hardware(**{key: v for key, v in given.items() if v is not None}),
            effects=tuple(_fitted(catalogue[n], e, units) for n, e in entry.effects.items()),
            mass_fixed=bool(entry.fixed) or name in bodies,
            rotary=units.rotary,
            joint=entry.joint,
            test_function=entry.test_function,
            channel_delay=entry.channel_delay or 0.0,
        )


def _units(entry: AxisEntry) -> AxisUnits:
    """Linear for an axis with a mass, rotary for one with an inertia."""
    kinds = [kind for kind in (LINEAR, ROTARY) if getattr(entry, kind.mass_name) is not None]
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


def _fitted(effect: Effect, entry: EffectTable, units: AxisUnits) -> Fitted:
    fitted = Fitted.at_start(effect, entry.model_extra, units)
    if entry.fixed is None:
        return fitted
    unknown = set(entry.fixed) - set(fitted.values)
    if unknown:
        raise InputError(
            f"effect '{effect.name}': fixed names unknown {', '.join(sorted(unknown))}; it has "
            f"{', '.join(fitted.values)}"
        )
    return replace(fitted, fixed=frozenset(entry.fixed))


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
            told = {k: v for k, v in asdict(step).items() if v is not None and v != ()}
            steps.append(tomlkit.item(told))
        document["history"] = steps
    return tomlkit.dumps(document)


def _axis_table(axis: AxisModel) -> tomlkit.items.Table:
    table = tomlkit.table()
    units, mass = axis.units, axis.mass_parameter
    if axis.joint is not None:
        table["joint"] = axis.joint
    else:
        table[mass.name] = tomlkit.item(axis.mass).comment(f"{units(mass.unit)}, {mass.meaning}")
        if axis.mass_fixed:
            table["fixed"] = [mass.name]
    for key, known in Hardware.entries().items():
        value = getattr(axis.hardware, key)
        if value is not None:
            item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
            table[key] = item.comment(f"{units(known.unit)}{known.note}")
    if axis.test_function is not None:
        length = tomlkit.item(axis.test_function)
        table["test_function"] = length.comment("s, over which a fit averages forces")
    if axis.channel_delay:
        delay = tomlkit.item(axis.channel_delay)
        table["channel_delay"] = delay.comment("s, by which the force is stamped late")
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
    """Write the model as a TOML file, each value with its unit in a comment.

    Its MJCF text is written beside it where there is no such file yet. A file of that path is
    replaced as a whole or not at all. Raises InputError where it cannot be written, where it could
    not be read again, and where the MJCF file beside it is another one.
    """
    path = Path(path)
    for name, axis in model.axes.items():
        with at(f"{path}: axes.{name}"):
            for fitted in axis.effects:
                fitted.require_sound(axis.units)
    text = format_model(model)
    _checked(tomllib.loads(text), str(path))
    if model.mjcf and model.mjcf_name:
        beside = path.parent / model.mjcf_name
        if not beside.exists():
            write_atomically(beside, model.mjcf.encode())
        elif read_mjcf(beside) != model.mjcf:
            raise Unwritten(
                f"{path}: beside it is another {beside.name}, which is kept; remove that, or give "
                "another folder"
            )
    write_atomically(path, text.encode())


ENTRY = "intervals"  # of the TOML document
ABOVE_FLOOR = "above_floor"
COMMENT = "90 % intervals of the fit that wrote this file; for `twin agree`"


def read_intervals(
    given: Mapping[str, Mapping[str, Sequence[float] | float]], axes: Mapping[str, AxisModel]
) -> dict[str, AxisIntervals]:
    """The intervals that a model's file gives; raises InputError for one that is none.

    An interval that does not hold its parameter's value belongs to another fit: the value was
    edited afterwards. It is left out.
    """
    found = {}
    for axis, entries in given.items():
        if axis not in axes:
            raise InputError(f"{ENTRY}: the model has no axis '{axis}'; it has {', '.join(axes)}")
        known = all_parameters(axes[axis])
        values = dict(zip((c.label for c in known), read(axes[axis], known), strict=True))
        ratio, ends = entries.get(ABOVE_FLOOR, 1.0), {}
        if not isinstance(ratio, float):
            raise InputError(
                f"{ENTRY}: {ABOVE_FLOOR} = {ratio}: give one number, error over noise floor"
            )
        for label, pair in entries.items():
            if label == ABOVE_FLOOR:
                continue
            if isinstance(pair, float) or not pair[0] <= pair[1]:
                raise InputError(f"{ENTRY}: {label} = {pair}: give two numbers, the low one first")
            if label not in values:
                raise InputError(f"{ENTRY}: axis {axis} has no parameter '{label}'; remove it")
            if pair[0] <= values[label] <= pair[1]:
                ends[label] = pair[0], pair[1]
        found[axis] = AxisIntervals(ends, ratio)
    return found


def intervals_table(model: MachineModel) -> tomlkit.items.Table:
    """The intervals of a model as TOML, each with its unit in a comment."""
    table = tomlkit.table(is_super_table=True)
    for name, intervals in model.intervals.items():
        axis, entries = model.axes[name], tomlkit.table()
        entries.comment(COMMENT)
        meaning = axis.units.words("1, force error over noise floor")
        entries[ABOVE_FLOOR] = tomlkit.item(intervals.above_floor).comment(meaning)
        own_units = {c.label: axis.units(c.parameter.unit) for c in all_parameters(axis)}
        for label, ends in intervals.ends.items():
            value = tomlkit.item(list(ends)).comment(own_units[label])
            entries.append(tomlkit.key([label]), value)
        table[name] = entries
    return table
