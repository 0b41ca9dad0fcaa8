"""What looks like a fault and is none, and beside it the fault itself."""

import numpy as np
import pytest
from check_drive import drive, findings

from twin.checks import Fault, check_log
from twin.checks.breaks import pushes
from twin.logs import AxisLog, Log

RATE, MASS, DAMPING = 1000.0, 2.0, 8.0  # Hz, kg, N s/m
Array = np.ndarray


def moved(force: Array) -> Array:
    """Position of a mass on a viscous slide under a force held over each sample."""
    decay = np.exp(-DAMPING / MASS / RATE)
    speed, place, out = 0.0, 0.0, []
    for f in force:
        out.append(place)
        place += speed / RATE
        speed = decay * speed + (1.0 - decay) * f / DAMPING
    return np.array(out)


def told(**columns: Array) -> set[Fault]:
    return {f.fault for f in check_log(Log(RATE, {"x": AxisLog(columns)})).findings}


def test_a_swing_is_no_push():
    t = np.arange(400) / RATE
    inside = (t > 0.1) & (t < 0.3)
    swing = np.where(inside, np.sin(2.0 * np.pi * 45.0 * t), 0.0)
    push = np.where((t > 0.2) & (t < 0.22), 1.0, 0.0)
    assert not pushes(swing, np.abs(swing) > 0.8, 20).any()
    assert pushes(push, push > 0.5, 20)[np.flatnonzero(push)].all()


@pytest.mark.parametrize("count", [10, 40, 100])
def test_a_command_in_steps_is_not_held_and_a_reading_of_few_samples_is(count):
    levels = 10.0 * np.random.default_rng(count).uniform(-1.0, 1.0, 8000 // count)
    steps = np.repeat(levels, count)
    if count > 20:  # of fewer samples nobody commands steps
        assert Fault.HELD not in told(position=moved(steps), force=steps)
    t = np.arange(8000) / RATE
    smooth = sum(3.0 * np.sin(w * t + w) for w in (5.0, 13.7, 29.9))
    read = np.repeat(smooth[::count], count)[: len(t)]
    assert Fault.HELD in told(position=moved(smooth), force=read)


@pytest.mark.parametrize(("late", "lags"), [(False, False), (True, True)])
def test_a_slow_loop_follows_and_late_readings_lag(late, lags):
    t = np.arange(12_000) / RATE
    goal = sum(a * np.sin(w * t) for a, w in ((0.05, 2.0), (0.02, 7.3), (0.01, 17.0)))
    position, gain = [0.0], 20.0  # 1/s of the loop: 50 ms
    for r in goal[:-1]:
        position.append(position[-1] + gain / RATE * (r - position[-1]))
    reading = np.roll(goal, 50) if late else np.array(position)
    speed = np.gradient(reading) * RATE
    force = MASS * np.gradient(speed) * RATE + DAMPING * speed
    columns = {"position": reading, "force": force, "setpoint_position": goal}
    found = findings(Log(RATE, {"x": AxisLog({n: c[100:] for n, c in columns.items()})}), Fault.LAG)
    assert bool(found) == lags


def test_a_force_that_kicks_is_no_glitch_and_a_glitch_of_it_is():
    t = np.arange(6000) / RATE
    force = sum(3.0 * np.sin(w * t + w) for w in (5.0, 13.7))
    kick = np.zeros_like(t)
    kick[3000] = 400.0
    assert Fault.OUTLIERS in told(position=moved(force), force=force + kick)
    found = told(position=moved(force + kick), force=force + kick)
    assert not found & {Fault.OUTLIERS, Fault.UNEVEN, Fault.STEP, Fault.JOINED}


def test_a_rough_command_of_a_coarse_reading_is_no_noise():
    def rough(columns):
        reading = 1e-3 * np.round(columns["position"] / 1e-3)
        columns["force"] -= 4e3 * (reading - columns["position"])
        columns["position"] = reading

    def noisy(columns):
        noise = np.random.default_rng(1).standard_normal(len(columns["force"]))
        columns["force"] += 3.0 * noise

    assert not findings(drive(100.0, 40.0, change=rough), Fault.NOISE)
    assert findings(drive(100.0, 40.0, change=noisy), Fault.NOISE)
