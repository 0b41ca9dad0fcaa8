"""What no file, no run and no export can hold is refused in one line that says what to give."""

import math
from dataclasses import replace

import numpy as np
import pytest

from identify.workflow import first_model
from twin.errors import InputError
from twin.experiments.kinds import Tracking
from twin.experiments.trajectory import Limits, Setpoint
from twin.export import axis_identifiers
from twin.logs import AxisLog, Log, cut_log, logs_by_name, write_log
from twin.model.machine import AxisModel, MachineModel
from twin.mujoco.mechanism import joints_of
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator, run

ONE = AxisLog({"position": np.arange(4.0), "force": np.zeros(4)})
LOG = Log(1000.0, {"x": ONE})
MACHINE = MachineModel("m", {"x": AxisModel(1.0)}, 1000.0)
ZERO = np.zeros((5, 1))
UNBUILT = (
    "<mujoco><worldbody><body><joint name='a'/><geom size='1'/></body></worldbody>"
    "<actuator><motor joint='none'/></actuator></mujoco>"
)


def holding(**columns: object) -> Log:
    return replace(LOG, axes={"x": replace(ONE, columns={**ONE.columns, **columns})})


@pytest.mark.parametrize(
    ("log", "said"),
    [
        (replace(LOG, axes={"x y": ONE}), "axis name 'x y': use letters, digits and underscores"),
        (replace(LOG, metadata={"run": 3}), "metadata run is 3; metadata values are text"),
        (holding(heat=np.zeros(4)), "unknown signal heat; allowed: "),
        (holding(velocity=np.array([0, 1, math.nan, 0])), "velocity is nan at 0.002 s (sample 2)"),
        (replace(LOG, truth={"x": {"a b": np.zeros(4)}}), "column name 'a b': use letters, digits"),
    ],
)
def test_what_no_log_can_hold_is_not_written(log, said, tmp_path):
    with pytest.raises(InputError) as error:
        write_log(log, tmp_path / "a.mcap")
    assert said in str(error.value)
    assert not list(tmp_path.iterdir())


MM, MIXED = {"position": "mm"}, {"position": "m", "force": "N m"}


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: holding(velocity=np.zeros(3)), "the columns differ in length (position 4, force"),
        (lambda: holding(velocity=np.array(["1"] * 4)), "velocity is no column of numbers (['1'"),
        (lambda: holding(velocity=np.zeros((4, 1))), "velocity is no column of numbers"),
        (lambda: holding(velocity=np.zeros(4) + 1j), "velocity is no column of numbers"),
        (lambda: holding(velocity=[1.0, None, [2.0], 3.0]), "velocity is no column of numbers"),
        (lambda: replace(ONE, units=MM), "unit of position is 'mm', allowed is m or rad"),
        (lambda: replace(ONE, units=MIXED), "force in N m, position in m: units of a rotary"),
        (
            lambda: AxisLog({"force": np.zeros(4)}).position,
            "the log has no position of an axis, but",
        ),
        (lambda: AxisLog({"position": np.zeros(4)}).force, "the log has neither force nor current"),
        (lambda: replace(LOG, sample_rate=0.0), "sample_rate is 0.0 Hz; give a number above 0"),
        (
            lambda: replace(LOG, axes={"x": ONE, "y": AxisLog({"position": np.zeros(3)})}),
            "the axes differ in length (x 4, y 3 samples); record all with one clock",
        ),
    ],
)
def test_what_is_no_log_is_refused_where_it_is_made(made, said):
    """A fit took a position in "mm" for one in m, and columns of two lengths ended in NumPy."""
    with pytest.raises(InputError) as error:
        made()
    assert str(error.value).startswith(said)


@pytest.mark.parametrize("column", [[0, 1, 2], (0.0, 1.0, 2.0), np.arange(3, dtype=np.float32)])
def test_columns_of_any_numbers_are_those_of_a_log(column):
    kept = AxisLog({"position": column}).position
    assert kept.dtype == np.float64
    np.testing.assert_array_equal(kept, [0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: Limits((1.0, -1.0), 1.0, 1.0, 1.0), "travel 1 .. -1 m is empty or not finite"),
        (lambda: Limits((0.0, math.inf), 1.0, 1.0, 1.0), "travel 0 .. inf m is empty or not"),
        (lambda: Limits((0.0, 1.0), 0.0, 1.0, 1.0), "velocity limit 0 m/s is not allowed"),
        (
            lambda: Setpoint(ZERO, ZERO, ZERO[1:], ZERO, 1000.0),
            "setpoint arrays of shapes [(4, 1), (5, 1)] do not belong together",
        ),
        (lambda: Setpoint(*[ZERO[:, 0]] * 4, 1000.0), "setpoint arrays of shapes [(5,)]"),
        (lambda: simulate(MACHINE, Tracking(1.0), duration=2.0), "has its own duration and axis"),
        (lambda: simulate(MACHINE, Tracking(1.0), axis="x"), "has its own duration and axis"),
        (lambda: cut_log(LOG, math.nan, 1.0), "nan to 1 s: give numbers of seconds"),
        (lambda: logs_by_name(["a", "b", "a"], "test"), "test: a is given twice; give each log"),
        (
            lambda: axis_identifiers(replace(MACHINE, axes=dict.fromkeys("xX", AxisModel(1.0)))),
            "axis x: is called x in an export, as another is",
        ),
        (lambda: joints_of(UNBUILT, "a.xml", {"x": "a"}), "a.xml: MuJoCo cannot build it: "),
        (
            lambda: first_model([LOG, replace(LOG, sample_rate=500.0)]),
            "the logs are sampled at 500, 1000 Hz; give one rate",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(call, said):
    with pytest.raises(InputError) as error:
        call()
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_setpoint_of_other_axes_is_not_run():
    two = np.zeros((5, 2))
    wanted = Setpoint(two, two, two, two, 1000.0)
    with pytest.raises(InputError, match="the setpoint has 2 axes, the model 1"):
        run(MACHINE, wanted, np.random.default_rng(0), simulator=ReducedSimulator)
