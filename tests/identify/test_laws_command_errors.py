"""The command line: every failure is one line on standard error and exit code 2."""

from __future__ import annotations

import json
import sys
from typing import get_type_hints

import numpy as np
import pytest
from cli_runs import twin
from strict_json import valid

from identify.cli import main
from identify.cli.command import OUTPUTS, Command
from identify.cli.shared import CheckedRecordings, Recordings, app
from twin.checks import check_log
from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log


@pytest.fixture
def cli(tmp_path):
    """Runs `twin` in an empty folder: exit code, standard output and standard error."""

    def run(*arguments: object) -> tuple[int, str, str]:
        done = twin(*arguments, folder=tmp_path)
        return done.returncode, done.stdout, done.stderr

    return run


# --- errors ---------------------------------------------------------------------------------


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
    def fails(*_: object, **__: object) -> None:
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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("fit", "m.toml", "a.mcap", "-o", ""), "-o ''"),
        (("", "a.mcap"), "''"),
        (("check", ""), "check ''"),
    ],
)
def test_an_empty_argument_is_no_name(cli, arguments, said):
    assert cli(*arguments) == (2, "", f"twin: {said}: is empty; give a name\n")


def test_a_traceback_is_shown_where_it_is_asked_for(monkeypatch):
    monkeypatch.setenv("TWIN_TRACEBACK", "1")
    monkeypatch.setattr(sys, "argv", ["twin", "effects"])
    monkeypatch.setattr("twin.effects.load_catalogue", lambda files: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main()


@pytest.mark.parametrize(
    "command",
    [
        ("fit", "m", "a"), ("add", "wear", "m", "a"), ("simulate", "moves"), ("recover", "a"),
        ("plan", "m"),
    ],
)  # fmt: skip
def test_a_missing_folder_is_said_before_the_work(cli, command):
    code, out, err = cli(*command, "-o", "no/where.toml")
    assert (code, out) == (2, "")
    assert "no/where.toml: its folder does not exist" in err


@pytest.mark.parametrize("command", ["compare", "diagnose"])
def test_a_report_is_html_in_a_folder_that_is_there(cli, command):
    for name, said in (
        ("no/where.html", "no/where.html: its folder does not exist"),
        ("a.pdf", "a.pdf: a report is an .html file; give such a name"),
    ):
        code, out, err = cli(command, "m", "a", "-o", name)
        assert (code, out) == (2, "")
        assert said in err


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("fit", "m", "a", "-o", "a"), "-o a: is the file that is read as LOG"),
        (("fit", "m", "b", "--holdout", "a", "-o", "link"), "-o link: is the file that is read as "
         "--holdout"),
        (("add", "wear", "m", "b", "--test", "a", "-o", "hard"), "read as --test"),
        (("compare", "m", "a", "--mcap", "./a"), "--mcap a: is the file that is read as LOG"),
        (("compare", "m", "b", "-o", "n.html", "--mcap", "n.html"), "are one file; give two names"),
        (("diagnose", "m", "a", "-o", "a"), "read as LOG"),
        (("import", "b", "--map", "a", "-o", "link"), "read as --map"),
        (("import", "--guess", "a", "-o", "a"), "read as FILE"),
        (("new", "a", "-o", "a"), "read as LOG"),
        (("recover", "a", "-o", "hard"), "read as LOG"),
        (("plan", "a", "-o", "a"), "read as MODEL"),
        (("plan", "m", "--between", "wear", "a", "-o", "a"), "read as --between"),
        (("simulate", "a", "-o", "a"), "read as EXPERIMENT"),
        (("simulate", "moves", "--model", "a", "-o", "a"), "read as --model"),
        (("effects", "wear", "--effects", "a", "--plot", "a"), "read as --effects"),
        (("demo", "--model", "better.toml", "-o", "."), "read as --model"),
    ],
)  # fmt: skip
def test_no_command_overwrites_what_it_reads(cli, tmp_path, command, said):
    for name in ("a", "better.toml"):
        (tmp_path / name).write_text("whole")
    (tmp_path / "link").symlink_to("a")
    (tmp_path / "hard").hardlink_to(tmp_path / "a")
    before = sorted(tmp_path.iterdir())
    code, out, err = cli(*command)
    assert (code, out) == (2, "")
    assert said in err
    assert (tmp_path / "a").read_text() == (tmp_path / "better.toml").read_text() == "whole"
    assert sorted(tmp_path.iterdir()) == before


def test_every_path_of_a_command_is_known_as_read_or_written():
    """A path of a new command must be among what is written, or it counts as read."""
    read = {"logs", "holdout", "test", "effects", "files", "sources", "mapping", "log"}
    assert all(info.cls is Command for info in app.registered_commands)
    hints = [get_type_hints(info.callback) for info in app.registered_commands]
    paths = {name for own in hints for name, kind in own.items() if "Path" in str(kind)}
    assert paths == {*read, *OUTPUTS}


def test_wrong_use_names_the_help_of_its_command(cli):
    assert cli("fit")[2] == "twin: Missing argument 'MODEL'. See `twin fit --help`.\n"
    assert cli("simulat")[2].endswith("See `twin --help`.\n")


def test_the_help_says_what_the_logs_are_for(cli):
    for command, fits in (("fit", True), ("compare", False), ("check", False), ("new", False)):
        assert ("MCAP logs to fit on." in cli(command, "--help")[1]) is fits


def test_twin_alone_prints_the_help(cli):
    code, out, err = cli()
    assert (code, err) == (0, "")
    assert out.count("\n") > 10
    assert "diagnose" in out


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
