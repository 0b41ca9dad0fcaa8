"""What a check says of open-loop commands, of few strokes, and of logs that state few units."""

import numpy as np
from check_drive import drive, findings

from twin.checks import Fault
from twin.logs import AxisLog, Log


def test_a_force_that_goes_in_steps_is_not_limited_but_by_a_loop():
    """An open-loop command has its extremes by itself; a loop that follows a setpoint has none."""
    t = np.arange(4000) / 500.0

    def stepped(columns):
        columns["force"] = np.where(np.sin(2.0 * np.pi * t / 4.0) >= 0.0, 6.0, -6.0)

    signals = ("position", "force")
    assert findings(drive(500.0, 8.0, change=stepped), Fault.SATURATION) == []
    of_a_loop = drive(500.0, 8.0, change=stepped, signals=(*signals, "setpoint_position"))
    assert len(findings(of_a_loop, Fault.SATURATION)) == 2


def test_a_log_that_rests_but_for_a_stroke_says_so():
    t = np.arange(3000) / 1000.0
    going = np.clip(t - 1.0, 0.0, 0.5)

    def stroke(columns):
        columns["position"] = 0.1 * (going - np.sin(4.0 * np.pi * going) / (4.0 * np.pi))

    (found,) = (f for f in findings(drive(seconds=3.0, change=stroke), Fault.WEAK_EXCITATION)
                if "stroke" in f.what)  # fmt: skip
    assert "makes one stroke only" in found.what
    assert not [f for f in findings(drive(), Fault.WEAK_EXCITATION) if "stroke" in f.what]


def test_a_unit_that_is_not_stated_is_that_of_the_axis():
    log = drive(signals=("position", "force", "velocity"))
    axis = log.axes["x"]
    columns = {**axis.columns, "velocity": np.zeros(len(axis))}
    own = AxisLog(columns, {"position": "m"})
    (found,) = findings(Log(1000.0, {"x": own}), Fault.FLAT)
    assert "velocity is 0 m/s throughout" in found.what
