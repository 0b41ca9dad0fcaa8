"""Ingest a folder: every log that the store has no record of is checked, fitted and kept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from identify.fleet.found_logs import Pattern, logs_below
from identify.fleet.models import Models
from identify.fleet.record import State, Task, record
from identify.fleet.store import FEW, PACK_FROM, Store
from identify.results.fleet import Ingested
from twin.engine import engine, outcomes
from twin.parallel import Progress, silent

MOST_TOLD = 20  # bad logs that are told line by line; all of them are in `findings`


def ingest(
    folder: Path,
    root: Path,
    models: Models,
    *,
    pattern: Pattern | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress = silent,
) -> Ingested:
    """Make the records of all logs below a folder that are not in the store yet.

    root: of the store, which is made where it is not there. scheduler: address of a Dask scheduler,
    whose workers see the same folders; None: workers of this computer, one a core. Raises
    InputError where the folder, the store or the workers fail.
    """
    folder = folder.resolve()
    total = sum(1 for _ in logs_below(folder))
    store = Store.made(root.resolve())
    tasks = _tasks(folder, store, models, pattern)
    states, told, unpacked = Counter[State](), list[str](), 0
    progress("ingesting", 0, total)
    with engine(scheduler, workers) as (executor, count):
        for done, outcome in enumerate(outcomes(executor, count, record, tasks), start=1):
            states[outcome.state] += 1
            unpacked += outcome.state in (State.FITTED, State.FAULTY)
            if outcome.what and len(told) < MOST_TOLD:
                told.append(_line(outcome.name, outcome.what))
            if unpacked >= PACK_FROM:
                store.pack()
                unpacked = 0
            progress("ingesting", done, total)
    store.pack(FEW)
    return Ingested(
        folder, store.root, total, states[State.FITTED], states[State.KNOWN],
        states[State.FAULTY], states[State.UNFINISHED], tuple(told),
    )  # fmt: skip


def _tasks(folder: Path, store: Store, models: Models, pattern: Pattern | None) -> Iterator[Task]:
    return (Task(folder, name, store, models, pattern) for name in logs_below(folder))


def _line(name: str, what: str) -> str:
    """A bad log in a line that begins with its name."""
    return what if name in what else f"{name}: {what}"
