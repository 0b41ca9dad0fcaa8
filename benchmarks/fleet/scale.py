"""What a store of a thousand machines and a year costs: page, question, memory of the driver."""

from __future__ import annotations

import hashlib
import shutil
import time
from collections.abc import Iterator, Mapping
from datetime import date, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.fleet.nights import drawn
from benchmarks.timing import twin
from identify.fleet.columns import RECORD
from identify.fleet.floor import STAGE, nights_of, record_night
from identify.fleet.store import Store, parquet, schema
from twin.logs import Log, read_log, write_log

MACHINES, NIGHTS, PARAMETERS = 1000, 365, 2
MB, GB = 1e6, 2.0**30
FEW_LOGS, MANY_LOGS = 1000, 10_000
WORKED = (160, 960)  # logs that one worker and two ingest; the difference takes no start


def figures() -> Iterator[Figure]:
    """Each in a folder that goes again."""
    for measured in (_page, _memory, _workers):
        with TemporaryDirectory() as folder:
            yield from measured(Path(folder))


def simulated_store(root: Path, machines: int, nights: int, parameters: int) -> int:
    """A store of records that are drawn, a packed file a night; how many rows it has."""
    import pyarrow as pa

    store, rng = Store.made(root), np.random.default_rng(1)
    panels = [p for p in drawn(machines, nights, rng) if p.parameter != "force_error"]
    names = [f"stage-{i:04d}" for i in range(machines)]
    known = schema(RECORD)
    for night in range(nights):
        day = date(2026, 1, 1) + timedelta(days=night)
        keys = [hashlib.sha256(f"{name} {day}".encode()).hexdigest() for name in names]
        tables = [
            pa.table([_column(f, panel, night, names, keys, day) for f in known], schema=known)
            for panel in panels[:parameters]
        ]
        digest = hashlib.sha256(str(day).encode()).hexdigest()
        (store.packed / f"{digest}.parquet").write_bytes(parquet(pa.concat_tables(tables)))
    return machines * nights * parameters


def _column(field, panel, night, names, keys, day):  # type: ignore[no-untyped-def]
    import pyarrow as pa

    values, spread = panel.values[:, night], 1.645 * panel.deviations[:, night]
    each: Mapping[str, object] = {
        "machine": names, "key": keys, "log_sha256": keys, "log": [f"{n}/{day}" for n in names],
        "value": values, "low": values - spread, "high": values + spread, "spread": spread,
    }  # fmt: skip
    all_alike = {
        "kind": "fit", "axis": "x", "model": "stage", "model_sha256": "0" * 64, "version": "0",
        "parameter": panel.parameter, "unit": panel.unit, "night": day, "force_unit": "N",
        "started": datetime(day.year, day.month, day.day, 2), "distance": 1.0, "duration": 10.0,
        "error": 0.003 * (1.0 + 0.08 * np.sin(night)), "floor": 0.0028,
    }  # fmt: skip
    if field.name in each:
        return pa.array(each[field.name], field.type)
    return pa.array([all_alike.get(field.name)] * len(names), field.type)


def _page(folder: Path) -> Iterator[Figure]:
    rows = simulated_store(folder / "store", MACHINES, NIGHTS, PARAMETERS)
    what = f"{MACHINES} machines, {NIGHTS} nights, {rows} rows"
    page = folder / "page.html"
    first = twin("fleet", "report", "--store", folder / "store", "-o", page)
    yield Figure(f"page of {what}", first.wall, "s", Target(high=30.0), "with its alarms")
    yield Figure("its memory", first.memory / GB, "GiB", Target(high=1.0))
    yield Figure("its size", page.stat().st_size / MB, "MB", Target(high=10.0))
    query = (
        "SELECT parameter, count(*), avg(value), max(high) FROM fits WHERE night >= '2026-06-01' "
        "GROUP BY parameter"
    )
    asked = twin("fleet", "sql", query, "--store", folder / "store")
    yield Figure("a question in SQL to it, the command as a whole", asked.wall, "s",
                 Target(high=1.0))  # fmt: skip
    told = twin("fleet", "sql", "SELECT * FROM alarms", "--store", folder / "store")
    yield Figure("its alarms, once they are told", told.wall, "s")


def _memory(folder: Path) -> Iterator[Figure]:
    """The driver's with logs that are refused at once, so that there are many in a short time."""
    small = Log(100.0, _short(folder).axes)
    (folder / "logs").mkdir()
    write_log(small, folder / "logs" / "0.mcap")
    content, used = (folder / "logs" / "0.mcap").read_bytes(), []
    for count in (FEW_LOGS, MANY_LOGS):
        for i in range(count):
            (folder / "logs" / f"{i}.mcap").write_bytes(content)
        given = ("--store", folder / f"store{count}", "--model", STAGE, "--workers", "1")
        used.append(twin("fleet", "ingest", folder / "logs", *given).memory)
    yield Figure(f"memory of the driver with {MANY_LOGS} logs over that with {FEW_LOGS}",
                 used[1] / used[0], "1", Target(high=1.1), f"{used[1] / MB:.0f} MB")  # fmt: skip


def _short(folder: Path) -> Log:
    night = next(iter(nights_of(folder / "one", 1, 1, seed=1)))
    record_night(night)
    made = read_log(next((folder / "one").rglob("*.mcap")))
    shutil.rmtree(folder / "one")
    return made.part(0, 200)


def _workers(folder: Path) -> Iterator[Figure]:
    for logs in WORKED:
        for night in nights_of(folder / f"logs{logs}", 8, logs // 8, seed=2):
            record_night(night)
    rates: dict[int, float] = {}
    for count in (1, 2, 2, 1):
        few, many = (_ingested(folder, logs, count) for logs in WORKED)
        rates[count] = max(3600.0 * (WORKED[1] - WORKED[0]) / (many - few), rates.get(count, 0.0))
    yield Figure("logs an hour by one worker", rates[1], "1",
                 note="of 3 s, one axis, 1 kHz, once the processes have started")  # fmt: skip
    yield Figure("two workers over one", rates[2] / rates[1], "1", Target(1.85),
                 "the better of two runs each")  # fmt: skip


def _ingested(folder: Path, logs: int, workers: int) -> float:
    """Seconds that a store of so many logs takes."""
    store = folder / "store"
    shutil.rmtree(store, ignore_errors=True)
    begun = time.perf_counter()
    given = ("--store", store, "--model", STAGE, "--workers", str(workers))
    twin("fleet", "ingest", folder / f"logs{logs}", *given)
    return time.perf_counter() - begun
