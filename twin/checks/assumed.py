"""What the map of an import assumed: said of the log until somebody has confirmed it.

A proposed map has the word ASSUMED in the comment of a line that the file does not prove. Whoever
knows it to be right takes the word away.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from twin.checks.report import Fault, Finding, Severity

WORD = "ASSUMED"
MAP = "import_map"  # entry of a log's metadata: the map as it was written
_TABLE = re.compile(r"\[axes\.\"?(\w+)\"?\]")
_ENTRY = re.compile(r"(\w+)\s*=\s*([^#]*)#(.*)")
_UNIT = re.compile(r"unit\s*=\s*\"([^\"]*)\"")


def assumptions(map_text: str, axis: str) -> list[str]:
    """What the lines of a map assume of an axis, or of all axes: "position in mm"."""
    found, table = [], None
    for line in map_text.splitlines():
        if header := _TABLE.match(line.strip()):
            table = header[1]
        entry = _ENTRY.match(line.strip())
        if entry is None or WORD not in entry[3] or table not in (None, axis):
            continue
        unit = _UNIT.search(entry[2])
        found.append(f"{entry[1]} in {unit[1]}" if unit else f"{entry[1]} = {entry[2].strip()}")
    return found


def check_assumed(axis: str, metadata: Mapping[str, str]) -> Iterator[Finding]:
    """A warning where the map that an axis was imported with assumes something."""
    if found := assumptions(metadata.get(MAP, ""), axis):
        yield Finding(
            Severity.WARNING, Fault.ASSUMED, axis,
            f"the import map assumes {', '.join(found)}", "whole log",
            f"if that is right, take the word {WORD} out of these lines of the map and import "
            "again; if not, correct them",
        )  # fmt: skip
