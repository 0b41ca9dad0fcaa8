"""Machines of the self-test and the demonstration: what is planted, logged and held out."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from built_fits import CATALOGUE, HARDWARE, PLAIN, axis_of, fitted
from cli_runs import in_small, refusal, twin
from planted_logs import SLIDE

from identify import demo
from identify.dataset.dataset import datasets
from identify.estimation.fit import fit_axis
from identify.selftest import cases
from identify.selftest.cases import NotShown, machine, own_error, plain_friction, prepared
from twin.effects import Catalogue
from twin.errors import InputError
from twin.experiments.named import simulate
from twin.logs import Log, read_log
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, MachineModel
from twin.simulator import ReducedSimulator

LUGRE = fitted("lugre", Fc=0.27, Fs=0.35, sigma2=0.021)
STAGE = MachineModel("s", {"x": AxisModel(5.3, HARDWARE, (LUGRE,)), "y": PLAIN}, 1000.0)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Logs of a few seconds."""
    monkeypatch.setattr(cases, "DURATION", 3.0)
    monkeypatch.setattr(demo, "DURATION", 6.0)


def built(*names: str, strength: float = 5.0, variation: str = "plain", seed: int = 3):
    effects = [CATALOGUE[name] for name in names]
    return machine(STAGE, effects, strength, variation, np.random.default_rng(seed))


def test_the_plain_friction_is_the_simplest_at_the_level_of_the_stages_own():
    found = plain_friction(STAGE, CATALOGUE["gms"])
    assert found.effect.name == "coulomb_viscous"
    assert (found.values["Fc"], found.values["sigma2"]) == (0.27, 0.021)
    assert found.values["Fs"] == CATALOGUE["coulomb_viscous"].parameter("Fs").start  # held
    with pytest.raises(NotShown):
        plain_friction(STAGE, CATALOGUE["coulomb_viscous"])


def same(one: Log, other: Log) -> bool:
    return np.array_equal(one.axes["x"].position, other.axes["x"].position)


def test_a_machine_is_logged_for_training_selection_and_test():
    found, again, empty = built("cogging"), built("cogging"), built()
    assert [list(found.logs), list(found.holdout), list(found.test)] == [
        ["log 1", "log 2"], ["log 3"], ["log 4"],
    ]  # fmt: skip
    every = {**found.logs, **found.holdout, **found.test}
    runs = [log.metadata["experiment"].split()[0] for log in every.values()]
    assert runs == ["tracking", "moves", "tracking", "moves"]
    assert not same(every["log 1"], every["log 3"])
    assert all(same(log, again.logs[name]) for name, log in found.logs.items())
    assert list(found.model.axes) == ["x"]
    assert found.true.axes["y"] != STAGE.axes["y"]  # drawn
    assert (empty.planted, empty.model.axes["x"]) == ((), STAGE.axes["x"])
    assert 0.0 < abs(empty.true.axes["x"].mass / STAGE.axes["x"].mass - 1.0) < 0.1


@pytest.mark.parametrize("strength", [2.0, 6.0])
def test_an_effect_has_the_strength_that_was_asked_beyond_what_the_model_takes_over(strength):
    """In noise floors, which are what the machine's own laws leave."""
    found = built("cogging", strength=strength)
    dataset = prepared(found, strength)
    own = own_error(found.true.axes["x"], dataset.fit)
    assert found.true.axes["x"].names == ("lugre", "cogging")
    left = fit_axis(found.model.axes["x"], dataset.fit).error
    assert np.sqrt(left**2 - own**2) / own == pytest.approx(strength, rel=0.2)
    with pytest.raises(NotShown, match="cogging"):
        prepared(found, 4.0 * strength)


def test_a_mass_that_would_hide_an_effect_was_weighed():
    found = built("payload_mass")
    assert found.model.axes["x"].mass_fixed
    assert found.model.axes["x"].mass == found.true.axes["x"].mass
    with pytest.raises(NotShown, match="actuator_saturation"):
        built("actuator_saturation", strength=1e6)


def test_a_friction_is_planted_first_and_scaled_until_the_model_falls_short():
    found = built("cogging", "gms")
    assert [f.effect.name for f in found.planted] == ["gms", "cogging"]
    assert found.true.axes["x"].names == ("gms", "cogging")
    assert found.model.axes["x"].names == ("coulomb_viscous",)
    level = found.planted[0].values["Fc"] / LUGRE.values["Fc"]
    assert 0.1 * 0.8 <= level <= 10.0 * 1.2  # of the machine's own, which is drawn
    dataset = prepared(found, 5.0)
    true = found.true.axes["x"]
    own = own_error(true, dataset.fit)
    simple = fit_axis(true.with_effect(plain_friction(STAGE, true["gms"].effect)), dataset.fit)
    assert np.sqrt(simple.error**2 - own**2) > 0.5 * 5.0 * own


# --- the demonstration ----------------------------------------------------------------------


@pytest.mark.slow
def test_a_demonstration_hides_what_it_finds_again(tmp_path):
    """By its command, among few effects."""
    own = replace(STAGE, axes={"x": replace(SLIDE, hardware=HARDWARE)})
    save_model(own, tmp_path / "m.toml")
    asked = ("demo", "-o", "new", "--seed", "3", "--model", "m.toml")
    with in_small("coulomb_viscous", "periodic_disturbance", "constant_force"):
        done = twin(*asked, "--json", folder=tmp_path)
    told, said = json.loads(done.stdout), done.stderr.splitlines()
    assert (done.returncode, told["named"]) == (0, True)
    assert [line[:2] for line in said if line[1] == "."] == ["1.", "2.", "3.", "4."]
    hidden = told["hidden"]
    assert told["addition"]["effect"] == hidden
    assert f"names {hidden} on x" in done.stderr
    logs = {p.name: read_log(p) for p in sorted((tmp_path / "new").glob("*.mcap"))}
    assert [log.metadata["experiment"] for log in logs.values()] == [*("tracking", "moves") * 2]
    assert len({log.metadata["seed"] for log in logs.values()}) == 4
    written = load_model(tmp_path / "new" / "better.toml", CATALOGUE)
    assert written.axes["x"].names == ("coulomb_viscous", hidden)
    (step,) = written.history
    assert step.test_error_before > 2.0 * step.test_error_after
    assert f"{step.test_error_before / step.test_error_after:.0f} times" in done.stderr
    assert (tmp_path / told["report"]).read_text(encoding="utf-8").count("<section") > 3
    assert "cannot be made" in refusal(*asked[:1], "-o", "m.toml/in", folder=tmp_path)


def test_only_what_shows_is_hidden():
    model = MachineModel("m", {"x": axis_of(fitted("cogging"))}, 1000.0)
    names = ("cogging", "constant_force", "gms", "encoder_delay", "periodic_disturbance")
    some = Catalogue([CATALOGUE[n] for n in names])
    found, hidden = demo.hidden_machine(model, some, np.random.default_rng(1))
    assert hidden.effect.name in ("constant_force", "periodic_disturbance")
    assert found.axes["x"].names == (*model.axes["x"].names, hidden.effect.name)
    log = simulate(found, "tracking", seed=1, duration=3.0, simulator=ReducedSimulator)
    dataset = datasets(found, {"a": log}, {})["x"]
    without = own_error(found.axes["x"].without(hidden.effect.name), dataset.fit)
    assert without == pytest.approx(demo.FORCE, rel=0.1)
    with pytest.raises(InputError, match="another seed"):
        demo.hidden_machine(model, Catalogue([some["gms"]]), np.random.default_rng(1))
