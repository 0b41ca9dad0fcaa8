"""A store is read whatever lies in it, each record once, and a question changes nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import refusal, twin
from fleet_cases import ingested, recorded

from identify.fleet.columns import VIEWS
from identify.fleet.sql import ask
from identify.fleet.store import Store
from twin.errors import InputError

pq = pytest.importorskip("pyarrow.parquet")
pa = pytest.importorskip("pyarrow")
pytest.importorskip("duckdb")
COUNT = "SELECT count(*), count(DISTINCT key) FROM fits"


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    ingested(recorded(folder / "logs", machines=2, nights=2), folder / "store")
    return folder / "store"


@pytest.fixture
def store(root, tmp_path) -> Store:
    """One to be spoilt."""
    made = Store.made(tmp_path / "store")
    for path in (root / "records").iterdir():
        (made.records / path.name).write_bytes(path.read_bytes())
    return made


def test_a_file_that_is_no_record_is_told_in_a_line_and_left_out(store) -> None:
    whole = ask(COUNT, store).rows
    first, *_ = sorted(store.records.iterdir())
    name = "0" * 64 + ".parquet"
    (store.records / name).write_bytes(first.read_bytes()[:200])
    pq.write_table(pa.table({"a": [1]}), store.records / ("1" * 64 + ".parquet"))
    (store.records / "..%2Fother.parquet").write_bytes(first.read_bytes())
    found = ask(COUNT, store)
    assert found.rows == whole
    told = dict(zip(("name", "cut", "columns"), sorted(found.faults), strict=True))
    assert "not named as a record" in told["name"]
    assert "cannot be read" in told["cut"]
    assert "other columns" in told["columns"]
    assert not any("\n" in line for line in found.faults)
    assert store.pack(least=1) == 4
    assert ask(COUNT, store).rows == whole


def test_records_that_are_packed_and_unpacked_count_once(store) -> None:
    whole = ask(COUNT, store).rows
    kept = {path.name: path.read_bytes() for path in store.records.iterdir()}
    assert store.pack(least=5) == 0
    assert store.pack(least=4) == 4
    assert ask(COUNT, store).rows == whole
    key = next(iter(kept)).removesuffix(".parquet")
    assert store.has(key)
    for name, content in kept.items():  # as a run leaves them that was killed
        (store.records / name).write_bytes(content)
    assert ask(COUNT, store).rows == whole


def test_the_views_have_the_columns_that_are_documented(root) -> None:
    for view, columns in VIEWS.items():
        found = ask(f"SELECT * FROM {view}", Store.opened(root))
        assert found.columns == tuple(column.name for column in columns)


@pytest.mark.parametrize(
    ("query", "why"),
    [
        ("DROP VIEW fits", "is not one SELECT"),
        ("SELECT 1; SELECT 2", "is not one SELECT"),
        ("COPY fits TO 'stolen.csv'", "is not one SELECT"),
        ("SELECT * FROM read_text('/etc/hostname')", "disabled"),
        ("SELECT nothing FROM fits", "fits has machine, axis"),
    ],
)
def test_a_question_only_reads_the_store(root, query, why) -> None:
    with pytest.raises(InputError, match=why):
        ask(query, Store.opened(root))


def test_the_command_answers_as_text_json_and_table(root, tmp_path) -> None:
    query = "SELECT machine, count(*) AS n FROM fits GROUP BY machine ORDER BY machine"
    done = twin("fleet", "sql", query, "--store", root, folder=tmp_path)
    assert done.stdout.split() == ["machine", "n", "stage-01", "10", "stage-02", "10"]
    done = twin("fleet", "sql", query, "--store", root, "-o", "a.csv", folder=tmp_path)
    assert done.returncode == 0
    assert (tmp_path / "a.csv").read_text().splitlines()[1] == '"stage-01",10'
    assert "no store" in refusal("fleet", "sql", query, "--store", "gone", folder=tmp_path)
    assert ".parquet" in refusal(
        "fleet", "sql", query, "--store", root, "-o", "a.xls", folder=tmp_path
    )
