"""TwinCAT CNC: the friction compensation of a compensation value list, and cogging as tables.

frict_comp.table adds a current by the size of the commanded speed, with its sign: at most 20 points
from speed 0 upwards (Beckhoff, TF5200, P-COMP-00041 to 00062).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import degrees

import numpy as np

from twin.export import Exported, Exporter, Remark, filled
from twin.export.formats.csv import csv_text
from twin.export.tables import ENTRIES, AxisTables, HeldAxis, exported, fewest_points, judged_axes
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """For each axis a compensation value list, and a file for each effect that repeats."""
    found, axes = judged_axes(model, logs, _held), {}
    for name, own in found.items():
        points = Remark(name, "friction table", _points(model.axes[name], own.tables))
        axes[name] = replace(own, approximated=(points, *own.approximated))
    return replace(exported(model, found, _files), axes=axes)


def _held(of: AxisTables) -> AxisTables:
    """What TwinCAT has a place for: a speed table that turns with the direction, and cogging."""
    chosen, _ = fewest_points(of.speeds, of.odd, 20)  # P-COMP-00062, as it is delivered
    still, speeds, odd = np.zeros_like(of.along), of.speeds[chosen], of.odd[chosen]
    return replace(of, along=still, speeds=speeds, forwards=odd, backwards=-odd)


def _points(axis: AxisModel, of: AxisTables) -> str:
    return f"{len(of.speeds)} points from 0 to {of.speeds[-1]:.3g} {axis.units.velocity}"


def _files(name: str, axis: AxisModel, found: HeldAxis) -> dict[str, str]:
    units, of = axis.units, found.tables
    constant = axis.hardware.force_constant
    known = constant != 1.0
    current = f"mA, {units.words('force')} over {constant:g} {units('N/A')}"
    force = f"0.001 {units.force}: the model has no force constant"
    speeds = np.degrees(of.speeds) * 1e3 if axis.rotary else of.speeds * 1e6
    needed = 1e3 * of.forwards / constant
    entries = [(round(float(v)), round(f, 3)) for v, f in zip(speeds, needed, strict=True)]
    listed = filled(
        "friction.lis", name=name, axis=axis, found=found, points=_points(axis, of), mass=of.mass,
        unit=current if known else force, entries=entries,
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


EXPORTER = Exporter("friction compensation table of TwinCAT CNC, cogging as tables", export, ".lis")
