"""The command line as a user meets it: exit codes, JSON by itself, what a call gives, failures."""

from __future__ import annotations

import json
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
from cli_runs import RATE, in_small, refusal, twin
from planted_logs import SLIDE, Ride, having, logged
from strict_json import strict, valid

from identify import adding, workflow
from identify.cli import main
from identify.cli.command import OUTPUTS, Command
from identify.cli.shared import CheckedRecordings, Recordings, app
from identify.output import as_json
from identify.output.blocks import blocks_of
from identify.output.machine import briefly
from identify.output.text import to_text
from identify.output.words.next_step import Source
from twin.checks import check_log
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.experiments.file import load_experiment
from twin.logs import AxisLog, Log, read_log, write_log
from twin.model.file import load_model, models_folder, save_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate

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


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("effects coging", ["'cogging'"]),
        ("effects my_effect", ["a file of your own can be added"]),
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
def test_every_failure_is_one_line_and_an_exit_code(monkeypatch, tmp_path, error, said):
    def fails(*_: object) -> None:
        raise error

    monkeypatch.delenv("TWIN_TRACEBACK", raising=False)
    monkeypatch.setattr("twin.effects.load_catalogue", fails)
    done = twin("effects", "--json", folder=tmp_path)
    interrupted = isinstance(error, KeyboardInterrupt)
    assert done.returncode == (130 if interrupted else 2)
    assert done.stderr.startswith(said)
    assert done.stderr.count("\n") == 1
    told = valid(json.loads(done.stdout)) if done.stdout else None
    assert told == (None if interrupted else {"error": done.stderr[6:-1]})
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
def test_what_cannot_be_written_is_said_before_the_work(tmp_path, command, said):
    assert said in refusal(*shlex.split(command), folder=tmp_path)


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
def test_no_command_overwrites_what_it_reads(tmp_path, command, said):
    for name in ("a", "better.toml"):
        (tmp_path / name).write_text("whole")
    (tmp_path / "link").symlink_to("a")
    (tmp_path / "hard").hardlink_to(tmp_path / "a")
    assert said in refusal(*command.split(), folder=tmp_path)
    assert (tmp_path / "a").read_text() == (tmp_path / "better.toml").read_text() == "whole"


def test_every_path_of_a_command_is_known_as_read_or_written():
    """A path of a new command must be among what is written, or it counts as read."""
    read = {"logs", "holdout", "test", "effects", "files", "sources", "mapping", "log", "mjcf"}
    assert all(info.cls is Command for info in app.registered_commands)
    hints = [get_type_hints(info.callback) for info in app.registered_commands]
    paths = {name for own in hints for name, kind in own.items() if "Path" in str(kind)}
    assert paths == {*read, *OUTPUTS}


