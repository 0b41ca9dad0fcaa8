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
from identify.selftest.variations import Drawn
from twin.effect import Excitation, Kind
from twin.errors import InputError
from twin.experiments.kinds import Moves, Tracking
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import FineSimulator

LUGRE = fitted("lugre", Fc=0.27, Fs=0.35, sigma2=0.021)
STAGE = MachineModel("s", {"x": AxisModel(5.3, HARDWARE, (LUGRE,)), "y": PLAIN})
EXCITATION = Excitation(-0.15, 0.15, 0.2, 0.3, 12.0, 1e-3)


def test_the_plain_friction_is_the_simplest_at_the_level_of_the_stages_own():
    found = plain_friction(STAGE, CATALOGUE["gms"])
    assert found.effect.name == "coulomb_viscous"
    assert (found.values["Fc"], found.values["sigma2"]) == (0.27, 0.021)
    assert found.values["Fs"] == CATALOGUE["coulomb_viscous"].parameter("Fs").start  # held
    with pytest.raises(NotShown):
        plain_friction(STAGE, CATALOGUE["coulomb_viscous"])


def test_a_machine_is_logged_for_training_selection_and_test(monkeypatch):
    ran, order = [], []

    def simulate(true, run, seed, simulator):
        ran.append((true, run, seed, simulator))
        return f"log of seed {seed}"

    def planted(drawn, effect, *rest):
        order.append(effect.name)
        new = Fitted.at_start(effect)
        model = replace(drawn.model.axes["x"], mass_fixed=True)
        drawn = replace(drawn, model=drawn.model.with_axis("x", model))
        return drawn.on("x", lambda a: a.with_effect(new)), new

    monkeypatch.setattr(cases, "simulate", simulate)
    monkeypatch.setattr(cases, "_with_planted", planted)
    monkeypatch.setattr(cases, "_with_friction", planted)
    effects = [CATALOGUE["wear"], CATALOGUE["gms"], CATALOGUE["cogging"]]
    found = machine(STAGE, effects, 5.0, "plain", np.random.default_rng(3))
    assert order == ["gms", "wear", "cogging"]  # a friction first
    assert [f.effect.name for f in found.planted] == order
    assert list(found.model.axes) == ["x"]
    assert found.true.axes["x"].names == ("gms", "wear", "cogging")
    assert found.model.axes["x"].mass == found.true.axes["x"].mass  # held, so it was weighed
    assert found.true.axes["y"] != STAGE.axes["y"]  # drawn
    assert [(r[1], r[3]) for r in ran] == [
        (run, FineSimulator) for run in (Tracking(12.0), Moves(8), Tracking(12.0), Moves(8))
    ]
    assert all(r[0] is found.true for r in ran)
    seeds = [r[2] for r in ran]
    assert len(set(seeds)) == 4
    assert list(found.logs) == ["log 1", "log 2"]
    assert found.holdout == {"log 3": f"log of seed {seeds[2]}"}
    assert found.test == {"log 4": f"log of seed {seeds[3]}"}
    empty = machine(STAGE, [], 5.0, "plain", np.random.default_rng(3))
    assert (empty.planted, empty.model.axes["x"]) == ((), STAGE.axes["x"])
    assert 0.0 < abs(empty.true.axes["x"].mass / STAGE.axes["x"].mass - 1.0) < 0.1
    assert [r[2] for r in ran[4:]] == seeds


def trial_of(axis, floor=0.02):
    dataset = SimpleNamespace(fit="logs", excitation=EXCITATION)
    return cases._Trial(dataset, built_fit(1.0, 0.5, axis), floor)


