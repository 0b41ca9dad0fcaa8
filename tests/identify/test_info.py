"""`twin info` tells what is in a log, `twin doctor` what is missing; every help has an example."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import cli_runs
import numpy as np
import pytest
import typer

import twin
from identify.cli import app, doctor
from twin.checks.long import LogInfo, log_info
from twin.errors import InputError
from twin.logs import ROTARY_UNITS, AxisLog, Log, read_log, write_log


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
    parts = log_info(path)
    assert ranges(parts) == ranges(whole)
    assert parts.samples == whole.samples == 30_000


def ranges(info: LogInfo) -> dict[str, list[tuple[str, float, float]]]:
    return {a: [(c.name, c.least, c.most) for c in own.channels] for a, own in info.axes.items()}


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


def test_a_file_that_a_log_carries_is_told_by_its_length(rotary, tmp_path) -> None:
    log = replace(read_log(rotary), metadata={"import_map": "# by hand\n[axes.a]\n"})
    write_log(log, tmp_path / "a.mcap")
    said = cli_runs.twin("info", "a.mcap", folder=tmp_path).stdout
    assert said.splitlines()[1] == "  written by: import_map (2 lines)"


@pytest.mark.parametrize("ending", ["csv", "mat", "parquet"])
def test_the_signals_of_a_log_go_to_other_tools_and_come_back(ending, rotary, tmp_path) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    whole = read_log(rotary)
    assert [*whole.table()] == ["time [s]", "a position [rad]", "a current [A]"]
    done = cli_runs.twin("info", rotary, "-o", f"a.{ending}", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"\na.{ending}: its signals as a table" in done.stdout
    name = "a_position" if ending == "mat" else "a position [rad]"
    (tmp_path / "map.toml").write_text(
        f'sample_rate = 1000.0\n[axes.a]\nposition = {{column = "{name}", unit = "rad"}}\n'
        f'current = {{column = "{name.replace("position", "current").replace("rad", "A")}", '
        'unit = "A"}\nforce_constant = 0.25 # N m/A\n'
    )
    back = twin.import_log(tmp_path / f"a.{ending}", twin.load_mapping(tmp_path / "map.toml"))
    for signal, column in whole.axes["a"].columns.items():
        np.testing.assert_allclose(back.axes["a"].columns[signal], column, atol=1e-11)


def test_a_table_is_of_one_log_and_of_a_known_ending(rotary, tmp_path) -> None:
    for given in ((rotary, "-o", "a.xls"), (rotary, rotary, "-o", "a.csv")):
        said = cli_runs.refusal("info", *given, folder=tmp_path)
        assert "a table is" in said
    assert not [*tmp_path.glob("a.*")]


def test_faults_are_one_line_and_a_file_that_is_no_log_too(tmp_path) -> None:
    t = 1e-3 * np.arange(3000)
    columns = {"position": np.zeros(3000), "force": np.cos(t)}
    write_log(Log(1000.0, {"x": AxisLog(columns)}), tmp_path / "flat.mcap")
    said = cli_runs.twin("info", "flat.mcap", folder=tmp_path).stdout
    assert "check: not suitable for identification: a signal never changes (axis x)" in said
    (tmp_path / "none.mcap").write_bytes(b"not a log")
    with pytest.raises(InputError, match=r"none.mcap: "):
        log_info(tmp_path / "none.mcap")


ROOT = Path(__file__).parent.parent.parent
COMMANDS = {n: c for n, c in typer.main.get_command(app).commands.items() if not c.hidden}
EVERY = COMMANDS | {
    f"{group} {n}": c for group in ("fleet", "project") for n, c in COMMANDS[group].commands.items()
}


def test_a_whole_installation_is_one_line_each(tmp_path) -> None:
    said = cli_runs.twin("doctor", folder=tmp_path)
    assert "compiled functions" in said.stdout
    assert "cannot be written" not in said.stdout
    assert said.returncode == 0
    lines = said.stdout.splitlines()
    topics = ["twin", "Python", "packages", "importers", "fleet", "live", "cache"]
    topics += ["MuJoCo", "display", "threads"]
    assert [line.split()[1] for line in lines] == topics
    assert "MuJoCo" in lines[7]
    assert "runs" in lines[7]
    found = json.loads(cli_runs.twin("doctor", "--json", folder=tmp_path).stdout)
    assert found["ok"] is True
    assert [line["about"] for line in found["lines"]] == topics


@pytest.mark.parametrize(
    ("which", "code", "said"),
    [
        ("NEEDED", 1, "lacks no-such-package: pip install --upgrade proton-twin"),
        ("FOR_IMPORT", 0, "[import]"),  # of use, but not needed
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
        (doctor.FOR_FLEET, project["optional-dependencies"]["fleet"]),
        (doctor.FOR_LIVE, project["optional-dependencies"]["live"]),
    ):
        assert set(looked) == {re.split(r"[>=<\[]", line)[0] for line in asked}


def test_the_list_of_commands_has_whole_sentences(tmp_path) -> None:
    said = cli_runs.twin("--help", folder=tmp_path).stdout
    assert "..." not in said.partition("Commands:")[2]
    for command in COMMANDS.values():
        first = " ".join(command.help.split("\n\n")[0].split())
        assert first.endswith(".")
        assert first in " ".join(said.split())


@pytest.mark.parametrize("name", sorted(EVERY))
def test_the_help_of_a_command_has_an_example_that_it_takes(name, tmp_path) -> None:
    (line,) = re.findall(r"^\s*Example: twin (.+)$", EVERY[name].help, re.MULTILINE)
    words, given = name.split(), shlex.split(line)
    assert f"Example: twin {name}" in cli_runs.twin(*words, "--help", folder=tmp_path).stdout
    assert given[: len(words)] == words
    EVERY[name].make_context(name, given[len(words) :])  # raises for an option that is not there


def test_a_shell_completes_commands_and_options(tmp_path) -> None:
    environment = {
        **os.environ, "_TWIN_COMPLETE": "complete_bash", "COMP_WORDS": "twin di", "COMP_CWORD": "1",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", "from identify.start import main; main()"],
        env=environment, cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["diagnose"]
