"""The user's own MJCF file, with the friction that was found, moves as the machine did."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from arms import ARM, COULOMB, COUPLED, JOINTS, MOTORS, VISCOUS, arm_of
from axis_runs import effect as fitted
from cli_runs import refusal, twin

from twin.export.formats.mjcf import attributes_of, export
from twin.model.file import save_model
from twin.model.machine import AxisIntervals, AxisModel, Fitted, Hardware, MachineModel

COMMENTED = ARM.replace(
    '<joint name="elbow"', "<!-- <joint name='elbow'/> as drawn -->\n          <joint name='elbow'"
).replace('name="base" axis', 'name="base" damping="7"\n   frictionloss="2" armature="0.5" axis')


def model(text: str = COMMENTED, **more: Fitted) -> MachineModel:
    """The arm with its planted friction, and more on some joints."""
    axes = {}
    for joint, dry, wet in zip(JOINTS, COULOMB, VISCOUS, strict=True):
        friction = fitted("coulomb_viscous", Fc=dry, Fs=dry, sigma2=wet)
        own = (friction, more[joint]) if joint in more else (friction,)
        axes[joint] = AxisModel(1.0, effects=own, mass_fixed=True, rotary=True, joint=joint)
    return MachineModel("arm", axes, 1000.0, text, "arm.xml")


def pushed(text: str, friction: bool) -> np.ndarray:
    """Where the arm is after 0.4 s under torques; friction: that of ``arms`` applied by hand."""
    made = mujoco.MjModel.from_xml_string(text)
    made.opt.timestep, made.opt.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_EULER
    data = mujoco.MjData(made)
    for k in range(4000):
        data.qfrc_applied[:] = np.array([3.0, 8.0, 2.0]) * np.sin(5.0 * k * 1e-4)
        if friction:
            slow = COULOMB * np.tanh(data.qvel / 2e-3) + VISCOUS * data.qvel
            data.qfrc_applied[:] -= slow
        mujoco.mj_step(made, data)
    return data.qpos.copy()


def test_it_moves_as_the_machine_in_bare_mujoco():
    made = export(model(COMMENTED.replace(' armature="0.5"', "")), {}).files["arm.xml"]
    assert isinstance(made, str)
    np.testing.assert_allclose(pushed(made, False), pushed(ARM, True), atol=5e-3)
    assert np.abs(pushed(made, False) - pushed(ARM, False)).max() > 0.1


DRIVEN = """<mujoco model="slide">
  <option timestep="1e-4" gravity="0 0 0"/>
  <worldbody><body><joint name="x" type="slide"/><geom size="0.1" mass="1e6"/></body></worldbody>
  <actuator><!-- of the drive --><dcmotor name="m" joint="x" gear="4"
    motorconst="1e-4 1e-4" resistance="1"/></actuator>
