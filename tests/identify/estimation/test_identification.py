"""Fits of the twin's own logs and of the EMPS drive: values, delays, intervals, a user's effect."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from check_drive import drive
from emps_published import direction_dependent, identify, load, prediction_error, symmetric
from machines import CATALOGUE, one_axis, tracked
from machines import PROTON as NOMINAL

from identify import adding, workflow
from identify.dataset.preparation import datasets
from identify.estimation.fit import Outcome, finished
from identify.estimation.intervals import OpenSided, Side, estimates
from identify.output.as_json import json_of
from identify.output.words.fit import refit_in_words
from identify.results.results import FitResult
from identify.validation.agreement import agreement
from identify.workflow import diagnose, fit
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.logs.log import Array
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.parameters import free_parameters, write

STAGE = one_axis(NOMINAL)
AXIS = STAGE.axes["x"]


@pytest.fixture(scope="module")
def dataset():
    logs = {f"log {s}": tracked(STAGE, s, 15.0) for s in (1, 2)}
    return datasets(STAGE, logs, {})["x"]


def test_a_value_that_fits_as_well_farther_off_has_no_interval():
    """An end stop that the motion does not reach could be anywhere beyond."""
    lowest, highest = -0.3, 0.0  # m; the motion goes from about -0.163 m to 0.033 m
    stops = {"low": lowest, "high": highest, "stiffness": 2.0}
    effect = CATALOGUE["end_stop"]
    there = STAGE.with_axis("x", AXIS.with_effect(Fitted.at_start(effect, stops)))
    log = tracked(there, 3, 10.0)
    dataset = datasets(STAGE, {"log": log}, {})["x"]
    touching = float(dataset.training[0].motion.position.min()) + 1e-4
    begun = AXIS.with_effect(Fitted.at_start(effect, {**stops, "low": touching}))
    fit = finished(begun, begun, dataset.training, Outcome.CONVERGED)
    found = {e.label: e for e in estimates(fit)}
    assert found["end_stop.low"].low is None
    assert found["end_stop.low"].reason == OpenSided(Side.SMALLER)
    assert found["end_stop.high"].low <= highest <= found["end_stop.high"].high


@pytest.mark.slow
def test_a_users_effect_is_fitted_and_named():
    own = load_catalogue([Path(__file__).parents[3] / "examples" / "my_effect.py"])
    true = {"k": 9.0, "place": 0.043, "w": 0.018}
    stage = STAGE.with_axis("x", AXIS.with_effect(Fitted.at_start(own["my_effect"], true)))
    logs = {f"log {s}": tracked(stage, s, 8.0, "moves") for s in (1, 2)}
    held = {"log 2": logs.pop("log 2")}
    rivals = ("asymmetric_friction", "position_dependent_friction")
    few = Catalogue([own["my_effect"], *(own[name] for name in rivals)])
    found = diagnose(STAGE, logs, held, catalogue=few)
    assert found.effect is own["my_effect"]
    best = found.leading.best
    assert best is not None
    for name, value in true.items():
        assert best.fit.axis["my_effect"].values[name] == pytest.approx(value, rel=0.03)


SAME_FORCE = {"mass": "payload_mass", "cable_slab.offset": "constant_force"}


def stage_with(label: str, value: float) -> MachineModel:
    """The stage with one number other than the model has it."""
    axis = NOMINAL.axes["x"]
    (where,) = (c for c in free_parameters(axis) if c.label == label)
    return NOMINAL.with_axis("x", write(axis, [where], [value]))


@cache
def logged(label: str, value: float) -> Log:
    stage = stage_with(label, value)
    return tracked(stage, 1, 6.0, "moves")


@cache
def fit_to(label: str, value: float) -> FitResult:
    return workflow.fit(NOMINAL, {"fit": logged(label, value)}, catalogue=CATALOGUE)


@pytest.mark.short(1)
@pytest.mark.parametrize(
    ("label", "value"),
    [("mass", 15.6), ("cable_slab.offset", 0.6), ("cable_slab.k1", 4.0)],
)
def test_the_value_that_was_off_is_told_first(label: str, value: float) -> None:
    found = fit_to(label, value).refits["x"]
    first = found.changed[0]
    assert first.parameter == label
    assert first.after == pytest.approx(value, rel=0.02)
    assert found.force_error < 0.2 * found.force_error_as_given
    assert first.same_force_as == ((SAME_FORCE[label],) if label in SAME_FORCE else ())
    assert label in str(refit_in_words(found))
    forces = [change.force for change in found.changed]
    assert forces == sorted(forces, reverse=True)
    assert len(forces) <= 3
    assert forces[-1] > 0.1 * found.force_error_as_given
    assert forces[0] == pytest.approx(
        (found.force_error_as_given**2 - found.force_error**2) ** 0.5, rel=0.1
    )


@pytest.mark.slow
def test_true_values_are_not_told_and_what_is_said_to_be_the_same_force_is() -> None:
    """With the mass held, that effect takes the error to where refitting the mass did."""
    true = NOMINAL.axes["x"]["cable_slab"].values["offset"]
    assert fit_to("cable_slab.offset", true).refits["x"].changed == ()
    found = fit_to("mass", 15.6).refits["x"]
    held = replace(NOMINAL.axes["x"], mass_fixed=True)
    model = NOMINAL.with_axis("x", held)
    effect = CATALOGUE[found.changed[0].same_force_as[0]]
    added = adding.add(effect, model, {"fit": logged("mass", 15.6)}, axis="x")
    assert added.step.fit_error_after < 1.01 * found.force_error


FRICTION = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 1.5, "Fs": 1.5, "sigma2": 3.5})
OFFSET = Fitted.at_start(CATALOGUE["constant_force"])


def noisy(columns: dict[str, Array]) -> None:
    force = columns["force"]
    force += np.random.default_rng(5).normal(0.0, 0.2, len(force))


@pytest.mark.parametrize(("effects", "refused"), [((FRICTION, OFFSET), False), ((FRICTION,), True)])
def test_what_is_refused_is_not_written(tmp_path, effects, refused):
    """The drive has a constant force; without it the model is wrong, and no interval is kept."""
    model = MachineModel("m", {"x": AxisModel(2.0, Hardware(), effects)}, 1000.0)
    found = fit(model, {"l": drive(seconds=8.0, change=noisy)})
    assert (found.fits["x"].ratio > 1.3) is refused
    save_model(found.model, tmp_path / "m.toml")
    written = load_model(tmp_path / "m.toml", CATALOGUE)
    kept = written.intervals["x"].ends
    told = json_of(found)["axes"]["x"]["parameters"]
    ends = {label: tuple(p["interval_90"]) for label, p in told.items() if p["interval_90"]}
    assert kept == ends
    assert bool(kept) is not refused
    shown = [line for line in str(found).splitlines() if re.search(r"\d to -?[\d.]+$", line)]
    assert len(shown) == len(kept)
    if refused:
        with pytest.raises(InputError, match="its model is wrong: find what it lacks") as why:
            agreement(written, written, Catalogue([]))
        assert "\n" not in str(why.value)


PUBLISHED = {  # M, Fv, Fc, offset; M, Fv+, Fc+, Fv-, Fc-
    symmetric: (["95.1089", "203.5034", "20.3935", "-3.1648"], "4.0834 %"),
    direction_dependent: (["95.1540", "166.7061", "20.1440", "240.4236", "20.6277"], "3.1117 %"),
}


def percent(ratio: float) -> str:
    return f"{100 * ratio:.4f} %"


def test_values_and_errors_are_those_published(shared_data: Path) -> None:
    run, pulses = (
        load(shared_data / "emps" / f"{n}.mat") for n in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    predicted = []
    for model, (values, error) in PUBLISHED.items():
        estimate = identify(run, model)
        assert [f"{value:.4f}" for value in estimate.parameters] == values
        assert percent(estimate.relative_error) == error
        predicted.append(prediction_error(pulses, model, estimate.parameters))
    assert percent(predicted[0]) == "5.9824 %"
    assert predicted[1] < 0.9 * predicted[0]
