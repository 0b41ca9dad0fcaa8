"""The drives of the second simulator: what they plant is all that they do."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.second_simulator.drives import DRIVES, STEP, simulate


@pytest.mark.parametrize("modulation", [0.0, 0.22])
def test_friction_by_position_brings_no_drag(modulation: float) -> None:
    """At a constant speed of 120 rad/s the mean torque is that of the plant to half a percent."""
    drive = DRIVES["motor"]
    plant = drive.plant._replace(modulation=modulation)
    speed = np.full(STEP // 2, 120.0)
    path = np.cumsum(speed) / STEP
    gains = np.array(drive.gains)
    _, torque = simulate(plant, gains, path, speed, 0.0 * speed, drive.encoder, 20, 20, True)
    steady = torque[len(torque) // 5 :].mean()
    assert steady == pytest.approx(plant.friction + 120.0 * plant.viscous, rel=5e-3)
