"""C99: one function for each axis that turns its setpoint into the force of the drive."""

from collections.abc import Mapping

from twin.export import Exported, Exporter
from twin.export.c_source import c_source
from twin.logs import Log
from twin.model.machine import MachineModel


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """A header and a source file."""
    made = c_source(model)
    files: dict[str, str | bytes] = {f"{made.name}.h": made.header, f"{made.name}.c": made.source}
    return Exported(files, made.kept, made.approximated, made.lost)


EXPORTER = Exporter(
    "C99 feedforward from the setpoint: force or current of each axis", export, ".c"
)
