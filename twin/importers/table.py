"""The table that every format is read into, the errors that all share, and a log as a table."""

from __future__ import annotations

import importlib
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from operator import eq
from pathlib import Path
from types import ModuleType
from typing import BinaryIO

import numpy as np
import scipy.io
from numpy.typing import NDArray

from twin.errors import InputError, near
from twin.files import atomic_writer
from twin.importers.proposal.names import unit_of
from twin.installed import pip_install
from twin.logs import Log
from twin.logs.container import LARGEST_RATIO
from twin.logs.log import Array
from twin.numbers import first_not_finite

_REAL = int | float | np.integer | np.floating
MOST_NAMED = 100  # cells in one answer; more than anybody corrects by hand
SMALLEST_TABLE = 1 << 27  # bytes, whatever the size of the file


@dataclass(frozen=True)
class SignalTable:
    """Columns as in the file; sample_rate (Hz), start_ns (since 1970): where it states them.

    first_line: that of the first row, in a file of text. said: what was left out of it or lost, a
    sentence each. notes: what its writer says of it as text, such as the lines above the names.
    """

    columns: Mapping[str, NDArray]
    sample_rate: float | None = None
    start_ns: int | None = None
    first_line: int | None = None
    said: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def calendar_times(self) -> Mapping[str, NDArray]:
        """Its columns that are times of a calendar."""
        return {name: c for name, c in self.columns.items() if np.asarray(c).dtype.kind == "M"}

    def part(self, first: int, last: int) -> SignalTable:
        """The same of its rows from one to another, which count from 1; scalars stay.

        Raises InputError where it has not as many.
        """
        count = max((len(c) for c in self.columns.values()), default=0)
        if not first < last <= count:
            raise InputError(
                f"there are {count} rows; correct the first and the last to take, in the map"
            )
        columns = {
            name: c[first - 1 : last] if len(c) > 1 else c for name, c in self.columns.items()
        }
        line = None if self.first_line is None else self.first_line + first - 1
        return replace(self, columns=columns, first_line=line)

    def hole(self, name: str, values: Array) -> str | None:
        """Where a column (n,) is not a finite number, and the remedy; None where it always is."""
        if (k := first_not_finite(values)) is None:
            return None
        if (message := self._message(name, k)) is not None:
            return (
                f"{message} has no {name.rpartition('.')[2]} ('{name}'), as "
                f"{np.count_nonzero(~np.isfinite(values))} of {len(values)} in all; give resample "
                "(Hz), which bridges it, or leave the signal out of the map"
            )
        line = "" if self.first_line is None else f" (line {self.first_line + k})"
        return (
            f"column '{name}' is {values[k]} in row {k + 1} of {len(values)}{line}, "
            f"{self._others(values)}; complete or cut out such rows, or leave the signal out of "
            "the map"
        )

    def _others(self, values: Array) -> str:
        """How many values (n,) are none, and the lines, or rows, of those behind the first."""
        bad = np.flatnonzero(~np.isfinite(values))
        if 2 * len(bad) > len(values) / 5:  # no slip, but rows of another column
            return f"{len(bad)} in all"
        behind = bad[1 : MOST_NAMED + 1] + (1 if self.first_line is None else self.first_line)
        if not len(behind):
            return "1 in all"
        what = f"{'row' if self.first_line is None else 'line'}{'s' if len(behind) > 1 else ''}"
        more = " and more" if len(bad) > MOST_NAMED + 1 else ""
        return f"{len(bad)} in all, also in {what} {', '.join(map(str, behind))}{more}"

    def _message(self, name: str, row: int) -> str | None:
        """Which message of a bag a row is; None where the table is of none."""
        for clock, times in self.calendar_times.items():
            prefix, _, field = clock.rpartition(".")
            if field == "log_time" and name.startswith(f"{prefix}.") and row < len(times):
                since = times[row] - times[0]
                return f"message {row + 1} ({since / np.timedelta64(1, 's'):.9g} s)"
        return None


def require_columns(wanted: Iterable[str], there: Collection[str]) -> None:
    """Raises InputError that lists the columns there are where a wanted one is missing."""
    most_names = 40  # columns listed in a message
    names = list(there)
    for name in wanted:
        if names.count(name) > 1:
            raise InputError(f"{names.count(name)} columns are called '{name}'; rename them")
        if name not in names:
            more = len(names) - most_names
            tail = f" and {more} more" if more > 0 else ""
            raise InputError(
                f"there is no column '{name}'; {near(name, names, cutoff=0.5)}columns: "
                f"{', '.join(names[:most_names]) or 'none'}{tail}"
            )


def chosen(wanted: Iterable[str], there: Collection[str]) -> tuple[str, ...]:
    """The wanted columns, all where none is named; raises InputError where one is missing."""
    names = tuple(wanted)
    require_columns(names, there)
    return names or tuple(there)


def with_unit(name: str, unit: str, asked: Collection[str]) -> str:
    """A column's name with the unit that its file states beside it, unless it is asked for without.

    unit: "" where none is stated.
    """
    plain = not unit or name in asked or bool(unit_of(name, bracketed=True))
    return name if plain else f"{name} [{unit}]"