@pytest.mark.parametrize(
    ("hidden", "visible", "held", "shown"),
    [(0.89, 0.71, False, True), (0.91, 0.71, True, True), (0.5, 0.69, False, False)],
)
def test_an_effect_must_show_and_the_mass_is_held_where_it_would_hide(
    monkeypatch, hidden, visible, held, shown
):
    """The strength is that of what the machine's own laws leave, not of the product's floor."""
    weighed = []
    monkeypatch.setattr(cases._Trial, "of", lambda drawn, seed: trial_of(drawn.model.axes["x"]))
    monkeypatch.setattr(
        cases, "_scaled", lambda effect, values, *_: Fitted.at_start(effect, values)
    )
    monkeypatch.setattr(cases, "hidden_part", lambda *_: hidden)
    monkeypatch.setattr(cases, "visible_force", lambda *_: visible * 5.0 * 0.02)

    def fit(axis, logs):
        weighed.append(axis.mass)
        return built_fit(1.0, 0.5, axis)

    monkeypatch.setattr(cases, "fit_axis", fit)
    true = STAGE.with_axis("x", replace(STAGE.axes["x"], mass=5.7))

    def plant():
        rng = np.random.default_rng(1)
        return cases._with_planted(Drawn(STAGE, true), CATALOGUE["wear"], 5.0, 7, rng)

    if not shown:
        with pytest.raises(NotShown):
            plant()
        return
    drawn, planted = plant()
    assert planted.effect.name == "wear"
    assert drawn.true.axes["x"].names == ("lugre", "wear")
    assert drawn.model.axes["x"].mass_fixed is held
    assert weighed == ([5.7] if held else [])


FLOOR, OTHER = 0.01, 0.03  # N RMS; the second is left by the right friction too, of the bumps, say


def stub_trials(monkeypatch, excess_of):
    """Trials whose error is made by the dry friction, both in N."""

    def trial(drawn, seed):
        excess = excess_of(drawn.true.axes["x"].effects[-1].values["Fc"])
        base = built_fit(float(np.hypot(excess, OTHER)), FLOOR, drawn.model.axes["x"])
        return cases._Trial(SimpleNamespace(fit="logs", excitation=EXCITATION), base, FLOOR)

    monkeypatch.setattr(cases._Trial, "of", trial)
    monkeypatch.setattr(cases, "fit_axis", lambda axis, logs: built_fit(OTHER, FLOOR, axis))


@pytest.mark.parametrize(("wanted", "times"), [(0.8, 10.0), (30.0, 0.1)])
def test_a_friction_stays_within_ten_times_the_machines_own(monkeypatch, wanted, times):
    """At ten times the level it shows 0.8 of the strength, and at a tenth still 30 of it."""
    own, strength = LUGRE.values["Fc"], 5.0
    stub_trials(monkeypatch, lambda dry: dry / (times * own) * wanted * strength * FLOOR)
    drawn = Drawn(STAGE, STAGE, reshaped=frozenset({"lugre"}))
    _, planted = cases._with_friction(
        drawn, CATALOGUE["gms"], strength, 1, np.random.default_rng(2)
    )
    assert planted.values["Fc"] == pytest.approx(times * own)


@pytest.mark.parametrize(("level", "shown"), [(1.0, True), (0.1, False)])
def test_a_friction_is_scaled_until_the_model_falls_short_by_the_strength(
    monkeypatch, level, shown
):
    """Its error grows with the dry level; what the right friction leaves too does not count."""
    stub_trials(monkeypatch, lambda dry: level * dry if shown else 0.05 * FLOOR)
    rng = np.random.default_rng(2)
    drawn = Drawn(STAGE, STAGE, reshaped=frozenset({"lugre"}))
    if not shown:
        with pytest.raises(NotShown):
            cases._with_friction(drawn, CATALOGUE["gms"], 5.0, 1, rng)
        return
    found, planted = cases._with_friction(drawn, CATALOGUE["gms"], 5.0, 1, rng)
    assert planted.effect.name == "gms"
    assert found.true.axes["x"]["gms"] is planted
    assert found.model.axes["x"].names == ("coulomb_viscous",)
    assert not found.reshaped
    assert level * planted.values["Fc"] / FLOOR == pytest.approx(5.0, rel=1e-3)


