"""Seconds in which more force acted than was recorded tell nothing; a drive at its limit does."""

from __future__ import annotations

import numpy as np
import pytest
from planted_logs import RATE, SLIDE, Ride, few, having, logged, with_force

import identify
from identify.dataset.clipped import clipped_in
from twin.logs import AxisLog, Log
from twin.model.machine import MachineModel

RIDES = {f"run{i}": Ride(30 + i) for i in range(3)}
MODEL = MachineModel("m", {"x": SLIDE}, RATE)


def clipped(log: Log, part: float) -> Log:
    """The log with its force cut off at a part of its largest."""
    most = part * np.abs(log.axes["x"].force).max()
    return with_force(log, lambda force: np.clip(force, -most, most))


def limited(ride: Ride, limit: float) -> Log:
    """A mass of 5.3 kg with friction, whose drive makes no more than a limit (N) after a ride."""
    wanted = np.concatenate([[0.0], np.cumsum(ride.speed())]) / RATE
    position, force = np.zeros((2, len(wanted)))
    x = v = 0.0
    for k, goal in enumerate(wanted):
        position[k] = x
        force[k] = np.clip(9e3 * (goal - x) - 300.0 * v, -limit, limit)
        for _ in range(10):
            v += (force[k] - 0.53 * v - 0.31 * np.tanh(v / 1e-3)) / 5.3 / (10 * RATE)
            x += v / (10 * RATE)
    noise = 1e-7 * np.random.default_rng(ride.seed).standard_normal(len(wanted))
    return Log(RATE, {"x": AxisLog({"position": position + noise, "force": force})})


def test_a_force_that_was_cut_off_is_seen_where_it_was() -> None:
    logs = {name: logged(SLIDE, ride) for name, ride in RIDES.items()}
    logs["run1"] = clipped(logs["run1"], 0.5)
    found = clipped_in(logs, "x")
    assert [*found] == ["run1"]
    force = np.abs(logs["run1"].axes["x"].force)
    held = force == force.max()
    assert np.mean(found["run1"] & held) > 0.9 * np.mean(held)
    assert not np.any(found["run1"] & ~held)


@pytest.mark.parametrize("limit", [3.0, 6.0])
def test_a_drive_at_its_own_limit_makes_what_it_records(limit: float) -> None:
    logs = {name: limited(ride, limit) for name, ride in RIDES.items()}
    at_it = np.abs(logs["run0"].axes["x"].force) == limit
    assert np.mean(at_it) > 0.02
    assert clipped_in(logs, "x") == {}


@pytest.mark.parametrize("which", RIDES)
def test_whatever_the_role_of_such_a_log_the_others_prove_what_they_do(which: str) -> None:
    """A force that was cut off refuted what the others proved, or moved the mass."""
    true = having(SLIDE, "cogging", p=0.021, a1=0.9)
    logs = {name: logged(true, ride) for name, ride in RIDES.items()}
    logs[which] = clipped(logs[which], 0.3)
    one, two, test = ({name: log} for name, log in logs.items())
    catalogue = few("coulomb_viscous", "cogging", "constant_force", "spring", "quadratic_drag")
    found = identify.diagnose(MODEL, one, two, test, catalogue=catalogue)
    axis = found.axes["x"]
    assert axis.named == ("cogging",)
    assert axis.final.axis.mass == pytest.approx(SLIDE.mass, rel=0.01)
    assert [*axis.dataset.clipped] == [which]
    assert "of this log is left out: its force stays at its extreme" in str(found)