def split_columns(name: str, values: NDArray) -> dict[str, NDArray]:
    """A vector as it is; a matrix as ``name[1]``, ``name[2]``, ... along its shorter side.

    A single value is a column of one row. Nothing where ``values`` has more than two sides.
    """
    array = np.atleast_1d(np.squeeze(values))
    if array.ndim == 1:
        return {name: array}
    if array.ndim != 2:
        return {}
    across = array if array.shape[0] < array.shape[1] else array.T
    return {f"{name}[{k}]": row for k, row in enumerate(across, 1)}


def numbers(name: str, raw: NDArray) -> Array:
    """Column as (n,) floats, dates as seconds since the first; raises InputError for text."""
    array = np.asarray(raw)
    if array.dtype.kind in "Mm":
        return np.asarray((array - array[:1]) / np.timedelta64(1, "s"), dtype=np.float64)
    if array.ndim != 1 or array.dtype.kind not in "fiub":
        row = next((k for k, v in enumerate(array.flat, 1) if not isinstance(v, _REAL)), None)
        place = f": {array.flat[row - 1]!r} in row {row}" if row else ""
        raise InputError(f"column '{name}' does not hold one real number a row{place}")
    return array.astype(np.float64)


def as_numbers(raw: NDArray) -> NDArray:
    """Cells (n,) that are numbers as text, decimals or none (NaN) as numbers, or as they are."""
    array = np.asarray(raw)
    if array.dtype.kind not in "OUS" or array.ndim != 1 or len(array) < 2:
        return array
    try:
        return np.array([np.nan if c in (None, "") else float(c) for c in array.tolist()])
    except (TypeError, ValueError):
        return array


def notes_of(entries: Mapping[str, object]) -> list[str]:
    """Attributes of a file as text, each with the unit that another one states for it."""
    return [
        f"{key}: {value} {entries.get(f'{key}_unit', '')}".rstrip()
        for key, value in entries.items()
        if np.size(np.asarray(value, dtype=object)) == 1
    ]


def key_in_turns(name: str, cells: Sequence[str]) -> str | None:
    """That a column of words tells rows of several axes or signals apart, where it does.

    Its words come again and again in one order, and are not the two of a heartbeat.
    """
    turns, flags = 3, {"true", "false", "on", "off", "yes", "no"}  # of how many turns at least
    words = [*dict.fromkeys(cells)]
    count = len(words)
    again = 1 < count <= len(cells) // turns and all(map(eq, cells[count:], cells))
    heartbeat = {str(word).lower() for word in words} <= flags
    return mixed_rows(name, [*map(str, words)]) if again and not heartbeat else None


def mixed_rows(name: str, values: Sequence[str]) -> str:
    """That rows are of several axes or signals, which a column of that name tells apart."""
    return (
        f"column '{name}' tells of what a row is, {' or '.join(values)}: a row must be one sample "
        "of all; give each its own columns (pandas: pivot), or split the file by it"
    )


def extra(module: str) -> ModuleType:
    """Import a package that only some formats need; raises InputError that says how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"needs the package {module.partition('.')[0]}; "
            f"install it with: {pip_install('import')}"
        ) from error


def require_fits(size: float, path: Path) -> None:
    """Raise InputError where columns of ``size`` bytes are more than a file may expand to.

    Recordings shrink to a tenth or so; a file of kB that announces GB has none.
    """
    most = SMALLEST_TABLE + LARGEST_RATIO * path.stat().st_size
    if size > most:
        raise InputError(
            f"announces columns of {size:.3g} bytes, a file of this size has at most {most:.3g}; "
            "export it again"
        )


@contextmanager
def parsing(what: str) -> Iterator[None]:
    """Make whatever a parser raises on a damaged file an InputError."""
    try:
        yield
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:
        raise InputError(
            f"cannot be read as {what} ({error}); state the format in the map, or export it again"
        ) from error


# --- a log as other tools read it -----------------------------------------------------------------


def write_table(log: Log, path: Path) -> None:
    """Write ``log.table()``; MAT files have names such as x_position, and their units beside them.

    Raises InputError for another ending than .csv, .mat or .parquet, or what cannot be written.
    """
    known = {".csv": _csv, ".mat": _mat, ".parquet": _parquet}
    if path.suffix.lower() not in known:
        raise InputError(f"{path}: a table is a {', '.join(known)} file; give such a name")
    with atomic_writer(path) as stream:
        known[path.suffix.lower()](stream, log.table())


def _csv(stream: BinaryIO, columns: dict[str, Array]) -> None:
    stream.write((",".join(columns) + "\n").encode())
    np.savetxt(stream, np.column_stack([*columns.values()]), fmt="%.12g", delimiter=",")


def _mat(stream: BinaryIO, columns: dict[str, Array]) -> None:
    split = {name: name.removesuffix("]").rpartition(" [") for name in columns}
    names = {name: re.sub(r"\W", "_", signal) for name, (signal, _, _) in split.items()}
    units = {names[name]: unit for name, (_, _, unit) in split.items()}
    content = {names[name]: column for name, column in columns.items()}
    whole = BytesIO()  # as sizes are filled in later, which a stream to be appended to cannot do
    scipy.io.savemat(whole, {**content, "units": units}, oned_as="column")
    stream.write(whole.getbuffer())


def _parquet(stream: BinaryIO, columns: dict[str, Array]) -> None:
    table = extra("pyarrow").table(columns)
    extra("pyarrow.parquet").write_table(table, stream)
