"""Attached masses: bodies in MuJoCo, the continuous two-mass equations, and their frequencies."""

import mujoco
import numpy as np
import pytest
from effect_runs import CATALOGUE
from scipy.integrate import solve_ivp

from twin.core.control import Controller
from twin.core.loop import POSITION_COLUMN
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import Array
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.mujoco.mjcf import machine_spec
from twin.simulator import MujocoSimulator, ReducedSimulator, run

BOTH = pytest.mark.parametrize("stage", [MujocoSimulator, ReducedSimulator])
Stepper = type[MujocoSimulator] | type[ReducedSimulator]
MASS = 5.0  # kg
VALUES = {
    "flexible_mode": {"load": 0.3, "frequency": 20.0, "damping": 0.05},
    "base_vibration": {"recoil": 0.2, "frequency": 5.0, "damping": 0.1},
    "backlash": {"load": 0.3, "play": 2e-3, "frequency": 25.0, "damping": 0.1},
    "payload_mass": {"ratio": 0.4},
}
EACH = pytest.mark.parametrize("name", VALUES)


def fitted(name: str, **changed: float) -> Fitted:
    return Fitted.at_start(CATALOGUE[name], {**VALUES[name], **changed})


@EACH
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_mujoco_model_has_the_masses(name: str, axis: str) -> None:
    stage = load_model("proton_xy", CATALOGUE)
    plain, model = (
        machine_spec(m).compile()
        for m in (stage, stage.with_axis(axis, stage.axes[axis].with_effect(fitted(name))))
    )
    mass, values = stage.axes[axis].mass, VALUES[name]
    own = model.body(int(model.joint(axis).bodyid[0])).id
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{name}_{axis}")
    before, moved = (m.body_subtreemass[own] for m in (plain, model))
    if name == "payload_mass":
        assert joint == -1
        assert moved == pytest.approx(before + values["ratio"] * mass)
        return
    assert model.nv == plain.nv + 1
    assert moved == pytest.approx(before)
    body = int(model.jnt_bodyid[joint])
    if "load" in values:
        assert model.body_mass[body] == pytest.approx(values["load"] * mass)
        assert model.body_parentid[body] == own
    else:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        whole = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, whole)
        dof = int(model.jnt_dofadr[joint])
        assert whole[dof, dof] == pytest.approx(mass / values["recoil"])


def push(t: Array | float) -> Array | float:
    return 8.0 * np.sin(2.0 * np.pi * 3.0 * t) + 5.0 * np.sin(2.0 * np.pi * 11.0 * t + 0.4)


def equations(name: str) -> tuple:
    """Right side of the continuous equations of position, attached displacement and speeds."""
    p = VALUES[name]
    if name == "payload_mass":
        return lambda t, z: (z[2], 0.0, push(t) / (MASS * (1.0 + p["ratio"])), 0.0)
    w, share = 2.0 * np.pi * p["frequency"], p.get("load", p.get("recoil"))

    def right(t: float, z: Array) -> tuple:
        half = 0.5 * p.get("play", 0.0)
        pull = w**2 * (z[1] - np.clip(z[1], -half, half)) + 2.0 * p["damping"] * w * z[3]
        if name == "base_vibration":  # m (q'' + b'') = F; the rest, m/share - m, feels -F - K b
            carriage = push(t) / MASS
            frame = (-push(t) - MASS / share * pull) / (MASS / share - MASS)
            return z[2], z[3], carriage - frame, frame
        motor = (push(t) + share * MASS * pull) / ((1.0 - share) * MASS)
        return z[2], z[3], motor, -pull - motor

    return right


def error(
    name: str, stage: Stepper, rate: float, exact: Array, t: Array, **changed: float
) -> float:
    """Largest error of the position at those instants, m; the force is held at its mean."""
    n = round(t[-1] * rate) + 1
    edges = np.arange(n + 1) / rate
    points, weights = np.polynomial.legendre.leggauss(5)
    middles = edges[:-1, None] + 0.5 * (1.0 + points) / rate
    force = 0.5 * push(middles) @ weights
    still = np.zeros((n, 1))
    model = MachineModel(
        "mass", {"x": AxisModel(MASS, effects=(fitted(name, **changed),))}, sample_rate=rate
    )
    done = run(
        model, Setpoint(still, still, still, force[:, None], rate),
        np.random.default_rng(0), simulator=stage, controllers={"x": Controller()},
    )  # fmt: skip
    found = done.signals[np.rint(t * rate).astype(int), 0, POSITION_COLUMN]
    return float(np.abs(found - exact).max())


@EACH
@BOTH
def test_it_converges_to_the_continuous_equations(name: str, stage: Stepper) -> None:
    t = np.arange(1, 101) * 5e-3
    solved = solve_ivp(
        equations(name), (0.0, t[-1]), np.zeros(4), "DOP853", t, rtol=1e-11, atol=1e-14,
        max_step=1e-3,
    )  # fmt: skip
    exact = solved.y[0]
    coarse, fine = (error(name, stage, rate, exact, t) for rate in (2000.0, 8000.0))
    assert fine < 1e-4 * np.ptp(exact)
    assert fine < 0.4 * coarse or coarse < 1e-9 * np.ptp(exact)
    off = {p: 1.1 * v for p, v in VALUES[name].items() if p in ("frequency", "ratio")}
    assert error(name, stage, 8000.0, exact, t, **off) > 4.0 * fine, "blind"
