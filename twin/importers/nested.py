"""Columns in arrays, lists and tables within tables, as JSON and MATLAB have them.

A column is called by the keys that lead to it. Of a list of tables each is called by a text in it,
such as the label of a signal or the name of a test, or by its number; where it has one array alone
that has the name of the table.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.importers.stamps import is_stamp
from twin.importers.table import split_columns

ROWS = "data"  # what the rows of a bare list are called
# of several tables with the same columns these are recordings, and no axes
_RUN = re.compile(r"(?i)(?:run|test|trial|rec|recording|meas|measurement|messung)[\W_]?\d+\W?$")


def flat(content: Mapping[str, Any]) -> dict[str, NDArray]:
    """The columns in arrays, lists and tables within tables."""
    return _flat("", content, ())


def _flat(prefix: str, content: Mapping[str, Any], outer: Sequence[str]) -> dict[str, NDArray]:
    """The same, called ``prefix`` and a key; outer: the names that a matrix may have."""
    columns: dict[str, NDArray] = {}
    names = next((v for v in map(_texts, content.values()) if v), outer)
    matrices = [k for k, v in content.items() if isinstance(v, list) and _are_all(list, v)]
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            numbered = len(value) > 1 and [*value] == [*map(str, range(len(value)))]
            if numbered and not any(isinstance(v, Mapping | list) for v in value.values()):
                columns |= _flat(prefix, {key: [*value.values()]}, names)  # as pandas writes them
            else:
                columns |= _flat(f"{name}.", value, names)
        elif _are_all(dict, value) and (batches := _batches(value)):
            above = f"{name}." if prefix else ""
            columns |= {f"{above}{k}": column for k, column in batches.items()}
        elif _are_messages(value):
            rows = [dict(_leaves("", row)) for row in value]
            for k in dict.fromkeys(k for row in rows[:1] + rows[-1:] for k in row):
                columns[f"{name}.{k}" if prefix else k] = np.array(
                    [row.get(k, np.nan) for row in rows]
                )
        elif _is_of_rows(value):
            above = f"{name}." if prefix or sum(map(_is_of_rows, content.values())) > 1 else ""
            for k in dict.fromkeys(k for row in value for k in row):
                columns[f"{above}{k}"] = np.array([row.get(k, np.nan) for row in value])
        elif _are_all(dict, value):
            for inner, table in _named_tables(name, value):
                columns |= _flat(inner, table, names)
        elif _are_all(str, value) and is_stamp(value[0]):
            columns[name] = np.array(value)
        elif isinstance(value, list) and not _are_all(str, value):
            above = f"{name}." if len(matrices) > 1 or names is outer else prefix
            columns |= _called(names, above, split_columns(name, _numeric(value)))
        elif isinstance(value, np.ndarray) and value.dtype == object and value.ndim == 1:
            columns |= _flat(prefix, {key: value.tolist()}, names)
        elif isinstance(value, np.ndarray | np.generic | int | float | str):
            columns |= _called(names, prefix, split_columns(name, np.asarray(value)))
    return columns


def _texts(value: Any) -> list[str]:
    """The texts in a list, or a cell array, of as many as may be the names of a matrix' columns."""
    many = 400  # columns, more than any machine has signals
    if isinstance(value, np.ndarray) and value.ndim == 1:
        value = value.tolist()
    named = _are_all(str, value) and len(value) <= many
    return [text.strip() for text in value] if named else []


def _called(names: Sequence[str], above: str, split: dict[str, NDArray]) -> dict[str, NDArray]:
    """The columns of a matrix by their names, where there are as many."""
    if not len(names) == len(split) > 1:
        return split
    return {f"{above}{name}": c for name, c in zip(names, split.values(), strict=True)}


def _are_all(kind: type, value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, kind) for v in value)


def _is_of_rows(value: Any) -> bool:
    """Whether it is a table as a list of rows, each with the names of the columns."""
    return _are_all(dict, value) and not _has_arrays(value[0])


