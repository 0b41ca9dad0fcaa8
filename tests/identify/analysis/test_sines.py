"""A sine is an experiment: its acceleration is its position, and tells no spring beside a mass."""

from __future__ import annotations

import numpy as np
import pytest
from constructed import log_of

from identify.workflow import first_model
from twin.checks import check_log
from twin.checks.report import Fault
from twin.logs import Log

RATE, REACH, MASS = 1000.0, 0.01, 1.0  # Hz, m, kg


def sine(frequency: float, sign: float = 1.0, spring: float = 0.0) -> Log:
    """8 s of it, with friction and noise; the force is the mean of each sample."""
    rng, turn = np.random.default_rng(5), 2.0 * np.pi * frequency
    time = np.arange(8000) / RATE
    middle = time + 0.5 / RATE
    x, v = REACH * np.sin(turn * middle), REACH * turn * np.cos(turn * middle)
    force = (spring - MASS * turn**2) * x + 2.0 * v + 0.5 * np.sign(v)
    noise = rng.standard_normal((2, len(time)))
    position = REACH * np.sin(turn * time) + 1e-7 * noise[0]
    return log_of(RATE, position, sign * force + 0.01 * noise[1])


@pytest.mark.parametrize("frequency", [1.0, 4.0, 10.0, 20.0])
def test_the_mass_of_a_sine_is_whole(frequency: float) -> None:
    axis = first_model(sine(frequency)).axes["x"]
    assert axis.mass == pytest.approx(MASS, rel=0.02)
    if frequency < 10.0:  # of faster ones a test function holds whole periods, and no friction
        assert axis.friction.values["sigma2"] == pytest.approx(2.0, rel=0.2)
        assert axis.friction.values["Fc"] == pytest.approx(0.5, rel=0.2)


@pytest.mark.parametrize("frequency", [4.0, 10.0, 20.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_sine_tells_the_sign_of_a_mass_beside_a_spring(frequency: float, sign: float) -> None:
    findings = check_log(sine(frequency, sign, spring=900.0)).findings
    assert Fault.SIGN not in {finding.fault for finding in findings}
