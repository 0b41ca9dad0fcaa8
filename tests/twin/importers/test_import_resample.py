"""Uneven time stamps onto one clock, JSON, and when a recording began."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from twin.errors import InputError
from twin.importers import import_log, load_mapping
from twin.logs import Log

MAP = """
time = {column = "t", unit = "s"}
resample = 1000.0
[axes.x]
position = {column = "q", unit = "mm"}
force = {column = "f", unit = "N"}
"""


def imported(folder: Path, columns: dict[str, np.ndarray], text: str = MAP) -> Log:
    (folder / "a.json").write_text(json.dumps({n: list(map(float, c)) for n, c in columns.items()}))
    (folder / "map.toml").write_text(text)
    return import_log(folder / "a.json", load_mapping(folder / "map.toml"))


def recording(jitter: float, start: float = 0.0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    t = np.arange(3000) * 1e-3 + jitter * 1e-3 * rng.uniform(-0.5, 0.5, 3000)
    return {"t": start + t, "q": 30.0 * np.sin(9.0 * t), "f": 5.0 * np.cos(9.0 * t)}


def test_jittered_stamps_come_onto_one_clock_and_the_log_says_what_that_cost(
    tmp_path: Path,
) -> None:
    columns = recording(jitter=0.8)
    columns = {n: np.insert(c, 1000, c[999]) for n, c in columns.items()}  # one row twice
    log = imported(tmp_path, columns)
    t = columns["t"][0] + np.arange(len(log)) / 1000.0
    error = log.axes["x"].position - 0.03 * np.sin(9.0 * t)
    assert np.abs(error).max() < 2e-6
    said = log.metadata["resampled"]
    assert "1 rows with a time that does not increase left out" in said
    cost = float(said.partition("x.position ")[2].split()[0])
    rms = float(np.sqrt(np.mean(error**2)))
    assert rms < cost < 10.0 * rms


def test_even_stamps_cost_nothing(tmp_path: Path) -> None:
    columns = recording(jitter=0.0)
    log = imported(tmp_path, columns)
    np.testing.assert_allclose(log.axes["x"].position, columns["q"] * 1e-3, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "text", "message"),
    [
        (lambda c: c, MAP.replace("resample = 1000.0", ""), r"give resample = \d+"),
        (lambda c: c, MAP.replace("= 1000.0", "= 9000.0"), r"rows come at about \d+"),
        (lambda c: c, MAP.replace('time = {column = "t", unit = "s"}', ""), "needs the times"),
        (
            lambda c: np.where(np.arange(len(c)) > 1500, c + 1.0, c),
            MAP,
            r"nothing between 1\.\d+ s and",
        ),
        (lambda c: np.zeros(len(c)), MAP, "increases in 1 of 3000 rows only"),
        (lambda c: c * np.nan, MAP, "row 1 is nan|cannot be read"),
    ],
)
def test_times_that_cannot_be_brought_onto_a_clock(tmp_path, change, text, message) -> None:
    columns = recording(jitter=0.8)
    columns["t"] = change(columns["t"])
    with pytest.raises(InputError, match=message):
        imported(tmp_path, columns, text)


def test_times_since_1970_stay_with_the_log(tmp_path: Path) -> None:
    log = imported(tmp_path, recording(jitter=0.0, start=1.7e9))
    assert log.metadata["start_time_unix_ns"] == "1700000000000000000"
    assert "start_time_unix_ns" not in imported(tmp_path, recording(jitter=0.0)).metadata


@pytest.mark.parametrize(
    "shape",
    [
        lambda c: {"keys": list(c), "data": np.column_stack(list(c.values())).tolist()},
        lambda c: [
            dict(zip(c, row, strict=True)) for row in zip(*map(list, c.values()), strict=True)
        ],
        lambda c: {"run": {n: list(v) for n, v in c.items()}},
    ],
)
def test_every_shape_of_json(tmp_path: Path, shape) -> None:
    columns = recording(jitter=0.0)
    (tmp_path / "a.json").write_text(json.dumps(shape(columns)))
    text = MAP
    if "run" in shape({"t": []}):
        text = MAP.replace('"t"', '"run.t"').replace('"q"', '"run.q"').replace('"f"', '"run.f"')
    (tmp_path / "map.toml").write_text(text)
    log = import_log(tmp_path / "a.json", load_mapping(tmp_path / "map.toml"))
    np.testing.assert_allclose(log.axes["x"].force, columns["f"], atol=1e-9)


@pytest.mark.parametrize(
    "text", ["", "[", "3", "[1, [2]]", '{"t": ["a", 1]}', "[" * 5000, '{"t": [1e999]}', "null"]
)
def test_a_damaged_json_file_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text)
    (tmp_path / "map.toml").write_text(MAP)
    with pytest.raises(InputError) as refused:
        import_log(tmp_path / "a.json", load_mapping(tmp_path / "map.toml"))
    assert "\n" not in str(refused.value)
