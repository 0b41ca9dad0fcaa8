"""Chapter "twin" on a log of a machine: its twin follows the reference, and both fits agree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from identify.output.report.thesis import write_reproduction
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.thesis.chapters import reproduce_on_logs
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.simulator import ReducedSimulator

MODEL = replace(load_model("thesis_memory", load_catalogue()), sample_rate=2000.0)


def test_a_log_and_its_twin_agree_and_move_alike(tmp_path: Path) -> None:
    log = simulate(MODEL, "tracking", seed=4, duration=6.0, simulator=ReducedSimulator)
    done = reproduce_on_logs(["twin"], MODEL, {"run": log}, axis="x")
    found = reproduction_json(done)["chapters"]["twin"]["run"]
    assert found["alike"]["agree"]
    assert found["closed_loop_error"]["position"]["found"] < 1e-5
    assert found["closed_loop_error"]["position"]["published_emps"]["run"] == 1.375e-4
    assert "machine and twin on run: axis x: the fits agree" in reproduction_text(done)
    write_reproduction(tmp_path / "page.html", done)
    assert "Published for EMPS" in (tmp_path / "page.html").read_text()


def test_an_axis_that_the_model_lacks_is_one_line() -> None:
    with pytest.raises(InputError, match=r"no axis 'z' in .*; there is x"):
        reproduce_on_logs(["twin"], MODEL, {}, axis="z")
