"""Laws of the bodies that structure effects build: masses, springs and dampers, exactly stepped."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from twin.errors import InputError
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.mujoco.mjcf import DIRECTIONS, Mount, Spring, attached_joint, machine_spec

PERIOD = 2e-4
MASS, INERTIA = 4.0, 0.3


def plain(*masses: float, rotary: bool = False) -> tuple[mujoco.MjSpec, MachineModel]:
    axes = {
        name: AxisModel(m, Hardware(), rotary=rotary)
        for name, m in zip("xyz", masses, strict=False)
    }
    model = MachineModel("plain", axes, 1.0 / PERIOD)
    return machine_spec(model), model


@pytest.mark.parametrize("frequency", [0.5, 40.0, 700.0])
@pytest.mark.parametrize("ratio", [0.0, 0.05, 0.6])
def test_a_step_decays_and_swings_as_the_exact_motion_does(frequency, ratio):
    """The poles of MuJoCo's step are those of the oscillator over one period."""
    spring = Spring.of(0.2, frequency, ratio, PERIOD)
    k, c, h = spring.stiffness, spring.damping, PERIOD
    kept = 1.0 / (1.0 + h * c)
    step = np.array([[1.0 - h * h * k * kept, h * kept], [-h * k * kept, kept]])
    omega = 2.0 * np.pi * frequency
    pole = np.exp(h * omega * (-ratio + 1j * np.sqrt(1.0 - ratio**2)))
    found = sorted(np.linalg.eigvals(step), key=lambda z: z.imag)
    np.testing.assert_allclose(found, [pole.conj(), pole], atol=1e-7)


@pytest.mark.parametrize("share", [0.1, 0.6])
@pytest.mark.parametrize("frequency", [2e3, 1e5])
def test_a_spring_beyond_the_sampling_rate_is_held_where_the_step_is_stable(frequency, share):
    spring = Spring.of(share, frequency, 0.05, PERIOD)
    assert spring.stiffness <= 2.0 * (1.0 - share) / PERIOD**2
    limit = Spring.of(share, 1e9, 0.05, PERIOD)
    assert spring == limit or frequency < 3.0 / (2.0 * np.pi * PERIOD)


@pytest.mark.parametrize("rotary", [False, True])
def test_what_hangs_on_an_axis_is_taken_off_its_body(rotary):
    mass = INERTIA if rotary else MASS
    spec, _ = plain(mass, 2.0 * mass, rotary=rotary)
    spring = Spring.of(0.3, 25.0, 0.1, PERIOD)
    Mount(spec, "x", "load", mass, rotary).hang(0.3, 25.0, 0.1)
    model = spec.compile()
    own, hung = (model.body(name) for name in ("x", "load"))
    for body, part in ((own, 0.7), (hung, 0.3)):
        moved = body.inertia[0] if rotary else body.mass[0]
        assert moved == pytest.approx(part * mass)
    joint = model.joint("load")
    assert joint.stiffness[0] == pytest.approx(spring.stiffness * 0.3 * mass)
    assert joint.damping[0] == pytest.approx(spring.damping * 0.3 * mass)
    assert joint.type[0] == model.joint("x").type[0]
    np.testing.assert_array_equal(joint.axis, model.joint("x").axis)
    assert not joint.limited[0]
    assert model.body(model.body("load").parentid[0]).name == "x"
    assert model.ntendon == 0


def test_play_is_a_width_within_which_the_spring_does_not_pull():
    spec, _ = plain(MASS)
    Mount(spec, "x", "load", MASS).hang(0.25, 25.0, 0.1, play=3e-3)
    model = spec.compile()
    tendon = model.tendon("load")
    np.testing.assert_allclose(model.tendon_lengthspring[tendon.id], [-1.5e-3, 1.5e-3])
    spring = Spring.of(0.25, 25.0, 0.1, PERIOD)
    assert np.ravel(model.tendon_stiffness)[tendon.id] == pytest.approx(
        spring.stiffness * 1.0
    )  # kg that hang
    assert model.joint("load").stiffness[0] == 0.0
    assert model.joint("load").damping[0] == pytest.approx(spring.damping)


@pytest.mark.parametrize(("rotary", "unit"), [(False, "kg"), (True, "kg m^2")])
def test_more_than_the_axis_has_cannot_hang_on_it(rotary, unit):
    spec, _ = plain(MASS, rotary=rotary)
    with pytest.raises(InputError, match=rf"load hangs 4 {unit.replace('^', '.')} .* only 4 "):
        Mount(spec, "x", "load", MASS, rotary).hang(1.0, 25.0, 0.1)


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_what_an_axis_stands_on_has_the_rest_of_the_mass(share):
    spec, _ = plain(MASS)
    Mount(spec, "x", "base", MASS).stand(share, 8.0, 0.02)
    model = spec.compile()
    spring = Spring.of(share, 8.0, 0.02, PERIOD)
    joint = model.joint("base")
    assert joint.stiffness[0] == pytest.approx(spring.stiffness * MASS / share)
    assert joint.damping[0] == pytest.approx(spring.damping * MASS / share)
    frame = model.body(model.jnt_bodyid[joint.id])
    heavy = frame.mass[0] + model.dof_armature[joint.dofadr[0]]
    assert heavy == pytest.approx(MASS * (1.0 - share) / share)
    np.testing.assert_allclose(joint.axis, model.joint("x").axis)


def test_axes_without_a_file_are_slides_and_hinges_in_turn():
    spec, _ = plain(1.0, 2.0, 3.0)
    model = spec.compile()
    for i, (name, mass) in enumerate((("x", 1.0), ("y", 2.0), ("z", 3.0))):
        assert model.body(name).mass[0] == mass
        np.testing.assert_array_equal(model.joint(name).axis, DIRECTIONS[i])
        assert model.joint(name).type[0] == mujoco.mjtJoint.mjJNT_SLIDE
        assert model.actuator(f"motor_{name}").gear[0] == 1.0
    np.testing.assert_array_equal(np.abs(DIRECTIONS), np.eye(3))
    assert model.opt.timestep == PERIOD
    assert not model.opt.gravity.any()
    turning, _ = plain(INERTIA, rotary=True)
    assert turning.compile().joint("x").type[0] == mujoco.mjtJoint.mjJNT_HINGE
    assert turning.compile().body("x").inertia == pytest.approx(INERTIA)
    assert attached_joint("x", "payload") == "payload_x"
