"""A body's inertia is written into the user's own file, and nothing else of it changes."""

import mujoco
import numpy as np
import pytest

from twin.errors import InputError
from twin.mujoco.written import in_mjcf, inertial, with_inertial

JOINTS = {"one": "a", "two": "b"}
FILE = """<mujoco>
  <!-- <body name="lower"> once had <inertial mass="1"/> -->
  <worldbody>
    <body name="upper">
      <joint name="a"/>
      {upper}
      <body name="lower" pos="0 0 -1">
        <inertial pos="0 0 -0.5" mass="2" diaginertia="1 1 1"></inertial>
        <!-- a hinge > -->
        <joint name="b" axis="1 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
OWN = '<inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>'
MASS, CENTRE = 2.5, np.array([0.1, 0.0, -0.4])
INERTIA = np.array([[1.2, 0.1, 0.0], [0.1, 1.1, -0.05], [0.0, -0.05, 0.9]])
ELEMENT = inertial(MASS, CENTRE, INERTIA)
ABOUT = INERTIA + MASS * (CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE))
WANTED = np.array([MASS, *(MASS * CENTRE), *ABOUT.diagonal(), *ABOUT[np.triu_indices(3, 1)]])


def file(upper: str = OWN) -> str:
    return FILE.format(upper=upper)


@pytest.mark.parametrize(
    ("axis", "text", "old"),
    [
        ("one", file(), OWN),
        ("two", file(), '<inertial pos="0 0 -0.5" mass="2" diaginertia="1 1 1"></inertial>'),
    ],
)
def test_an_element_is_replaced_and_all_else_stays(axis: str, text: str, old: str) -> None:
    made = with_inertial(text, "arm.xml", JOINTS, axis, ELEMENT, WANTED)
    assert made == text.replace(old, ELEMENT)
    model = mujoco.MjModel.from_xml_string(made)
    body = model.jnt_bodyid[model.joint(JOINTS[axis]).id]
    np.testing.assert_allclose(model.body_mass[body], MASS)
    np.testing.assert_allclose(model.body_ipos[body], CENTRE, atol=1e-9)


def test_a_body_of_shapes_alone_gets_an_element() -> None:
    text = file('<geom size="0.1" mass="3"/>')
    made = with_inertial(text, "arm.xml", JOINTS, "one", ELEMENT, WANTED)
    assert made.replace(ELEMENT, "") == text


def test_where_the_file_makes_another_inertia_of_it_is_one_line() -> None:
    with pytest.raises(InputError, match="joint 'a' does not take its inertia from an inertial"):
        with_inertial(file(), "arm.xml", JOINTS, "one", ELEMENT, 1.1 * WANTED)


def test_a_urdf_becomes_mjcf_first() -> None:
    urdf = """<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    text = in_mjcf(urdf, "arm.urdf")
    made = with_inertial(text, "arm.urdf", {"one": "a"}, "one", ELEMENT, WANTED)
    assert ELEMENT in made
