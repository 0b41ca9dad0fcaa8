"""An ingest that is killed at random moments: what is lost, what is doubled, what can be read."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.timing import ROOT, TWIN, twin
from identify.fleet.floor import STAGE, nights_of, record_night
from identify.fleet.sql import ask
from identify.fleet.store import Store

KILLS, SEED = 100, 7
MACHINES, NIGHTS = 4, 4
BEGUN = 0.3  # of a run, before which it has started no log
FITS = "SELECT count(*), count(DISTINCT (key, axis, parameter)), count(DISTINCT key) FROM fits"


def figures(kills: int = KILLS, seed: int = SEED) -> Iterator[Figure]:
    """Of stores that were killed in the making, against one that was not."""
    with TemporaryDirectory() as name:
        folder, rng = Path(name), np.random.default_rng(seed)
        for night in nights_of(folder / "logs", MACHINES, NIGHTS, seed=2):
            record_night(night)
        begun = time.perf_counter()
        whole = _rows(folder, "clean")
        latest = time.perf_counter() - begun  # of a run that nobody kills
        unreadable = doubled = amid = 0
        for _ in range(kills):
            _killed(folder, rng.uniform(BEGUN * latest, latest))
            store = Store(folder / "store")
            if not store.records.is_dir():
                continue
            found = ask(FITS, store)
            ((rows, once, logs),) = found.rows
            doubled += rows - once
            unreadable += len(found.faults)
            amid += 0 < logs < MACHINES * NIGHTS
            if logs == MACHINES * NIGHTS:  # then there is nothing left to be killed
                shutil.rmtree(store.root)
        lost = whole - _rows(folder, "store")
    note = f"{kills} kills within {latest:.1f} s, {amid} of them with some logs done and some not"
    for what, count in (("lost", lost), ("doubled", doubled), ("unreadable", unreadable)):
        yield Figure(f"killed ingests: {what}", count, "1", Target(0.0, 0.0), note)


def _command(folder: Path, store: str) -> list[str]:
    return ["fleet", "ingest", str(folder / "logs"), "--store", str(folder / store),
            "--model", str(STAGE)]  # fmt: skip


def _killed(folder: Path, seconds: float) -> None:
    command = [sys.executable, "-c", TWIN, *_command(folder, "store")]
    nowhere = subprocess.DEVNULL
    with subprocess.Popen(command, cwd=ROOT, stdout=nowhere, stderr=nowhere) as run:
        time.sleep(seconds)
        run.kill()


def _rows(folder: Path, store: str) -> int:
    """The rows of a store that was made to its end."""
    twin(*_command(folder, store))
    ((rows, *_),) = ask(FITS, Store.opened(folder / store)).rows
    return int(rows)
