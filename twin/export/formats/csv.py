"""CSV: tables over position, speed and phase of a pitch, whose sum is the force of an axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.export import Exported, Exporter
from twin.export.tables import HeldAxis, exported, judged_axes
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel
from twin.signals import Array


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """A file for each table of each axis."""
    return exported(model, judged_axes(model, logs, lambda tables: tables), _files)


def _files(name: str, axis: AxisModel, found: HeldAxis) -> dict[str, str]:
    units, of = axis.units, found.tables
    force, position = f"{units.words('force')} ({units.force})", f"({units.position})"
    place = f"{units.words('position')} {position}"
    mass = f"{units.mass_name} ({units.mass})"
    speed = {f"speed ({units.velocity})": of.speeds, f"{force} forwards": of.forwards}
    speed[f"{force} backwards"] = of.backwards
    files = {
        f"{name}_{units.mass_name}.csv": csv_text({mass: np.array([of.mass])}),
        f"{name}_position.csv": csv_text({place: of.positions, force: of.along}),
        f"{name}_speed.csv": csv_text(speed),
    }
    for p in of.periodic:
        at = p.period * np.arange(len(p.force)) / len(p.force)
        files[f"{name}_{p.name}.csv"] = csv_text({place: at, force: p.force})
        terms = p.harmonics()
        files[f"{name}_{p.name}_harmonics.csv"] = csv_text(
            {
                "harmonic (1)": np.array([*terms]),
                f"period {position}": np.array([p.period / k if k else np.inf for k in terms]),
                f"sine ({units.force})": np.array([-c.imag for c in terms.values()]),
                f"cosine ({units.force})": np.array([c.real for c in terms.values()]),
            }
        )
    return files


def csv_text(columns: Mapping[str, Array]) -> str:
    """Columns of equal length with their names, which hold no comma."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{v:.9g}" for v in r) for r in rows)]) + "\n"


EXPORTER = Exporter("tables over position, speed and phase of a pitch", export, ".csv")
