"""A model that is wrong by its values alone: what refitting changed, and what it could be."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from identify import workflow
from identify.estimation.confounded import Refit
from identify.output.words.fit import refit_in_words
from identify.results.results import FitResult
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.model.parameters import free_parameters, write
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
SAME_FORCE = {"mass": "payload_mass", "cable_slab.offset": "constant_force"}


@cache
def nominal() -> MachineModel:
    return load_model("proton_xy", CATALOGUE)


def machine(label: str, value: float) -> MachineModel:
    """The stage with one number other than the model has it."""
    axis = nominal().axes["x"]
    (where,) = (c for c in free_parameters(axis) if c.label == label)
    return nominal().with_axis("x", write(axis, [where], [value]))


@cache
def logged(label: str, value: float) -> Log:
    stage = machine(label, value)
    return simulate(stage, "moves", seed=1, duration=6.0, simulator=ReducedSimulator)


@cache
def fitted(label: str, value: float) -> FitResult:
    return workflow.fit(nominal(), {"fit": logged(label, value)}, catalogue=CATALOGUE)


def refit(label: str, value: float) -> Refit:
    return fitted(label, value).refits["x"]


@pytest.mark.parametrize(
    ("label", "value"),
    [("mass", 15.6), ("cable_slab.offset", 0.6), ("cable_slab.k1", 4.0)],
)
def test_the_value_that_was_off_is_told_first(label: str, value: float) -> None:
    found = refit(label, value)
    first = found.changes[0]
    assert first.label == label
    assert first.after == pytest.approx(value, rel=0.02)
    assert found.refitted < 0.2 * found.given
    assert first.alike == ((SAME_FORCE[label],) if label in SAME_FORCE else ())
    assert label in str(refit_in_words(found))
    forces = [change.force for change in found.changes]
    assert forces == sorted(forces, reverse=True)
    assert len(forces) <= 3
    assert forces[-1] > 0.1 * found.given
    assert forces[0] == pytest.approx((found.given**2 - found.refitted**2) ** 0.5, rel=0.1)


def test_true_values_are_not_told_and_what_is_said_to_be_the_same_force_is() -> None:
    """With the mass held, that effect takes the error to where refitting the mass did."""
    true = nominal().axes["x"]["cable_slab"].values["offset"]
    assert refit("cable_slab.offset", true).changes == ()
    found = refit("mass", 15.6)
    held = replace(nominal().axes["x"], mass_fixed=True)
    model = nominal().with_axis("x", held)
    effect = CATALOGUE[found.changes[0].alike[0]]
    added = workflow.add(effect, model, {"fit": logged("mass", 15.6)}, axis="x")
    assert added.step.fit_error_after < 1.01 * found.refitted
