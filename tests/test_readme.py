"""The README is true: its shell commands and its Python run as printed, in an empty folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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


def test_the_loop_runs_as_printed_and_the_error_falls(tmp_path):
    commands = [line for line in blocks("sh")[1].splitlines() if line.startswith("twin ")]
    assert len(commands) == 10
    if shutil.which("twin", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("the package is not installed, so there is no `twin` command")
    for command in commands:
        result = run(command.split(), tmp_path)
        assert result.returncode == 0, f"{command}\n{result.stderr}"
        if "diagnose" in command:
            assert "axis x" in result.stdout
            assert "cogging" in result.stdout
    assert "held out" in run(
        ["twin", "fit", "better.toml", "fit.mcap", "--holdout", "held.mcap"], tmp_path
    ).stdout  # fmt: skip
    assert (tmp_path / "after.html").stat().st_size > 10_000
    assert (tmp_path / "next.mcap").stat().st_size > 10_000


def test_the_python_example_runs_and_names_the_effect(tmp_path):
    (tmp_path / "example.py").write_text(blocks("python")[0])
    result = run([sys.executable, "example.py"], tmp_path)
    assert result.returncode == 0, result.stderr
    name, before, after = result.stdout.split()
    assert name == "cogging"
    assert float(after) < float(before) / 3.0


def test_the_two_commands_are_targets_of_the_makefile():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"^make (\w+)", blocks("sh")[0], flags=re.M):
        assert re.search(rf"^{target}:", makefile, flags=re.M)


def test_the_files_it_names_exist():
    for name in re.findall(r"`((?:examples|models|tests|twin|identify|benchmarks)/[\w./]*)`", TEXT):
        assert (ROOT / name).exists(), name
