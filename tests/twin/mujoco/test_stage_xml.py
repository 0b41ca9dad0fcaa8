"""The stage's MJCF: what it promises to the simulator, and nothing hidden in it."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

STAGE_XML = Path(__file__).resolve().parents[3] / "models" / "proton_xy.xml"
TRAVEL = 0.17  # m, joint limit on either side


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(STAGE_XML))


def test_sensors_read_the_joints_and_motors_take_newtons_up_to_their_limit(model):
    assert {model.actuator(i).name for i in range(model.nu)} == {"motor_x", "motor_y"}
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = [0.01, -0.02], [0.3, -0.4], [1e4, -150.0]
    mujoco.mj_forward(model, data)
    readings = {model.sensor(i).name: data.sensor(i).data.item() for i in range(model.nsensor)}
    expected = {"position_x": 0.01, "velocity_x": 0.3, "position_y": -0.02, "velocity_y": -0.4}
    assert readings == expected
    np.testing.assert_array_equal(data.actuator_force, [200.0, -150.0])


def test_steps_at_the_control_rate_and_lets_passive_forces_in(model: mujoco.MjModel) -> None:
    assert model.opt.timestep == 1e-4
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    disabled = mujoco.mjtDisableBit
    assert model.opt.disableflags & disabled.mjDSBL_CONTACT
    # With springs and dampers both off MuJoCo skips the passive callback; limits need constraints.
    needed = (
        disabled.mjDSBL_SPRING | disabled.mjDSBL_DAMPER | disabled.mjDSBL_ACTUATION
        | disabled.mjDSBL_SENSOR | disabled.mjDSBL_CONSTRAINT | disabled.mjDSBL_LIMIT
        | disabled.mjDSBL_CLAMPCTRL
    )  # fmt: skip
    assert not model.opt.disableflags & needed


def test_joint_limits_stop_the_axes(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    data.ctrl[:] = [20.0, -20.0]
    mujoco.mj_step(model, data, nstep=20_000)
    np.testing.assert_allclose(data.qpos, [TRAVEL, -TRAVEL], atol=2e-3)
    assert data.ncon == 0
