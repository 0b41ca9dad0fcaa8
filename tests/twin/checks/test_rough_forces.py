"""What spoils the rough command of a loop with a coarse encoder, where no model of it holds."""

import numpy as np
import pytest

from benchmarks.second_simulator.drives import DRIVES, Recorder
from benchmarks.second_simulator.recordings import AXIS, recordings
from twin.checks import check_log
from twin.checks.report import Fault
from twin.logs import AxisLog, Log

SERVO = DRIVES["servo"]


@pytest.fixture(scope="module")
def log():
    return recordings(SERVO, SERVO.plant, Recorder(2000, 2000), 4, None, "")["again"]


def with_force(log: Log, change) -> Log:
    axis = log.axes[AXIS]
    force = change(axis.columns["force"].copy())
    return Log(log.sample_rate, {AXIS: AxisLog({**axis.columns, "force": force}, axis.units)})


def told(log: Log, fault: Fault) -> list[str]:
    return [str(f) for f in check_log(log).findings if f.fault is fault]


def jump(force: np.ndarray) -> np.ndarray:
    force[10_000:10_040] += 4.0 * np.abs(force).max()
    return force


def pushed(log: Log) -> Log:
    """The same jump, and a motion that answers it: 40 samples of it by a mass of 20 g m^2."""
    made = with_force(log, jump)
    axis = made.axes[AXIS]
    rate = (axis.columns["force"] - log.axes[AXIS].columns["force"]) / SERVO.plant.mass
    moved = np.cumsum(np.cumsum(rate)) / log.sample_rate**2
    position = axis.columns["position"] + moved
    return Log(log.sample_rate, {AXIS: AxisLog({**axis.columns, "position": position}, axis.units)})


def test_a_jump_of_the_force_is_told_where_no_motion_answers_it(log):
    (said,) = told(with_force(log, jump), Fault.OUTLIERS)
    assert "5 to 5.0195 s: the force jumps by" in said
    assert "and back, which no motion answers" in said
    assert not [s for s in told(pushed(log), Fault.OUTLIERS) if "no motion answers" in s]
    assert not told(log, Fault.OUTLIERS)


@pytest.mark.parametrize("part", [0.5, 0.7])
def test_a_rough_force_that_is_clipped_is_told(log, part):
    def clipped(force):
        most = part * np.abs(force).max()
        return np.clip(force, -most, most)

    said = told(with_force(log, clipped), Fault.SATURATION)
    assert said
    assert all("the force stays at its extreme of" in s for s in said)
    assert not told(log, Fault.SATURATION)


@pytest.mark.parametrize("seed", [1, 2])
def test_what_a_loop_answers_of_rounded_readings_is_no_lag(seed):
    """The command answers the rounding a moment later, which looked like 3 to 4.5 ms ahead."""
    sines = recordings(SERVO, SERVO.plant, Recorder(1000, 1000), seed, None, "")["sines"]
    assert not told(sines, Fault.LAG)
