"""What a late motor adds to the command is told at the log's own rate, whatever blocks it has."""

from __future__ import annotations

import numpy as np
import pytest
from built_fits import fitted
from noisy_motion import RATE, noisy

from identify.estimation.force_balance import averaged_force
from twin.model.machine import AxisModel


def lagging(command: np.ndarray, tau: float) -> np.ndarray:
    """Means (n,) over samples of a force with tau du/dt = command - u, the command held."""
    turns = 1.0 / RATE / tau
    out, last = np.empty_like(command), command[0]
    for k, u in enumerate(command):
        out[k] = u - (u - last) * (1.0 - np.exp(-turns)) / turns
        last = u - (u - last) * np.exp(-turns)
    return out


def late(command: np.ndarray, samples: int) -> np.ndarray:
    """A command that acts so many whole samples later."""
    return np.concatenate([np.full(samples, command[0]), command[:-samples]])


@pytest.fixture(scope="module")
def log():
    """Of a loud command, on an encoder so noisy that each block is of several samples."""
    found = noisy(3, force=0.5, reading=1e-6, duration=3.0)
    assert found.motion.period > 3.0 / RATE
    return found


@pytest.mark.parametrize(
    ("effect", "acting"),
    [
        (fitted("actuator_lag", tau=3e-4), lambda u: lagging(u, 3e-4)),
        (fitted("actuator_delay", tau=2.0 / RATE), lambda u: late(u, 2)),
    ],
)
def test_a_late_motor_is_walked_sample_by_sample(log, effect, acting) -> None:
    command = log.motion.raw[1]
    wanted = log.fine.mean(acting(command) - command)
    found = averaged_force(AxisModel(1.7, effects=(effect,)), [log])
    left = np.std(found - wanted) / np.std(wanted)
    assert left < 0.01


def test_a_friction_beside_it_is_walked_along_the_motion_as_alone(log) -> None:
    rubbing = fitted("coulomb_viscous", Fc=0.3, Fs=0.3, sigma2=2.0)
    lag = fitted("actuator_lag", tau=3e-4)
    both, one, other = (
        averaged_force(AxisModel(1.7, effects=effects), [log])
        for effects in ((rubbing, lag), (rubbing,), (lag,))
    )
    np.testing.assert_allclose(both, one + other, atol=1e-3 * np.std(one))
