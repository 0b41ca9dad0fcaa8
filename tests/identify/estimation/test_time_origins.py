"""Logs started at any moment: a force that repeats in time has a phase of its own in each."""

from dataclasses import replace

import numpy as np
import pytest
from machines import one_axis

from identify.dataset.dataset import Dataset, datasets
from identify.estimation.fit import fit_axis
from identify.estimation.time_origin import time_origins, with_time_origins
from identify.selection.diagnosis import Verdict, diagnose_axis
from identify.selection.trying import try_effect
from identify.workflow import compare, fit
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import Fitted

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
PUMP = Fitted.at_start(CATALOGUE["periodic_disturbance"], {"f": 23.7, "a": 0.02, "b": 0.01})
FEW = Catalogue(CATALOGUE[n] for n in ("periodic_disturbance", "cogging", "quadratic_drag"))
LATE = (0.0, 0.313, 0.871)  # s


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    """Logs of a stage beside a pump that had run for a while when each began."""
    out = []
    for i, late in enumerate(LATE):
        phase = 2.0 * np.pi * PUMP.values["f"] * late
        turned = (PUMP.values["a"] + 1j * PUMP.values["b"]) * np.exp(1j * phase)
        values = {**PUMP.values, "a": turned.real, "b": turned.imag}
        axis = STAGE.axes["x"].with_effect(Fitted.at_start(PUMP.effect, values))
        out.append(simulate(replace(STAGE, axes={"x": axis}), "tracking", seed=i, duration=8.0))
    return out


@pytest.fixture(scope="module")
def dataset(logs) -> Dataset:
    """The last log is held out."""
    return datasets(STAGE, {"a": logs[0], "b": logs[1]}, {"c": logs[2]})["x"]


def turns(dataset: Dataset) -> np.ndarray:
    """Clocks in periods of the pump, between -1/2 and 1/2."""
    found = time_origins(dataset) * PUMP.values["f"]
    return found - np.rint(found)


def test_clocks_are_when_the_logs_began(dataset):
    found = turns(with_time_origins(STAGE.axes["x"], dataset))
    late = np.array(LATE) * PUMP.values["f"]
    np.testing.assert_allclose(found, late - np.rint(late), atol=0.02)


def test_a_pump_is_named_whatever_its_phase_in_each_log(dataset):
    known = with_time_origins(STAGE.axes["x"], dataset)
    found = diagnose_axis(fit_axis(STAGE.axes["x"], known.fit), known, FEW)
    assert found.verdict is Verdict.MISSING_EFFECTS
    assert found.named == ("periodic_disturbance",)
    values = found.final.axis["periodic_disturbance"].values
    assert values["f"] == pytest.approx(23.7, rel=1e-4)
    assert np.hypot(values["a"], values["b"]) == pytest.approx(np.hypot(0.02, 0.01), rel=0.02)


def test_with_one_clock_for_all_logs_it_is_not(dataset):
    base = fit_axis(STAGE.axes["x"], dataset.fit)
    pump = CATALOGUE["periodic_disturbance"]
    assert not try_effect(base, dataset, pump).fit.at_floor


WITH_PUMP = replace(STAGE, axes={"x": STAGE.axes["x"].with_effect(PUMP)})


@pytest.mark.slow
def test_a_model_with_the_pump_meets_each_log_at_its_phase(logs):
    assert fit(WITH_PUMP, {str(i): log for i, log in enumerate(logs)}).fits["x"].ratio < 1.2
    alone = fit(WITH_PUMP, {"b": logs[1]})
    assert alone.fits["x"].ratio < 1.2
    found = compare(WITH_PUMP, {"b": logs[1], "c": logs[2]}).axes["x"]
    assert found.ratio < 1.2
