"""Machines of the self-test and the demonstration: what is planted, logged and held out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, HARDWARE, PLAIN, axis_of, built_fit, fitted

from identify import demo
from identify.selftest import cases
from identify.selftest.cases import NotShown, machine, plain_friction
from twin.effect import Kind
from twin.errors import InputError
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import FineSimulator, ReducedSimulator

LUGRE = fitted("lugre", Fc=0.27, Fs=0.35, sigma2=0.021)
STAGE = MachineModel("s", {"x": AxisModel(5.3, HARDWARE, (LUGRE,)), "y": PLAIN})


def test_the_plain_friction_is_the_simplest_at_the_level_of_the_stages_own():
    found = plain_friction(STAGE, CATALOGUE["gms"])
    assert found.effect.name == "coulomb_viscous"
    assert (found.values["Fc"], found.values["sigma2"]) == (0.27, 0.021)
    assert found.values["Fs"] == CATALOGUE["coulomb_viscous"].parameter("Fs").start  # held
    with pytest.raises(NotShown):
        plain_friction(STAGE, CATALOGUE["coulomb_viscous"])


def test_a_machine_is_logged_three_times_and_the_last_is_held_out(monkeypatch):
    ran, order = [], []

    def simulate(true, run, seed, duration, simulator):
        ran.append((true, run, seed, duration, simulator))
        return f"log of seed {seed}"

    def planted(true, effect, *rest):
        order.append(effect.name)
        new = Fitted.at_start(effect)
        axis = replace(true.axes["x"].with_effect(new), mass_fixed=True)
        return true.with_axis("x", axis), new

    def friction(true, model, effect, *rest):
        assert model.axes["x"].names == ("coulomb_viscous",)
        return planted(true, effect)

    monkeypatch.setattr(cases, "simulate", simulate)
    monkeypatch.setattr(cases, "_with_planted", planted)
    monkeypatch.setattr(cases, "_with_friction", friction)
    effects = [CATALOGUE["wear"], CATALOGUE["gms"], CATALOGUE["cogging"]]
    found = machine(STAGE, effects, 5.0, np.random.default_rng(3))
    assert order == ["gms", "wear", "cogging"]  # a friction first
    assert [f.effect.name for f in found.planted] == order
    assert list(found.model.axes) == ["x"]
    assert found.model.axes["x"].names == ("coulomb_viscous",)
    assert found.model.axes["x"].mass_fixed
    assert found.true.axes["x"].names == ("gms", "wear", "cogging")
    assert found.true.axes["y"] != STAGE.axes["y"]  # drawn
    assert [(r[1], r[3], r[4]) for r in ran] == [
        (run, 12.0, FineSimulator) for run in ("tracking", "moves", "tracking")
    ]
    assert all(r[0] is found.true for r in ran)
    seeds = [r[2] for r in ran]
    assert len(set(seeds)) == 3
    assert list(found.logs) == ["log 1", "log 2"]
    assert found.holdout == {"log 3": f"log of seed {seeds[2]}"}
    empty = machine(STAGE, [], 5.0, np.random.default_rng(3))
    assert (empty.planted, empty.model.axes["x"]) == ((), STAGE.axes["x"])
    assert [r[2] for r in ran[3:]] == seeds


@pytest.mark.parametrize(
    ("hidden", "visible", "held", "shown"),
    [(0.89, 0.71, False, True), (0.91, 0.71, True, True), (0.5, 0.69, False, False)],
)
def test_an_effect_must_show_and_the_mass_is_held_where_it_would_hide(
    monkeypatch, hidden, visible, held, shown
):
    trial, forces = SimpleNamespace(fit="logs", excitation="seen"), []

    def simulate(true, run, seed, duration, simulator):
        assert (run, seed, duration, simulator) == ("tracking", 7, 12.0, ReducedSimulator)

    def drawn(effect, axis, logs, excitation, force, rng, beside=None):
        assert (logs, excitation) == ("logs", "seen")
        forces.append((force, beside and beside.axis.mass_fixed))
        return Fitted.at_start(effect)

    monkeypatch.setattr(cases, "simulate", simulate)

    def studied(stage, logs, held):
        assert (list(stage.axes), list(logs), held) == (["x"], ["trial"], {})
        return {"x": trial}

    def seen(fitted, base, dataset):
        assert (fitted.effect.name, dataset, base.floor) == ("wear", trial, 0.02)
        return visible * 5.0 * 0.02

    monkeypatch.setattr(cases, "datasets", studied)
    monkeypatch.setattr(cases, "fit_axis", lambda axis, logs: built_fit(1.0, 0.02, axis))
    monkeypatch.setattr(cases, "draw_effect", drawn)
    monkeypatch.setattr(cases, "hidden_part", lambda fitted, base, dataset: hidden)
    monkeypatch.setattr(cases, "visible_force", seen)

    def plant():
        rng = np.random.default_rng(1)
        return cases._with_planted(STAGE, CATALOGUE["wear"], 5.0, 7, rng)

    if not shown:
        with pytest.raises(NotShown):
            plant()
        return
    true, planted = plant()
    assert planted.effect.name == "wear"
    assert true.axes["x"].names == ("lugre", "wear")
    assert true.axes["x"].mass_fixed is held
    assert forces == [(0.02, None), (pytest.approx(0.1), held)]


@pytest.mark.parametrize(("level", "shown"), [(1.0, True), (0.1, False)])
def test_a_friction_is_scaled_until_the_model_falls_short_by_the_strength(
    monkeypatch, level, shown
):
    """The error of the model is in proportion to the dry level, or stays short of what is asked."""
    floor = 0.01
    monkeypatch.setattr(cases, "simulate", lambda true, *a, **k: true)
    monkeypatch.setattr(
        cases, "datasets", lambda model, logs, held: {"x": SimpleNamespace(fit=logs["trial"])}
    )
    monkeypatch.setattr(cases, "floor_of", lambda axis, logs: floor)

    def fit(axis, true):
        excess = (level * true.axes["x"]["gms"].values["Fc"]) if shown else 0.05 * floor
        return built_fit(np.hypot(excess, floor), floor)

    monkeypatch.setattr(cases, "fit_axis", fit)
    model = STAGE.with_axis("x", PLAIN)
    rng = np.random.default_rng(2)
    if not shown:
        with pytest.raises(NotShown):
            cases._with_friction(STAGE, model, CATALOGUE["gms"], 5.0, 1, rng)
        return
    true, found = cases._with_friction(STAGE, model, CATALOGUE["gms"], 5.0, 1, rng)
    assert found.effect.name == "gms"
    assert true.axes["x"]["gms"] is found
    assert level * found.values["Fc"] / floor == pytest.approx(5.0, rel=1e-3)


# --- the demonstration ----------------------------------------------------------------------


def test_a_demonstration_holds_out_its_third_log_and_writes_what_it_found(monkeypatch, tmp_path):
    hidden, said, calls, recorded = fitted("cogging"), [], {}, []
    found, as_fitted = made.diagnosed(), {}

    def record(machine, experiment, path, seed, progress):
        recorded.append((machine, experiment, path.name, seed))
        return path.name

    def diagnose(model, logs, held, **named):
        calls["diagnose"] = (model, dict(logs), dict(held))
        return found

    def add(effect, model, logs, held, axis, progress):
        calls["add"] = (effect.name, model, dict(logs), dict(held), axis)
        return made.addition()

    monkeypatch.setattr(demo, "hidden_machine", lambda model, catalogue, rng: ("machine", hidden))
    monkeypatch.setattr(demo, "_record", record)
    monkeypatch.setattr(demo.workflow, "diagnose", diagnose)
    monkeypatch.setattr(demo.workflow, "add", add)
    monkeypatch.setattr(demo.workflow, "add_named", lambda diagnosis: as_fitted.get(diagnosis))
    monkeypatch.setattr(demo, "save_model", lambda *given: calls.update(save=given))
    monkeypatch.setattr(demo, "write_report", lambda *given, **named: calls.update(report=named))
    model = MachineModel("m", {"x": PLAIN})
    out = demo.demo(model, CATALOGUE, tmp_path / "new", 4, said.append)
    names = [f"machine_{i}.mcap" for i in (1, 2, 3)]
    assert [r[1:] for r in recorded] == [
        ("tracking", names[0], 1004), ("moves", names[1], 2004), ("tracking", names[2], 3004),
    ]  # fmt: skip
    fit, held = {n: n for n in names[:2]}, {names[2]: names[2]}
    assert calls["diagnose"] == (model, fit, held)
    assert calls["add"] == ("cogging", found.model, fit, held, "x")
    assert calls["save"] == (made.MODEL, tmp_path / "new" / "better.toml")
    assert calls["report"]["comparison"] is found.comparison
    assert out.named
    assert out.report == tmp_path / "new" / "report.html"
    assert [line[:2] for line in said] == ["1.", "2.", "3.", "4."]
    assert "cogging on x" in said[2]
    assert not replace(out, hidden=fitted("wear")).named
    del calls["add"]
    as_fitted[found] = made.addition()  # the diagnosis has the fit already
    again = demo.demo(model, CATALOGUE, tmp_path / "new", 4, said.append)
    assert again.addition is as_fitted[found]
    assert "add" not in calls
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        demo.demo(model, CATALOGUE, Path(tmp_path / "file" / "in"), 4, said.append)


def test_a_recording_is_written_to_its_file_and_given_back(monkeypatch, tmp_path):
    written, seen = [], []

    def simulate(machine, experiment, seed, duration, progress):
        progress(3, 4)
        return machine, experiment, seed, duration

    monkeypatch.setattr(demo, "simulate", simulate)
    monkeypatch.setattr(demo, "write_log", lambda log, path: written.append((log, path)))
    path = tmp_path / "machine_1.mcap"
    log = demo._record("machine", "moves", path, 7, lambda *given: seen.append(given))
    assert log == ("machine", "moves", 7, demo.DURATION)
    assert written == [(log, path)]
    assert seen == [("simulating machine_1.mcap", 3, 4)]


def test_only_what_shows_is_hidden(monkeypatch):
    monkeypatch.setattr(demo, "simulate", lambda *a, **k: "trial")
    monkeypatch.setattr(
        demo, "datasets", lambda *a: {"x": SimpleNamespace(fit="logs", excitation="seen")}
    )
    monkeypatch.setattr(demo, "fit_axis", lambda axis, logs: built_fit(1.0))
    monkeypatch.setattr(
        demo, "draw_effect",
        lambda effect, axis, logs, seen, force, rng: force == 0.05 and Fitted.at_start(effect),
    )  # fmt: skip
    monkeypatch.setattr(demo, "shows", lambda hidden, base, dataset: hidden.effect.name == "wear")
    model = MachineModel("m", {"x": axis_of(fitted("cogging"))})
    found, hidden = demo.hidden_machine(model, CATALOGUE, np.random.default_rng(1))
    assert hidden.effect.name == "wear"
    assert found.axes["x"].names == ("coulomb_viscous", "cogging", "wear")
    assert found.axes["x"]["cogging"].effect.kind is Kind.FORCE
    monkeypatch.setattr(demo, "shows", lambda *_: False)
    with pytest.raises(InputError, match="another seed"):
        demo.hidden_machine(model, CATALOGUE, np.random.default_rng(1))