def test_help_is_where_it_is_looked_for(tmp_path):
    wrong = refusal("fit", folder=tmp_path), refusal("simulat", folder=tmp_path)
    assert wrong[0] == "twin: Missing argument 'MODEL'. See `twin fit --help`."
    assert wrong[1].endswith("See `twin --help`.")
    for command, fits in (("fit", True), ("compare", False), ("check", False), ("new", False)):
        asked = twin(command, "--help", folder=tmp_path).stdout
        assert ("MCAP logs to fit on." in asked) is fits
    done = twin(folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("\n") > 10
    assert "diagnose" in done.stdout
    assert "selftest" not in done.stdout


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


def test_no_duration_is_refused_before_setpoints_are_written(tmp_path):
    said = refusal("simulate", "tracking", "--duration", 0, "--setpoints", "s.csv", folder=tmp_path)
    assert "duration" in said
    assert not [*tmp_path.iterdir()]


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


OWN = Path(__file__).parents[2] / "examples" / "my_effect.py"
HELD, TESTED = ("--holdout", "b.mcap"), ("--test", "c.mcap")
COMMON = ("--test-function", "0.07")
TYPED = (*COMMON, "--effects", str(OWN))  # that the next command needs as well


FEW = ("coulomb_viscous", "quadratic_drag", "cogging", "wear", OWN.stem)


def few(user_files=()) -> Catalogue:
    """The catalogue in small, so that a diagnosis takes seconds."""
    return Catalogue([e for n, e in load_catalogue(user_files).items() if n in FEW])


@pytest.fixture(scope="module")
def slide(tmp_path_factory) -> Path:
    """A model of one axis, and logs of it with a drag that it lacks."""
    path = tmp_path_factory.mktemp("machine")
    save_model(MachineModel("slide", {"x": SLIDE}, 1000.0), path / "m.toml")
    dragged = having(SLIDE, "quadratic_drag", c=3.0)
    for seed, name in enumerate("abc", start=1):
        write_log(logged(dragged, Ride(seed, 4.0)), path / f"{name}.mcap")
    return path


def logs_of(slide: Path, *names: str) -> dict:
    return {f"{n}.mcap": read_log(slide / f"{n}.mcap") for n in names}


def called(name: str, slide: Path) -> object:
    """The call from Python that a command with HELD, TESTED and COMMON stands for."""
    catalogue = few([OWN] if name == "diagnose" else ())
    model = load_model(slide / "m.toml", catalogue)
    fit, held, test = (logs_of(slide, n) for n in "abc")
    if name == "compare":
        return workflow.compare(model, fit, test_function=0.07)
    if name == "plan":
        between = [catalogue["quadratic_drag"], catalogue["cogging"]]
        return workflow.plan(
            model, fit, held, between=between, catalogue=catalogue, axis="x", duration=3.0,
            test_function=0.07,
        )  # fmt: skip
    if name == "add":
        effect = catalogue["quadratic_drag"]
        return adding.add(effect, model, fit, held, test, axis="x", test_function=0.07)
    call = {"fit": workflow.fit, "diagnose": workflow.diagnose}[name]
    return call(model, fit, held, test, catalogue=catalogue, test_function=0.07)


ARGUMENTS = {
    "fit": ("m.toml", "a.mcap", *HELD, *TESTED),
    "compare": ("m.toml", "a.mcap"),
    "diagnose": ("m.toml", "a.mcap", *HELD, *TESTED, "--effects", OWN),
    "add": ("quadratic_drag", "m.toml", "a.mcap", *HELD, *TESTED, "--axis", "x"),
    "plan": ("m.toml", "a.mcap", *HELD, "--between", "quadratic_drag", "cogging", "--axis", "x",
             "--duration", "3"),
}  # fmt: skip
OUT = {"fit": "f.toml", "add": "n.toml", "plan": "e.toml"}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_command_tells_and_writes_what_its_call_gives(slide, name, monkeypatch):
    monkeypatch.setattr("twin.effects.load_catalogue", few)
    out = OUT.get(name, f"{name}.html")
    done = twin(name, *ARGUMENTS[name], *COMMON, "-o", out, "--json", folder=slide)
    found = called(name, slide)
    wanted, told = strict(as_json.json_of(found)), json.loads(done.stdout)
    added = {"left_out", "data_faults", "file", "setpoints"}
    assert {k: v for k, v in told.items() if k not in added} == {
        k: v for k, v in wanted.items() if k not in added
    }
    valid(told)
    assert done.returncode == 0, done.stderr
    assert (slide / out).is_file()
    text = twin(name, *ARGUMENTS[name], *COMMON, "-o", out, folder=slide).stdout
    source = () if name != "diagnose" else (Source(model="m.toml", options=TYPED),)
    assert text.startswith(to_text(blocks_of(found, *source)))
    if name == "add":
        assert (found.position_error_on is None) == (found.position_error is None)
    if name in ("fit", "add"):
        again = load_model(slide / out, load_catalogue())
        assert again.axes["x"].names == found.model.axes["x"].names
        assert again.axes["x"].mass == pytest.approx(found.model.axes["x"].mass)
    if name == "plan":
        assert (found.favoured_by_the_logs, found.supposed) == ("quadratic_drag", False)
        assert found.gap.share is not None
        assert load_experiment(slide / out) == found.chosen.experiment
        assert f"twin simulate {out}" in text
        assert (slide / told["setpoints"]).name == "e.setpoints.csv"
        assert (slide / told["setpoints"]).is_file()
    if out.endswith(".html"):
        assert (slide / out).read_text(encoding="utf-8").count("<section") > 3


def test_a_simulation_is_that_of_its_seed_duration_and_axis(slide):
    asked = ("--model", "m.toml", "--seed", "5", "--duration", "1.5", "--axis", "x")
    done = twin("simulate", "cable_pass", *asked, "-o", "r.mcap", "--json", folder=slide)
    log = read_log(slide / "r.mcap")
    assert valid(json.loads(done.stdout)) == {
        "log": "r.mcap", "samples": len(log), "sample_rate": 1000.0, "unit": "Hz",
        "setpoints": None,
    }  # fmt: skip
    model = load_model(slide / "m.toml", load_catalogue())
    wanted = simulate(model, "cable_pass", seed=5, duration=1.5, axis="x")
    np.testing.assert_array_equal(log.axes["x"].position, wanted.axes["x"].position)


def test_the_catalogue_is_printed_and_one_effect_drawn(tmp_path):
    every = json.loads(twin("effects", "--json", folder=tmp_path).stdout)["effects"]
    assert [e["name"] for e in every] == list(load_catalogue())
    one = valid(json.loads(twin("effects", "wear", "--json", folder=tmp_path).stdout))
    assert one in every
    done = twin("effects", "--plot", "w.svg", folder=tmp_path)
    said = "twin: --plot w.svg: draws one effect; give its NAME\n"
    assert (done.returncode, done.stderr) == (2, said)
    assert "wear" in twin("effects", "wear", "--plot", "w.svg", folder=tmp_path).stdout
    assert "<svg" in (tmp_path / "w.svg").read_text(encoding="utf-8")


def test_a_check_ends_with_one_where_a_log_is_unfit(slide):
    log = read_log(slide / "a.mcap")
    log.axes["x"].columns["force"][:] *= -1.0  # of the other sign
    write_log(log, slide / "h.mcap")
    for first, code in (("h.mcap", 1), ("a.mcap", 0)):
        done = twin("check", first, "b.mcap", "--json", folder=slide)
        told = json.loads(done.stdout)
        assert (done.returncode, told["ok"]) == (code, code == 0)
        assert list(told["logs"]) == [first, "b.mcap"]
