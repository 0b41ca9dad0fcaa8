"""Tasks on processes or on a cluster: few at a time, nothing lost, nothing doubled."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from unittest.mock import patch

import pytest
from cli_runs import process, refusal
from fleet_cases import MODELS, recorded, rows
from machines import CATALOGUE, STAGE

from identify.experiment_design.plan import plan
from identify.fleet.ingest import ingest
from identify.fleet.sql import ask
from identify.fleet.store import Store
from twin.engine import AHEAD, cluster, engine, in_order, needed, outcomes
from twin.errors import InputError

pytest.importorskip("pyarrow")
pytest.importorskip("duckdb")
COUNT = "SELECT count(*), count(DISTINCT key), count(DISTINCT (log, parameter)) FROM fits"


class Counting:
    """An executor that counts what it was handed and has not given back."""

    def __init__(self) -> None:
        self.most, self.now = 0, 0

    def submit(self, job, task) -> Future:
        self.now += 1
        self.most = max(self.most, self.now)
        made: Future = Future()
        made.set_result(job(task))
        made.add_done_callback(lambda _: setattr(self, "now", self.now - 1))
        return made


class Breaking:
    """An executor whose worker has died."""

    def submit(self, job, task) -> Future:
        made: Future = Future()
        made.set_exception(BrokenProcessPool("killed"))
        return made


def test_ten_thousand_tasks_are_handed_over_a_few_at_a_time() -> None:
    taken = 0

    def tasks():
        nonlocal taken
        for i in range(10_000):
            taken += 1
            yield i

    executor, ahead = Counting(), 0
    for done, _ in enumerate(outcomes(executor, 2, int, tasks())):
        ahead = max(ahead, taken - done)
    assert taken == 10_000
    assert ahead <= 2 * 2 * AHEAD


@pytest.mark.parametrize("count", [0, 1, 7, 26])
def test_results_come_in_the_order_of_what_was_given_and_their_number_is_told(count) -> None:
    told: list[tuple[int, int]] = []
    items = [str(i) for i in range(count)]
    results = in_order(Counting(), 2, int, items, lambda done, total: told.append((done, total)))
    assert results == list(range(count))
    assert told[0] == (0, count)
    assert told[-1] == (count, count)
    assert sorted(told) == told


def test_a_lost_worker_is_told_in_a_line() -> None:
    with pytest.raises(InputError, match="a worker was lost"):
        list(outcomes(Breaking(), 1, int, [1]))


def test_what_is_not_installed_is_told_with_how_to_get_it() -> None:
    with (
        patch.object(importlib, "import_module", side_effect=ImportError),
        pytest.raises(InputError, match=r"needs the package duckdb; install it with: pip install"),
    ):
        needed("duckdb")


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_told_in_a_line(tmp_path) -> None:
    pytest.importorskip("distributed")
    with (
        patch("twin.engine.TIMEOUT", 0.5),
        pytest.raises(InputError, match="none answers there"),
        cluster("tcp://127.0.0.1:1"),
    ):
        pass


def test_a_folder_that_is_not_there_is_told_in_a_line(tmp_path) -> None:
    given = ("--store", "store", "--model", MODELS.path)
    assert "gone" in refusal("fleet", "ingest", "gone", *given, folder=tmp_path)


@pytest.fixture(scope="module")
def logs(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("floor") / "logs", machines=4, nights=6)


@pytest.mark.slow
def test_an_experiment_is_planned_the_same_here_on_workers_and_on_a_cluster(dask) -> None:
    rivals = [CATALOGUE[name] for name in ("cogging", "force_constant_ripple")]

    def planned(**on) -> list[tuple]:
        made = plan(STAGE, between=rivals, axis="x", duration=4.0, **on)
        return [(one.experiment, one.gain, one.difference, one.floor) for one in made.ranking]

    here = planned()
    assert len(here) > 10
    with engine(workers=2) as workers:
        assert planned(over=partial(in_order, *workers)) == here
    with engine(dask.address) as workers:
        assert planned(over=partial(in_order, *workers)) == here


def contents(store: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (store / "records").iterdir()}


@pytest.mark.slow
def test_one_worker_and_two_give_the_same_bytes(logs, tmp_path) -> None:
    for count in (1, 2):
        done = ingest(logs, tmp_path / str(count), MODELS, workers=count)
        assert done.fitted == 24
    one, two = (contents(tmp_path / name) for name in "12")
    assert one == two


@pytest.mark.slow
def test_a_killed_ingest_leaves_a_store_that_is_read_and_goes_on(logs, tmp_path) -> None:
    command = [
        "fleet",
        "ingest",
        logs,
        "--store",
        "store",
        "--model",
        MODELS.path,
        "--workers",
        "2",
    ]
    records = tmp_path / "store" / "records"
    for wait in (0.0, 0.2, 0.6):
        known = made(records)
        run = subprocess.Popen(
            [sys.executable, "-c", "from identify.cli import main; main()", *map(str, command)],
            cwd=tmp_path, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        until(lambda known=known: made(records) > known)
        time.sleep(wait)
        run.kill()
        run.wait()
        ask(COUNT, Store.opened(tmp_path / "store"))
    done = process(*command, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    ((rows_, keys, apart),) = ask(COUNT, Store.opened(tmp_path / "store")).rows
    assert (keys, apart) == (24, rows_)
    assert len([r for r in rows(tmp_path / "store") if r["kind"] == "fit"]) == rows_


def made(records: Path) -> int:
    """How many records there are."""
    return len(list(records.glob("*.parquet")))


def until(true, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.02)


class Cluster:
    """A Dask scheduler and workers on this computer, as their commands start them."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.file, self.running = folder, folder / "scheduler.json", []
        self.start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
                   "--scheduler-file", self.file)  # fmt: skip
        until(self.file.exists)
        self.workers = [self.worker(), self.worker()]

    @property
    def address(self) -> str:
        import json

        return json.loads(self.file.read_text())["address"]

    def start(self, kind: str, *arguments: object) -> subprocess.Popen:
        made = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_" + kind, *map(str, arguments)],
            cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        self.running.append(made)
        return made

    def worker(self) -> subprocess.Popen:
        return self.start("worker", "--scheduler-file", self.file, "--nthreads", "1", "--no-nanny",
                          "--no-dashboard", "--local-directory", self.folder)  # fmt: skip

    def end(self) -> None:
        for one in self.running:
            one.kill()
            one.wait()


