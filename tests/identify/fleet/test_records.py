"""Logs become records: each once, with its fault where it has one, the same whoever makes it."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from fleet_cases import MODELS, ingested, recorded, rows

from identify.fleet.found_logs import Pattern, instant, origin_of
from identify.fleet.models import Models
from identify.fleet.record import State, Task, record
from identify.fleet.store import Store
from twin.errors import InputError
from twin.logs import read_log, write_log

pytest.importorskip("pyarrow")
pytest.importorskip("duckdb")


@pytest.fixture(scope="module")
def logs(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("floor") / "logs", machines=2, nights=2)


@pytest.fixture(scope="module")
def first(logs) -> Path:
    return min(logs.rglob("*.mcap"))


def put(log, folder: Path, name: str = "a.mcap", **changed) -> Path:
    """A log of a folder, with metadata that are others."""
    read = read_log(log)
    write_log(replace(read, metadata={**read.metadata, **changed}), folder / name)
    return folder / name


def made(path: Path, store: Path, models: Models = MODELS, **more) -> tuple[State, list[dict]]:
    outcome = record(Task(path.parent, path.name, Store.made(store), models, **more))
    return outcome.state, rows(store)


def test_each_log_is_a_record_with_a_row_a_free_parameter(logs, tmp_path) -> None:
    done = ingested(logs, tmp_path / "store")
    assert (done.logs, done.fitted, done.faulty) == (4, 4, 0)
    fits = [row for row in rows(tmp_path / "store") if row["kind"] == "fit"]
    assert {row["machine"] for row in fits} == {"stage-01", "stage-02"}
    assert {str(row["night"]) for row in fits} == {"2026-01-04", "2026-01-05"}  # before midnight
    mass = next(row for row in fits if row["parameter"] == "mass")
    assert mass["unit"] == "kg"
    assert mass["low"] < mass["value"] < mass["high"]
    assert mass["no_interval"] is None
    assert mass["error"] >= mass["floor"] > 0.0
    assert mass["distance"] > 0.1
    assert mass["duration"] == pytest.approx(3.0)


def test_what_is_known_is_not_made_again_and_the_same_elsewhere(first, tmp_path) -> None:
    task = Task(first.parent, first.name, Store.made(tmp_path / "one"), MODELS)
    assert record(task).state is State.FITTED
    (file,) = task.store.records.glob("*.parquet")
    content, changed = file.read_bytes(), file.stat().st_mtime_ns
    assert record(task).state is State.KNOWN
    assert file.stat().st_mtime_ns == changed
    made(first, tmp_path / "other")
    (again,) = (tmp_path / "other" / "records").glob("*.parquet")
    assert (again.name, again.read_bytes()) == (file.name, content)


def test_a_log_that_is_being_written_is_left_for_later(first, tmp_path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(first.read_bytes()[:-100])
    done = ingested(tmp_path, tmp_path / "store")
    assert (done.unfinished, rows(tmp_path / "store")) == (1, [])
    assert done.told == ("a.mcap: is still being written; it is left for the next time",)
    shutil.copy(first, path)
    assert made(path, tmp_path / "store")[0] is State.FITTED


def test_a_bad_log_is_a_row_with_its_fault_and_stops_nothing(first, tmp_path) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    shutil.copy(first, folder / "good.mcap")
    broken = bytearray(first.read_bytes())
    broken[len(broken) // 2] ^= 0xFF
    (folder / "broken.mcap").write_bytes(broken)
    put(first, folder, "nobody.mcap", machine="")
    put(first, folder, "undated.mcap", started="yesterday")
    done = ingested(folder, tmp_path / "store")
    assert (done.fitted, done.faulty) == (1, 3)
    found = {row["log"]: row["fault"] for row in rows(tmp_path / "store") if row["fault"]}
    assert found == {
        "broken.mcap": "UNREADABLE", "nobody.mcap": "UNNAMED", "undated.mcap": "UNNAMED"
    }  # fmt: skip
    assert all("\n" not in line and ".mcap" in line for line in done.told)


def test_a_log_with_an_error_of_the_check_is_not_fitted(first, tmp_path) -> None:
    read = read_log(first)
    halved = read.changed(lambda name, column: -column if name in ("force", "current") else column)
    write_log(halved, tmp_path / "a.mcap")
    state, found = made(tmp_path / "a.mcap", tmp_path / "store")
    assert state is State.FAULTY
    assert {(row["kind"], row["severity"], row["fault"]) for row in found} >= {
        ("finding", "error", "SIGN")
    }
    assert not any(row["kind"] == "fit" for row in found)


def test_a_path_tells_what_the_log_does_not(first, tmp_path) -> None:
    path = put(first, tmp_path, "m-7_20260314.mcap", machine="", started="")
    pattern = Pattern("{machine}_{started}.mcap")
    state, found = made(path, tmp_path / "store", pattern=pattern)
    assert state is State.FITTED
    assert {(row["machine"], str(row["night"])) for row in found} == {("m-7", "2026-03-13")}
    with pytest.raises(InputError, match=r"\{when\} is not known"):
        Pattern("{when}.mcap")


def test_the_name_of_a_machine_is_never_a_path(first, tmp_path) -> None:
    folder = tmp_path / "models"
    folder.mkdir()
    shutil.copy(MODELS.path, tmp_path / "secret.toml")
    shutil.copy(MODELS.path, folder / "stage-02.toml")
    path = put(first, tmp_path, machine="../secret")
    state, found = made(path, tmp_path / "store", Models.at(folder))
    assert state is State.FAULTY
    assert [row["fault"] for row in found] == ["NO_MODEL"]
    shutil.copy(MODELS.path, folder / "default.toml")
    assert made(path, tmp_path / "store", Models.at(folder))[0] is State.FITTED


def test_a_time_without_a_zone_is_that_of_the_wall(tmp_path) -> None:
    assert instant("2026-03-14T02:30:00+09:00") == instant("2026-03-14T02:30:00")
    assert str(origin_of({"machine": "a", "started": "20260314"}, {}).night) == "2026-03-13"
    with pytest.raises(InputError, match="machine and started"):
        origin_of({}, {})
