"""`twin doctor` names what is missing with its remedy; every command's help has an example."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import cli_runs
import pytest
import typer

from identify.cli import app, doctor

ROOT = Path(__file__).parent.parent.parent
COMMANDS = {n: c for n, c in typer.main.get_command(app).commands.items() if not c.hidden}


def test_a_whole_installation_is_one_line_each(tmp_path) -> None:
    said = cli_runs.twin("doctor", folder=tmp_path)
    assert said.returncode == 0
    lines = said.stdout.splitlines()
    topics = ["twin", "Python", "packages", "importers", "cache", "MuJoCo", "display", "threads"]
    assert [line.split()[1] for line in lines] == topics
    assert "MuJoCo" in lines[5]
    assert "runs" in lines[5]
    found = json.loads(cli_runs.twin("doctor", "--json", folder=tmp_path).stdout)
    assert found["ok"] is True
    assert [line["about"] for line in found["lines"]] == topics


def test_what_is_missing_is_named_with_how_to_get_it(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(doctor, "NEEDED", ("numpy", "a-package-that-is-not"))
    said = cli_runs.twin("doctor", folder=tmp_path)
    assert said.returncode == 1
    (line,) = [line for line in said.stdout.splitlines() if line.startswith("MISSING")]
    assert "lacks a-package-that-is-not: pip install --upgrade proton-twin" in line
    monkeypatch.undo()
    monkeypatch.setattr(doctor, "FOR_IMPORT", ("no-such-importer",))
    said = cli_runs.twin("doctor", folder=tmp_path)
    assert said.returncode == 0  # of use, but not needed
    assert 'pip install "proton-twin[import]"' in said.stdout


def test_it_looks_at_every_package_that_the_installation_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    names = [re.split(r"[>=<\[]", line)[0] for line in project["dependencies"]]
    assert set(doctor.NEEDED) == set(names)
    wanted = [re.split(r"[>=<\[]", one)[0] for one in project["optional-dependencies"]["import"]]
    assert set(doctor.FOR_IMPORT) == set(wanted)


def test_the_list_of_commands_has_whole_sentences(tmp_path) -> None:
    said = cli_runs.twin("--help", folder=tmp_path).stdout
    assert "..." not in said.partition("Commands:")[2]
    for command in COMMANDS.values():
        first = " ".join(command.help.split("\n\n")[0].split())
        assert first.endswith(".")
        assert first in " ".join(said.split())


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_the_help_of_a_command_has_an_example_that_it_takes(name, tmp_path) -> None:
    (line,) = re.findall(r"^\s*Example: twin (.+)$", COMMANDS[name].help, re.MULTILINE)
    assert f"Example: twin {name}" in cli_runs.twin(name, "--help", folder=tmp_path).stdout
    first, *arguments = shlex.split(line)
    assert first == name
    COMMANDS[name].make_context(name, arguments)  # raises for an option that is not there


def test_a_shell_completes_commands_and_options(tmp_path) -> None:
    environment = {
        **os.environ, "_TWIN_COMPLETE": "complete_bash", "COMP_WORDS": "twin di", "COMP_CWORD": "1",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", "from identify.start import main; main()"],
        env=environment, cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["diagnose"]