def _are_messages(value: Any) -> bool:
    """Whether it is a list of many alike tables of single values, in tables within them."""
    many = 20  # no recording of so few samples is of use, and no machine has so many signals
    if not _are_all(dict, value) or len(value) < many or _is_of_rows(value):
        return False
    return all(len(list(_leaves("", row))) == len(dict(_leaves("", value[0]))) for row in value[:2])


def _batches(rows: Sequence[Mapping[str, Any]]) -> dict[str, NDArray]:
    """The columns of rows that hold many samples each, one after another; nothing of others.

    What is the same in all, such as the rate, is a single value.
    """
    many, several = 20, 2  # samples of a batch, more than a machine has axes; signals
    sizes = {k: len(v) for k, v in rows[0].items() if isinstance(v, list) and len(v) > many}
    alike = all(row.keys() == rows[0].keys() for row in rows) and len(rows) > 1
    if len(sizes) < several or len({*sizes.values()}) > 1 or not alike:
        return {}
    out = {}
    for key in rows[0]:
        values = [row[key] for row in rows]
        if key in sizes:
            out[key] = _numeric([v for batch in values for v in batch])
        else:
            out[key] = np.array(values[:1] if all(v == values[0] for v in values) else values)
    return out


def _leaves(prefix: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The single values in a table and in those within it, by the keys that lead to them."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(f"{prefix}{key}.", value)
        elif isinstance(value, list):
            for number, entry in enumerate(value, 1):
                if isinstance(entry, Mapping):
                    yield from _leaves(f"{prefix}{key}[{number}].", entry)
                else:
                    yield f"{prefix}{key}[{number}]", entry
        else:
            yield f"{prefix}{key}", value


def _has_arrays(table: Mapping[str, Any]) -> bool:
    """Whether a table has columns of its own."""
    return any(isinstance(v, list | Mapping) or np.size(v) > 1 for v in table.values())


def _named_tables(
    name: str, tables: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """The prefix and the content of each of several tables, less the text that it is called by."""
    texts = [[k for k, v in table.items() if isinstance(v, str) and v.strip()] for table in tables]
    shared = [k for k in texts[0] if all(k in others for others in texts)]
    distinct = [k for k in shared if len({t[k] for t in tables}) == len(tables)]
    for number, table in enumerate(tables, 1):
        own = f"{name}.{table[distinct[0]]}" if distinct else f"{name}[{number}]"
        kept = {k: v for k, v in table.items() if not isinstance(v, str)}
        arrays = [k for k, v in kept.items() if np.size(np.asarray(v, dtype=object)) > 3]
        if len(arrays) == 1 and not isinstance(kept[arrays[0]], Mapping):
            whole = kept[arrays[0]]  # the values of a signal
            above, dot, last = own.rpartition(".")
            yield f"{above}{dot}", {last: whole}
        else:
            yield f"{own}.", kept


def _numeric(value: list[Any]) -> NDArray:
    """Rows as an array; what is no number, or is ragged, stays as it is and is refused later."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.array([str(v) for v in value], dtype=object)


def recordings_of(columns: Mapping[str, NDArray]) -> tuple[str, ...]:
    """What several recordings in one file are called; nothing where it has one alone.

    They are tables with the same columns, of which none is the same in all, as that of the times is
    where the tables are the axes of a machine; beside them are single values alone.
    """
    tables: dict[str, dict[str, NDArray]] = {}
    for name, column in columns.items():
        parted = re.fullmatch(r"(.*?)(\[\d+\]|[./][^./\[\]]+(?: \[[^\]]*\])?)", name)
        if parted is None:
            if len(column) > 1:
                return ()
            continue
        if len(column) > 1:
            tables.setdefault(parted[1], {})[parted[2]] = column
    keys = {tuple(table) for table in tables.values()}
    fewest = 3  # columns of a recording: its times, a position and a force
    if len(tables) < 2 or len(keys) > 1 or len(next(iter(keys))) < fewest:
        return ()
    if all(_RUN.search(name) for name in tables):
        return tuple(tables)
    first, *others = tables.values()
    if not any(c.dtype.kind in "fiuM" and (c[1:] > c[:-1]).all() for c in first.values()):
        return ()  # without times of its own
    if any(all(np.array_equal(c, o[k]) for o in others) for k, c in first.items()):
        return ()
    return tuple(tables)
