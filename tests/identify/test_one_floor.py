"""Fit, comparison, diagnosis and addition tell one error and one floor of one log and one model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from planted_logs import RATE, SLIDE, Ride, few, having, logged

from identify import adding, workflow
from identify.selection.diagnosis import Verdict
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate

EXAMPLES = Path(__file__).parents[2] / "examples"

KNOWN = few("cogging", "spring", "quadratic_drag")
HIDDEN = {
    "nothing": SLIDE,
    "cogging": having(SLIDE, "cogging", p=0.021, a1=0.05, b1=0.02),
    "spring": having(SLIDE, "spring", k1=4.0),
    "drag": having(SLIDE, "quadratic_drag", c=3.0),
}


@pytest.mark.short(1)
@pytest.mark.parametrize("noise", [2e-3, pytest.param(0.1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("hidden", HIDDEN)
def test_every_command_tells_the_same_of_one_log(hidden: str, noise: float) -> None:
    """Of white noise in the command, which every log shows."""
    model, log = (
        MachineModel("m", {"x": SLIDE}, RATE),
        logged(HIDDEN[hidden], Ride(3, 3.0), noise=noise),
    )
    fitted = workflow.fit(model, {"a": log})
    own = fitted.fits["x"]
    compared = workflow.compare(fitted.model, {"a": log}).axes["x"]
    base = workflow.diagnose(model, {"a": log}, catalogue=KNOWN).axes["x"].base
    added = adding.add(KNOWN["spring"], model, {"a": log}, axis="x").step.fit_error_before
    for error in (compared.total_error, base.error, added):
        assert error == pytest.approx(own.error, rel=1e-3)
    for ratio in (compared.ratio, base.ratio):
        assert ratio == pytest.approx(own.ratio, rel=1e-2)


def test_a_log_without_noise_of_the_model_itself_leaves_nothing() -> None:
    """LAAS left 66 times a floor that was 0 but for numbers: no interval, and no effect for it."""
    model = load_model(EXAMPLES / "laas.toml")
    quiet = {
        axis: replace(own, hardware=replace(own.hardware, encoder_noise=0.0, current_noise=0.0))
        for axis, own in model.axes.items()
    }
    model = replace(model, axes=quiet)
    one, other = (simulate(model, "moves", seed=k, duration=4.0) for k in (1, 2))
    (axis,) = quiet
    found = workflow.diagnose(model, one, other, catalogue=KNOWN).axes[axis]
    assert found.verdict is Verdict.NOTHING_MISSING
    assert found.final.at_floor


def test_errors_of_models_that_tell_of_other_parts_of_a_log_are_compared_where_both_do() -> None:
    """A friction that remembers holds at rest too, where one that sticks tells nothing."""
    model, log = MachineModel("m", {"x": SLIDE}, RATE), logged(SLIDE, Ride(3, 3.0), noise=0.01)
    bristles, spring = (adding.add(name, model, {"a": log}) for name in ("dahl", "spring"))
    assert bristles.in_motion is not None
    assert bristles.in_motion[0] == pytest.approx(bristles.step.fit_error_before, rel=1e-6)
    assert "where both tell of the training logs it is" in bristles.notes[-2]
    assert spring.in_motion is None
