"""Fits on the twin's own logs: parameters, delay, noise floor, intervals, and a user's effect."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from machines import machine, one_axis

from identify.dataset.preparation import datasets
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import residual
from identify.estimation.intervals import OpenSided, Side, estimates
from identify.selection.trying import try_effect
from identify.workflow import diagnose
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import Fitted
from twin.model.parameters import free_parameters, read, write
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
AXIS = STAGE.axes["x"]


@pytest.fixture(scope="module")
def dataset():
    logs = {
        f"log {s}": simulate(STAGE, "tracking", seed=s, duration=15.0, simulator=ReducedSimulator)
        for s in (1, 2)
    }
    return datasets(STAGE, logs, {})["x"]


@pytest.fixture(scope="module")
def fitted(dataset):
    return fit_axis(AXIS, dataset.fit)


def test_every_parameter_is_found_from_a_start_half_off(dataset):
    where = free_parameters(AXIS)
    truth = read(AXIS, where)
    off = [c.parameter.name != "phase" for c in where]
    found = fit_axis(write(AXIS, where, np.where(off, 0.5 * truth, truth)), dataset.fit)
    assert found.ratio < 1.2
    for c, value, true in zip(where, read(found.axis, where), truth, strict=True):
        loose = 0.15 if c.label in ("lugre.sigma1", "lugre.sigma2") else 0.05
        assert value == pytest.approx(true, rel=loose), c.label


def test_most_intervals_cover_the_truth_and_are_narrow(fitted):
    truth = dict(
        zip(
            (c.label for c in free_parameters(AXIS)), read(AXIS, free_parameters(AXIS)), strict=True
        )
    )
    free = [e for e in estimates(fitted) if e.free]
    covered = [e.low <= truth[e.label] <= e.high for e in free if e.low is not None]
    assert len(covered) == len(free)
    # Of ten intervals of 90 % six or fewer hold the truth in 1 of 80 cases, of more less often.
    assert len(covered) >= 10
    assert np.mean(covered) > 0.6
    mass = next(e for e in free if e.label == "mass")
    heavier = replace(fitted.axis, mass=fitted.axis.mass + 1.0)
    slope = (residual(heavier, fitted.logs) - residual(fitted.axis, fitted.logs))[fitted.kept]
    alone = 2.0 * 1.645 * fitted.floor / np.linalg.norm(slope)  # width, were all else known
    # What else is fitted, and the colour that overlapping windows give the noise, widen it.
    assert alone < mass.high - mass.low < 5.0 * alone


def test_a_value_that_fits_as_well_farther_off_has_no_interval():
    """An end stop that the motion does not reach could be anywhere beyond."""
    lowest, highest = -0.3, 0.0  # m; the motion goes from about -0.163 m to 0.033 m
    stops = {"low": lowest, "high": highest, "stiffness": 2.0}
    effect = CATALOGUE["end_stop"]
    there = STAGE.with_axis("x", AXIS.with_effect(Fitted.at_start(effect, stops)))
    log = simulate(there, "tracking", seed=3, duration=10.0, simulator=ReducedSimulator)
    dataset = datasets(STAGE, {"log": log}, {})["x"]
    touching = float(dataset.fit[0].motion.position.min()) + 1e-4
    begun = AXIS.with_effect(Fitted.at_start(effect, {**stops, "low": touching}))
    fit = finished(begun, begun, dataset.fit, Outcome.CONVERGED)
    found = {e.label: e for e in estimates(fit)}
    assert found["end_stop.low"].low is None
    assert found["end_stop.low"].reason == OpenSided(Side.SMALLER)
    assert found["end_stop.high"].low <= highest <= found["end_stop.high"].high


def test_the_twin_has_no_delay(fitted, dataset):
    delayed = try_effect(fitted, dataset, CATALOGUE["actuator_delay"])
    assert not delayed.supported
    assert delayed.fit.axis["actuator_delay"].values["tau"] < 0.05 * STAGE.period


def test_a_users_effect_is_fitted_and_named():
    own = load_catalogue([Path(__file__).parents[3] / "examples" / "my_effect.py"])
    true = {"k": 9.0, "place": 0.043, "w": 0.018}
    stage = STAGE.with_axis("x", AXIS.with_effect(Fitted.at_start(own["my_effect"], true)))
    logs = {
        f"log {s}": simulate(stage, "moves", seed=s, duration=8.0, simulator=ReducedSimulator)
        for s in (1, 2, 3)
    }
    held = {"log 3": logs.pop("log 3")}
    rivals = ("asymmetric_friction", "position_dependent_friction")
    few = Catalogue([own["my_effect"], *(own[name] for name in rivals)])
    found = diagnose(STAGE, logs, held, catalogue=few)
    assert found.effect is own["my_effect"]
    best = found.leading.best
    assert best is not None
    for name, value in true.items():
        assert best.fit.axis["my_effect"].values[name] == pytest.approx(value, rel=0.03)


@pytest.mark.slow
def test_a_hidden_effect_of_a_planted_fault_is_not_explained_by_others():
    """Negative control: with the planted effect out of the catalogue nothing takes its name."""
    hidden = machine(STAGE, CATALOGUE, "cogging", 0.04, 21)
    without = Catalogue([e for e in CATALOGUE.values() if e.name != "cogging"])
    found = diagnose(STAGE, hidden.logs, hidden.holdout, catalogue=without)
    assert found.effect is None
    assert found.leading.unexplained is not None
