"""The link to MuJoCo: what it must never disturb, and what it must survive."""

import ctypes
from collections.abc import Iterator
from functools import cache

import mujoco
import numpy as np
import pytest
from effect_runs import CATALOGUE, with_all
from mujoco.batch import Batch

from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.mujoco.callback import Offsets, offsets, passive_callback
from twin.signals import Array
from twin.simulator import MujocoSimulator

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS


@cache
def everything() -> MachineModel:
    """The Proton stage with every effect on both axes."""
    return with_all(load_model("proton_xy", CATALOGUE), np.random.default_rng(41))


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
    return np.array([stepped(stage, u) for u in controls(begin, end)])


def stepped(stage: MujocoSimulator, u: Array) -> Array:
    """One sample under a command (2,) N; returns the state after it."""
    stage.data.ctrl[:] = u
    mujoco.mj_step(stage.model, stage.data)
    return state(stage)


def state(stage: MujocoSimulator, spec: mujoco.mjtState = STATE) -> Array:
    found = np.empty(mujoco.mj_stateSize(stage.model, spec))
    mujoco.mj_getState(stage.model, stage.data, found, spec)
    return found


def physics(stage: MujocoSimulator) -> Array:
    return state(stage, PHYSICS)


# --- a sample counts once -------------------------------------------------------------------------


def test_looking_at_the_forces_changes_nothing(stage: MujocoSimulator) -> None:
    step(stage, 0, 100)
    mujoco.mj_forward(stage.model, stage.data)
    seen, forces = state(stage), stage.data.qfrc_passive.copy()
    assert np.all(forces != 0.0)
    for _ in range(5):
        mujoco.mj_forward(stage.model, stage.data)
    np.testing.assert_array_equal(state(stage), seen)
    np.testing.assert_array_equal(stage.data.qfrc_passive, forces)


@pytest.mark.parametrize("looks", [1, 2, 7])
def test_looking_at_the_forces_does_not_change_what_follows(looks: int) -> None:
    with passive_callback():
        undisturbed, watched = (fresh() for _ in range(2))
        for begin in range(0, 300, 50):
            for k in range(looks):  # also a look at what another command would do
                watched.data.ctrl[:] = 3.0 * k
                mujoco.mj_forward(watched.model, watched.data)
            after = step(watched, begin, begin + 50)
            np.testing.assert_array_equal(after, step(undisturbed, begin, begin + 50))


# --- saved, restored, reset -----------------------------------------------------------------------


def test_a_restored_snapshot_continues_to_the_bit(stage: MujocoSimulator) -> None:
    step(stage, 0, 120)
    snapshot = state(stage)
    first = step(stage, 120, 400)
    mujoco.mj_setState(stage.model, stage.data, snapshot, STATE)
    np.testing.assert_array_equal(step(stage, 120, 400), first)
    other = mujoco.MjData(stage.model)
    mujoco.mj_setState(stage.model, other, snapshot, STATE)
    stage.data = other
    np.testing.assert_array_equal(step(stage, 120, 400), first)


def test_a_reset_starts_again(stage: MujocoSimulator) -> None:
    first = step(stage, 0, 200)
    mujoco.mj_resetData(stage.model, stage.data)
    np.testing.assert_array_equal(step(stage, 0, 200), first)


def test_going_back_in_time_alone_forgets_the_effects_states(stage: MujocoSimulator) -> None:
    start = physics(stage)
    first = step(stage, 0, 200)
    mujoco.mj_setState(stage.model, stage.data, start, PHYSICS)  # userdata is not part of it
    again = step(stage, 0, 200)
    np.testing.assert_array_equal(again[:, : len(start)], first[:, : len(start)])


def test_the_same_seed_gives_the_same_bytes() -> None:
    one, two, other = (simulate(everything(), "moves", seed=s, duration=0.3) for s in (7, 7, 8))
    for axis in one.axes:
        for name, column in one.axes[axis].columns.items():
            assert column.tobytes() == two.axes[axis].columns[name].tobytes()
        for name, column in one.truth[axis].items():
            assert column.tobytes() == two.truth[axis][name].tobytes()
        assert other.axes[axis].force.tobytes() != one.axes[axis].force.tobytes()


# --- threads --------------------------------------------------------------------------------------


def starts(stage: MujocoSimulator, count: int) -> Array:
    """Initial physics states at several places and speeds, (count, n_state)."""
    rng = np.random.default_rng(42)
    found = []
    for _ in range(count):
        mujoco.mj_resetData(stage.model, stage.data)
        for axis in ("x", "y"):  # the bodies that structure effects attach start at rest
            stage.data.joint(axis).qpos[:] = rng.uniform(-0.1, 0.1)
            stage.data.joint(axis).qvel[:] = rng.uniform(-0.05, 0.05)
        found.append(physics(stage))
    return np.array(found)


def serially(stage: MujocoSimulator, initial: Array, n: int) -> Array:
    """Physics states after every step from each initial state, (count, n, n_state)."""
    runs = []
    for start in initial:
        mujoco.mj_resetData(stage.model, stage.data)
        mujoco.mj_setState(stage.model, stage.data, start, PHYSICS)
        runs.append(step(stage, 0, n)[:, : len(start)])
    return np.array(runs)


def test_batch_on_two_threads_is_stepping_serially(stage: MujocoSimulator) -> None:
    initial = starts(stage, 12)
    wanted = serially(stage, initial, 150)
    batch = Batch(stage.model, nsim=12, nthread=2)
    n = stage.model.nq
    batch.qpos, batch.qvel = initial[:, 1 : 1 + n], initial[:, 1 + n : 1 + 2 * n]
    for k, u in enumerate(controls(0, 150)):
        batch.ctrl = np.tile(u, (12, 1))
        batch.step()
        np.testing.assert_array_equal(batch.bind("qpos"), wanted[:, k, 1 : 1 + n])
        np.testing.assert_array_equal(batch.bind("qvel"), wanted[:, k, 1 + n : 1 + 2 * n])


# --- where the fields are -------------------------------------------------------------------------


def test_offsets_point_at_the_fields(stage: MujocoSimulator) -> None:
    step(stage, 0, 30)
    found = offsets()

    def word(address: int, offset: int) -> int:
        return ctypes.c_uint64.from_address(address + offset).value

    model, data = stage.model, stage.data
    assert word(model._address, found.n_numeric_data) == model.nnumericdata
    assert word(model._address, found.numeric_data) == model.numeric_data.ctypes.data
    assert ctypes.c_double.from_address(data._address + found.time).value == data.time > 0.0
    for name in ("userdata", "qpos", "qvel", "ctrl", "qfrc_passive"):
        at = word(data._address, getattr(found, name))
        assert at == getattr(data, name).ctypes.data, name
    assert len(set(found)) == len(Offsets._fields)
