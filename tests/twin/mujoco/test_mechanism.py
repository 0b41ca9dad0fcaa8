"""Bodies of a mechanism: those of MuJoCo's inverse dynamics; their inertia in a user's file."""

import mujoco
import numpy as np
import pytest
from arms import ARM, COUPLED, JOINTS, MOTORS, SUMS

from twin.errors import InputError
from twin.mujoco.mechanism import mechanism_of
from twin.mujoco.written import in_mjcf, inertial, with_inertial

OWN = {joint: joint for joint in JOINTS}
LOOSE = ARM.replace('name="elbow" axis="0 1 0"', 'name="elbow" type="ball"')
MESHED = ARM.replace(
    "<worldbody>",
    '<asset><mesh name="cover" file="not_there.stl"/></asset>\n  <worldbody>',
).replace(
    '<body name="fore" pos="0.4 0 0">',
    '<body name="fore" pos="0.4 0 0"><geom type="mesh" mesh="cover"/>',
)


def smooth_motion(step: float, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration (3, n) of sines."""
    rate, phase = np.array([[2.0], [3.1], [4.3]]), np.array([[0.3], [1.1], [2.0]])
    at = rate * step * np.arange(count) + phase
    return np.sin(at), rate * np.cos(at), -(rate**2) * np.sin(at)


TIE = '<equality><joint joint1="elbow" joint2="shoulder" polycoef="0.2 -1.5 0 0 0"/></equality>'
TIED = ARM.replace("</mujoco>", f"{TIE}</mujoco>")
BOTH = '<tendon><fixed name="both"><joint joint="elbow" coef="2"/></fixed></tendon>'
GRIPPER = TIED.replace("<equality>", f"{BOTH}<equality>")
SPATIAL = (
    ARM.replace('<joint name="elbow"', '<site name="b"/><joint name="elbow"')
    .replace('<body name="fore"', '<site name="a"/><body name="fore"')
    .replace("</mujoco>", "<tendon><spatial name='rope'>ab</spatial></tendon></mujoco>")
    .replace("ab<", '<site site="a"/><site site="b"/><')
)
TRANSMISSIONS = {
    "all axes": (ARM, OWN, np.eye(3), 0.0),
    "the elbow follows": (
        TIED, {"base": "base", "up": "shoulder"}, [[1, 0], [0, 1], [0, -1.5]], [0, 0, 0.2],
    ),
    "tendons of two joints": (COUPLED, MOTORS, np.linalg.inv(SUMS), 0.0),
    "tied tendons": (
        COUPLED.replace(
            "<tendon>",
            '<equality><tendon tendon1="belt" tendon2="lift" polycoef="0.1 2"/></equality><tendon>',
        ),
        {"base": "base", "lift": "lift"}, np.linalg.inv(SUMS) @ [[1, 0], [0, 1], [0, 2]],
        np.linalg.inv(SUMS) @ [0, 0, 0.1],
    ),
    "a tendon of tied joints": (
        GRIPPER, {"base": "base", "grip": "both"}, [[1, 0], [0, -1 / 3], [0, 0.5]],
        [0, 0.2 / 1.5, 0],
    ),
}  # fmt: skip
"""File and axes, and with it how the joints move with these: ratios and where they begin."""


@pytest.mark.parametrize("of", TRANSMISSIONS)
def test_momentum_form_is_the_inverse_dynamics(of):
    """A joint that moves with axes is moved, and felt, by the ratios of their motions."""
    text, axes, by, begun = TRANSMISSIONS[of]
    by = np.array(by)
    step, n = 1e-3, len(axes)
    q, v, a = (rows[:n] for rows in smooth_motion(step, 60))
    mechanism = mechanism_of(text, "arm.xml", axes)
    momentum, force = mechanism.along(q, v, v)
    # Of fourth order: a difference of second order would be the larger error.
    near, far = momentum[:, 3:-1] - momentum[:, 1:-3], momentum[:, 4:] - momentum[:, :-4]
    ours = (8.0 * near - far) / (12.0 * step) + force[:, 2:-2]
    model = mujoco.MjModel.from_xml_string(ARM)
    data, wanted = mujoco.MjData(model), []
    for k in range(2, q.shape[1] - 2):
        data.qpos[:] = by @ q[:, k] + begun
        data.qvel[:], data.qacc[:] = by @ v[:, k], by @ a[:, k]
        mujoco.mj_inverse(model, data)
        wanted.append(by.T @ data.qfrc_inverse)
    largest = np.abs(wanted).max(axis=0)
    assert np.all(np.abs(ours - np.transpose(wanted)).max(axis=1) < 1e-6 * largest)


def test_a_rotor_behind_a_belt_of_several_joints_is_felt_at_each_of_them():
    """The armature of a fixed tendon was no part of a fit, and of every simulation."""
    belt = """<tendon><fixed name="belt" armature="0.01"><joint joint="shoulder" coef="3"/>
    <joint joint="elbow" coef="-2"/></fixed></tendon></mujoco>"""
    q, v, a = smooth_motion(1e-3, 5)
    geared, plain = (
        mechanism_of(text, "arm.xml", OWN) for text in (ARM.replace("</mujoco>", belt), ARM)
    )
    way = np.array([0.0, 3.0, -2.0])
    more = geared.along(q, v, v)[0] - plain.along(q, v, v)[0]
    np.testing.assert_allclose(more, 0.01 * np.outer(way, way) @ v, atol=1e-9)
    np.testing.assert_allclose(
        geared.carried(q, a) - plain.carried(q, a), 0.01 * np.outer(way, way) @ a, atol=1e-9
    )
    np.testing.assert_allclose(geared.inertia - plain.inertia, 0.01 * way**2, atol=1e-9)


def test_what_holds_and_accelerates_bodies_is_the_inverse_dynamics_at_rest():
    q, _, a = smooth_motion(1e-3, 5)
    carried = mechanism_of(ARM, "arm.xml", OWN).carried(q, a)
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    for k in range(q.shape[1]):
        data.qpos[:], data.qacc[:] = q[:, k], a[:, k]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(carried[:, k], data.qfrc_inverse, rtol=1e-9)


def test_a_heavier_body_takes_what_its_parameters_say():
    """Half a kilogram at the place of the fore arm's centre."""
    motion, place = (lambda q, v, _: (q, v, v))(*smooth_motion(1e-3, 20)), (0.15, 0.02, 0.0)
    file, heavier = (
        mechanism_of(text, "arm.xml", OWN) for text in (ARM, ARM.replace('mass="2"', 'mass="2.5"'))
    )
    x, y, _ = place
    more = [0.5, 0.5 * x, 0.5 * y, 0.0]
    more += [0.5 * y * y, 0.5 * x * x, 0.5 * (x * x + y * y), -0.5 * x * y, 0.0, 0.0]
    np.testing.assert_allclose(heavier.inertial(2) - file.inertial(2), more, atol=1e-12)
    wanted = np.subtract(heavier.along(*motion), file.along(*motion))
    found = np.einsum("k,pkan->pan", more, file.per_unit(2, *motion))
    np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max())