@pytest.mark.parametrize(
    ("effects", "own", "shown"),
    [
        (["cogging"], 0.1, True),
        (["cogging"], 0.3, False),  # the machine's own laws leave as much without the effect
        (["lugre", "encoder_quantization"], 0.3, True),  # found by other means, or no force
    ],
)
def test_a_force_is_shown_where_its_own_law_can_follow_the_logs(monkeypatch, effects, own, shown):
    """Without it its law leaves 0.4 N; at 5 times 0.1 N it must reach 0.35 N, at 0.3 N 1.05 N."""
    planted = tuple(fitted(name) for name in effects)
    true = STAGE.with_axis("x", replace(STAGE.axes["x"], effects=planted))
    made_up = SimpleNamespace(fit="logs")
    monkeypatch.setattr(cases, "datasets", lambda *_, **__: {"x": made_up})
    monkeypatch.setattr(
        cases, "own_error", lambda axis, logs: own if axis is true.axes["x"] else 0.4
    )
    built = cases.Machine(STAGE, true, planted, frozenset(), frozenset(), {}, {}, {})
    if shown:
        assert cases.prepared(built, 5.0) is made_up
        return
    with pytest.raises(NotShown, match=effects[0]):
        cases.prepared(built, 5.0)


# --- the demonstration ----------------------------------------------------------------------


def test_a_demonstration_chooses_by_its_third_log_and_tests_by_its_fourth(monkeypatch, tmp_path):
    hidden, said, calls, recorded = fitted("cogging"), [], {}, []
    found, as_fitted = made.diagnosed(), {}

    def record(machine, experiment, path, seed, progress):
        recorded.append((machine, experiment, path.name, seed))
        return path.name

    def diagnose(model, *logs, **named):
        calls["diagnose"] = (model, *map(dict, logs))
        return found

    added = made.addition()
    tested = replace(added.step, test_error_before=0.237, test_error_after=0.00411)
    added = replace(added, step=tested)

    def add(effect, model, *logs, axis, progress):
        calls["add"] = (effect.name, model, *map(dict, logs), axis)
        return added

    monkeypatch.setattr(demo, "hidden_machine", lambda model, catalogue, rng: ("machine", hidden))
    monkeypatch.setattr(demo, "_record", record)
    monkeypatch.setattr(demo.workflow, "diagnose", diagnose)
    monkeypatch.setattr(demo.workflow, "add", add)
    monkeypatch.setattr(demo.workflow, "add_named", lambda diagnosis: as_fitted.get(diagnosis))
    monkeypatch.setattr(demo, "save_model", lambda *given: calls.update(save=given))
    monkeypatch.setattr(demo, "write_report", lambda *given, **named: calls.update(report=named))
    model = MachineModel("m", {"x": PLAIN})
    out = demo.demo(model, CATALOGUE, tmp_path / "new", 4, said.append)
    names = [f"machine_{i}.mcap" for i in (1, 2, 3, 4)]
    assert [r[1:] for r in recorded] == [
        ("tracking", names[0], 1004), ("moves", names[1], 2004), ("tracking", names[2], 3004),
        ("moves", names[3], 4004),
    ]  # fmt: skip
    roles = {n: n for n in names[:2]}, {names[2]: names[2]}, {names[3]: names[3]}
    assert calls["diagnose"] == (model, *roles)
    assert calls["add"] == ("cogging", found.model, *roles, "x")
    assert calls["save"] == (made.MODEL, tmp_path / "new" / "better.toml")
    assert calls["report"]["comparison"] is found.comparison
    assert out.named
    assert out.report == tmp_path / "new" / "report.html"
    assert [line[:2] for line in said] == ["1.", "2.", "3.", "4."]
    assert "cogging on x" in said[2]
    assert "from 237.00 mN to 4.11 mN, 58 times" in said[3]
    assert not replace(out, hidden=fitted("wear")).named
    del calls["add"]
    as_fitted[found] = added  # the diagnosis has the fit already
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
