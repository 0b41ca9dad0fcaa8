"""A project: commands without arguments, a ledger, a step back, and a history that repeats it."""

import json
import shlex
import subprocess
import sys
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from cli_runs import refusal, twin

from identify.project import history
from identify.project.entries import AnswerEntry, ExportEntry, ModelEntry, Project
from identify.project.folder import Folder
from twin.logs import AxisLog, Log, write_log

T = np.arange(4000) / 1000.0
NAMES = ("run1.csv", "run $(touch made); 2.csv", "run3.csv")
SETS = ("--set", "axes.x.position.unit=mm", "axes.x.force.unit=N")


def recorded(path: Path, rate: float, seed: int) -> None:
    """4 s of a mass of 5 kg with Coulomb friction and a spring of 40 N/m."""
    noise = np.random.default_rng(seed)
    x = 0.05 * np.sin(rate * T) + 0.02 * np.sin(2.6 * rate * T)
    a = -(rate**2) * (0.05 * np.sin(rate * T) + 0.1352 * np.sin(2.6 * rate * T))
    force = 5.0 * a + 2.1 * np.sign(np.gradient(x)) + 40.0 * x + noise.normal(0.0, 0.05, len(T))
    x = x + noise.normal(0.0, 1e-7, len(T))
    columns = np.column_stack([T, 1e3 * x, force])
    np.savetxt(path, columns, "%.9g", ",", header="time_s,pos,force", comments="")


@pytest.fixture(scope="module")
def walked(tmp_path_factory) -> Path:
    """A project in which three recordings became a model with a spring."""
    folder = tmp_path_factory.mktemp("machine")
    for number, name in enumerate(NAMES):
        recorded(folder / name, 5.0 + number, number)
    for words in (
        ["project", "init"],
        ["import", NAMES[0], *SETS],
        ["import", NAMES[1], "--map", "logs/run1.map.toml"],
        ["import", NAMES[2], "--map", "logs/run1.map.toml"],
        ["new"],
        ["fit"],
        ["undo"],
        ["add", "spring"],
        ["export", "--to", "csv"],
    ):
        done = twin(*words, folder=folder)
        assert done.returncode == 0, done.stderr
    return folder


def ledger(folder: Path) -> dict:
    done = twin("log", "--json", folder=folder)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_commands_without_arguments_take_their_logs_by_role(walked):
    found = ledger(walked)
    assert [r["role"] for r in found["recordings"]] == ["training", "selection", "test"]
    first, last = found["models"]
    assert (last["base"], last["change"], last["proved"]) == (first["file"], ["spring"], True)
    command = shlex.split(next(a for a in found["answers"] if a["model"])["command"])
    assert command[3:6] == ["models/1.toml", found["recordings"][0]["file"], "--holdout"]


def test_only_a_diagnosis_of_the_present_model_tells_what_to_add(walked):
    said = twin("add", "--found", folder=walked).stderr
    assert "has no diagnosis of its present model; `twin diagnose` makes one" in said
    assert len(said.splitlines()) == 1


def test_the_error_in_the_ledger_is_that_of_the_command_outside(walked, tmp_path):
    logs = [str(walked / r["file"]) for r in ledger(walked)["recordings"]]
    roles = [logs[0], "--holdout", logs[1], "--test", logs[2]]
    words = ["add", "spring", walked / "models/1.toml", *roles, "-o", "b.toml", "--json"]
    outside = json.loads(twin(*words, folder=tmp_path).stdout)
    errors = {e["role"]: (e["before"], e["after"]) for e in ledger(walked)["models"][-1]["errors"]}
    assert errors["test"] == (outside["test_error_before"], outside["test_error_after"])
    assert errors["test"][1] < 0.5 * errors["test"][0]


