"""The link to MuJoCo and its global callback: what they must never disturb, and must survive."""

from collections.abc import Iterator
from functools import cache
from math import sin

import mujoco
import numpy as np
import pytest
from effect_runs import FRICTIONS, with_all
from machines import PROTON
from mujoco.batch import Batch

from twin.effect import Effect
from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.model.machine import Fitted, MachineModel
from twin.mujoco.callback import MAGIC, passive_callback
from twin.signals import Array
from twin.simulation.simulators import MujocoSimulator

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS


@cache
def everything() -> MachineModel:
    """The Proton stage with every effect on both axes."""
    return with_all(PROTON, np.random.default_rng(41))


def fresh() -> MujocoSimulator:
    """A simulation of it at its start; needs the callback."""
    return MujocoSimulator(everything(), everything().table())


@pytest.fixture
def stage() -> Iterator[MujocoSimulator]:
    """The stage with every effect on both axes, under the callback."""
    with passive_callback():
        yield fresh()


def controls(begin: int, end: int) -> Array:
    """Forces that move both axes back and forth, (n, 2) N."""
    k = np.arange(begin, end)
    return np.stack([8.0 * np.sin(0.031 * k), 5.0 * np.sin(0.023 * k)], axis=1)


def step(stage: MujocoSimulator, begin: int, end: int) -> Array:
    """Step some samples; returns the states after each, (n, n_state)."""
    found = []
    for stage.data.ctrl[:] in controls(begin, end):
        mujoco.mj_step(stage.model, stage.data)
        found.append(state(stage))
    return np.array(found)


def state(stage: MujocoSimulator, spec: mujoco.mjtState = STATE) -> Array:
    found = np.empty(mujoco.mj_stateSize(stage.model, spec))
    mujoco.mj_getState(stage.model, stage.data, found, spec)
    return found


def test_looking_at_the_forces_changes_nothing_now_or_later() -> None:
    with passive_callback():
        undisturbed, watched = (fresh() for _ in range(2))
        for begin in range(0, 150, 50):
            for k in range(3):  # also a look at what another command would do
                watched.data.ctrl[:] = 3.0 * k
                mujoco.mj_forward(watched.model, watched.data)
                seen, forces = state(watched), watched.data.qfrc_passive.copy()
                mujoco.mj_forward(watched.model, watched.data)
                np.testing.assert_array_equal(state(watched), seen)
                np.testing.assert_array_equal(watched.data.qfrc_passive, forces)
            after = step(watched, begin, begin + 50)
            np.testing.assert_array_equal(after, step(undisturbed, begin, begin + 50))


@pytest.mark.parametrize("friction", FRICTIONS, ids=lambda e: e.name)
def test_a_restored_snapshot_continues_to_the_bit(friction: Effect) -> None:
    axis = everything().axes["x"].with_effect(Fitted.at_start(friction))
    with passive_callback():
        model = everything().with_axis("x", axis)
        stage = MujocoSimulator(model, model.table())
        step(stage, 0, 120)
        snapshot = state(stage)
        first = step(stage, 120, 400)
        mujoco.mj_setState(stage.model, stage.data, snapshot, STATE)
        np.testing.assert_array_equal(step(stage, 120, 400), first)
        other = mujoco.MjData(stage.model)
        mujoco.mj_setState(stage.model, other, snapshot, STATE)
        stage.data = other
        np.testing.assert_array_equal(step(stage, 120, 400), first)


def test_going_back_in_time_alone_forgets_the_effects_states(stage: MujocoSimulator) -> None:
    start = state(stage, PHYSICS)
    first = step(stage, 0, 200)
    mujoco.mj_setState(stage.model, stage.data, start, PHYSICS)  # userdata is not part of it
    again = step(stage, 0, 200)
    np.testing.assert_array_equal(again[:, : len(start)], first[:, : len(start)])


def test_batch_on_two_threads_is_stepping_serially(stage: MujocoSimulator) -> None:
    """From several places and speeds; the bodies that structure effects attach start at rest."""
    rng, count, samples, n = np.random.default_rng(42), 12, 150, stage.model.nq
    starts, wanted = np.zeros((2, count, n)), np.empty((count, samples, 2 * n))
    axes = [stage.model.joint(a).qposadr[0] for a in ("x", "y")]
    starts[0][:, axes] = rng.uniform(-0.1, 0.1, (count, 2))
    starts[1][:, axes] = rng.uniform(-0.05, 0.05, (count, 2))
    for i in range(count):
        mujoco.mj_resetData(stage.model, stage.data)
        stage.data.qpos[:], stage.data.qvel[:] = starts[:, i]
        wanted[i] = step(stage, 0, samples)[:, 1 : 1 + 2 * n]
    batch = Batch(stage.model, nsim=count, nthread=2)
    batch.qpos, batch.qvel = starts
    for k, u in enumerate(controls(0, samples)):
        batch.ctrl = np.tile(u, (count, 1))
        batch.step()
        np.testing.assert_array_equal(batch.bind("qpos"), wanted[:, k, :n])
        np.testing.assert_array_equal(batch.bind("qvel"), wanted[:, k, n:])


# The callback is global to the process: it comes and goes cleanly, and touches no other model


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
