"""A twin that follows the log of a machine: as noisy as that, and alike where both are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, axis_of, fitted
from constructed import log_of
from machines import tracked

from identify.dataset.motion import motion_of
from identify.testing import assert_agree
from studies.thesis.following import closed_loop_errors, identified, twin_of
from twin.model.machine import MachineModel
from twin.simulation.simulators import ReducedSimulator

RATE = 1000.0
DRIVE = replace(axis_of(fitted("constant_force")), hardware=replace(HARDWARE, travel=(-0.1, 0.1)))
MACHINE = MachineModel("drive", {"x": DRIVE}, RATE)


def test_errors_of_the_closed_loop_are_parts_of_what_the_machine_did() -> None:
    t = np.arange(3000) / RATE
    x, force = 0.02 * np.sin(7.0 * t), np.cos(5.0 * t)
    machine, follower = log_of(RATE, x, force), log_of(RATE, 1.03 * x, 0.8 * force)
    expected = {"position": 0.03, "velocity": 0.03, "acceleration": 0.03, "force": 0.2}
    assert closed_loop_errors(machine, follower, "x") == pytest.approx(expected)
    quick = 0.02 * np.sin(7.0 * t) + 1e-5 * np.sin(140.0 * t)  # of what is quick more is differing
    found = closed_loop_errors(machine, log_of(RATE, quick, force), "x")
    size = {"position": 1.0, "velocity": 20.0, "acceleration": 400.0}
    assert {k: found[k] for k in size} == pytest.approx({k: 5e-4 * v for k, v in size.items()}, 0.2)


def test_a_log_and_its_twin_agree_and_move_alike() -> None:
    log = tracked(MACHINE, 4, 5.0)
    fit = identified(MACHINE, log)
    follower = twin_of(fit, log, simulator=ReducedSimulator)
    assert_agree(fit, identified(MACHINE, follower))
    errors = closed_loop_errors(log, follower, "x")
    assert errors["position"] < 1e-4


@pytest.mark.parametrize("own", [3e-7, 0.0])
def test_a_twin_is_as_noisy_as_the_log_where_the_model_does_not_say(own: float) -> None:
    noisy = replace(DRIVE, hardware=replace(DRIVE.hardware, encoder_noise=5e-6))
    machine = MachineModel("drive", {"x": noisy}, RATE)
    log = tracked(machine, 4, 3.0)
    model = replace(DRIVE, hardware=replace(DRIVE.hardware, encoder_noise=own))
    follower = twin_of(MachineModel("drive", {"x": model}, RATE), log, simulator=ReducedSimulator)
    noise = {k: motion_of(one, "x", k).position_noise for k, one in (("m", log), ("t", follower))}
    assert noise["t"] == pytest.approx(own or noise["m"], rel=0.2)
