"""Chapters on logs of a real machine: what passes tell, and what needs the twin."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_runs import refusal

from identify.output.plain import plain
from identify.output.report.thesis import write_reproduction
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.thesis.chapters import Reproduction, reproduce_on_logs
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.kinds import Passes
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.simulator import ReducedSimulator

MODEL = load_model("proton_xy", load_catalogue())


@pytest.fixture(scope="module")
def done() -> Reproduction:
    passes = Passes("x", span=0.3, speed=0.1, repeats=2)
    log = simulate(MODEL, passes, seed=1, simulator=ReducedSimulator)
    return reproduce_on_logs(["cable"], MODEL, {"passes": log})


def test_passes_of_a_machine_give_its_cable_and_its_pitch(done, tmp_path: Path) -> None:
    chapter = json.loads(json.dumps(plain(reproduction_json(done))))["chapters"]["cable"]
    assert chapter["true"] is None
    assert chapter["pitch"]["mean"] == pytest.approx(0.034, abs=1e-4)
    assert "90 % band" in reproduction_text(done)
    write_reproduction(tmp_path / "page.html", done)
    assert "Cable force" in (tmp_path / "page.html").read_text()


def test_a_chapter_that_needs_the_twin_says_so() -> None:
    with pytest.raises(InputError, match=r"'models' needs the twin.* there is simulation, cable"):
        reproduce_on_logs(["models"], MODEL, {})


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--log", "l.mcap"), "--log and --model go together; give both"),
        (("--axis", "x"), "--axis chooses an axis of --log; leave it out, or give --log"),
        (("--log", "l.mcap", "--model", "m.toml", "--small"), "--small is for the twin"),
        (("--log", "l.mcap", "--model", "m.toml", "--seed", "1"), "leave out --seed, or --log"),
    ],
)
def test_options_of_the_twin_and_of_logs_do_not_mix(options, said: str, tmp_path: Path) -> None:
    assert said in refusal("reproduce", *options, folder=tmp_path)