def test_axes_may_be_in_another_order_than_joints():
    q, v, _ = smooth_motion(1e-3, 20)
    straight = mechanism_of(ARM, "arm.xml", OWN).along(q, v, v)
    turned = dict(zip("abc", reversed(JOINTS), strict=True))
    back = mechanism_of(ARM, "arm.xml", turned).along(q[::-1], v[::-1], v[::-1])
    for one, other in zip(straight, back, strict=True):
        np.testing.assert_array_equal(one, other[::-1])


@pytest.mark.parametrize(
    "given", [MESHED, ARM.replace("<joint", '<joint damping="3" armature="1"')]
)
def test_meshes_and_what_is_an_effect_are_no_bodies(given):
    q, v, _ = smooth_motion(1e-3, 20)
    plain = mechanism_of(ARM, "arm.xml", OWN).along(q, v, v)
    for one, other in zip(plain, mechanism_of(given, "arm.xml", OWN).along(q, v, v), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "joints", "said"),
    [
        (ARM, {**OWN, "elbow": "elbo"}, r"'elbo' is not in arm.xml, which has base, shoulder"),
        (ARM, {"base": "base", "elbow": "elbow"}, "joints shoulder are no axes"),
        (ARM, {**OWN, "elbow": "base"}, "is that of axis base"),
        (LOOSE, OWN, "neither a hinge nor a slide"),
        ("<mujoco", OWN, "is not an MJCF or URDF file"),
        (COUPLED, {"base": "base", "lift": "lift"}, "joints shoulder, elbow are no axes"),
        (
            COUPLED,
            {**MOTORS, "elbow": "elbow"},
            "axis elbow: .* moves as the axes base, lift, roll",
        ),
        (COUPLED, {**MOTORS, "roll": "twist"}, "which has base, shoulder, elbow, lift, belt; give"),
        (SPATIAL, {**OWN, "elbow": "rope"}, "tendon 'rope' of arm.xml is spatial"),
    ],
)
def test_what_cannot_be_an_axis_is_one_line(text, joints, said):
    with pytest.raises(InputError, match=said) as raised:
        mechanism_of(text, "arm.xml", joints)
    assert "\n" not in str(raised.value)


