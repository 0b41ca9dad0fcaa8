"""`twin import FILE` without a map: it proposes, shows, asks, writes the map, and proves it."""

import json
import os
import re
import select
import sys
from pathlib import Path

import numpy as np
import pytest
from cli_runs import refusal, twin
from import_cases import write_csv
from strict_json import valid

from twin.errors import Unwritten
from twin.importers import load_mapping
from twin.logs import read_log

T = np.arange(6000) / 1000.0
MASS, COULOMB = 5.0, 2.1  # kg, N
X = 0.05 * np.sin(5.0 * T) + 0.02 * np.sin(13.0 * T)
V = 0.25 * np.cos(5.0 * T) + 0.26 * np.cos(13.0 * T)
F = MASS * (-1.25 * np.sin(5.0 * T) - 3.38 * np.sin(13.0 * T)) + COULOMB * np.sign(V)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return written(tmp_path, "time_s,pos_mm,force_N", 1e3 * X, F)


def written(folder: Path, names: str, *columns: np.ndarray) -> Path:
    path = folder / "run 1.csv"
    np.savetxt(path, np.column_stack([T, *columns]), "%.9g", ",", header=names, comments="")
    return path


def test_without_a_terminal_it_shows_what_it_proposes_and_writes_nothing(recording):
    done = twin("import", recording.name, folder=recording.parent)
    assert done.returncode == 1
    position = next(x for x in done.stdout.splitlines() if x.startswith("pos_mm"))
    for said in (" mm ", "-70 to 70", " x: position ", "sure", "▁", "so called"):
        assert said in position
    assert "nothing is written; --yes takes this map, --map MAP another" in done.stdout
    assert [p.name for p in recording.parent.iterdir()] == [recording.name]


@pytest.mark.parametrize("out", [None, "b.mcap"])
def test_entries_that_are_set_are_in_the_log_which_has_the_recordings_name_or_its_own(
    recording, out
):
    given = ("--set", "axes.x.position.sign=-1", "axes.x.force.offset=2.5")
    chosen = () if out is None else ("-o", out)
    done = twin("import", recording.name, *given, *chosen, folder=recording.parent)
    assert done.returncode == 0, done.stderr
    made = recording.parent / (out or "run 1.mcap")
    assert sorted(p.name for p in recording.parent.iterdir()) == sorted(
        [recording.name, made.name, f"{made.stem}.map.toml"]
    )
    axis = read_log(made).axes["x"]
    assert axis.position == pytest.approx(-X, abs=1e-9)
    assert axis.force == pytest.approx(F + 2.5, abs=1e-6)


