"""The header of a TwinCAT Scope text export: rows of a key and its value for each channel.

Source: Beckhoff Infosys, TE13xx TwinCAT 3 Scope View, "Export to CSV". A column under the key is
that of the times, in ms since the first sample or, as full time stamps, in 100 ns since 1601.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from twin.errors import InputError

TIME = "time"
END = "EOF"  # the last line of an export, where it was asked for
_NAME, _SYMBOL, _STEP = "Name", "SymbolName", "SampleTime[ms]"
_STARTS = ("StartRecord", "Starttime of export", "StartTime")
_UNIX_EPOCH = 116_444_736_000_000_000  # in 100 ns since 1601


@dataclass(frozen=True)
class ScopeHeader:
    """names: of the columns; first: row of the first numbers; start_ns: since 1970, or None."""

    names: tuple[str, ...]
    first: int
    sample_rate: float | None
    start_ns: int | None


def find_header(
    rows: Sequence[Sequence[str]], is_number: Callable[[str], bool], value: Callable[[str], float]
) -> ScopeHeader | None:
    """The header of an export, None where the rows are none; raises InputError."""
    keys = [row[0] if row else "" for row in rows]
    if _STEP not in keys or _NAME not in keys:
        return None
    step = keys.index(_STEP)
    first = next((k for k in range(step, len(rows)) if is_number(keys[k])), None)
    if first is None:
        raise InputError("has no numbers below the header of TwinCAT Scope; export it again")
    named = keys.index(_SYMBOL) if _SYMBOL in keys[:first] else _last(keys[:step], _NAME)
    names = [TIME if cell in (keys[named], "") else cell for cell in rows[named]]
    width = len(rows[first])
    if width < len(names):  # exported without times
        names = [name for name in names if name != TIME]
    if width > len(names) or not names:
        raise InputError(
            f"has {len(names)} names of channels, but rows of {width} cells; export it from "
            "TwinCAT Scope with the whole header and one time column"
        )
    return ScopeHeader(
        _distinct(names[:width]), first, _rate(rows[step], is_number, value), _start(rows[:first])
    )


def _last(keys: Sequence[str], key: str) -> int:
    return len(keys) - 1 - keys[::-1].index(key)


def _distinct(names: Sequence[str]) -> tuple[str, ...]:
    """The time of the first channel is that of all; others are called time[2], time[3], ..."""
    times, out = 0, []
    for name in names:
        times += name == TIME
        out.append(f"{TIME}[{times}]" if name == TIME and times > 1 else name)
    return tuple(out)


def _rate(
    row: Sequence[str], is_number: Callable[[str], bool], value: Callable[[str], float]
) -> float | None:
    steps = {value(cell) for cell in row if is_number(cell)}
    if len(steps) > 1:
        shown = ", ".join(f"{step:g}" for step in sorted(steps))
        raise InputError(
            f"has channels with sample times of {shown} ms; export those of one sample time at once"
        )
    step = steps.pop() if steps else 0.0
    return 1e3 / step if step > 0.0 else None


def _start(rows: Sequence[Sequence[str]]) -> int | None:
    for row in rows:
        if len(row) > 1 and row[0] in _STARTS and row[1].isdigit() and int(row[1]) > _UNIX_EPOCH:
            return 100 * (int(row[1]) - _UNIX_EPOCH)
    return None
