"""The link to MuJoCo: what it must never disturb, and what it must survive."""

from collections.abc import Iterator
from functools import cache

import mujoco
import numpy as np
import pytest
from effect_runs import CATALOGUE, FRICTIONS, with_all
from mujoco.batch import Batch

from twin.effect import Effect
from twin.model.file import load_model
from twin.model.machine import Fitted, MachineModel
from twin.mujoco.callback import passive_callback
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
