"""The command line as a user meets it: exit codes, JSON by itself, failures of one line."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
from cli_runs import RATE, in_small, refusal, twin
from strict_json import valid

from identify.cli import main
from identify.cli.command import OUTPUTS, Command
from identify.cli.shared import CheckedRecordings, Recordings, app
from identify.output.machine import briefly
from twin.checks import check_log
from twin.errors import InputError
from twin.experiments.named import simulate
from twin.logs import AxisLog, Log, write_log
from twin.model.file import load_model, models_folder

Cli = Callable[..., tuple[int, str, str]]
STAGE = (models_folder() / "proton_xy.toml").read_text()


@pytest.fixture(scope="module")
def recorded() -> Log:
    model = replace(load_model("proton_xy"), sample_rate=RATE)
    return simulate(model, "tracking", seed=3, duration=4.0)


@pytest.fixture
def folder(recorded, tmp_path) -> Path:
    """A folder with the log, half of it, logs that nothing fits, and models that are wrong."""
    write_log(recorded, tmp_path / "log.mcap")
    whole = (tmp_path / "log.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.mcap").write_text("no log")
    ramp = np.linspace(0.0, 0.1, 4000) ** 2
    write_log(Log(1000.0, {"z": AxisLog({"position": ramp, "force": ramp})}), tmp_path / "z.mcap")
    current = AxisLog({"position": ramp, "current": ramp})
    write_log(Log(1000.0, {"x": current}), tmp_path / "current.mcap")
    for value in ("-1.0", "nan"):
        (tmp_path / f"bad{value}.toml").write_text(STAGE.replace("Fc = 0.285", f"Fc = {value}"))
    narrow = STAGE.replace("travel = [-0.17, 0.17]", "travel = [0.17, -0.17]")
    (tmp_path / "narrow.toml").write_text(narrow)
    return tmp_path


@pytest.fixture
def cli(tmp_path) -> Cli:

    def run(*arguments: object) -> tuple[int, str, str]:
        done = twin(*arguments, folder=tmp_path)
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("effects coging", ["'cogging'"]),
        ("effects my_effect", ["--effects FILE adds your own"]),
        ("simulate traking", ["'tracking'"]),
        ("add coging proton_xy log.mcap -o b.toml", ["'cogging'"]),
        ("fit proton_yx log.mcap", ["proton_xy.toml"]),
        ("fit no/proton_xy.toml log.mcap", ["proton_xy.toml"]),
        *((f"fit bad{value}.toml log.mcap", ["Fc", " N"]) for value in ("-1.0", "nan")),
        ("fit proton_xy nowhere.mcap", ["nowhere.mcap"]),
        ("compare proton_xy text.mcap", ["text.mcap"]),
        ("diagnose proton_xy cut.mcap", ["twin recover"]),
        ("fit proton_xy z.mcap", ["axis"]),
        ("fit proton_xy current.mcap", ["force constant (N/A)"]),
        ("simulate tracking --model narrow.toml", ["travel"]),
        ("reproduce --chapter cable --log a b", ["`python -m studies.thesis`"]),
        ("selftest --case cogging@5/cable/17", ["`python -m benchmarks selftest`"]),
    ],
)
def test_what_is_wrong_is_one_line_that_says_what_to_try(folder, command, said):
    line = refusal(*command.split(), folder=folder)
    assert all(part in line for part in said)


def test_far_names_are_not_suggested(folder):
    for far in ("m.toml", "cogging"):
        assert "package has" not in refusal("fit", far, "log.mcap", folder=folder)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (InputError("two\nlines"), "twin: two lines"),
        (KeyboardInterrupt(), "twin: interrupted"),
        (PermissionError(13, "Permission denied", "f.x"), "twin: f.x: Permission denied; check"),
        (ValueError("odd"), "twin: this is a fault of the program: ValueError: odd; please"),
    ],
)
def test_every_failure_is_one_line_and_an_exit_code(monkeypatch, cli, error, said):
    def fails(*_: object) -> None:
        raise error

    monkeypatch.delenv("TWIN_TRACEBACK", raising=False)
    monkeypatch.setattr("twin.effects.load_catalogue", fails)
    code, out, err = cli("effects", "--json")
    interrupted = isinstance(error, KeyboardInterrupt)
    assert code == (130 if interrupted else 2)
    assert err.startswith(said)
    assert err.count("\n") == 1
    assert (valid(json.loads(out)) if out else None) == (
        None if interrupted else {"error": err[6:-1]}
    )
    if type(error) is ValueError:
        monkeypatch.setenv("TWIN_TRACEBACK", "1")
        monkeypatch.setattr(sys, "argv", ["twin", "effects"])
        with pytest.raises(ValueError, match="odd"):
            main()


@pytest.mark.parametrize(
    ("command", "said"),
    [
        *(
            (f"{command} -o no/where.toml", "no/where.toml: its folder does not exist")
            for command in ("fit m a", "add wear m a", "simulate moves", "recover a", "plan m")
        ),
        ("fit m.toml a.mcap -o ''", "twin: -o '': is empty; give a name"),
        ("check ''", "twin: check '': is empty; give a name"),
        ("compare m a -o no/where.html", "no/where.html: its folder does not exist"),
        ("diagnose m a -o a.pdf", "a.pdf: a report is an .html file; give such a name"),
    ],
)
def test_what_cannot_be_written_is_said_before_the_work(cli, command, said):
    code, out, err = cli(*shlex.split(command))
    assert (code, out) == (2, "")
    assert said in err


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("fit m a -o a", "-o a: is the file that is read as LOG"),
        ("fit m b --holdout a -o link", "-o link: is the file that is read as --holdout"),
        ("fit m b --holdout c a -o link", "-o link: is the file that is read as --holdout"),
        ("diagnose m b --holdout c --test d a -o hard", "is the file that is read as --test"),
        ("compare m a --mcap ./a", "--mcap a: is the file that is read as LOG"),
        ("compare m b -o n.html --mcap n.html", "are one file; give two names"),
        ("import b --map a -o link", "read as --map"),
        ("import --guess a -o a", "read as FILE"),
        ("new a -o hard", "read as LOG"),
        ("plan a -o a", "read as MODEL"),
        ("plan m --between wear a -o a", "read as --between"),
        ("simulate a -o a", "read as EXPERIMENT"),
        ("simulate moves --model a -o a", "read as --model"),
        ("effects wear --effects a --plot a", "read as --effects"),
        ("demo --model better.toml -o .", "read as --model"),
    ],
)
def test_no_command_overwrites_what_it_reads(cli, tmp_path, command, said):
    for name in ("a", "better.toml"):
        (tmp_path / name).write_text("whole")
    (tmp_path / "link").symlink_to("a")
    (tmp_path / "hard").hardlink_to(tmp_path / "a")
    before = sorted(tmp_path.iterdir())
    code, out, err = cli(*command.split())
    assert (code, out) == (2, "")
    assert said in err
    assert (tmp_path / "a").read_text() == (tmp_path / "better.toml").read_text() == "whole"
    assert sorted(tmp_path.iterdir()) == before


def test_every_path_of_a_command_is_known_as_read_or_written():
    """A path of a new command must be among what is written, or it counts as read."""
    read = {"logs", "holdout", "test", "effects", "files", "sources", "mapping", "log", "mjcf"}
    assert all(info.cls is Command for info in app.registered_commands)
    hints = [get_type_hints(info.callback) for info in app.registered_commands]
    paths = {name for own in hints for name, kind in own.items() if "Path" in str(kind)}
    assert paths == {*read, *OUTPUTS}


def test_help_is_where_it_is_looked_for(cli):
    assert cli("fit")[2] == "twin: Missing argument 'MODEL'. See `twin fit --help`.\n"
    assert cli("simulat")[2].endswith("See `twin --help`.\n")
    for command, fits in (("fit", True), ("compare", False), ("check", False), ("new", False)):
        assert ("MCAP logs to fit on." in cli(command, "--help")[1]) is fits
    code, out, err = cli()
    assert (code, err) == (0, "")
    assert out.count("\n") > 10
    assert "diagnose" in out
    assert "selftest" not in out


def test_a_truncated_log_is_recovered_diagnosed_and_no_effect_added(folder):
    result = twin("recover", "cut.mcap", "-o", "good.mcap", "--json", folder=folder)
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["lost"]
    assert (told["log"], told["others"]) == ("good.mcap", [])
    with in_small("quadratic_drag"):
        done = twin("diagnose", "proton_xy", "good.mcap", "--json", folder=folder)
    answer = json.loads(done.stdout)
    keys = "verdict effect ranking ambiguous_with findings also_seen unexplained remainder"
    assert {*keys.split(), "noise_floor", "noise_floors", "parameters"} <= set(answer)
    assert answer["verdict"] == "nothing_missing"
    add = ("add", "quadratic_drag", "proton_xy", "good.mcap", "-o", "b.toml", "--json")
    result = twin(*add, folder=folder)
    assert result.returncode == 1
    assert json.loads(result.stdout)["kept"] is False


def test_a_drive_too_weak_for_its_motion_is_told_of(tmp_path):
    weak = STAGE.replace("force_limit = 200.0", "force_limit = 8.0", 1)
    (tmp_path / "weak.toml").write_text(weak)
    command = ("simulate", "tracking", "--duration", 3, "--seed", 2)
    ran = twin(*command, "--model", "weak.toml", folder=tmp_path)
    assert ran.returncode == 0
    (line,) = ran.stderr.splitlines()
    assert "axis x" in line
    assert "outside its travel" in line
    assert twin(*command, folder=tmp_path).stderr == ""


def test_warnings_on_a_log_are_one_line_that_says_where_they_are_told():
    doubt, other = "a.mcap: warning: axis x: jitter", "a.mcap: warning: axis x: one way; move back"
    wrong, assumed = "b.mcap: error: SIGN", "b.mcap: warning: the import map assumes the unit of x"
    assert briefly([doubt, wrong, other, assumed]) == [
        wrong, assumed, "a.mcap: 2 warnings; `twin check a.mcap` tells what to do",
    ]  # fmt: skip
    assert briefly([doubt]) == ["a.mcap: 1 warning; `twin check a.mcap` tells what to do"]


def test_identification_holds_no_more_of_a_log_than_it_reads(tmp_path):
    """Seven columns and the truth of a simulation are four times what is fitted."""
    t = 1e-3 * np.arange(3000)
    own = {
        "position": 0.05 * np.sin(3.0 * t), "force": np.cos(3.0 * t), "current": np.cos(3.0 * t),
        "setpoint_position": 0.05 * np.sin(3.0 * t),
        "velocity": 0.15 * np.cos(3.0 * (t - 0.02)),  # late; the check says so
    }  # fmt: skip
    whole = Log(
        1000.0,
        {"x": AxisLog({**own, "setpoint_velocity": np.cos(t)}, force_constant=1.0)}, {"a": "b"},
        truth={"x": {"position": own["position"]}}, attachments={"model.toml": b""},
    )  # fmt: skip
    path = tmp_path / "a.mcap"
    write_log(whole, path)
    checked = CheckedRecordings([path])
    for logs in (checked, Recordings([path])):
        (log,) = logs.values()
        columns = log.axes["x"].columns
        assert {f: c.tolist() for f, c in columns.items()} == {
            f: c.tolist() for f, c in own.items()
        }
        assert (log.truth, log.attachments) == ({}, {})
        assert (log.metadata["a"], log.axes["x"].force_constant) == ("b", 1.0)
    findings = [f"{path}: {f.severity.value}: {f}" for f in check_log(whole).findings]
    assert checked.findings == findings
    assert any("velocity" in f for f in findings)
