"""Logs: columns with units, the MCAP codec, recovery of damaged ones."""

from twin.logs.cut import cut_log
from twin.logs.decode import GivenLogs, logs_by_name, read_log, some_logs
from twin.logs.log import FIELDS, LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log
from twin.logs.recover import Recovery, recover_file, recover_log
from twin.logs.writer import record_log, write_log, write_topics

__all__ = [
    "FIELDS",
    "LINEAR_UNITS",
    "ROTARY_UNITS",
    "AxisLog",
    "GivenLogs",
    "Log",
    "Recovery",
    "cut_log",
    "logs_by_name",
    "read_log",
    "record_log",
    "recover_file",
    "recover_log",
    "some_logs",
    "write_log",
    "write_topics",
]
