"""TwinCAT Scope's export as text, known by its header: rows of a key and each channel's value.

Source: Beckhoff Infosys, TE13xx TwinCAT 3 Scope View, "Export to CSV". A column under the key is
that of the times, in ms since the first sample or, as full time stamps, in 100 ns since 1601.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.style import Style
from twin.importers.table import SignalTable, parsing
from twin.importers.text import ENDINGS, Head, Layout, read_table

TIME = "time"
END = "EOF"  # the last line of an export, where it was asked for
_NAME, _SYMBOL, _STEP = "Name", "SymbolName", "SampleTime[ms]"
_STARTS = ("StartRecord", "Starttime of export", "StartTime")


def is_its(path: Path) -> bool:
    """Whether a file has the keys of a Scope's header."""
    keys = {line.partition("\t")[0].partition(";")[0].partition(",")[0].strip()
            for line in Head.of(path).lines}  # fmt: skip
    return {_STEP, _NAME} <= keys


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of an export; raises InputError."""
    with parsing("an export of TwinCAT Scope"):
        return read_table(path, mapping, _layout(Head.of(path), mapping))


def _layout(head: Head, stated: ImportMap) -> Layout:
    style = head.style(stated)
    rows = [style.cells(line) for line in head.lines]
    keys = [row[0] if row else "" for row in rows]
    step = keys.index(_STEP)
    first = next((k for k in range(step, len(rows)) if style.is_number(keys[k])), None)
    if first is None:
        raise InputError("has no numbers below the header of TwinCAT Scope; export it again")
    symbols = _SYMBOL in keys[:first]  # above the steps each channel has its name
    named = keys.index(_SYMBOL) if symbols else max(k for k in range(step) if keys[k] == _NAME)
    names = _names(rows[named], keys[named], len(rows[first]))
    stated_starts = (row[1] for row in rows[:first] if len(row) > 1 and row[0] in _STARTS)
    unix_epoch = 116_444_736_000_000_000  # in 100 ns since 1601
    ticks = (int(cell) - unix_epoch for cell in stated_starts if cell.isdigit())
    start_ns = next((100 * t for t in ticks if t > 0), None)
    return Layout(
        head.encoding, style, names, first, rows[first : first + 40], (), named,
        _rate(rows[step], style), start_ns, end=END,
    )  # fmt: skip


def _names(row: Sequence[str], key: str, width: int) -> tuple[str, ...]:
    """The names of the columns; the time of the first channel is that of all."""
    names = [TIME if cell in (key, "") else cell for cell in row]
    if width < len(names):  # exported without times
        names = [name for name in names if name != TIME]
    if width > len(names) or not names:
        raise InputError(
            f"has {len(names)} names of channels, but rows of {width} cells; export it from "
            "TwinCAT Scope with the whole header and one time column"
        )
    places = [k for k, name in enumerate(names) if name == TIME]
    for number, k in enumerate(places[1:], 2):  # others are called time[2], time[3], ...
        names[k] = f"{TIME}[{number}]"
    return tuple(names[:width])


def _rate(row: Sequence[str], style: Style) -> float | None:
    """The sample rate in Hz; raises InputError where channels have several."""
    steps = sorted({style.value(cell) for cell in row if style.is_number(cell)})
    if len(steps) > 1:
        raise InputError(
            f"has channels with sample times of {', '.join(f'{s:g}' for s in steps)} ms; export "
            "those of one sample time at once"
        )
    return 1e3 / steps[0] if steps and steps[0] > 0.0 else None


DIALECT = Dialect("TwinCAT Scope", ENDINGS, read, is_its)
