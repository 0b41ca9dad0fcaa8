"""The alarms of a store, kept beside its records until these are others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from typing import Any

from identify.fleet.columns import ALARM
from identify.fleet.nights import Panel, panels
from identify.fleet.store import Contents, Store, parquet, table
from identify.results.fleet import Alarm, Scope
from twin.engine import needed
from twin.errors import Unwritten
from twin.files import write_atomically

RULES = b"1"  # grows when alarms are told by other rules
MADE_OF = b"made_of"


def alarms(
    store: Store, contents: Contents, every: Iterable[Panel] | None = None
) -> tuple[Alarm, ...]:
    """The alarms of a store: those that are kept, or new ones where its records are others.

    every: its panels, where they are there.
    """
    kept = _kept(store, contents)
    if kept is not None:
        return tuple(_read(row) for row in kept.to_pylist())
    from identify.fleet.alarms import alarms_of  # numba takes longer to load than a question

    told = alarms_of(panels(contents) if every is None else every)
    keep(store, contents, told)
    return told


def keep(store: Store, contents: Contents, told: Sequence[Alarm]) -> None:
    """Keep alarms for the next question; a store that may only be read does without."""
    made = as_table(told).replace_schema_metadata({MADE_OF: _made_of(contents)})
    with suppress(Unwritten):
        write_atomically(store.alarms, parquet(made))


def as_table(told: Sequence[Alarm]) -> Any:
    """Alarms as an Arrow table."""
    return table([_row(alarm) for alarm in told], ALARM)


def _kept(store: Store, contents: Contents) -> Any:
    """The table of alarms, or None where it is of other records or cannot be read."""
    pq, pa = needed("pyarrow.parquet"), needed("pyarrow")
    try:
        found = pq.read_table(store.alarms)
    except (OSError, pa.ArrowException):
        return None
    made = (found.schema.metadata or {}).get(MADE_OF)
    known = [c.name for c in ALARM] == found.column_names
    return found if known and made == _made_of(contents) else None


def _made_of(contents: Contents) -> bytes:
    return RULES + contents.digest.encode()


def _row(alarm: Alarm) -> Mapping[str, Any]:
    own = {f.name: getattr(alarm, f.name) for f in fields(alarm)}
    return {**own, "scope": alarm.scope.value, "others": ", ".join(alarm.others) or None}


def _read(row: Mapping[str, Any]) -> Alarm:
    others = tuple(row["others"].split(", ")) if row["others"] else ()
    values: dict[str, Any] = {**row, "scope": Scope(row["scope"]), "others": others}
    return Alarm(**values)
