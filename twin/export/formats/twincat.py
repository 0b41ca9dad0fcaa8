"""TwinCAT CNC: the friction compensation of a compensation value list, and cogging as tables.

frict_comp.table adds a current by the size of the commanded speed, with its sign: at most 20 points
from speed 0 upwards (Beckhoff, TF5200, P-COMP-00041 to 00062). It has no place for a mass, which a
comment tells for the acceleration feedforward.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from math import degrees

import numpy as np

from twin.export import Exported, Exporter, Held, Remark, axis_identifiers, filled
from twin.export.formats.csv import csv_columns, csv_text
from twin.export.tables import ENTRIES, AxisTables, Periodic, TableFormat, fewest_points
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel
from twin.signals import Array

MOST = 20  # points of a table, P-COMP-00062, as it is delivered


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """For each axis a compensation value list, and a file for each effect that repeats."""
    made, axes = FORMAT.exported(model, logs), {}
    for axis, name in axis_identifiers(model).items():
        files, own = {file: str(text) for file, text in made.files.items()}, model.axes[axis]
        points = Remark(axis, "friction table", _points(own, read(files, name, own).speeds))
        axes[axis] = replace(made.axes[axis], approximated=(points, *made.axes[axis].approximated))
    return replace(made, axes=axes)


def _points(axis: AxisModel, speeds: Array) -> str:
    return f"{len(speeds)} points from 0 to {speeds[-1]:.3g} {axis.units.velocity}"


def write(name: str, axis: AxisModel, of: AxisTables, said: Held) -> dict[str, str]:
    """A speed table that turns with the direction, and a file for each effect that repeats."""
    units, constant = axis.units, axis.hardware.force_constant
    known = constant != 1.0
    current = f"mA, {units.words('force')} over {constant:g} {units('N/A')}"
    force = f"0.001 {units.force}: the model has no force constant"
    chosen, _ = fewest_points(of.speeds, of.odd, MOST)
    speeds, needed = of.speeds[chosen] * _per_speed(axis), 1e3 * of.odd[chosen] / constant
    entries = [(round(float(v)), round(f, 3)) for v, f in zip(speeds, needed, strict=True)]
    listed = filled(
        "friction.lis", name=name, axis=axis, found=said, points=_points(axis, of.speeds[chosen]),
        mass=of.mass, unit=current if known else force, entries=entries,
    )  # fmt: skip
    files = {f"{name}_friction.lis": listed}
    for p in of.periodic:
        phase = np.arange(ENTRIES) * 360.0 / ENTRIES
        unit = f"force ({units.force})" if not known else "current (A)"
        turn = f"{p.period:.9g} {units.position}"
        table = {f"phase (deg; 360 are {turn} from position 0)": phase, unit: p.force / constant}
        files[f"{name}_{p.name}.csv"] = csv_text(table)
        terms = p.harmonics().items()
        rows = [f"{k},{abs(c) / constant:.9g},{degrees(np.angle(c)):.9g}" for k, c in terms]
        head = f"harmonic of {turn} (1),amplitude of the {unit},phase of the cosine (deg)"
        files[f"{name}_{p.name}_harmonics.csv"] = "\n".join([head, *rows]) + "\n"
    return files


def _per_speed(axis: AxisModel) -> float:
    """The unit of a speed of the list, um/s or 0.001 degrees/s, in those of the model."""
    return degrees(1e3) if axis.rotary else 1e6


def read(files: Mapping[str, str], name: str, axis: AxisModel) -> AxisTables:
    """The tables of the files of an axis; what the controller passes over is zero."""
    pairs = re.findall(
        r"^frict_comp\.table\[\d+\]\.(in|out) +(\S+)", files[f"{name}_friction.lis"], re.M
    )
    speeds, needed = (np.array([float(v) for k, v in pairs if k == what]) for what in ("in", "out"))
    constant = axis.hardware.force_constant
    odd = 1e-3 * constant * needed
    periodic = []
    for effect in axis.names:
        if text := files.get(f"{name}_{effect}.csv"):
            head = text.splitlines()[0]
            _, current = csv_columns(text).values()
            period = float(head.split("360 are ")[1].split()[0])
            periodic.append(Periodic(effect, period, constant * current))
    still = np.zeros(2)
    return AxisTables(
        0.0, np.arange(2.0), still, speeds / _per_speed(axis), odd, -odd, tuple(periodic)
    )


FORMAT = TableFormat(write, read)
EXPORTER = Exporter("friction compensation table of TwinCAT CNC, cogging as tables", export, ".lis")