@pytest.fixture
def dask(tmp_path):
    distributed = pytest.importorskip("distributed")
    made = Cluster(tmp_path)
    try:
        with distributed.Client(made.address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        yield made
    finally:
        made.end()


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_makes_the_same_records(logs, tmp_path, dask) -> None:
    store = Store.made(tmp_path / "store")
    with cluster(dask.address) as (_, count):
        assert count == 2
    killed = []

    def progress(what: str, done: int, total: int) -> None:
        if done == 4 and not killed:
            killed.append(dask.workers[0].send_signal(signal.SIGKILL))

    done = ingest(logs, store.root, MODELS, scheduler=dask.address, progress=progress)
    assert killed
    assert done.fitted + done.known == 24  # known: what the lost worker made and could not tell
    ingest(logs, tmp_path / "local", MODELS, workers=1)
    assert contents(store.root) == contents(tmp_path / "local")


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_told_in_a_line_and_the_store_is_read(
    logs, tmp_path, dask
) -> None:
    store = Store.made(tmp_path / "store")

    def progress(what: str, done: int, total: int) -> None:
        if done == 4:
            dask.running[0].kill()

    with pytest.raises(InputError, match="was lost; what a store holds is kept"):
        ingest(logs, store.root, MODELS, scheduler=dask.address, progress=progress)
    ((_, keys, _),) = ask(COUNT, store).rows
    assert 4 <= keys < 24
