"""CSV: tables over position, speed and phase of a pitch, whose sum is the force of an axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.export import Exporter, Held
from twin.export.tables import AxisTables, Periodic, TableFormat
from twin.model.machine import AxisModel
from twin.signals import Array


def write(name: str, axis: AxisModel, of: AxisTables, said: Held) -> dict[str, str]:
    """A file for each table of an axis."""
    units = axis.units
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


def read(files: Mapping[str, str], name: str, axis: AxisModel) -> AxisTables:
    """The tables of the files of an axis."""
    (mass,) = csv_columns(files[f"{name}_{axis.units.mass_name}.csv"]).values()
    positions, along = csv_columns(files[f"{name}_position.csv"]).values()
    speeds, forwards, backwards = csv_columns(files[f"{name}_speed.csv"]).values()
    periodic = []
    for effect in axis.names:
        if text := files.get(f"{name}_{effect}.csv"):
            places, force = csv_columns(text).values()
            periodic.append(Periodic(effect, len(places) * float(places[1]), force))
    return AxisTables(
        float(mass[0]), positions, along, speeds, forwards, backwards, tuple(periodic)
    )


def csv_text(columns: Mapping[str, Array]) -> str:
    """Columns of equal length with their names, which hold no comma."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{v:.9g}" for v in r) for r in rows)]) + "\n"


def csv_columns(text: str) -> dict[str, Array]:
    """The columns (n,) of such a text by name."""
    head, *rows = text.splitlines()
    columns = np.loadtxt(rows, delimiter=",", ndmin=2).T
    return dict(zip(head.split(","), columns, strict=True))


EXPORTER = Exporter(
    "tables over position, speed and phase of a pitch", TableFormat(write, read).exported, ".csv"
)
