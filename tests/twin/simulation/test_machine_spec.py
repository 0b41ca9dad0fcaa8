"""The MuJoCo machine of a model: its masses, what hangs on springs, and what is refused."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulation.spec import machine_spec

CATALOGUE = load_catalogue()
STACKED = """<mujoco>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="7" diaginertia="1 1 1"/>
      <body name="lower">
        <joint name="x" type="slide" axis="1 0 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <body name="upper">
          <joint name="y" type="slide" axis="0 1 0"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="motor_x" joint="x" gear="1"/>
    <motor name="motor_y" joint="y" gear="1"/>
  </actuator>
</mujoco>"""
ROTARY_FILE = """<mujoco>
  <worldbody>
    <body name="disc">
      <joint name="a" type="hinge" axis="0 0 1"/>
      <geom type="cylinder" size="0.1 0.02" mass="3"/>
    </body>
  </worldbody>
  <actuator><motor name="motor_a" joint="a"/></actuator>
</mujoco>"""
STAGE = MachineModel(
    "s", {"x": AxisModel(15.0), "y": AxisModel(6.0)}, 10_000.0, mjcf=STACKED, mjcf_name="s.xml"
)
PLAIN = MachineModel("p", {"x": AxisModel(4.0), "a": AxisModel(0.2, rotary=True)}, 10_000.0)


def having(model: MachineModel, axis: str, effect: str, **values: float) -> MachineModel:
    fitted = Fitted.at_start(CATALOGUE[effect], values)
    return model.with_axis(axis, model.axes[axis].with_effect(fitted))


def built(model: MachineModel) -> mujoco.MjModel:
    return machine_spec(model).compile()


def test_an_axis_that_carries_another_moves_both_masses() -> None:
    made = built(STAGE)
    assert made.body("lower").mass[0] == pytest.approx(9.0)
    assert made.body("upper").mass[0] == pytest.approx(6.0)
    assert made.opt.timestep == 1e-4


def test_the_mass_is_the_models_where_the_file_has_it_by_geoms() -> None:
    """The geoms' mass was kept: 1 kg in place of 9, and MuJoCo's motion was another machine's."""
    inertial, geom = '<inertial pos="0 0 0" mass="1"', '<geom type="box" size="1 1 1" mass="1"'
    file = STACKED.replace(inertial + ' diaginertia="1 1 1"', geom)
    tool = file.replace("</body>", '<body name="tool"><geom size="0.1" mass="2"/></body></body>', 1)
    bare = STACKED.replace(inertial + ' diaginertia="1 1 1"/>', "")
    for mjcf, upper in ((file, 6.0), (tool, 4.0), (bare, 6.0)):
        made = built(replace(STAGE, mjcf=mjcf))
        assert made.body("upper").mass[0] == pytest.approx(upper)
        assert made.body("lower").mass[0] == pytest.approx(9.0)
        assert made.body_subtreemass[made.body("lower").id] == pytest.approx(15.0)


def test_a_rotary_axis_has_its_inertia_about_its_hinge_and_the_mass_of_the_file() -> None:
    disc = MachineModel("d", {"a": AxisModel(0.3, rotary=True)}, mjcf=ROTARY_FILE, mjcf_name="d")
    made = built(disc)
    assert made.body("disc").mass[0] == pytest.approx(3.0)
    np.testing.assert_allclose(made.body("disc").inertia, 0.3)
    np.testing.assert_allclose(built(PLAIN).body("a").inertia, 0.2)


@pytest.mark.parametrize(("axis", "whole"), [("x", 4.0), ("a", 0.2)])
def test_a_part_on_a_spring_swings_with_its_frequency_and_damping(axis: str, whole: float) -> None:
    loaded = having(PLAIN, axis, "flexible_mode", load=0.25, frequency=20.0, damping=0.1)
    made = built(loaded)
    hung, own = made.body(f"flexible_mode_{axis}"), made.body(axis)
    of = {"x": lambda b: b.mass[0], "a": lambda b: b.inertia[0]}[axis]
    assert of(hung) == pytest.approx(0.25 * whole)
    assert of(own) == pytest.approx(0.75 * whole)
    turn = 2.0 * np.pi * 20.0
    joint = made.joint(f"flexible_mode_{axis}")
    assert joint.stiffness[0] == pytest.approx(0.25 * whole * turn**2, rel=0.02)
    assert joint.damping[0] == pytest.approx(0.25 * whole * 2.0 * 0.1 * turn, rel=0.05)


def test_a_play_is_a_spring_that_does_not_pull_within_it() -> None:
    values = {"load": 0.25, "frequency": 20.0, "damping": 0.1, "play": 4e-4}
    made = built(having(PLAIN, "x", "backlash", **values))
    assert made.joint("backlash_x").stiffness[0] == 0.0
    np.testing.assert_allclose(made.tendon_lengthspring, [[-2e-4, 2e-4]])
    assert made.tendon_stiffness[0] == pytest.approx((2.0 * np.pi * 20.0) ** 2, rel=0.02)


def test_what_an_axis_stands_on_swings_with_its_share_of_the_mass() -> None:
    values = {"recoil": 0.2, "frequency": 8.0, "damping": 0.05}
    made = built(having(PLAIN, "x", "base_vibration", **values))
    turn, carried = 2.0 * np.pi * 8.0, 4.0 / 0.2  # kg on the spring, the axis among it
    joint = made.joint("base_vibration_x")
    assert joint.stiffness[0] == pytest.approx(carried * turn**2, rel=0.02)
    assert joint.damping[0] == pytest.approx(carried * 2.0 * 0.05 * turn, rel=0.05)
    assert made.body("frame_x").mass[0] == pytest.approx(carried - 4.0)


STANDING = {"frequency": 8.0, "damping": 0.05}


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (
            having(STAGE, "x", "flexible_mode", load=0.7, frequency=20.0, damping=0.1),
            "axis x: flexible_mode_x hangs 10.5 kg on a spring, but the axis has only 9 kg of its "
            "own; give a smaller share of the moved mass",
        ),
        (
            having(STAGE, "y", "base_vibration", recoil=0.5, **STANDING),
            "axis y: base_vibration_y leaves 6 kg for what the axis stands on, of which its guide "
            "has 9 kg; give a smaller share",
        ),
        (
            replace(STAGE, axes={"x": AxisModel(5.0), "y": AxisModel(6.0)}),
            "axis x: mass 5 kg is not above the 6 kg of what it carries; give the whole moved mass",
        ),
        (
            replace(STAGE, mjcf=STACKED.replace('joint="x" gear="1"', 'joint="x" gear="2.5"')),
            "s.xml: motor_x has gear 2.5; the command is in N, give gear 1",
        ),
        (
            replace(STAGE, mjcf=STACKED.replace('name="y" type', 'name="y" damping="3" type')),
            "s.xml: joint 'y' has damping of its own; remove it and give the axis an effect",
        ),
        (
            replace(STAGE, axes={"x": AxisModel(15.0), "y": AxisModel(1.0, rotary=True)}),
            "s.xml: joint 'y' is not a hinge, but the axis is rotary (inertia in kg m^2); change",
        ),
        (
            replace(STAGE, axes={"x": AxisModel(15.0), "z": AxisModel(1.0)}),
            "s.xml: has no joint 'z' with a motor 'motor_z'; an axis needs both",
        ),
    ],
)
def test_what_cannot_be_built_is_refused_with_its_masses(model: MachineModel, said: str) -> None:
    with pytest.raises(InputError) as refused:
        built(model)
    assert str(refused.value).startswith(said)
