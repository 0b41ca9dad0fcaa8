"""The bodies that structure effects build in MuJoCo: their masses, and on what they hang."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
import pytest
from axis_runs import effect

from twin.errors import InputError
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.mujoco.mjcf import Spring, attached_joint, machine_spec

PERIOD = 2e-4  # s
STAGE = load_model("proton_xy")
VALUES = {
    "flexible_mode": {"load": 0.3, "frequency": 25.0},
    "backlash": {"load": 0.25, "frequency": 25.0, "play": 3e-3},
    "base_vibration": {"recoil": 0.2, "frequency": 8.0},
    "payload_mass": {"ratio": 0.4},
}
EACH = pytest.mark.parametrize("name", VALUES)
ROTARY = pytest.mark.parametrize("rotary", [False, True])


def having(model: MachineModel, effects: Mapping[str, Fitted]) -> mujoco.MjModel:
    """The compiled machine with one more effect by axis."""
    for axis, fitted in effects.items():
        model = model.with_axis(axis, model.axes[axis].with_effect(fitted))
    return machine_spec(model).compile()


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


# --- the step of a spring -------------------------------------------------------------------------


@pytest.mark.parametrize("frequency", [0.5, 40.0, 700.0])
@pytest.mark.parametrize("ratio", [0.0, 0.05, 0.6])
def test_a_step_decays_and_swings_as_the_exact_motion_does(frequency: float, ratio: float) -> None:
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
def test_a_spring_beyond_the_sampling_rate_is_held_where_the_step_is_stable(
    frequency: float, share: float
) -> None:
    spring = Spring.of(share, frequency, 0.05, PERIOD)
    assert spring.stiffness <= 2.0 * (1.0 - share) / PERIOD**2
    limit = Spring.of(share, 1e9, 0.05, PERIOD)
    assert spring == limit or frequency < 3.0 / (2.0 * np.pi * PERIOD)


# --- masses ---------------------------------------------------------------------------------------


@EACH
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_stage_keeps_its_masses_and_each_part_has_its_own(name: str, axis: str) -> None:
    bare, model = machine_spec(STAGE).compile(), having(STAGE, {axis: effect(name, **VALUES[name])})
    mass, values = STAGE.axes[axis].mass, VALUES[name]
    own = int(model.joint(axis).bodyid[0])
    before, moved = (m.body_subtreemass[own] for m in (bare, model))
    joint = attached_joint(axis, name)
    if name == "payload_mass":
        assert model.nv == bare.nv
        assert moved == pytest.approx(before + values["ratio"] * mass)
        return
    assert model.nv == bare.nv + 1
    assert moved == pytest.approx(before)
    if "load" in values:
        assert mass_felt(model, joint) == pytest.approx(values["load"] * mass)
        assert model.body_parentid[int(model.joint(joint).bodyid[0])] == own
    else:
        assert mass_felt(model, joint) == pytest.approx(mass / values["recoil"])


@pytest.mark.parametrize("recoils", [(0.6, 0.1), (0.2, 0.35), (0.3, 0.3)])
def test_a_frame_on_springs_both_ways_has_the_mass_of_each_way(
    recoils: tuple[float, float],
) -> None:
    """One body for both: what one way is heavier stands on that joint alone, never below 0."""
    parts = {a: effect("base_vibration", recoil=r) for a, r in zip("xy", recoils, strict=True)}
    model = having(STAGE, parts)
    for axis, recoil in zip("xy", recoils, strict=True):
        felt = mass_felt(model, attached_joint(axis, "base_vibration"))
        assert felt == pytest.approx(STAGE.axes[axis].mass / recoil)
    assert np.all(model.dof_armature >= 0.0)
    assert np.count_nonzero(model.dof_armature > 1e-9) == 1


@ROTARY
@pytest.mark.parametrize("name", ["flexible_mode", "backlash"])
def test_what_hangs_on_an_axis_is_taken_off_its_body(name: str, rotary: bool) -> None:
    mass, values = 0.3 if rotary else 4.0, VALUES[name]
    model = having(plain(mass, 2.0 * mass, rotary=rotary), {"x": effect(name, **values)})
    joint, load = model.joint(attached_joint("x", name)), values["load"] * mass
    own, hung = model.body("x"), model.body(attached_joint("x", name))
    for body, part in ((own, mass - load), (hung, load)):
        assert (body.inertia[0] if rotary else body.mass[0]) == pytest.approx(part)
    damping = effect(name, **values).values["damping"]
    spring = Spring.of(values["load"], values["frequency"], damping, PERIOD)
    assert joint.damping[0] == pytest.approx(spring.damping * load)
    if "play" in values:  # a width within which the spring does not pull
        np.testing.assert_allclose(model.tendon_lengthspring[0], [-1.5e-3, 1.5e-3])
        assert np.ravel(model.tendon_stiffness)[0] == pytest.approx(spring.stiffness * load)
        assert joint.stiffness[0] == 0.0
    else:
        assert joint.stiffness[0] == pytest.approx(spring.stiffness * load)
        assert model.ntendon == 0
    assert joint.type[0] == model.joint("x").type[0]
    np.testing.assert_array_equal(joint.axis, model.joint("x").axis)
    assert not joint.limited[0]


@ROTARY
def test_what_an_axis_stands_on_swings_along_it(rotary: bool) -> None:
    model = having(plain(4.0, rotary=rotary), {"x": effect("base_vibration", recoil=0.1)})
    joint = model.joint("base_vibration_x")
    assert mass_felt(model, "base_vibration_x") == pytest.approx(40.0)
    np.testing.assert_allclose(joint.axis, model.joint("x").axis)
    assert joint.type[0] == model.joint("x").type[0]


# --- machines without a file, and what is refused -------------------------------------------------


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
def test_more_than_the_axis_has_is_refused_with_its_mass(
    axis: str, fitted: Fitted, message: str
) -> None:
    with pytest.raises(InputError, match=rf"axis {axis}: {fitted.effect.name}_{axis} {message}"):
        having(STAGE, {axis: fitted})
