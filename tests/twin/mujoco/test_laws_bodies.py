"""The springs and axes that are built in MuJoCo, and what is refused.

That attached bodies have their masses and springs is what makes both simulations agree.
"""

import mujoco
import numpy as np
import pytest
from axis_runs import effect

from twin.errors import InputError
from twin.model.file import load_model, models_folder
from twin.model.machine import AxisModel, MachineModel
from twin.simulation.spec import attached_joint, machine_spec

PERIOD = 2e-4  # s
STAGE = load_model("proton_xy")


def plain(*masses: float, rotary: bool = False) -> MachineModel:
    axes = {n: AxisModel(m, rotary=rotary) for n, m in zip("xyz", masses, strict=False)}
    return MachineModel("plain", axes, 1.0 / PERIOD)


def mass_felt(model: mujoco.MjModel, joint: str) -> float:
    """By a force on that joint, with all others held: kg."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    whole = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, whole)
    dof = model.joint(joint).dofadr[0]
    return float(whole[dof, dof])


@pytest.mark.parametrize("recoils", [(0.6, 0.1), (0.2, 0.35)])
def test_a_frame_on_springs_both_ways_has_the_mass_of_each_way(recoils):
    """One body for both: what one way is heavier stands on that joint alone, never below 0."""
    machine = STAGE
    for axis, recoil in zip("xy", recoils, strict=True):
        standing = effect("base_vibration", recoil=recoil)
        machine = machine.with_axis(axis, machine.axes[axis].with_effect(standing))
    model = machine_spec(machine).compile()
    for axis, recoil in zip("xy", recoils, strict=True):
        felt = mass_felt(model, attached_joint(axis, "base_vibration"))
        assert felt == pytest.approx(STAGE.axes[axis].mass / recoil)
    assert np.all(model.dof_armature >= 0.0)
    assert np.count_nonzero(model.dof_armature > 1e-9) == 1


def test_axes_without_a_file_are_slides_and_hinges_in_turn() -> None:
    model = machine_spec(plain(1.0, 2.0, 3.0)).compile()
    for i, (name, mass) in enumerate((("x", 1.0), ("y", 2.0), ("z", 3.0))):
        assert model.body(name).mass[0] == mass
        np.testing.assert_array_equal(np.abs(model.joint(name).axis), np.eye(3)[i])
        assert model.joint(name).type[0] == mujoco.mjtJoint.mjJNT_SLIDE
        assert model.actuator(f"motor_{name}").gear[0] == 1.0
    assert model.opt.timestep == PERIOD
    assert not model.opt.gravity.any()
    turning = machine_spec(plain(0.3, rotary=True)).compile()
    assert turning.joint("x").type[0] == mujoco.mjtJoint.mjJNT_HINGE
    assert turning.body("x").inertia == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("axis", "fitted", "message"),
    [
        (
            "x",
            effect("flexible_mode", load=0.9),
            "hangs 13.5 kg .* the axis has only",
        ),
        ("y", effect("base_vibration", recoil=0.9), "leaves .* kg for what the axis stands on"),
    ],
)
def test_more_than_the_axis_has_is_refused_with_its_mass(axis, fitted, message):
    with pytest.raises(InputError, match=rf"axis {axis}: {fitted.effect.name}_{axis} {message}"):
        machine_spec(STAGE.with_axis(axis, STAGE.axes[axis].with_effect(fitted)))


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(models_folder() / "proton_xy.xml"))


def test_sensors_read_the_joints_and_motors_take_newtons_up_to_their_limit(model):
    assert {model.actuator(i).name for i in range(model.nu)} == {"motor_x", "motor_y"}
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = [0.01, -0.02], [0.3, -0.4], [1e4, -150.0]
    mujoco.mj_forward(model, data)
    readings = {model.sensor(i).name: data.sensor(i).data.item() for i in range(model.nsensor)}
    expected = {"position_x": 0.01, "velocity_x": 0.3, "position_y": -0.02, "velocity_y": -0.4}
    assert readings == expected
    np.testing.assert_array_equal(data.actuator_force, [200.0, -150.0])


def test_joint_limits_stop_the_axes(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    data.ctrl[:] = [20.0, -20.0]
    mujoco.mj_step(model, data, nstep=20_000)
    np.testing.assert_allclose(data.qpos, [0.17, -0.17], atol=2e-3)
    assert data.ncon == 0