def test_yes_writes_log_and_map_and_says_what_they_prove(recording):
    folder = recording.parent
    done = twin("import", recording.name, "--yes", "-o", "run.mcap", folder=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert re.search(
        r"axis x, with this map: moved mass 5.0\d kg, friction 2.1\d N, force explained to 100 %; "
        r"with the sign reversed it would be \d+ %", done.stdout,
    )  # fmt: skip
    log = read_log(folder / "run.mcap")
    assert log.axes["x"].force == pytest.approx(F, abs=1e-6)
    assert load_mapping(folder / "run.map.toml").text == log.metadata["import_map"]
    again = twin("import", recording.name, "--map", "run.map.toml", "-o", "b.mcap", folder=folder)
    assert again.returncode == 0


def test_its_answer_as_json(recording):
    folder = recording.parent
    shown = twin("import", recording.name, "--json", folder=folder)
    answer = valid(json.loads(shown.stdout))
    assert [c["field"] for c in answer["columns"]] == ["position", "force"]
    done = twin("import", recording.name, "--yes", "--json", folder=folder)
    answer = valid(json.loads(done.stdout))
    assert answer["map"] == "run 1.map.toml"
    assert answer["proofs"]["x"]["explained"] > 0.99


def test_a_column_that_is_taken_for_nothing_is_shown(tmp_path):
    noise = np.random.default_rng(1).normal(size=len(T))
    path = written(tmp_path, "time_s,pos_mm,force_N,x7", 1e3 * X, F, noise)
    answer = valid(json.loads(twin("import", path.name, "--json", folder=tmp_path).stdout))
    taken = {c["column"]: (c["axis"], c["field"]) for c in answer["columns"]}
    assert taken == {"pos_mm": ("x", "position"), "force_N": ("x", "force"), "x7": (None, None)}


def test_what_is_not_known_is_left_open_and_asked_for(tmp_path):
    written(tmp_path, "t,pos [mm],torque [%]", 1e3 * X, F)
    done = twin("import", "run 1.csv", "--yes", folder=tmp_path)
    assert done.returncode == 1
    assert "the log is not written, for what is said above" in done.stdout
    assert "N for one of torque [%]" in done.stderr
    assert not (tmp_path / "run 1.mcap").exists()
    assert "scale NOT KNOWN: N for one" in (tmp_path / "run 1.map.toml").read_text()


def typed(folder: Path, arguments: list[str], answers: list[str]) -> tuple[str, int]:
    """What a command writes on a terminal on which these answers are typed, and its exit code."""
    import pty

    run = "from identify.cli import main; main()"
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(folder)
        os.execv(sys.executable, [sys.executable, "-c", run, *arguments])
    said = b""
    while select.select([terminal], [], [], 60.0)[0]:
        try:
            read = os.read(terminal, 1 << 16)
        except OSError:
            break
        said += read
        if said.endswith(b"] ") and answers:
            os.write(terminal, f"{answers.pop(0)}\n".encode())
    return said.decode().replace("\r", ""), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no terminal to be had there")
def test_on_a_terminal_it_asks_for_what_is_not_known(tmp_path):
    written(tmp_path, "t,pos,torque [%]", 1e3 * X, F)
    answers = ["mm", "much", "0.5", "y"]
    said, code = typed(tmp_path, ["import", "run 1.csv", "-o", "a.mcap"], answers)
    assert code == 0, said
    assert "x: the unit of pos [" in said
    assert "'much' is not a number" in said
    assert "moved mass 2.50 kg" in said
    axis = load_mapping(tmp_path / "a.map.toml").axes["x"]
    assert axis.position is not None
    assert axis.force is not None
    assert (axis.position.unit, axis.force.scale) == ("mm", 0.5)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no terminal to be had there")
def test_on_a_terminal_the_rate_is_asked_for_and_counts_of_an_axis_that_travels(tmp_path):
    """Counts a turn made it a rotary axis, whatever was answered."""
    columns = np.column_stack([np.round(1e6 * X), F / 20.0])
    head = "encoder (counts),current (A)"
    np.savetxt(tmp_path / "a.csv", columns, "%.9g", ",", header=head, comments="")
    answers = ["often", "1000", "1e6 per turn", "1e6 per metre", "20", "y"]
    said, code = typed(tmp_path, ["import", "a.csv", "-o", "a.mcap"], answers)
    assert code == 0, said
    assert "'often' is not a number" in said
    assert "'1e6 per turn' is not a number" in said
    assert "moved mass 5.0" in said
    mapping = load_mapping(tmp_path / "a.map.toml")
    assert mapping.sample_rate == 1000.0
    position = mapping.axes["x"].position
    assert position is not None
    assert (position.counts_per_metre, position.counts_per_turn) == (1e6, None)


def test_an_edited_map_or_model_is_kept_when_it_is_written_over(recording):
    folder = recording.parent
    first = ("import", "--guess", recording.name, "-o", "map.toml")
    assert twin(*first, folder=folder).returncode == 0
    assert twin(*first, folder=folder).stderr == ""  # the same again loses nothing
    for number, kept in enumerate(("map.toml~", "map.toml~2")):
        (folder / "map.toml").write_text(f"# mine, {number}\n")
        done = twin(*first, folder=folder)
        assert f"map.toml: what was there is kept as {kept}" in done.stderr
        assert (folder / kept).read_text() == f"# mine, {number}\n"
    assert twin("import", recording.name, "--map", "map.toml", "-o", "a.mcap",
                folder=folder).returncode == 0  # fmt: skip
    (folder / "m.toml").write_text("# my model\n")
    done = twin("new", "a.mcap", "-o", "m.toml", folder=folder)
    assert "m.toml: what was there is kept as m.toml~" in done.stderr
    assert (folder / "m.toml~").read_text() == "# my model\n"


def test_an_import_says_what_its_signals_contradict(recording):
    folder = recording.parent
    text = (
        'time = {column = "time_s", unit = "s"}\n[axes.x]\n'
        'position = {column = "pos_mm", unit = "mm"}\n'
        'force = {column = "force_N", unit = "N", sign = -1}\n'
    )
    (folder / "map.toml").write_text(text)
    done = twin("import", recording.name, "--map", "map.toml", "-o", "a.mcap", folder=folder)
    assert done.returncode == 0
    assert "map.toml: warning: axes.x: the motion explains 57 % of the force" in done.stderr
    assert "give the force or the position sign = -1" in done.stderr


def test_an_import_by_a_map_says_what_its_clock_did(tmp_path):
    micros = (2**32 - 5 * 10**5 + 1000 * np.arange(2000)) % 2**32
    place = np.sin(0.006 * np.arange(2000))
    write_csv(tmp_path / "a.csv", {"us": micros, "m": place, "N": 2.0 * np.cos(place)})
    (tmp_path / "map.toml").write_text(
        'time = {column = "us", unit = "us"}\n[axes.x]\n'
        'position = {column = "m", unit = "m"}\nforce = {column = "N", unit = "N"}\n'
    )
    done = twin("import", "a.csv", "--map", "map.toml", "-o", "a.mcap", folder=tmp_path)
    assert done.stdout == "a.mcap: 2000 samples at 1000 Hz\n"
    assert "the roll-over of a counter of 32 bits is taken out" in done.stderr


def test_nothing_is_fitted_to_a_force_that_works_on_friction(tmp_path):
    """A part of the command, of which the feedforward of friction is missing, is no force."""
    t = 0.002 * np.arange(4000)
    place = 0.1 * np.sin(2.0 * t) + 0.03 * np.sin(7.0 * t)
    speed = np.gradient(place, 0.002)
    force = 5.0 * np.gradient(speed, 0.002) + 8.0 * speed - 1.0 * np.sign(speed)
    write_csv(tmp_path / "a.csv", {"t": t, "m": place, "N": force})
    (tmp_path / "map.toml").write_text(
        'time = {column = "t", unit = "s"}\n[axes.x]\n'
        'position = {column = "m", unit = "m"}\nforce = {column = "N", unit = "N"}\n'
    )
    done = twin("import", "a.csv", "--map", "map.toml", "-o", "a.mcap", folder=tmp_path)
    assert "negative friction" in done.stderr
    assert twin("check", "a.mcap", folder=tmp_path).returncode == 1
    said = refusal("new", "a.mcap", "-o", "m.toml", folder=tmp_path)
    assert "map the whole force; nothing is fitted to it" in said


def test_what_cannot_be_proposed_is_refused_in_a_line(recording):
    folder = recording.parent
    assert "2 files; give one at a time" in refusal(
        "import", recording.name, recording.name, folder=folder
    )
    assert "give -o LOG" in refusal("import", recording.name, "--map", "m.toml", folder=folder)


def test_on_a_disk_that_fills_meanwhile_the_answer_is_told_all_the_same(recording, monkeypatch):
    def fills(_model, path):
        raise Unwritten(f"{path}: cannot be written: No space left on device")

    folder = recording.parent
    assert twin("import", recording.name, "--yes", "-o", "a.mcap", folder=folder).stdout
    assert twin("new", "a.mcap", "-o", "m.toml", folder=folder).returncode == 0
    monkeypatch.setattr("twin.model.file.save_model", fills)
    done = twin("fit", "m.toml", "a.mcap", "-o", "f.toml", folder=folder)
    assert done.returncode == 2
    assert "force error on the training logs" in done.stdout
    assert (
        done.stderr.splitlines()[-1] == "twin: f.toml: cannot be written: No space left on device"
    )
