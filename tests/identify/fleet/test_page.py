"""The page and the report of a floor: what needs attention first, with dates, sizes and units."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from cli_runs import refusal, twin
from fleet_cases import FIRST_DAY

from identify.fleet.columns import RECORD
from identify.fleet.nights import EPOCH
from identify.fleet.store import Store

pytest.importorskip("pyarrow")
pytest.importorskip("duckdb")


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    """Six machines over sixty nights, of which m3's friction grows by a tenth."""
    store = Store.made(tmp_path_factory.mktemp("fleet") / "store")
    rng = np.random.default_rng(0)
    values = 0.31 * (1.0 + 0.008 * rng.standard_normal((6, 60)))
    values[3, 40:] *= 1.1
    from datetime import datetime, timedelta

    first = EPOCH + timedelta(days=FIRST_DAY)
    for i, nightly in enumerate(values):
        rows = []
        for night, value in enumerate(nightly):
            day = first + timedelta(days=night)
            rows.append({
                "kind": "fit", "machine": f"m<{i}>", "axis": "x", "model": "stage", "night": day,
                "model_sha256": "a", "version": "1", "key": f"{i} {night}", "unit": "N",
                "started": datetime(day.year, day.month, day.day, 2), "log": f"{i}/{night}.mcap",
                "parameter": "lugre.Fc", "value": value, "spread": 1e-4, "low": value - 1e-4,
                "high": value + 1e-4, "error": 0.003, "floor": 0.0028, "force_unit": "N",
                "distance": 2.0, "duration": 10.0,
            })  # fmt: skip
        store.write(f"{i:064x}", rows)
    bad = {"kind": "finding", "machine": "m<5>", "severity": "error", "fault": "UNREADABLE"}
    store.write("f" * 64, [{**bad, "key": "bad", "log": "5/x.mcap", "what": "x.mcap: truncated"}])
    return store.root


def test_a_row_of_a_record_has_no_other_columns() -> None:
    assert len({column.name for column in RECORD}) == len(RECORD)


def test_the_report_ranks_machines_and_tells_alarms(root, tmp_path) -> None:
    done = twin("fleet", "report", "--store", root, "--json", folder=tmp_path)
    assert done.returncode == 1  # a machine changed
    found = json.loads(done.stdout)
    assert [m["machine"] for m in found["machines"][:2]] == ["m<3>", "m<5>"]
    assert found["machines"][1]["faulty"] == 1
    (alarm,) = found["alarms"]
    assert (alarm["parameter"], alarm["unit"], alarm["changed"]) == ("lugre.Fc", "N", "2026-02-10")
    assert alarm["size"] == pytest.approx(0.031, rel=0.2)
    text = twin("fleet", "report", "--store", root, folder=tmp_path).stdout
    assert "m<3>: lugre.Fc of axis x rose on 2026-02-10" in text
    assert re.search(r"\d+\.\d ± \d\.\d mN \(\+\d+ %\), from 310 mN to", text)


def test_the_page_is_one_file_of_the_reports_own_blocks(root, tmp_path) -> None:
    page = tmp_path / "fleet.html"
    twin("fleet", "report", "--store", root, "-o", page, folder=tmp_path)
    text = page.read_text(encoding="utf-8")
    assert "1 of 6 machines changed" in text
    assert "m&lt;3&gt;" in text
    assert "m<3>" not in text
    assert not re.search(r"(src|href)=.?https?:", text)
    assert "&#34;dates&#34;: true" in text
    assert len(text) < 1_000_000


def test_what_is_asked_wrongly_is_told_in_a_line(root, tmp_path) -> None:
    said = refusal("fleet", "report", "--store", root, "--logs", "logs", folder=tmp_path)
    assert "--logs and --model" in said
    said = refusal("fleet", "report", "--store", root, "-o", "a.txt", folder=tmp_path)
    assert ".html" in said
    kind = ("fleet", "kind", "proton_xy", "--store", root)
    assert "fewer than 5 machines" in refusal(*kind, folder=tmp_path)


def test_alarms_are_kept_until_the_records_are_others(root, tmp_path) -> None:
    query = ("fleet", "sql", "SELECT machine, scope, trend FROM alarms", "--store", root, "--json")
    first = json.loads(twin(*query, folder=tmp_path).stdout)
    assert first["rows"] == [["m<3>", "machine", None]]
    kept = (root / "alarms.parquet").stat().st_mtime_ns
    assert json.loads(twin(*query, folder=tmp_path).stdout) == first
    assert (root / "alarms.parquet").stat().st_mtime_ns == kept
    (root / "alarms.parquet").write_bytes(b"cut")
    assert json.loads(twin(*query, folder=tmp_path).stdout) == first


@pytest.mark.slow
def test_the_demonstration_finds_what_it_planted(tmp_path) -> None:
    done = twin(
        "fleet", "demo", "-o", "demo", "--machines", "6", "--nights", "52", "--json",
        folder=tmp_path,
    )  # fmt: skip
    found = json.loads(done.stdout)
    assert done.returncode == 0, done.stderr
    assert found["false_alarms"] == 0
    (planted,), (alarm,) = found["planted"], found["alarms"]
    assert (alarm["machine"], alarm["what"]) == (planted["machine"], planted["what"])
    assert alarm["size"] > 0.0
    assert alarm["unit"] == "N"
    assert (tmp_path / "demo" / "fleet.html").stat().st_size > 50_000
