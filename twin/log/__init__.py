"""Logs: columns with units, the MCAP codec, importers and checks."""

from twin.log.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log

__all__ = ["FIELDS", "LINEAR_UNITS", "ROTARY_UNITS", "AxisLog", "Log"]
