"""The velocity-friction map, and the Stribeck curve through it."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest

import identify
from identify.dataset.motion import motion_of
from identify.estimation.stribeck_curve import StribeckCurve, fit_stribeck, start_rule
from identify.estimation.velocity_map import velocity_map
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.kinds import Reversals, Staircase
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
STAGE = load_model("proton_xy", CATALOGUE)
ONE = MachineModel("slide", {"x": replace(STAGE.axes["x"])}, 2000.0)
CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.03, 0.1, 0.3])


def test_friction_of_a_machine_with_a_cable_lies_on_its_curve() -> None:
    """Between two rollers; the cable's force is taken off, so both directions are alike."""
    speeds = (0.004, 0.02)
    log = simulate(
        ONE, Staircase("x", speeds=speeds, span=0.024, at=(0.023,)), simulator=ReducedSimulator
    )
    found = velocity_map(ONE.axes["x"], motion_of(log, "x", "log"))
    assert np.sign(found.velocity).tolist() == [1.0, -1.0, 1.0, -1.0]
    assert np.abs(found.velocity) == pytest.approx(np.repeat(speeds, 2), rel=1e-3)
    assert found.friction == pytest.approx(CURVE(np.abs(found.velocity)), abs=1.5e-3)
    whole = identify.velocity_map(ONE, {"log": log})
    assert whole.friction.tolist() == found.friction.tolist()
    assert np.all(np.diff(np.abs(found.towards(-1.0).velocity)) > 0.0)


def test_a_log_without_constant_speed_is_refused() -> None:
    log = simulate(ONE, Reversals("x", repeats=8), simulator=ReducedSimulator)
    with pytest.raises(InputError, match="no constant speed"):
        velocity_map(ONE.axes["x"], motion_of(log, "x", "log"))


def test_the_start_rules_are_those_of_the_thesis() -> None:
    start = start_rule(SPEEDS, CURVE(SPEEDS))
    least = int(np.argmin(CURVE(SPEEDS)))
    assert start.Fc == CURVE(SPEEDS)[least]
    assert start.Fs == CURVE(SPEEDS)[0]
    assert start.v0 == SPEEDS[least]
    assert start.sigma2 == pytest.approx(
        (CURVE(SPEEDS)[-1] - CURVE(SPEEDS)[least]) / (SPEEDS[-1] - SPEEDS[least])
    )


@pytest.mark.parametrize("weight", [None, np.linspace(1.0, 3.0, len(SPEEDS))])
def test_a_curve_without_noise_is_found_exactly(weight) -> None:
    found = fit_stribeck(SPEEDS, CURVE(SPEEDS), weight)
    assert astuple(found) == pytest.approx(astuple(CURVE), rel=1e-6)


def test_the_slopes_are_those_of_the_curve() -> None:
    for i, name in enumerate(("Fc", "Fs", "v0", "sigma2")):
        step = 1e-6 * getattr(CURVE, name)
        moved = replace(CURVE, **{name: getattr(CURVE, name) + step})
        change = (moved(SPEEDS) - CURVE(SPEEDS)) / step
        assert CURVE.slopes(SPEEDS)[:, i] == pytest.approx(change, rel=1e-4, abs=1e-9)


def test_fewer_speeds_than_parameters_are_refused() -> None:
    with pytest.raises(InputError, match="four parameters, the map 3 speeds"):
        fit_stribeck(SPEEDS[:3], CURVE(SPEEDS[:3]))
