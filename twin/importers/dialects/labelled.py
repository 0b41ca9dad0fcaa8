"""Lines of labelled values, as microcontrollers print them: `t:120,pos:3.25,target:3.30,pwm:81`.

The form that the serial plotter of the Arduino IDE reads
(https://docs.arduino.cc/software/ide-v2/tutorials/ide-v2-serial-plotter), with ":" or "=" behind
a label, and a unit behind a value where it has one.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.table import MOST_NAMED, SignalTable, chosen, parsing
from twin.importers.text import ENDINGS, Head

_LABELLED = re.compile(
    r"([^\W\d][\w .]*?)\s*[:=]\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?: ?([A-Za-zµ°%/]+))?"
    r"(?=\s*(?:[,;\t|]|$)|\s+[^\W\d][\w.]*\s*[:=])"
)
_LOOKED = 20  # lines by which such a file is known


def is_its(path: Path) -> bool:
    """Whether most lines of the beginning hold two and more labelled values, and nothing else."""
    try:
        lines = Head.of(path).lines[:_LOOKED]
    except InputError:
        return False
    return 2 * sum(len(_pairs(line)) > 1 for line in lines) > len(lines)


def _pairs(line: str) -> list[tuple[str, str]]:
    """Names, with their units, and values of a line; nothing where something else is in it."""
    found = _LABELLED.findall(line)
    rest = re.sub(r"[,;|\s]", "", _LABELLED.sub("", line))
    return [] if rest else [(f"{n.strip()} [{u}]" if u else n.strip(), v) for n, v, u in found]


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns by label; text above and below is left out, and told; raises InputError."""
    encoding = Head.of(path).encoding
    with parsing("labelled values"), open(path, encoding=encoding, errors="replace") as stream:
        lines = [_pairs(line) for line in stream]
    told = [tuple(name for name, _ in pairs) for pairs in lines]
    names = Counter(own for own in told if own).most_common(1)[0][0]
    rows = [k for k, own in enumerate(told) if own == names]
    inside = [k + 1 for k in range(rows[0], rows[-1]) if told[k] != names]
    if inside:
        shown = ", ".join(f"line {k}" for k in itertools.islice(inside, MOST_NAMED))
        more = f" and {len(inside) - MOST_NAMED} more" if len(inside) > MOST_NAMED else ""
        raise InputError(
            f"{shown}{more}: without a number behind each of {', '.join(names)}; complete or cut "
            "out such lines"
        )
    values = np.array([[float(v) for _, v in lines[k]] for k in rows])
    columns = dict(zip(names, np.ascontiguousarray(values.T), strict=True))
    outside = [k + 1 for k in range(len(lines)) if told[k] != names]
    said = tuple(f"line {k} is text and left out" for k in itertools.islice(outside, MOST_NAMED))
    wanted = chosen(mapping.column_names(), columns)
    return SignalTable({n: columns[n] for n in wanted}, first_line=rows[0] + 1, said=said)


DIALECT = Dialect("lines of labelled values, as of a serial plotter", ENDINGS, read, is_its)
