"""A few machines over a few nights, ingested in this process."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import numpy as np

from identify.fleet.floor import STAGE, nights_of, record_night
from identify.fleet.ingest import ingest
from identify.fleet.models import Models
from identify.fleet.nights import Panel
from identify.fleet.store import Store
from identify.results.fleet import Ingested

MODELS = Models.at(STAGE)
FIRST_DAY = 20_454.0  # 2026-01-01


@contextmanager
def here(*_: object, **__: object) -> Iterator[tuple[Executor, int]]:
    """The engine within this process."""
    with ThreadPoolExecutor(1) as pool:
        yield pool, 1


def ingested(folder: Path, store: Path, **more: object) -> Ingested:
    """Ingest a folder without another process."""
    with patch("identify.fleet.ingest.engine", here):
        return ingest(folder, store, MODELS, **more)


def recorded(folder: Path, machines: int, nights: int) -> Path:
    """The logs of machines that are well."""
    for night in nights_of(folder, machines, nights, seed=3):
        record_night(night)
    return folder


def panel(values: np.ndarray, parameter: str = "lugre.Fc", **more: np.ndarray) -> Panel:
    """A panel of machines (m, n) of one kind."""
    shape = values.shape
    given = {"deviations": np.full(shape, 1e-4), "temperatures": np.full(shape, np.nan), **more}
    return Panel(
        "stage", "x", parameter, "N", tuple(f"m{i}" for i in range(shape[0])),
        FIRST_DAY + np.arange(shape[1]), values, distances=np.ones(shape), **given,
    )  # fmt: skip


def rows(store: Path) -> list[dict]:
    """All rows of a store."""
    from pyarrow import parquet

    paths = Store.opened(store).contents().paths
    return [row for path in paths for row in parquet.read_table(path).to_pylist()]
