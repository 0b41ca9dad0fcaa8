"""Columns with rows of their own: of several recorders in one table, each with its own stamps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError, at
from twin.importers.stated_rate import SLOWEST
from twin.importers.table import SignalTable, numbers
from twin.importers.time_base import even_times, require_no_hole, simple_rate
from twin.importers.time_columns import Times, candidates, counts
from twin.logs.log import Array

_FEW = 0.1  # of the rows without a number, that a column may have lost


def bridged(times: Array, columns: Mapping[str, Array]) -> tuple[Array, dict[str, Array]]:
    """Columns (n,) at the times (n,) in s from where all have begun, by lines over their holes.

    Raises InputError where one has nothing for so long that a line is no measurement.
    """
    where = {name: np.flatnonzero(np.isfinite(column)) for name, column in columns.items()}
    for name, rows in where.items():
        with at(f"column '{name}'"):
            if len(rows) < 2:
                raise InputError(f"has {len(rows)} numbers; leave it out of the map")
            require_no_hole(times[rows])
    span = slice(max(r[0] for r in where.values()), min(r[-1] for r in where.values()) + 1)
    across = {
        name: np.interp(times[span], times[where[name]], column[where[name]])
        for name, column in columns.items()
    }
    return times[span], across


@dataclass(frozen=True)
class OnOneTimeBase:
    """A table with all columns on one even clock, and its rate in Hz."""

    table: SignalTable
    rate: float


def on_one_time_base(table: SignalTable) -> OnOneTimeBase | None:
    """A table as if one clock had recorded it; None where no column has rows of its own."""
    read = _numbers(table)
    own = {name: column for name, column in read.items() if (~np.isfinite(column)).mean() > _FEW}
    whole = {name: column for name, column in read.items() if np.isfinite(column).all()}
    if not own or (stamps := _times(table, whole)) is None:
        return None
    seconds = stamps.seconds
    steps = {n: np.diff(seconds[np.isfinite(column)]) for n, column in own.items()}
    rates = {n: 1.0 / np.median(s) for n, s in steps.items() if len(s) and np.median(s) > 0.0}
    kept = {n: own[n] for n, rate in rates.items() if rate > SLOWEST}
    if not kept:
        return None
    try:
        times, columns = bridged(seconds, {**kept, **whole})
    except InputError:
        return None
    rate = simple_rate(max(rates[n] for n in kept))
    grid = even_times(times[0], times[-1], rate)
    even = {name: np.interp(grid, times, column) for name, column in columns.items()}
    name = stamps.name
    even[name] = _as_written(table.columns[name], columns[name], times, grid)
    return OnOneTimeBase(replace(table, columns={**_others(table, even), **even}), rate)


def _numbers(table: SignalTable) -> dict[str, Array]:
    """The columns of as many numbers as there are rows."""
    longest = max((len(c) for c in table.columns.values()), default=0)
    out = {}
    for name, raw in table.columns.items():
        if len(raw) == longest and np.asarray(raw).dtype.kind in "fiubM":
            out[name] = numbers(name, raw)
    return out


def _times(table: SignalTable, columns: Mapping[str, Array]) -> Times | None:
    """The column of the times that all rows have."""
    counters = [name for name, column in columns.items() if counts(name, column)]
    called, _ = candidates(table, columns, counters)
    return next((one for one in called if one.rest is None), None)


def _as_written(raw: NDArray, column: Array, times: Array, grid: Array) -> NDArray:
    """The even times in the unit of the column that they are of, or as its dates."""
    even = np.interp(grid, times, column)
    if raw.dtype.kind != "M":
        return even
    return raw[0] + np.rint(1e9 * even).astype("timedelta64[ns]")


def _others(table: SignalTable, even: Mapping[str, NDArray]) -> dict[str, NDArray]:
    """The columns that are single values."""
    return {n: c for n, c in table.columns.items() if n not in even and len(c) == 1}
