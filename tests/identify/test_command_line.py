"""The command line as a user meets it: exit codes, JSON by itself, errors of one line."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_runs import RATE, in_small, refusal, twin

from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.logs import AxisLog, Log, write_log
from twin.model.file import load_model


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    """A folder with a short log of the twin."""
    folder = tmp_path_factory.mktemp("logs")
    model = replace(load_model("proton_xy", load_catalogue()), sample_rate=RATE)
    write_log(simulate(model, "tracking", seed=3, duration=4.0), folder / "log.mcap")
    return folder


@pytest.fixture
def folder(recorded, tmp_path) -> Path:
    """An empty folder with a link to the log."""
    (tmp_path / "log.mcap").write_bytes((recorded / "log.mcap").read_bytes())
    return tmp_path


def axis_log(**columns: np.ndarray) -> Log:
    return Log(1000.0, {"x": AxisLog(columns)})


def test_the_documented_keys_of_diagnose_are_there(folder):
    with in_small("quadratic_drag"):
        done = twin("diagnose", "proton_xy", "log.mcap", "--json", folder=folder)
    answer = json.loads(done.stdout)
    keys = "verdict effect ranking ambiguous_with findings also_seen unexplained remainder"
    assert {*keys.split(), "noise_floor", "noise_floors", "parameters"} <= set(answer)
    assert answer["verdict"] == "nothing_missing"


def test_unknown_names_suggest_the_nearest(folder):
    assert "'cogging'" in refusal("effects", "coging", folder=folder)
    assert "'tracking'" in refusal("simulate", "traking", folder=folder)
    assert "'cogging'" in refusal(
        "add", "coging", "proton_xy", "log.mcap", "-o", "b.toml", folder=folder
    )
    assert "proton_xy.toml" in refusal("fit", "proton_yx", "log.mcap", folder=folder)
    assert "proton_xy.toml" in refusal("fit", "no/proton_xy.toml", "log.mcap", folder=folder)
    for far in ("m.toml", "cogging"):
        assert "package has" not in refusal("fit", far, "log.mcap", folder=folder)
    assert "--effects FILE adds your own" in refusal("effects", "my_effect", folder=folder)


@pytest.mark.parametrize("value", ["-1.0", "nan", "1e16"])
def test_a_parameter_out_of_bounds_is_refused_with_its_unit(folder, value):
    text = load_text().replace("Fc = 0.285", f"Fc = {value}")
    (folder / "bad.toml").write_text(text)
    line = refusal("fit", "bad.toml", "log.mcap", folder=folder)
    assert "Fc" in line
    assert " N" in line


def load_text() -> str:
    from twin.model.file import models_folder

    return (models_folder() / "proton_xy.toml").read_text()


def test_files_that_are_no_logs_are_refused(folder):
    assert "nowhere.mcap" in refusal("fit", "proton_xy", "nowhere.mcap", folder=folder)
    (folder / "text.mcap").write_text("no log")
    assert "text.mcap" in refusal("compare", "proton_xy", "text.mcap", folder=folder)
    whole = (folder / "log.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    assert "twin recover" in refusal("diagnose", "proton_xy", "cut.mcap", folder=folder)


def test_a_truncated_log_can_be_recovered(folder):
    whole = (folder / "log.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    result = twin("recover", "cut.mcap", "-o", "good.mcap", "--json", folder=folder)
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["lost"]
    assert (told["log"], told["others"]) == ("good.mcap", [])
    assert twin("compare", "proton_xy", "good.mcap", folder=folder).returncode == 0


def test_a_log_of_another_axis_is_refused(folder):
    ramp = np.linspace(0.0, 0.1, 4000) ** 2
    log = axis_log(position=ramp, force=ramp)
    write_log(Log(1000.0, {"z": log.axes["x"]}), folder / "z.mcap")
    assert "axis" in refusal("fit", "proton_xy", "z.mcap", folder=folder)


def test_current_without_a_force_constant_is_refused(folder):
    ramp = np.linspace(0.0, 0.1, 4000) ** 2
    write_log(axis_log(position=ramp, current=ramp), folder / "current.mcap")
    assert "force constant (N/A)" in refusal("fit", "proton_xy", "current.mcap", folder=folder)


def test_a_setpoint_outside_the_travel_is_refused(folder):
    narrow = load_text().replace("travel = [-0.17, 0.17]", "travel = [0.17, -0.17]")
    (folder / "narrow.toml").write_text(narrow)
    assert "travel" in refusal("simulate", "tracking", "--model", "narrow.toml", folder=folder)


def test_a_drive_too_weak_for_its_motion_is_told_of(tmp_path):
    weak = load_text().replace("force_limit = 200.0", "force_limit = 8.0", 1)
    (tmp_path / "weak.toml").write_text(weak)
    command = ("simulate", "tracking", "--duration", 3, "--seed", 2)
    ran = twin(*command, "--model", "weak.toml", folder=tmp_path)
    assert ran.returncode == 0
    (line,) = ran.stderr.splitlines()
    assert "axis x" in line
    assert "outside its travel" in line
    assert twin(*command, folder=tmp_path).stderr == ""


def test_adding_what_the_data_do_not_support_is_said_with_exit_code_one(folder):
    result = twin(
        "add", "quadratic_drag", "proton_xy", "log.mcap", "-o", "b.toml", "--json", folder=folder
    )
    assert result.returncode == 1
    assert json.loads(result.stdout)["kept"] is False


@pytest.mark.parametrize(
    ("command", "where"),
    [
        (("reproduce",), "`make thesis` or `python -m studies.thesis`"),
        (("reproduce", "--chapter", "cable", "--log", "a", "b"), "`python -m studies.thesis`"),
        (("selftest", "--help"), "`make selftest` or `python -m benchmarks selftest`"),
        (("selftest", "--case", "cogging@5/cable/17"), "`python -m benchmarks selftest`"),
    ],
)
def test_what_was_a_command_is_told_where_it_went(tmp_path, command, where):
    assert where in refusal(*command, folder=tmp_path)
    assert command[0] not in twin("--help", folder=tmp_path).stdout
