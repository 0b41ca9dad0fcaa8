"""`twin example` writes what its commands need; the simulated examples run as they are printed."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import cli_runs
import pytest

from twin.errors import InputError
from twin.examples import EXAMPLES, examples_folder, write_example
from twin.importers import load_mapping
from twin.model.file import load_model

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
