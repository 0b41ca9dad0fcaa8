"""A fit that would give numbers without a meaning is refused, and one that contradicts another is
an alarm."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import cli_runs
import pytest

import twin
from identify.output.words.fit import objectives_in_words
from identify.results.results import SimulationFit
from twin.logs import Log, write_log
from twin.model.machine import AxisModel

STAGE = twin.load_model("proton_xy")


@pytest.fixture(scope="module")
def log() -> Log:
    model = replace(STAGE, sample_rate=2500.0)
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


def disagreements(after: AxisModel) -> list[str]:
    """What is said where the fit of simulated motion ends there, begun at the stage's values."""
    fit = SimpleNamespace(axis=after, begun=STAGE.axes["x"])
    return objectives_in_words(SimulationFit(STAGE, None, {"x": fit}, {"x": None}))


@pytest.mark.parametrize(
    ("factor", "told"), [(2.5, True), (0.4, True), (1.9, False), (0.55, False)]
)
def test_a_parameter_that_two_objectives_give_far_apart_is_an_alarm(factor, told):
    after = replace(STAGE.axes["x"], mass=factor * STAGE.axes["x"].mass)
    said = disagreements(after)
    assert len(said) == told
    if told:
        assert said[0].startswith(f"alarm: axis x: mass is {after.mass:.4g} kg, and ")


def test_a_force_that_may_have_either_sign_is_none():
    begun = STAGE.axes["x"]
    effect, parameter = next(
        (f, p.name)
        for f in begun.effects
        for p in f.effect.parameters
        if p.lower < 0.0 and p.name not in f.fixed
    )
    other = replace(effect, values={**effect.values, parameter: 77.0})
    assert disagreements(begun.with_effect(other)) == []
