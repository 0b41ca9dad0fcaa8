"""The command of a feedforward, put into the model, makes the motion that it was computed for."""

import numpy as np
import pytest
from axis_runs import effect
from effect_runs import CATALOGUE

from twin.effect import Kind
from twin.feedforward import feedforward, followed, imposed
from twin.laws.trials import moderate
from twin.model.machine import AxisModel, Fitted

PERIOD, MASS = 1e-3, 3.0  # s, kg
TURN = 2.0 * np.pi
TIME = PERIOD * np.arange(1500)
# Always forwards, so that the friction of a sample is much that of the one before.
MOTION = np.stack([
    0.05 * TIME - 0.02 / TURN * np.cos(TURN * TIME),
    0.05 + 0.02 * np.sin(TURN * TIME),
    0.02 * TURN * np.cos(TURN * TIME),
])  # fmt: skip
AT_REST = np.zeros_like(MOTION)
RUBBING = effect("coulomb_viscous", Fc=1.5, Fs=1.5, sigma2=4.0)
KINDS = (Kind.FORCE, Kind.MODIFIER, Kind.ACTUATION)
NAMES = [n for n, e in CATALOGUE.items() if e.kind in KINDS and not e.reads_other_axis]


def moderately(name: str) -> Fitted:
    """An effect of 0.5 N or so."""
    chosen = CATALOGUE[name]
    return Fitted.at_start(chosen, moderate(chosen, np.random.default_rng(3), 0.5))


@pytest.mark.parametrize("name", NAMES)
def test_the_command_balances_the_model(name):
    axis = AxisModel(MASS, effects=(RUBBING, moderately(name)))
    kept = followed(axis)
    command = feedforward(axis, MOTION, AT_REST, PERIOD)
    made = command + imposed(kept.axis, np.stack([*MOTION[:2], command]), AT_REST, PERIOD)
    left = (made - MASS * MOTION[2])[20:]  # a friction that reads the command needs some samples
    assert np.abs(left).max() < 1e-3 * np.abs(command).max()


def test_a_drive_that_is_late_asks_for_the_setpoint_as_much_earlier():
    drive = effect("actuator_lag", tau=4e-3), effect("actuator_delay", tau=2e-3)
    kept = followed(AxisModel(MASS, effects=drive))
    assert kept.late == pytest.approx(6e-3, rel=0.02)
    assert kept.ahead(PERIOD) == pytest.approx(6.5e-3, rel=0.02)
    assert set(kept.approximated) == {"actuator_lag", "actuator_delay"}
    assert not kept.axis.effects


def test_what_no_setpoint_tells_is_lost_with_its_reason():
    found = followed(
        AxisModel(MASS, effects=(moderately("actuator_deadband"), moderately("encoder_ripple")))
    )
    assert "no straight line" in found.lost["actuator_deadband"]
    assert "reading" in found.lost["encoder_ripple"]
    assert found.late == 0.0
