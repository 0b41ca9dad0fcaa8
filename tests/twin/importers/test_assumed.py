"""What a map assumes is said until it is confirmed; every column and value of a file is listed."""

from __future__ import annotations

import json

import cli_runs
import numpy as np
import pytest
from import_cases import mapping, write_csv
from scipy.io import savemat

from twin.checks import Fault, check_log
from twin.checks.content import assumptions
from twin.importers import import_log
from twin.importers.guess import guess_map
from twin.logs import read_log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, MachineModel

T = np.arange(4000) / 1000.0
Q = 0.05 * np.sin(5.0 * T) + 0.02 * np.sin(13.0 * T)
V = 0.25 * np.cos(5.0 * T) + 0.26 * np.cos(13.0 * T)
F = -3.0 * np.gradient(V, T) + 2.0 * np.sign(V) + 5.0 * V
COLUMNS = {"t [s]": T, "position": Q, "force [N]": F, "temperature": 20.0 + 0.0 * T}


def assumed(log) -> list[str]:
    return [f.what for f in check_log(log).findings if f.fault is Fault.ASSUMED]


@pytest.fixture
def guessed(tmp_path):
    write_csv(tmp_path / "a.csv", COLUMNS)
    (tmp_path / "map.toml").write_text(guess_map(tmp_path / "a.csv").text, encoding="utf-8")
    return tmp_path


def test_an_assumed_unit_is_said_of_the_log_and_of_its_file_until_confirmed(guessed):
    text = (guessed / "map.toml").read_text(encoding="utf-8")
    assert "ASSUMED" in text
    log = import_log(guessed / "a.csv", mapping(guessed, text))
    (what,) = assumed(log)
    assert what.startswith("the import map assumes position in ")
    write_log(log, guessed / "a.mcap")
    assert assumed(read_log(guessed / "a.mcap")) == [what]
    confirmed = text.replace("; unit ASSUMED", "")
    assert assumed(import_log(guessed / "a.csv", mapping(guessed, confirmed))) == []


def test_import_check_and_the_report_say_it(guessed):
    said = cli_runs.twin("import", "a.csv", "--map", "map.toml", "-o", "a.mcap", folder=guessed)
    assert said.returncode == 0
    assert "the import map assumes position in" in said.stderr
    said = cli_runs.twin("check", "a.mcap", folder=guessed)
    assert "the import map assumes position in" in said.stdout
    save_model(MachineModel("plain", {"x": AxisModel(3.0)}, 1000.0), guessed / "m.toml")
    said = cli_runs.twin("compare", "m.toml", "a.mcap", "-o", "r.html", folder=guessed)
    assert said.returncode == 0, said.stderr
    head = (guessed / "r.html").read_text(encoding="utf-8").partition("<h2")[0]
    assert "the import map assumes position in" in head


def test_a_map_by_hand_assumes_nothing_and_comments_are_no_entries():
    text = '# correct what is ASSUMED\n[axes.x]\nposition = {column = "q", unit = "m"} # known\n'
    assert assumptions(text, "x") == []
    text = 'sample_rate = 1000.0 # Hz, ASSUMED\n[axes.x]\nforce = {unit = "N"} # ASSUMED\n'
    assert assumptions(text, "x") == ["sample_rate = 1000.0", "force in N"]
    assert assumptions(text, "y") == ["sample_rate = 1000.0"]


@pytest.mark.parametrize("ending", ["csv", "mat", "json"])
def test_every_column_and_value_is_in_the_map(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    values = {"gain": 35.15, "note": "run 7"}
    extra = {"short": [1.0, 2.0, 4.0]}
    if ending == "csv":
        values = extra = {}
        write_csv(path, COLUMNS)
    elif ending == "mat":
        named = {n.split()[0]: c for n, c in COLUMNS.items()}
        savemat(path, {**named, **values, **extra})
    else:
        columns = {n: c.tolist() for n, c in COLUMNS.items()}
        path.write_text(json.dumps({**columns, **values, **extra}))
    text = guess_map(path).text
    assert "# not used: temperature = 20 throughout" in text
    if values:
        assert "# not used: gain = 35.15\n" in text
        assert "# not used: note (no numbers)" in text
        assert "# not used: short (3 rows, 1 to 4)" in text
    assert import_log(path, mapping(tmp_path, text)).axes
