"""Force error by frequency: noise alone is the noise band, a planted line stands out of its own."""

import numpy as np
import pytest
from machines import one_axis

from identify.output import as_json
from identify.output.words.residual import region_in_words
from identify.validation.misfit_maps import (misfit_by_frequency)
from identify.workflow import compare, fit
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import Fitted

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
LINE, HEIGHT = 29.0, 0.02  # Hz, N


def logs(seed: int, **disturbance: float):
    machine = STAGE
    if disturbance:
        pump = Fitted.at_start(CATALOGUE["periodic_disturbance"], disturbance)
        machine = STAGE.with_axis("x", STAGE.axes["x"].with_effect(pump))
    return {"run": simulate(machine, "tracking", seed=seed, duration=20.0)}


@pytest.fixture(scope="module")
def pumped():
    return compare(STAGE, logs(3, f=LINE, a=HEIGHT))


def by_frequency(compared):
    return next(m for m in compared.axes["x"].maps if m.coordinate == "frequency")


@pytest.mark.parametrize("window", [0.02, 0.1])
def test_noise_alone_fills_the_noise_band_whatever_the_window(window):
    result = fit(STAGE, logs(3), test_function=window)
    found = misfit_by_frequency(result.fits["x"].axis, result.datasets["x"].fit)
    assert found.high[-1] > 100.0
    wide = found.low > 2.0
    assert found.rms[wide] == pytest.approx(found.floor[wide], rel=0.4)
    assert np.mean(found.rms[wide] / found.floor[wide]) == pytest.approx(1.0, abs=0.15)


def test_a_planted_line_has_its_height_in_newtons_in_its_band_alone(pumped):
    found = by_frequency(pumped)
    hit = (found.low <= LINE) & (found.high > LINE)
    assert hit.sum() == 1
    assert found.rms[hit][0] == pytest.approx(HEIGHT / np.sqrt(2.0), rel=0.03)
    assert (found.rms[~hit] < 3.0 * found.floor[~hit]).all()


def test_the_worst_region_names_the_band(pumped):
    worst = pumped.axes["x"].worst[0]
    assert worst.coordinate == "frequency"
    assert worst.low <= LINE < worst.high
    assert "frequency between" in region_in_words(worst)
    assert "Hz" in region_in_words(worst)


def test_the_bands_are_in_the_json(pumped):
    found = as_json.json_of(pumped)
    region = found["axes"]["x"]["regions"]["frequency"]
    assert region["unit"] == "Hz"
    assert max(region["force_error"]) == pytest.approx(HEIGHT / np.sqrt(2.0), rel=0.03)
    assert len(region["noise_floor"]) == len(region["centre"]) == len(region["force_error"])
    assert set(region["mean"]) == {None}
