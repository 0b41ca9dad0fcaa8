"""The README is true: its shell commands and its Python run as printed, in an empty folder."""

import json
import os
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
from cli_runs import in_small, twin
from report_cases import without_drawing

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, flags=re.S | re.M)


def run(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        arguments, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


COMMANDS = [line for line in blocks("sh")[1].splitlines() if line.startswith("twin ")]


@pytest.mark.slow
def test_the_loop_runs_as_printed_and_the_error_falls(tmp_path):
    if shutil.which("twin", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("the package is not installed, so there is no `twin` command")
    assert_the_error_falls(lambda command: run(command, tmp_path), tmp_path)


def test_the_loop_runs_in_small_and_the_error_falls(tmp_path):
    """The printed commands on short logs, with two effects to choose from and blank pictures."""
    rivals = ("cogging", "force_constant_ripple")
    with in_small(*rivals, duration=5.0), without_drawing():
        assert_the_error_falls(lambda command: twin(*command[1:], folder=tmp_path), tmp_path)


def assert_the_error_falls(answer, folder):
    """Every command ends well, and on the test log the model with the effect errs far less."""
    steps = {command.split()[1] for command in COMMANDS}
    assert steps == {"simulate", "check", "fit", "compare", "diagnose", "add", "plan"}
    errors = []
    for command in COMMANDS:
        compares = command.startswith("twin compare")
        result = answer([*command.split(), *["--json"] * compares])
        assert result.returncode == 0, f"{command}\n{result.stderr}"
        if compares:
            told = json.loads(result.stdout)["axes"]["x"]["logs"]["test.mcap"]
            errors.append(told["force_error"])
        if "diagnose" in command:
            assert "axis x" in result.stdout
            assert "cogging" in result.stdout
    after = answer(["twin", "fit", "better.toml", "fit.mcap", "--holdout", "held.mcap"])
    assert "held out" in after.stdout
    before, after = errors
    assert after < before / 3.0
    for name in ("before.html", "diagnosis.html", "after.html", "next.mcap"):
        assert (folder / name).stat().st_size > 10_000


@pytest.mark.slow
def test_the_python_example_runs_and_names_the_effect(tmp_path):
    (tmp_path / "example.py").write_text(blocks("python")[0])
    result = run([sys.executable, "example.py"], tmp_path)
    assert result.returncode == 0, result.stderr
    assert_cogging_found(result.stdout)


def test_the_python_example_runs_in_small():
    with in_small("cogging", "quadratic_drag"), redirect_stdout(StringIO()) as out:
        exec(compile(blocks("python")[0], "README.md", "exec"), {})
    assert_cogging_found(out.getvalue())


def assert_cogging_found(printed):
    first, *answer = printed.splitlines()
    name, before, after = first.split()
    assert name == "cogging"
    assert float(after) < float(before) / 3.0
    assert any("cogging" in line for line in answer)  # a result prints itself


def test_the_two_commands_are_targets_of_the_makefile():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"^make (\w+)", blocks("sh")[0], flags=re.M):
        assert re.search(rf"^{target}:", makefile, flags=re.M)


def test_the_files_it_names_exist():
    folders = "examples|models|tests|twin|identify|studies|benchmarks"
    for name in re.findall(rf"`((?:{folders})/[\w./]*)`", TEXT):
        assert (ROOT / name).exists(), name
