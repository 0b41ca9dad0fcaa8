"""Logs of other programs -> Log: one module for each format, and a map that names the columns."""

from twin.importers.importer import import_log, import_notes
from twin.importers.mapping import AxisMap, ColumnMap, ImportMap, load_mapping

__all__ = ["AxisMap", "ColumnMap", "ImportMap", "import_log", "import_notes", "load_mapping"]
