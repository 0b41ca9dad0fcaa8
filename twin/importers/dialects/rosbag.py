"""Bags of ROS 1 (.bag) and of ROS 2 in SQLite (.db3), by rosbags; see ``messages.py``."""

from __future__ import annotations

from pathlib import Path

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.messages import Messages
from twin.importers.table import SignalTable, extra, parsing


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a bag; raises InputError."""
    anyreader, typesys = extra("rosbags.highlevel"), extra("rosbags.typesys")
    messages = Messages(mapping.column_names())
    usual = typesys.get_typestore(typesys.Stores.LATEST)  # for bags that bring no definitions
    with parsing("a bag of ROS"):
        try:
            reader = anyreader.AnyReader([path], default_typestore=usual)
            reader.open()
        except anyreader.AnyReaderError as error:
            raise InputError(
                f"is no whole bag ({error}); write its index anew with: rosbag reindex, or for "
                ".db3: ros2 bag reindex"
            ) from error
        try:
            wanted = [c for c in reader.connections if messages.is_wanted(c.id, c.topic)]
            for connection, time, data in reader.messages(connections=wanted):
                if messages.is_wanted(connection.id, connection.topic):
                    message = reader.deserialize(data, connection.msgtype)
                    messages.add(connection.id, connection.topic, message, time)
        finally:
            reader.close()
    return messages.table((), ())


DIALECT = Dialect("bags of ROS 1, and of ROS 2 in SQLite", (".bag", ".db3"), read)
