"""Logs of other programs -> Log: one module for each format, and a map that names the columns."""

from twin.log.importers.importer import import_log
from twin.log.importers.mapping import AxisMap, ColumnMap, CsvLayout, ImportMap, load_mapping

__all__ = ["AxisMap", "ColumnMap", "CsvLayout", "ImportMap", "import_log", "load_mapping"]
