"""A slider on a crank: its inertia varies with the angle, as Lagrange's equation has it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from planted_logs import RATE, SLIDE, Ride, asked, few

Array = NDArray[np.float64]
TURN = 0.08  # m of the axis, as of a belt that turns the crank
CRANK, ROD = 0.02, 0.09  # m
SLIDER = 0.3 * SLIDE.mass * (TURN / (2.0 * np.pi * CRANK)) ** 2  # kg: a third, felt at the axis


def place(x: Array) -> Array:
    """Where the slider is, m."""
    angle = 2.0 * np.pi * x / TURN
    return CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)


def slider(x: Array, speed: Array) -> Array:
    """The force on the axis: the slider's own acceleration, times how far it moves with the axis.

    Less the mean of its inertia, which the mass of the axis has.
    """
    pushed = np.gradient(ratio(x) * speed) * RATE
    known = float(np.mean(felt(x))) * np.gradient(speed) * RATE
    return known - SLIDER * ratio(x) * pushed


def ratio(x: Array) -> Array:
    """How far the slider moves with the axis, by differences."""
    step = 1e-6
    return (place(x + step) - place(x - step)) / (2.0 * step)


def felt(x: Array) -> Array:
    """What the axis feels of the slider's mass, kg."""
    return SLIDER * ratio(x) ** 2


@pytest.mark.short(3)
def test_an_inertia_that_varies_with_the_angle_is_named() -> None:
    """It was told as a friction. The rod makes the first and third harmonic beside the second."""
    known = few("varying_inertia", "cogging", "friction_ripple", "dwell_stiction", "leuven")
    found = asked(SLIDE, SLIDE, known, slider, Ride(3, seconds=8.0))
    assert found.named == ("varying_inertia",)
    law = found.findings[0].parameters
    assert law["p"] == pytest.approx(TURN, rel=5e-3)
    turn = np.linspace(0.0, TURN, 1000, endpoint=False)
    waves = np.fft.rfft(felt(turn) / SLIDE.mass)[1:4].real / 500.0
    assert [law["b1"], law["b2"], law["b3"]] == pytest.approx(waves, rel=0.1)
