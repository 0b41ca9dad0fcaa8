"""README and tutorial are true: their commands and their Python run as printed, in an empty folder.

What they answer is written below them by docs/outputs.py; the long version compares it.
"""

import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch

import pytest
from cli_runs import in_small, twin

from twin import effects
from twin.model.file import load_model

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
TUTORIAL = (ROOT / "docs" / "start" / "tutorial.md").read_text(encoding="utf-8")
MOST_LINES = 100


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, flags=re.S | re.M)


def run(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        arguments, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


def commands_of(text: str) -> Iterator[list[str]]:
    """The commands of a block, the loops written out."""
    loop = re.compile(r"for (\w+) in ([^;]*); do (.*); done")
    for line in text.splitlines():
        found = loop.fullmatch(line)
        if found is None:
            yield shlex.split(line, comments=True)
            continue
        name, values, command = found.groups()
        for value in values.split():
            yield shlex.split(command.replace(f"${name}", value))


def test_it_is_short():
    assert len(TEXT.splitlines()) <= MOST_LINES


# The loop of the tutorial.

CELLS = re.findall(r"^```\{code-cell\}.*?\n%%sh\n(.*?)^```", TUTORIAL, flags=re.S | re.M)
COMMANDS = [line for cell in CELLS for line in cell.splitlines() if line.startswith("twin ")]


@pytest.mark.slow
def test_the_loop_runs_as_printed_and_the_error_falls(tmp_path):
    require_installed()
    assert_the_error_falls(lambda command: run(command, tmp_path), tmp_path)


@pytest.mark.slow
def test_the_loop_runs_in_small_and_the_error_falls(tmp_path):
    """The printed commands on short logs, with two effects to choose from and blank pictures."""
    rivals = ("cogging", "force_constant_ripple")
    with in_small(*rivals, duration=2.0):
        assert_the_error_falls(lambda command: twin(*command[1:], folder=tmp_path), tmp_path)


def require_installed():
    if shutil.which("twin", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("the package is not installed, so there is no `twin` command")


def assert_the_error_falls(answer, folder):
    """Every command ends well, and on the test log the model with the effect errs far less."""
    steps = {command.split()[1] for command in COMMANDS}
    assert steps == {"simulate", "check", "fit", "compare", "diagnose", "plan"}
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
    assert "on the selection logs" in after.stdout
    before, after = errors
    assert after < before / 3.0
    for name in ("before.html", "diagnosis.html", "after.html", "next.mcap"):
        assert (folder / name).stat().st_size > 10_000


# The README's own recordings, by commands and in Python.


def test_the_recordings_are_diagnosed_in_small(tmp_path):
    """The five commands and the example in Python, with two effects to choose from."""
    own = next(block for block in blocks("sh") if "import" in block)
    own_effects = ("coulomb_viscous", "constant_force")  # of the drive, and of a first model
    with in_small("cogging", "spring", *own_effects), chdir(tmp_path):
        script, *commands = commands_of(own)
        recordings = runpy.run_path(str(ROOT / script[1]), run_name="recordings")
        recordings["main"](tmp_path)
        assert len(own.splitlines()) - 1 == 5
        for command in commands:
            result = twin(*command[1:], folder=tmp_path)
            assert result.returncode == 0, f"{command}\n{result.stderr}"
        assert "Missing: cogging." in result.stdout
        assert (tmp_path / "report.html").stat().st_size > 10_000
        assert "cogging" in load_model(tmp_path / "better.toml").axes["x"].names
        few = patch("identify.workflow.load_catalogue", effects.load_catalogue)
        with few, redirect_stdout(StringIO()) as out:
            exec(compile(blocks("python")[0], "README.md", "exec"), {})
        assert "(('cogging',),)" in out.getvalue()


@pytest.mark.slow
def test_the_answers_are_those_of_the_commands(tmp_path):
    """Word for word, but for figures, which another processor may round otherwise."""
    require_installed()
    outputs = runpy.run_path(str(ROOT / "docs" / "outputs.py"), run_name="outputs")
    assert without_figures(outputs["answered"](TEXT, tmp_path)) == without_figures(TEXT)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "named"), [("emps", "asymmetric_friction"), ("laas", "cogging")])
def test_the_pages_of_public_measurements_are_true(name, named, shared_data, tmp_path):
    """Who has the published files gets by the page alone, as printed, to the effect in newtons."""
    require_installed()
    for file in (shared_data / name).iterdir():
        (tmp_path / file.name).symlink_to(file)
    text = (ROOT / "docs" / "start" / f"{name}.md").read_text(encoding="utf-8")
    outputs = runpy.run_path(str(ROOT / "docs" / "outputs.py"), run_name="outputs")
    found = outputs["answered"](text, tmp_path)
    assert re.search(rf"Missing: {named}\b.*\n  \w+ error on the training logs [\d.]+ ->", found)
    assert without_figures(found) == without_figures(text)


def without_figures(text: str) -> str:
    """And without the spaces before them: a figure that begins with a minus is wider."""
    return re.sub(r" *[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text)


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_the_files_it_names_exist(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    folders = "examples|models|tests|twin|identify|studies|benchmarks|docs"
    named = re.findall(rf"`((?:{folders})/[\w./]*)`", text)
    linked = re.findall(r"\]\(([\w./-]+)\)", text)
    for name in [*named, *linked]:
        assert (ROOT / name).exists(), name


def test_the_version_cited_is_this_one_and_has_a_place_in_the_changelog():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## {version} (" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_targets_that_it_names_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"`make (\w+)`", TEXT):
        assert re.search(rf"^{target}:", makefile, flags=re.M), target