@pytest.mark.slow  # nine processes
def test_the_history_repeats_it_in_an_empty_folder(walked, tmp_path):
    """Whatever is in the names of files."""
    program = tmp_path / "bin" / "twin"
    program.parent.mkdir()
    program.write_text(
        f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c "from identify.cli import main; main()"'
        ' "$@"\n'
    )
    program.chmod(0o755)
    again = tmp_path / "again"
    again.mkdir()
    subprocess.run(
        ["sh", str(walked / "history.sh")], cwd=again, check=True, capture_output=True,
        env={"PATH": f"{program.parent}:/usr/bin:/bin", "PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    models = [json.dumps(ledger(folder)["models"]) for folder in (again, walked)]
    # As many threads as here add up in another order.
    first, second = (json.loads(m, parse_float=lambda v: f"{float(v):.6g}") for m in models)
    assert first == second
    assert not (again / "made").exists()


def test_a_command_with_its_own_logs_leaves_the_project_alone(walked):
    before = (walked / "project.toml").read_bytes()
    log = ledger(walked)["recordings"][0]["file"]
    assert twin("check", log, folder=walked).returncode == 0
    assert (walked / "project.toml").read_bytes() == before


def test_a_map_that_is_not_complete_writes_nothing(tmp_path):
    recorded(tmp_path / "run.csv", 5.0, 0)
    twin("project", "init", folder=tmp_path)
    done = twin("import", "run.csv", "--set", "axes.x.position=nowhere", folder=tmp_path)
    assert done.returncode == 2
    assert "nowhere" in done.stderr
    assert [*(tmp_path / "logs").iterdir()] == []
    assert ledger(tmp_path)["recordings"] == []


def test_what_is_lacking_is_said_in_one_line(tmp_path):
    assert "is no project" in twin("log", folder=tmp_path).stderr
    twin("project", "init", folder=tmp_path)
    for words, said in (
        ("diagnose", "has no model yet; `twin new`"),
        ("new", "has no recording in role training selection; `twin import FILE`"),
        ("undo", "nothing was changed yet"),
        ("project init", "is a project already"),
        ("project role a.mcap --to test", "is no recording of this project; there are none yet"),
        ("add --found", "has no model yet"),
    ):
        done = twin(*words.split(), folder=tmp_path)
        assert done.returncode == 2
        assert said in done.stderr, words
        assert len(done.stderr.splitlines()) == 1


def test_logs_are_taken_given_roles_left_and_taken_back(tmp_path):
    for name in ("a b.mcap", "b.mcap", "c.mcap"):
        position, force = np.random.default_rng(len(name)).standard_normal((2, 1000))
        axis = AxisLog({"position": position, "force": force})
        write_log(Log(1000.0, {"x": axis}), tmp_path / name)
    told = {}
    for words in (
        ["project", "init"], ["project", "take", "a b.mcap", "b.mcap", "--to", "test"],
        ["project", "role", "a b.mcap", "--to", "training"], ["project", "leave", "b.mcap"],
        ["undo"], ["project", "take", "c.mcap", "b.mcap"],  # which keeps its role
    ):  # fmt: skip
        done = twin(*words, "--json", folder=tmp_path)
        assert done.returncode == 0, done.stderr
        told = json.loads(done.stdout)
    roles = {r["file"]: r["role"] for r in told["recordings"]}
    assert roles == {"a b.mcap": "training", "c.mcap": "selection", "b.mcap": "test"}
    assert told["history"] == [
        "twin project init", "twin project take 'a b.mcap' b.mcap --to test",
        "twin project role 'a b.mcap' --to training", "twin project leave b.mcap", "twin undo",
        "twin project take c.mcap b.mcap",
    ]  # fmt: skip
    for words, said in (
        (["role", "b.mcap", "--to", "tests"], "--to tests: give training, selection or test"),
        (["take", "b.mcap", "--to", "none"], "--to none: give training, selection or test"),
        (["role", "d.mcap", "--to", "test"], "d.mcap: "),
        (["leave", "d.mcap", "b.mcap"], "b.mcap, d.mcap: not all are recordings of this project"),
        (["take", "d.mcap"], "d.mcap"),
    ):
        assert refusal("project", *words, folder=tmp_path).startswith(f"twin: {said}")


def exported(name: str):
    return lambda project: project.model_copy(
        update={"exports": [*project.exports, ExportEntry(format=name)]}
    )


def test_what_a_command_asks_for_by_itself_is_said_as_elsewhere(walked):
    assert "Missing option '--to'" in refusal("export", folder=walked)


def test_of_two_writers_neither_overwrites_the_other(tmp_path):
    Folder(tmp_path).begin()

    def write(name: str) -> None:
        for _ in range(8):
            Folder(tmp_path).change(exported(name))

    writers = [Thread(target=write, args=(name,)) for name in ("a", "b")]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    found = [e.format for e in Folder(tmp_path).read().exports]
    assert sorted(found) == ["a"] * 8 + ["b"] * 8


def test_a_free_name_has_the_number_behind_the_last_of_its_kind(tmp_path):
    """Whatever its zeros and its ending: what is beside an answer has its number too."""
    folder = Folder(tmp_path)
    assert folder.free_name("answers", "{}-fit.json") == Path("answers/1-fit.json")
    for name in ("2-fit.json", "007-fit.json", "11-check.json", "a12-fit.json", "9-fit.json.new"):
        (tmp_path / "answers" / name).touch()
    assert folder.free_name("answers", "{}-fit.json") == Path("answers/10-fit.json")
    assert folder.free_name("answers", "{}-check.json") == Path("answers/12-check.json")


def test_an_edit_by_hand_is_one_step_back(tmp_path):
    folder = Folder(tmp_path)
    folder.begin()
    folder.change(exported("a"))
    folder.file.write_text(Project().text() + '[[exports]]\nformat = "mine"\n')
    folder.change(exported("b"))
    kept = [[e.format for e in folder.undo().exports] for _ in range(3)]
    assert kept == [["mine"], ["a"], []]


def test_an_answer_alone_is_no_step_back(tmp_path):
    folder = Folder(tmp_path)
    folder.begin()
    folder.change(exported("a"))
    entry = AnswerEntry(command="twin check", file="answers/1.json")
    folder.change(lambda p: p.model_copy(update={"answers": [entry]}))
    assert folder.read().answers == [entry]
    assert folder.undo() == Project()


def test_a_second_command_waits_and_says_for_whom(tmp_path):
    folder, told = Folder(tmp_path), []
    folder.begin()
    with folder.working("twin diagnose"):
        assert folder.worker() == "twin diagnose"
        second = Thread(target=lambda: folder.working("twin add", told.append).__enter__())
        second.start()
        while not told:
            assert second.is_alive()
    second.join(timeout=5.0)
    assert told == ["twin diagnose"]


def test_a_command_that_failed_does_not_end_the_history(tmp_path):
    folder = Folder(tmp_path)
    folder.begin()
    history.note(folder, ["check", "a.mcap"], ends_well=False)
    history.note(folder, ["fit"])
    assert (tmp_path / history.HISTORY).read_text().splitlines()[-2:] == [
        "twin check a.mcap || true", "twin fit",
    ]  # fmt: skip
    assert history.commands(folder) == ["twin check a.mcap", "twin fit"]


def test_the_last_answer_of_a_kind_about_the_present_model():
    models = [ModelEntry(file="models/1.toml"), ModelEntry(file="models/2.toml")]
    asked = (("diagnose", 2), ("diagnose", 1), ("compare", 2), ("diagnose", 2), ("compare", 2))
    answers = [
        AnswerEntry(
            command=f"twin {kind} models/{n}.toml", file=f"{i}.json", model=f"models/{n}.toml"
        )
        for i, (kind, n) in enumerate(asked)
    ]
    found = Project(models=models, answers=answers)
    assert found.answer("diagnose") is answers[3]
    assert found.answer("plan") is None
