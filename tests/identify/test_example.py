"""`twin example` writes what its commands need; the demonstration finds what it hides."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import cli_runs
import numpy as np
import pytest
from built_fits import CATALOGUE, HARDWARE, axis_of, fitted
from cli_runs import in_small, refusal, twin
from planted_logs import SLIDE

from identify import demo
from identify.dataset.preparation import datasets
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from twin.effects import Catalogue
from twin.errors import InputError
from twin.examples import EXAMPLES, examples_folder, write_example
from twin.importers import load_mapping
from twin.logs import read_log
from twin.model.file import load_model, save_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

ROOT = Path(__file__).parent.parent.parent


def test_the_examples_are_listed(tmp_path) -> None:
    said = cli_runs.twin("example", folder=tmp_path)
    assert [line.split()[0] for line in said.stdout.splitlines()] == list(EXAMPLES)
    found = json.loads(cli_runs.twin("example", "--json", folder=tmp_path).stdout)
    assert found["examples"].keys() == EXAMPLES.keys()


def test_the_recording_goes_from_csv_to_a_fitted_model_as_printed(tmp_path) -> None:
    said = cli_runs.twin("example", "recording", folder=tmp_path)
    folder = tmp_path / "recording"
    assert said.stdout.splitlines()[0] == "recording: map.toml, recording.csv"
    for command in EXAMPLES["recording"].commands:
        assert f"  {command}" in said.stdout.splitlines()
        done = cli_runs.twin(*command.split()[1:], folder=folder)
        assert done.returncode == 0, done.stderr
    fitted, true = load_model(folder / "fitted.toml"), load_model("example_machine")
    assert fitted.axes["x"].mass == pytest.approx(true.axes["x"].mass, rel=0.05)


@pytest.mark.slow
def test_hidden_effect_has_a_log_of_each_role(tmp_path) -> None:
    example, files = write_example("hidden_effect", tmp_path / "new")
    assert [file.name for file in files] == ["fit.mcap", "held.mcap", "test.mcap"]
    words = " ".join(example.commands).split()
    assert all(file.name in words for file in files)


@pytest.mark.parametrize("name", [n for n, e in EXAMPLES.items() if e.files])
def test_the_files_of_an_example_are_those_that_its_commands_name(name, tmp_path) -> None:
    example, files = write_example(name, tmp_path / "new")
    for file in files:
        if file.name.startswith("import_"):
            assert load_mapping(file).axes
        elif file.suffix == ".toml":
            assert load_model(file).axes
        assert file.name in " ".join(example.commands) or name == "viewer"
    assert all((examples_folder() / file).is_file() for file in example.files)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive", "friction"])
def test_the_scripts_of_an_example_run_as_printed(name, tmp_path) -> None:
    example, files = write_example(name, tmp_path / "new")
    program, *given = next(c.split() for c in example.commands if c.startswith("python "))
    assert program == "python"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, *given], cwd=tmp_path / "new", env=environment, check=True)
    assert len([*(tmp_path / "new").iterdir()]) > len(files)


def test_nothing_is_written_over(tmp_path) -> None:
    (tmp_path / "mine").write_text("mine")
    with pytest.raises(InputError, match="exists and is not an empty folder; give another"):
        write_example("own_effect", tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["mine"]
    with pytest.raises(InputError, match="unknown example 'emsp'; did you mean 'emps'"):
        write_example("emsp", tmp_path / "new")


def test_every_example_file_is_offered_and_travels_with_the_package() -> None:
    there = {file.name for file in (ROOT / "examples").iterdir() if file.is_file()}
    assert there == {file for example in EXAMPLES.values() for file in example.files}
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    included = settings["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included["examples"] == "twin/example_files"


def test_a_demonstration_hides_what_it_finds_again(tmp_path):
    own = MachineModel("s", {"x": replace(SLIDE, hardware=HARDWARE)}, 1000.0)
    save_model(own, tmp_path / "m.toml")
    asked = ("demo", "-o", "new", "--seed", "3", "--model", "m.toml")
    with in_small("coulomb_viscous", "periodic_disturbance", "constant_force"):
        done = twin(*asked, "--json", folder=tmp_path)
    told, said = json.loads(done.stdout), done.stderr.splitlines()
    assert (done.returncode, told["named"]) == (0, True)
    assert [line[:2] for line in said if line[1] == "."] == ["1.", "2.", "3.", "4.", "5."]
    hidden = told["hidden"]
    assert told["diagnosis"]["missing"] == [hidden]
    assert f"names {hidden} on x" in done.stderr
    logs = {p.name: read_log(p) for p in sorted((tmp_path / "new").glob("*.mcap"))}
    assert [log.metadata["experiment"] for log in logs.values()] == [*("tracking", "moves") * 2]
    assert len({log.metadata["seed"] for log in logs.values()}) == 4
    written = load_model(tmp_path / "new" / "better.toml", CATALOGUE)
    assert written.axes["x"].names == ("coulomb_viscous", hidden)
    (step,) = written.history
    assert step.test_error_before > 2.0 * step.test_error_after
    assert f"{step.test_error_before / step.test_error_after:.0f} times" in done.stderr
    tracked = told["feedforward"]["axes"]["x"]
    assert tracked["diagnosed"]["rms"] < tracked["before"]["rms"] < tracked["without"]["rms"]
    page = (tmp_path / told["report"]).read_text(encoding="utf-8")
    assert page.count("<section") > 3
    typed = re.sub("<.*?>", "", page[page.index("<code>") : page.index("</code>")])
    assert typed.startswith("twin diagnose m.toml new/machine_1.mcap new/machine_2.mcap ")
    opened = re.search(r'"against": *"(\w+)"', page)
    assert opened
    assert (opened[1] == "time") is (hidden == "periodic_disturbance")
    assert "cannot be made" in refusal(*asked[:1], "-o", "m.toml/in", folder=tmp_path)


def test_only_what_shows_is_hidden():
    model = MachineModel("m", {"x": axis_of(fitted("cogging"))}, 1000.0)
    names = ("cogging", "constant_force", "gms", "encoder_delay", "periodic_disturbance")
    some = Catalogue([CATALOGUE[n] for n in names])
    found, hidden = demo.hidden_machine(model, some, np.random.default_rng(1))
    assert hidden.effect.name in ("constant_force", "periodic_disturbance")
    assert found.axes["x"].names == (*model.axes["x"].names, hidden.effect.name)
    log = simulate(found, "tracking", seed=1, duration=3.0, simulator=ReducedSimulator)
    dataset = datasets(found, {"a": log}, {})["x"]
    without = rms(error_on(found.axes["x"].without(hidden.effect.name), dataset.training))
    assert without == pytest.approx(demo.FORCE, rel=0.1)
    with pytest.raises(InputError, match="another seed"):
        demo.hidden_machine(model, Catalogue([some["gms"]]), np.random.default_rng(1))
