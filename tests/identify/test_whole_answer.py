"""The final model is the answer: nothing is in it without a name, and the user gets all of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import pytest
from cli_runs import refusal, twin
from planted_logs import RATE, SLIDE, Ride, begun, few, having, logged

from identify import add_found
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.workflow import fit
from twin.logs import Log, read_log, write_log
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, MachineModel

KNOWN = ("cogging", "spring", "quadratic_drag", "payload_mass", "constant_force")
ROLES = ("a.mcap", "--holdout", "b.mcap", "--test", "c.mcap")


def machine(mass: float, **forces: dict[str, float]) -> AxisModel:
    axis = replace(SLIDE, mass=mass)
    for name, values in forces.items():
        axis = having(axis, name, **values)
    return axis


COGGING = {"p": 0.021, "a1": 0.9, "b1": 0.5}
HELD = {  # what the machine has, beside an inertia that the model holds at 5.3 kg
    "too small": machine(16.0, cogging=COGGING),
    "too large": machine(1.8, cogging=COGGING),
    "with a spring": machine(16.0, cogging=COGGING, spring={"k1": 40.0}),
}


def beyond(found: AxisDiagnosis) -> set[str]:
    """Laws, and values set free, that the final model has and the base has not."""
    base, final = found.base.axis, found.final.axis
    freed = {n for n in base.names if n in final.names and base[n].fixed - final[n].fixed}
    return {n for n in final.names if n not in base.names} | freed


@pytest.mark.parametrize("name", HELD)
def test_every_law_of_the_final_model_belongs_to_a_finding(name: str) -> None:
    logs = [{f"{i}": logged(HELD[name], Ride(i))} for i in (1, 2, 3)]
    base = replace(SLIDE, mass_fixed=True)
    found = diagnose_axis(*begun(base, *logs), few(*KNOWN))
    assert beyond(found) == {f.effect for f in found.findings} == {*found.named}
    assert {"cogging", "payload_mass"} <= {*found.named}
    assert found.final.error < 0.03 * found.base.error


@pytest.mark.parametrize("there", ["xy", "x", "y"])
def test_all_that_was_found_is_kept_where_the_logs_prefer_it_on_every_axis(there: str) -> None:
    plain, found = replace(SLIDE, mass=5.3), machine(5.3, cogging=COGGING)
    base, grown = (MachineModel("m", {"x": a, "y": a}, RATE) for a in (plain, found))
    logs = []
    for first in (1, 3):
        rides = {a: logged(found if a in there else plain, Ride(first, 4.0)) for a in "xy"}
        logs.append(Log(RATE, {a: log.axes["x"] for a, log in rides.items()}))
    made = add_found(grown, base, *logs, catalogue=few("coulomb_viscous", "cogging"))
    assert made.kept is (there == "xy")
    assert [(s.axis, s.effect, s.action) for s in made.steps] == [
        (axis, "cogging", "add") for axis in "xy"
    ]
    for step in made.steps:
        assert (step.holdout_error_after < 0.1 * step.holdout_error_before) is (step.axis in there)
        assert (step.fit_error_after < 0.1 * step.fit_error_before) is (step.axis in there)


@pytest.fixture(scope="module", autouse=True)
def in_small() -> Iterator[None]:
    """The catalogue in small, so that a diagnosis takes seconds."""
    with patch("twin.effects.load_catalogue", lambda files=(): few("coulomb_viscous", *KNOWN)):
        yield


@pytest.fixture(scope="module")
def drive(tmp_path_factory) -> Path:
    """A model whose inertia is held too small, and logs of the machine, with a cogging besides."""
    folder = tmp_path_factory.mktemp("drive")
    base = MachineModel("drive", {"x": replace(SLIDE, mass_fixed=True)}, RATE)
    save_model(base, folder / "m.toml")
    for seed, name in enumerate("abc", start=1):
        write_log(logged(HELD["too small"], Ride(seed)), folder / f"{name}.mcap")
    return folder


@pytest.fixture(scope="module")
def answer(drive: Path) -> dict:
    """What the command printed, and wrote beside it."""
    done = twin("diagnose", "m.toml", *ROLES, "--model", "better.toml", "--json", folder=drive)
    assert done.returncode == 0, done.stderr
    (drive / "answer.json").write_text(done.stdout, encoding="utf-8")
    return json.loads(done.stdout)


def errors_of(model: Path, folder: Path) -> tuple[float, float]:
    """RMS force errors on the training and the test log of who fits the model again, N."""
    logs = [{f"{n}.mcap": read_log(folder / f"{n}.mcap")} for n in "abc"]
    again = fit(load_model(model), *logs)
    return again.fits["x"].error, again.test_error["x"]


def test_the_model_that_is_written_leaves_the_error_that_was_told(drive: Path, answer: dict):
    told = answer["force_error_with_found"], answer["test_error_after"]
    assert answer["test_error_after"] < 0.05 * answer["test_error_before"]
    assert errors_of(drive / "better.toml", drive) == pytest.approx(told, rel=0.01)
    assert (drive / "better.toml").read_text(encoding="utf-8") == answer["model"]
    history = load_model(drive / "better.toml").history
    assert {step.effect for step in history} == {*answer["missing"]}
    assert all("together with" in step.notes[0] for step in history)


def test_what_a_saved_answer_found_is_added_later(drive: Path, answer: dict) -> None:
    given = ("add", "--found", "answer.json", "m.toml", *ROLES)
    done = twin(*given, "-o", "added.toml", "--json", folder=drive)
    assert done.returncode == 0, done.stderr
    added = json.loads(done.stdout)
    assert {step["effect"] for step in added["steps"]} == {*answer["missing"]}
    for step in added["steps"]:
        assert step["test_error_after"] == pytest.approx(answer["test_error_after"], rel=0.01)
    told = answer["force_error_with_found"], answer["test_error_after"]
    assert errors_of(drive / "added.toml", drive) == pytest.approx(told, rel=0.01)
    text = twin(*given, "-o", "text.toml", folder=drive).stdout
    assert text.startswith("added ")
    assert "force error on the test logs" in text


def test_an_effect_is_taken_out_and_its_worth_told(drive: Path, answer: dict) -> None:
    given = ("remove", "cogging", "better.toml", *ROLES)
    done = twin(*given, "-o", "without.toml", "--json", folder=drive)
    assert done.returncode == 0, done.stderr
    told, less = json.loads(done.stdout), load_model(drive / "without.toml")
    assert told["needed"]
    assert told["test_error_before"] == pytest.approx(answer["test_error_after"], rel=0.01)
    assert told["test_error_after"] > 10.0 * told["test_error_before"]
    assert {*less.axes["x"].names} == {*load_model(drive / "better.toml").axes["x"].names} - {
        "cogging"
    }
    assert less.history[-1].action == "remove"
    assert errors_of(drive / "without.toml", drive)[1] == pytest.approx(
        told["test_error_after"], rel=0.05
    )
    more = ("add", "quadratic_drag", "better.toml", *ROLES, "-o", "more.toml")
    assert twin(*more, folder=drive).returncode == 1  # as nothing proves it
    text = twin(
        "remove", "quadratic_drag", "more.toml", *ROLES, "-o", "x.toml", folder=drive
    ).stdout
    assert text.startswith("took quadratic_drag off axis x\n")
    assert "The logs do not ask for it." in text
    said = refusal("remove", "wear", "better.toml", *ROLES, "-o", "x.toml", folder=drive)
    assert "wear: cannot be taken out; axis x has coulomb_viscous" in said


def test_what_is_no_answer_is_refused_in_one_line(drive: Path, answer: dict) -> None:
    agreed = {"schema": f"{answer['schema'].partition('#')[0]}#/$defs/ErrorAnswer", "error": "odd"}
    damaged = {**answer, "model": "[axes"}
    told = {"no.json": "{}", "list.json": "[1]", "error.json": json.dumps(agreed), "m.toml": None,
            "damaged.json": json.dumps(damaged), "none.json": None}  # fmt: skip
    for name, text in told.items():
        if text is not None:
            (drive / name).write_text(text, encoding="utf-8")
        said = refusal("add", "--found", name, "m.toml", *ROLES, "-o", "x.toml", folder=drive)
        why = "cannot be read: No such file" if name == "none.json" else "is no answer of a diag"
        assert f"{name}: {why}" in said
    assert "--axis and --shape: --found adds all" in refusal(
        "add", "--found", "no.json", "m.toml", *ROLES, "-o", "x.toml", "--axis", "x", "--shape",
        folder=drive,
    )  # fmt: skip
    other = {**answer, "model": answer["model"].replace("axes.x", "axes.q").replace(".x]", ".q]")}
    (drive / "other.json").write_text(json.dumps(other), encoding="utf-8")
    assert "axes q" in refusal(
        "add", "--found", "other.json", "m.toml", *ROLES, "-o", "x.toml", folder=drive
    )


@pytest.mark.slow
def test_the_next_command_is_done_once_the_model_is_written(drive: Path, answer: dict) -> None:
    first = twin("diagnose", "m.toml", *ROLES, folder=drive).stdout
    assert f"next: twin diagnose m.toml {' '.join(ROLES)} --model better.toml" in first
    then = twin("diagnose", "m.toml", *ROLES, "--model", "again.toml", folder=drive).stdout
    assert "again.toml: the model with " in then
    assert "next: twin diagnose" not in then
    done = twin("diagnose", "again.toml", *ROLES, folder=drive).stdout
    assert "Missing:" not in done


def test_a_model_keeps_the_length_that_its_errors_were_told_at(drive: Path, tmp_path: Path) -> None:
    """Beside it every command tells them, where the samples of the logs allow that length."""
    axis = replace(machine(16.0, cogging=COGGING), test_function=0.05)
    save_model(MachineModel("drive", {"x": axis}, RATE), tmp_path / "kept.toml")
    kept = load_model(tmp_path / "kept.toml", few("coulomb_viscous", "cogging"))
    assert kept.axes["x"].test_function == axis.test_function
    log = read_log(drive / "a.mcap")
    own, asked = fit(kept, {"a": log}), fit(kept, {"a": log}, test_function=0.05)
    plain = fit(kept.with_axis("x", replace(axis, test_function=None)), {"a": log})
    assert own.fits["x"].error == asked.fits["x"].error != plain.fits["x"].error
    short = replace(kept, axes={"x": replace(axis, test_function=1.0 / RATE)})
    assert fit(short, {"a": log}).datasets["x"].length > 2.0 / RATE