# A body's inertia is written into the user's own file, and nothing else of it changes


WRITTEN_JOINTS = {"one": "a", "two": "b"}
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
WRITTEN_OWN = '<inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>'
MASS, CENTRE = 2.5, np.array([0.1, 0.0, -0.4])
INERTIA = np.array([[1.2, 0.1, 0.0], [0.1, 1.1, -0.05], [0.0, -0.05, 0.9]])
ELEMENT = inertial(MASS, CENTRE, INERTIA)
ABOUT = INERTIA + MASS * (CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE))
WANTED = np.array([MASS, *(MASS * CENTRE), *ABOUT.diagonal(), *ABOUT[np.triu_indices(3, 1)]])


def file(upper: str = WRITTEN_OWN) -> str:
    return FILE.format(upper=upper)


@pytest.mark.parametrize(
    ("axis", "text", "old"),
    [
        ("one", file(), WRITTEN_OWN),
        ("two", file(), '<inertial pos="0 0 -0.5" mass="2" diaginertia="1 1 1"></inertial>'),
    ],
)
def test_an_element_is_replaced_and_all_else_stays(axis: str, text: str, old: str) -> None:
    made = with_inertial(text, "arm.xml", WRITTEN_JOINTS, axis, ELEMENT, WANTED)
    assert made == text.replace(old, ELEMENT)
    model = mujoco.MjModel.from_xml_string(made)
    body = model.jnt_bodyid[model.joint(WRITTEN_JOINTS[axis]).id]
    np.testing.assert_allclose(model.body_mass[body], MASS)
    np.testing.assert_allclose(model.body_ipos[body], CENTRE, atol=1e-9)


def test_a_body_of_shapes_alone_gets_an_element() -> None:
    text = file('<geom size="0.1" mass="3"/>')
    made = with_inertial(text, "arm.xml", WRITTEN_JOINTS, "one", ELEMENT, WANTED)
    assert made.replace(ELEMENT, "") == text


def test_where_the_file_makes_another_inertia_of_it_is_one_line() -> None:
    with pytest.raises(InputError, match="joint 'a' does not take its inertia from an inertial"):
        with_inertial(file(), "arm.xml", WRITTEN_JOINTS, "one", ELEMENT, 1.1 * WANTED)


def test_a_urdf_becomes_mjcf_first() -> None:
    urdf = """<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    text = in_mjcf(urdf, "arm.urdf")
    made = with_inertial(text, "arm.urdf", {"one": "a"}, "one", ELEMENT, WANTED)
    assert ELEMENT in made
