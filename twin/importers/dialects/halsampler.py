"""LinuxCNC's halsampler: a sample a line, each number with one blank behind it, and no names.

Source: LinuxCNC, man halsampler(1), sampler(9) and sampler_usr.c. Where its buffer was full a line
says "overrun"; with -t the number of the sample stands first. Columns are called "1", "2", ...
"""

from __future__ import annotations

import re
from pathlib import Path

from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.style import Style
from twin.importers.table import SignalTable, parsing
from twin.importers.text import ENDINGS, Head, Layout, read_table

_NUMBER = r"[-+]?(?:\d+\.?\d*(?:e[-+]?\d+)?|nan|inf)"
_LINE = re.compile(rf"(?:{_NUMBER} )+|(?:\d+ )?overrun", re.IGNORECASE)
_OVERRUN = "overrun"


def is_its(path: Path) -> bool:
    """Whether its first lines are of numbers with a blank behind each."""
    first = Head.of(path).lines[:3]
    return all(_LINE.fullmatch(line) for line in first)


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a recording; raises InputError."""
    with parsing("a recording of halsampler"):
        head = Head.of(path)
        style = Style(None, ".")
        rows = [style.cells(line) for line in head.lines if _OVERRUN not in line][:40]
        names = tuple(str(k + 1) for k in range(len(rows[0])))
        with open(path, encoding=head.encoding) as stream:
            overruns = sum(_OVERRUN in line for line in stream)
        said = f"{overruns} overruns, where samples are lost; halsampler -t numbers them"
        layout = Layout(
            head.encoding, style, names, 0, rows, is_row=lambda line: _OVERRUN not in line,
            said=(said,) * bool(overruns),
        )  # fmt: skip
        return read_table(path, mapping, layout)


DIALECT = Dialect("halsampler of LinuxCNC", ENDINGS, read, is_its)
