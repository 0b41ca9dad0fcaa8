"""A fit that would give numbers without a meaning is refused, and one that contradicts another is
an alarm."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import cli_runs
import numpy as np
import pytest

import twin
from identify.output.words.fit import objectives_in_words
from identify.results.results import SimulationFit
from twin.logs import Log, write_log


@pytest.fixture(scope="module")
def log() -> Log:
    model = replace(twin.load_model("proton_xy"), sample_rate=2500.0)
    return twin.simulate(model, "tracking", seed=1, duration=4.0)


def scaled(log: Log, field: str, factor: float) -> Log:
    axes = {
        name: replace(a, columns={n: factor * c if n == field else c for n, c in a.columns.items()})
        for name, a in log.axes.items()
    }
    return replace(log, axes=axes)


@pytest.mark.parametrize(
    ("field", "factor", "said"),
    [("force", -1.0, "one of them is reversed"), ("position", 1e3, "unit")],
)
def test_a_reversed_force_or_a_wrong_unit_writes_no_model(log, tmp_path, field, factor, said):
    wrong = scaled(log, field, factor)
    write_log(wrong, tmp_path / "wrong.mcap")
    for command in (("fit",), ("add", "cogging")):
        done = cli_runs.twin(
            *command, "proton_xy", "wrong.mcap", "-o", "m.toml", "--json", folder=tmp_path
        )
        assert done.returncode == 2
        error = json.loads(done.stdout)["error"]
        assert error.startswith("wrong.mcap: axis x")
        assert said in error
        assert "; nothing is fitted to it" in error
        assert not (tmp_path / "m.toml").exists()


def test_a_sound_log_is_fitted_and_its_model_written(log, tmp_path):
    write_log(log, tmp_path / "right.mcap")
    done = cli_runs.twin("fit", "proton_xy", "right.mcap", "-o", "m.toml", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert twin.load_model(tmp_path / "m.toml").axes["x"].mass > 0.0


@pytest.mark.parametrize(
    ("factor", "told"), [(2.5, True), (0.4, True), (1.9, False), (0.55, False), (1.0, False)]
)
def test_a_parameter_that_two_objectives_give_far_apart_is_an_alarm(factor, told):
    begun = twin.load_model("proton_xy").axes["x"]
    after = replace(begun, mass=factor * begun.mass)
    fit = SimpleNamespace(axis=after, begun=begun)
    found = SimulationFit(twin.load_model("proton_xy"), None, {"x": fit}, {"x": None})
    said = objectives_in_words(found)
    assert len(said) == told
    if told:
        assert said[0].startswith(f"alarm: axis x: mass is {after.mass:.4g} kg, and ")


def test_a_force_that_may_have_either_sign_is_none():
    begun = twin.load_model("proton_xy").axes["x"]
    name = next(
        (f.effect.name, p.name)
        for f in begun.effects
        for p in f.effect.parameters
        if p.lower < 0.0 and p.name not in f.fixed
    )
    own = begun[name[0]]
    other = begun.with_effect(replace(own, values={**own.values, name[1]: 77.0}))
    fit = SimpleNamespace(axis=other, begun=begun)
    found = SimulationFit(twin.load_model("proton_xy"), None, {"x": fit}, {"x": None})
    assert objectives_in_words(found) == []


def test_new_has_the_constant_force_that_the_log_asks_for(tmp_path):
    model = twin.load_model("proton_xy")
    pushed = model.axes["x"].with_effect(
        twin.Fitted.at_start(twin.load_catalogue()["constant_force"], {"F0": 1.5})
    )
    machine = replace(model.with_axis("x", pushed), sample_rate=2500.0)
    run = twin.simulate(machine, "tracking", seed=4, duration=8.0)
    write_log(run, tmp_path / "run.mcap")
    assert cli_runs.twin("new", "run.mcap", "-o", "m.toml", folder=tmp_path).returncode == 0
    found = twin.load_model(tmp_path / "m.toml").axes["x"]
    (constant,) = [f for f in found.effects if f.effect.name == "constant_force"]
    assert constant.values["F0"] == pytest.approx(1.5, abs=0.3)
    assert np.isfinite(found.mass)
