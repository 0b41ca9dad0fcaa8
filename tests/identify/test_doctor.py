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


@pytest.mark.parametrize(
    ("which", "code", "said"),
    [
        ("NEEDED", 1, "lacks no-such-package: pip install --upgrade proton-twin"),
        ("FOR_IMPORT", 0, 'pip install "proton-twin[import]"'),  # of use, but not needed
    ],
)
def test_what_is_missing_is_named_with_how_to_get_it(tmp_path, monkeypatch, which, code, said):
    monkeypatch.setattr(doctor, which, ("numpy", "no-such-package"))
    done = cli_runs.twin("doctor", folder=tmp_path)
    (line,) = [line for line in done.stdout.splitlines() if "no-such-package" in line]
    assert (done.returncode, said in line) == (code, True)


def test_it_looks_at_every_package_that_the_installation_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for looked, asked in (
        (doctor.NEEDED, project["dependencies"]),
        (doctor.FOR_IMPORT, project["optional-dependencies"]["import"]),
    ):
        assert set(looked) == {re.split(r"[>=<\[]", line)[0] for line in asked}


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