</mujoco>"""
TENDON = '<tendon><fixed name="x"><joint joint="q" coef="1"/></fixed></tendon>'
OF_TENDON = DRIVEN.replace('joint name="x"', 'joint name="q"').replace('joint="x"', 'tendon="x"')
OF_TENDON = OF_TENDON.replace("<actuator>", f"{TENDON}<actuator>")
BRISTLES = {"Fc": 3.0, "Fs": 5.0, "v0": 0.01, "sigma0": 1000.0, "sigma1": 2.0, "sigma2": 7.0}


def dragged(text: str, speed: float) -> np.ndarray:
    """The force on the slide while it moves at that speed, over 0.2 s."""
    made = mujoco.MjModel.from_xml_string(text)
    data, force = mujoco.MjData(made), []
    for _ in range(2000):
        data.qvel[0] = speed
        mujoco.mj_step(made, data)
        force.append(data.qfrc_actuator[0] + data.qfrc_passive[0])
    return np.array(force)


@pytest.mark.parametrize(
    ("speed", "driven"), [(0.002, DRIVEN), (0.01, DRIVEN), (-0.05, DRIVEN), (0.01, OF_TENDON)]
)
def test_a_dc_motor_holds_lugre_friction_as_it_is(speed, driven):
    axis = AxisModel(1.0, effects=(fitted("lugre", **BRISTLES),), mass_fixed=True)
    made = export(MachineModel("slide", {"x": axis}, 1000.0, driven, "slide.xml"), {})
    text = made.files["slide.xml"]
    assert isinstance(text, str)
    assert (made.kept["x"], made.approximated, made.lost) == (("lugre",), (), ())
    assert "<!-- of the drive -->" in text
    b, z, wanted = BRISTLES, 0.0, []
    for _ in range(2000):
        level = b["Fc"] + (b["Fs"] - b["Fc"]) * np.exp(-((speed / b["v0"]) ** 2))
        rate = speed - b["sigma0"] * abs(speed) / level * z
        wanted.append(-b["sigma0"] * z - b["sigma1"] * rate - b["sigma2"] * speed)
        z += 1e-4 * rate
    np.testing.assert_allclose(dragged(text, speed), wanted, rtol=2e-3)
    other = replace(axis, effects=(fitted("lugre", **BRISTLES, n=1.0),))
    nearly = export(MachineModel("slide", {"x": other}, 1000.0, DRIVEN, "slide.xml"), {})
    assert [r.part for r in nearly.approximated] == ["lugre"]


def test_a_joint_whose_motor_holds_the_friction_has_none_of_its_own():
    driven = DRIVEN.replace('type="slide"', 'type="slide" frictionloss="3" damping="0.5"')
    axis = AxisModel(1.0, effects=(fitted("lugre", **BRISTLES),), mass_fixed=True)
    made = export(MachineModel("slide", {"x": axis}, 1000.0, driven, "slide.xml"), {})
    built = mujoco.MjModel.from_xml_string(made.files["slide.xml"])
    assert built.dof_frictionloss.tolist() == [0.0]
    said = {r.part: r.text for r in made.written}
    assert said["frictionloss"] == "3 N becomes 0 N"


def test_a_joint_may_have_the_name_of_an_attribute():
    named = ARM.replace('"elbow"', '"joint1"')
    whole = model(named)
    axes = {a.replace("elbow", "joint1"): own for a, own in whole.axes.items()}
    axes["joint1"] = replace(axes["joint1"], joint="joint1")
    made = export(replace(whole, axes=axes), {}).files["arm.xml"]
    assert isinstance(made, str)
    last = mujoco.MjModel.from_xml_string(made).joint("joint1").dofadr[0]
    assert mujoco.MjModel.from_xml_string(made).dof_frictionloss[last] == pytest.approx(COULOMB[2])


def test_comments_and_order_stay_and_what_was_there_of_friction_goes():
    made = export(model(), {}).files["arm.xml"]
    assert isinstance(made, str)
    assert "<!-- <joint name='elbow'/> as drawn -->" in made
    before, after = (
        [line for line in text.splitlines() if "joint" not in line and "frictionloss" not in line]
        for text in (COMMENTED, made)
    )
    assert after == before
    built = mujoco.MjModel.from_xml_string(made)
    np.testing.assert_allclose(built.dof_frictionloss, COULOMB)
    np.testing.assert_allclose(np.ravel(built.dof_damping)[: len(VISCOUS)], VISCOUS)
    np.testing.assert_array_equal(built.dof_armature, [0.5, 0.0, 0.0])  # no effect is about it


@pytest.mark.parametrize(("low", "high"), [(6.5, 7.5), (6.5, 7.0), (7.0, 7.5), (6.5, 6.95)])
def test_a_value_of_the_file_that_a_fit_does_not_refuse_stays(low, high):
    """7 N m s of damping in the file, whose interval by the fit has these ends."""
    own = model()
    friction = fitted("coulomb_viscous", Fc=2.1, Fs=2.1, sigma2=6.9)
    base = replace(own.axes["base"], effects=(friction,))
    ends = {"coulomb_viscous.sigma2": (low, high)}
    own = replace(own.with_axis("base", base), intervals={"base": AxisIntervals(ends, 1.0)})
    built = mujoco.MjModel.from_xml_string(export(own, {}).files["arm.xml"])
    assert np.ravel(built.dof_damping)[0] == (7.0 if low <= 7.0 <= high else 6.9)
    assert built.dof_frictionloss[0] == pytest.approx(2.1)  # without an interval


def test_springs_and_rotors_are_joints_own_also_in_degrees():
    spring = fitted("spring", middle=0.2, offset=0.3, k1=1.5)
    own = model(ARM.replace("<option", '<compiler angle="degree"/><option'), elbow=spring)
    made = mujoco.MjModel.from_xml_string(export(own, {}).files["arm.xml"])
    assert made.qpos_spring[2] == pytest.approx(0.2 - 0.3 / 1.5)
    assert np.ravel(made.jnt_stiffness)[2] == pytest.approx(1.5)
    rotor = export(model(base=fitted("rotor_inertia", inertia=0.07)), {})
    assert mujoco.MjModel.from_xml_string(rotor.files["arm.xml"]).dof_armature[0] == 0.07
    assert "rotor_inertia" in rotor.kept["base"]


def test_a_tendon_holds_them_too_and_joints_that_are_no_axes_let_go():
    spring = fitted("spring", middle=0.2, offset=0.6, k1=1.5)
    roll = (fitted("rotor_inertia", inertia=0.07), fitted("viscous_friction", c=0.2), spring)
    own = {"base": (), "lift": model().axes["elbow"].effects, "roll": roll}
    axes = {
        axis: AxisModel(1.0, effects=effects, mass_fixed=True, rotary=True, joint=MOTORS[axis])
        for axis, effects in own.items()
    }
    made = export(MachineModel("arm", axes, 1000.0, COUPLED, "arm.xml"), {})
    assert (made.kept["roll"], made.lost) == (tuple(f.effect.name for f in roll), ())
    built = mujoco.MjModel.from_xml_string(made.files["arm.xml"])
    lift, belt = (built.tendon(name).id for name in ("lift", "belt"))
    assert built.tendon_frictionloss[[lift, belt]].tolist() == [COULOMB[2], 0.0]
    assert np.ravel(built.tendon_damping)[[lift, belt]] == pytest.approx([VISCOUS[2], 0.2])
    assert built.tendon_armature[[lift, belt]].tolist() == [2.0, 0.07]
    assert np.ravel(built.tendon_stiffness)[[lift, belt]].tolist() == [7.0, 1.5]
    assert built.tendon_lengthspring[belt] == pytest.approx(-0.2)
    assert np.all(built.dof_frictionloss == 0.0)
    assert not np.any(built.dof_damping)


def test_what_is_lost_is_told_in_newtons_on_a_log():
    t = np.arange(4000) / 500.0
    log = arm_of(np.stack([np.sin(t)] * 3, axis=1), np.zeros((4000, 3)))
    own = model(shoulder=fitted("cogging", p=0.2, a1=0.3), elbow=fitted("spring", k1=1.0, k3=0.2))
    made = export(own, {"log": log})
    (lost,) = made.lost
    assert (lost.axis, lost.part) == ("shoulder", "cogging")
    assert lost.text == "0.2 of its 0.2 N m RMS are lost on log"
    (nearly,) = made.approximated
    assert (nearly.axis, nearly.part) == ("elbow", "spring")
    assert attributes_of(own.axes["elbow"])["stiffness"] == 1.0


@pytest.mark.parametrize("k3", [0.0042, 0.0046, 0.42, 0.45])
def test_a_spring_that_bends_is_held_nearly_up_to_half_of_it(k3):
    """And not worth a word up to a hundredth."""
    t = np.arange(4000) * 2.0 * np.pi / 500.0
    log = arm_of(np.stack([1.7 * np.sin(t)] * 3, axis=1), np.zeros((4000, 3)))
    spring = fitted("spring", k1=1.0, k3=k3)
    held = export(model(elbow=spring), {"run": log}).axes["elbow"]
    x = 1.7 * np.sin(t)
    left, size = (float(np.sqrt(np.mean(f**2))) for f in (k3 * x**3, x + k3 * x**3))
    told = f"{left:.2g} of its {size:.2g} N m RMS are lost on run"
    nearly, lost = ([r.text for r in said] for said in (held.approximated, held.lost))
    assert ("spring" in held.kept) is (left < 0.01 * size)
    assert nearly == [told] * (0.01 * size < left < 0.5 * size)
    assert lost == [told] * (left > 0.5 * size)


def test_without_a_log_it_is_told_on_a_sine_over_the_travel():
    hardware = Hardware(travel=(-0.1, 0.3), velocity=0.5)
    axis = AxisModel(1.0, hardware, (fitted("spring", middle=0.1, k1=2.0, k3=90.0),))
    made = export(MachineModel("slide", {"x": axis}, 1000.0, DRIVEN, "slide.xml"), {})
    y = 0.2 * np.sin(np.linspace(0.0, 25.0, 10_000))
    left, size = (float(np.sqrt(np.mean(f**2))) for f in (90.0 * y**3, 2.0 * y + 90.0 * y**3))
    (lost,) = made.lost
    assert lost.text == f"{left:.2g} of its {size:.2g} N RMS are lost on a sine over its travel"


STAYS = "which no effect of the model holds, stays"
SOFT = COMMENTED.replace("<joint name='elbow' axis", "<joint name='elbow' stiffness='2e-3' axis")


@pytest.mark.parametrize(
    ("more", "armature", "stiffness"),
    [
        ({}, f"0.5 kg m^2, {STAYS}", f"0.002 N m/rad, {STAYS}"),
        ({"base": fitted("rotor_inertia", inertia=0.4), "elbow": fitted("spring", k1=1e-3)},
         "0.5 kg m^2 becomes 0.4 kg m^2", "0.002 N m/rad becomes 0.001 N m/rad"),
        ({"base": fitted("rotor_inertia", inertia=0.5), "elbow": fitted("spring", k1=2e-3)},
         None, None),
    ],
)  # fmt: skip
def test_what_is_another_in_the_file_is_told_however_little(more, armature, stiffness):
    assert SOFT != COMMENTED
    said = {f"{r.axis} {r.part}": r.text for r in export(model(SOFT, **more), {}).written}
    assert said.pop("base armature", None) == armature
    assert said.pop("elbow stiffness", None) == stiffness
    assert said == {
        "base damping": "7 N m s/rad becomes 0.3 N m s/rad",
        "base frictionloss": "2 N m becomes 0.8 N m",
        "shoulder damping": "0 N m s/rad becomes 0.2 N m s/rad",
        "shoulder frictionloss": "0 N m becomes 0.4 N m",
        "elbow damping": "0 N m s/rad becomes 0.05 N m s/rad",
        "elbow frictionloss": "0 N m becomes 0.1 N m",
    }


def test_the_command_writes_the_file_that_it_is_given(tmp_path):
    save_model(model(), tmp_path / "arm.toml")
    done = twin("export", "arm.toml", "--to", "mjcf", "-o", "fitted.xml", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    built = mujoco.MjModel.from_xml_path(str(tmp_path / "fitted.xml"))
    np.testing.assert_allclose(built.dof_frictionloss, COULOMB)
    plain = MachineModel("plain", {"x": AxisModel(1.0)}, 1000.0)
    save_model(plain, tmp_path / "plain.toml")
    said = refusal("export", "plain.toml", "--to", "mjcf", "-o", "x.xml", folder=tmp_path)
    assert "has no MuJoCo file to write back" in said
