"""Logs: columns with units, the MCAP codec, importers and checks."""

from twin.log.by_name import GivenLogs, logs_by_name
from twin.log.decode import read_log
from twin.log.encode import record_log, write_log, write_topics
from twin.log.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log
from twin.log.recover import Recovery, recover_file, recover_log

__all__ = [
    "FIELDS",
    "LINEAR_UNITS",
    "ROTARY_UNITS",
    "AxisLog",
    "GivenLogs",
    "Log",
    "Recovery",
    "logs_by_name",
    "read_log",
    "record_log",
    "recover_file",
    "recover_log",
    "write_log",
    "write_topics",
]
