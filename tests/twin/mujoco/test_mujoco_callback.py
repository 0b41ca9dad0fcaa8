"""The callback is global to the process: it comes and goes cleanly, and touches no other model."""

from math import sin

import mujoco
import numpy as np
import pytest

from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.mujoco.callback import MAGIC, passive_callback
from twin.simulator import MujocoSimulator

STATE = mujoco.mjtState.mjSTATE_INTEGRATION


SLIDE = """
  <option timestep="1e-3"/>
  <worldbody>
    <body>
      <joint name="x" type="slide" axis="1 0 1" stiffness="50" damping="1"/>
      <geom type="sphere" size="0.1"/>
    </body>
  </worldbody>
  <actuator><motor name="motor_x" joint="x"/></actuator>"""
MANY = " ".join(str(0.1 * i) for i in range(200))
FOREIGN = {
    "slide": f"<mujoco>{SLIDE}</mujoco>",
    "many": f'<mujoco>{SLIDE}<custom><numeric name="own" data="{MANY}"/></custom></mujoco>',
    "userdata": f'<mujoco><size nuserdata="50"/>{SLIDE}</mujoco>',
    "magic": f'<mujoco>{SLIDE}<custom><numeric name="own" data="3 {MAGIC!r}"/></custom></mujoco>',
    "empty": "<mujoco/>",
}


def installed() -> bool:
    return mujoco.get_mjcb_passive() is not None


def test_the_callback_stays_while_any_simulation_runs_whichever_ends_first() -> None:
    """Two threads end in any order; contexts entered and left by hand show each."""
    with pytest.raises(KeyError), passive_callback():
        raise KeyError
    for first, last in ((0, 1), (1, 0)):
        both = passive_callback(), passive_callback()
        for one in both:
            one.__enter__()
        both[first].__exit__(None, None, None)
        assert installed()
        both[last].__exit__(None, None, None)
        assert not installed()


def test_the_clock_of_mujoco_stands_still_meanwhile_and_comes_back() -> None:
    """Reading it takes a quarter of a step."""
    model = mujoco.MjModel.from_xml_string(FOREIGN["slide"])

    def timed() -> float:
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 50)
        return float(data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration)

    assert timed() > 0.0
    with passive_callback():
        assert timed() == 0.0
    assert timed() > 0.0


def test_a_callback_that_was_there_comes_back() -> None:
    calls: list[float] = []

    def own(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        calls.append(data.time)

    model = mujoco.MjModel.from_xml_string(FOREIGN["slide"])
    data = mujoco.MjData(model)
    mujoco.set_mjcb_passive(own)
    try:
        with passive_callback():
            mujoco.mj_forward(model, data)
        assert not calls
        mujoco.mj_forward(model, data)
        assert len(calls) == 1
    finally:
        mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize("xml", FOREIGN.values(), ids=FOREIGN)
def test_a_foreign_model_moves_as_without_the_callback(xml: str) -> None:
    def moved() -> np.ndarray:
        model = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(model)
        for k in range(300):
            data.ctrl[:] = sin(0.1 * k)
            mujoco.mj_step(model, data)
        found = np.empty(mujoco.mj_stateSize(model, STATE))
        mujoco.mj_getState(model, data, found, STATE)
        return found

    wanted = moved()
    with passive_callback():
        np.testing.assert_array_equal(moved(), wanted)


def test_only_the_mark_at_its_end_makes_a_numeric_a_table() -> None:
    stage = load_model("proton_xy", load_catalogue())
    with passive_callback():
        simulation = MujocoSimulator(stage, stage.table())
        model, data = simulation.model, simulation.data
        data.qpos[:] = 0.05, 0.05
        mujoco.mj_forward(model, data)
        assert np.all(data.qfrc_passive != 0.0)
        model.numeric_data[-1] = np.nextafter(MAGIC, 0.0)
        mujoco.mj_forward(model, data)
        assert not data.qfrc_passive.any()
