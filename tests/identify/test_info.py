"""`twin info` tells what is in a log, from a log in one part and in several, in text and JSON."""

from __future__ import annotations

import json
from pathlib import Path

import cli_runs
import numpy as np
import pytest

import twin
from twin.checks.long import log_info
from twin.errors import InputError
from twin.logs import ROTARY_UNITS, AxisLog, Log, write_log


@pytest.fixture(scope="module")
def rotary(tmp_path_factory) -> Path:
    t = 1e-3 * np.arange(3000)
    columns = {"position": 0.5 * np.sin(3.0 * t), "current": 2.0 * np.cos(3.0 * t) + 1.0}
    path = tmp_path_factory.mktemp("info") / "turning.mcap"
    axis = AxisLog(columns, {n: ROTARY_UNITS[n] for n in columns}, force_constant=0.25)
    write_log(Log(1000.0, {"a": axis}, {"source": "test rig 7"}), path)
    return path


def test_ranges_are_those_of_the_whole_log_however_long(tmp_path, monkeypatch) -> None:
    path = tmp_path / "long.mcap"
    write_log(twin.simulate(twin.load_model("proton_xy"), "tracking", seed=1, duration=3.0), path)
    whole = log_info(path)
    monkeypatch.setattr("twin.checks.long.LARGEST_PART", 14_000)
    assert log_info(path).axes == whole.axes
    assert log_info(path).samples == whole.samples == 30_000


def test_what_was_written_is_told_in_text_and_as_one_object(rotary) -> None:
    said = cli_runs.twin("info", rotary, folder=rotary.parent)
    assert said.returncode == 0
    lines = said.stdout.splitlines()
    assert lines[0] == f"{rotary}: 3 s, 3000 samples at 1000 Hz, axis a"
    assert "  written by: source test rig 7" in lines[1]
    assert "  axis a (rotary, force constant 0.25 N m/A)" in lines
    assert "    position  -0.499999 to 0.5 rad" in lines or "    position  -0.5 to 0.5 rad" in lines
    assert sum("check:" in line for line in lines) == 1
    done = cli_runs.twin("info", rotary, "--json", folder=rotary.parent)
    found = json.loads(done.stdout)["logs"][str(rotary)]
    assert (found["duration"], found["duration_unit"], found["ok"]) == (3.0, "s", True)
    assert (found["samples"], found["sample_rate"]) == (3000, 1000.0)
    assert found["metadata"] == {"source": "test rig 7"}
    axis = found["axes"]["a"]
    assert (axis["kind"], axis["force_constant"], axis["force_constant_unit"]) == (
        "rotary", 0.25, "N m/A",
    )  # fmt: skip
    for name, unit, least, most in (("position", "rad", -0.5, 0.5), ("current", "A", -1.0, 3.0)):
        told = axis["channels"][name]
        assert (told["unit"], told["least"], told["most"]) == (
            unit, pytest.approx(least, abs=1e-5), pytest.approx(most, abs=1e-5),
        )  # fmt: skip


def test_faults_are_one_line_and_a_file_that_is_no_log_too(tmp_path) -> None:
    t = 1e-3 * np.arange(3000)
    columns = {"position": np.zeros(3000), "force": np.cos(t)}
    write_log(Log(1000.0, {"x": AxisLog(columns)}), tmp_path / "flat.mcap")
    said = cli_runs.twin("info", "flat.mcap", folder=tmp_path).stdout
    assert "check: not suitable for identification: a signal never changes (axis x)" in said
    (tmp_path / "none.mcap").write_bytes(b"not a log")
    with pytest.raises(InputError, match=r"none.mcap: "):
        log_info(tmp_path / "none.mcap")
