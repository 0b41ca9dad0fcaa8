"""Frictions against closed forms, SciPy's solvers and MuJoCo's plastic springs."""

from itertools import pairwise

import mujoco
import numpy as np
import pytest
from friction_runs import (
    ELEMENTS,
    along,
    at_turns,
    error_of,
    friction,
    reversals,
    shares_and_springs,
    travelled,
    wavy,
)
from scipy.integrate import solve_ivp

from twin.laws.trials import Array

# --- Dahl -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1.0, 2.0])
def test_dahl_agrees_with_a_stiff_solver(n: float) -> None:
    p = {"Fc": 1.0, "sigma0": 1e5, "sigma2": 0.4, "n": n}

    def rate(t: float, f: Array) -> Array:
        left = 1.0 - f * np.sign(wavy(t))
        return p["sigma0"] * np.sign(left) * np.abs(left) ** n * wavy(t)

    instants = [0.0, *reversals(1.0), 1.0]
    pieces, start = [], [0.0]
    for begin, end in pairwise(instants):
        solved = solve_ivp(
            rate, (begin, end), start, method="LSODA", rtol=1e-11, atol=1e-13, dense_output=True
        )
        pieces.append(solved.sol)
        start = solved.y[:, -1]

    def wanted(t: Array) -> Array:
        where = np.searchsorted(instants, t) - 1
        f = np.array([pieces[i](one)[0] for i, one in zip(where, t, strict=True)])
        return f + p["sigma2"] * wavy(t)

    errors = [error_of(friction("dahl", **p), wanted, dt) for dt in (1e-3, 5e-4, 2.5e-4)]
    assert errors[-1] < 3e-4
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.35)


# --- generalized Maxwell-slip ---------------------------------------------------------------------


@pytest.mark.parametrize("dt", [1e-3, 1e-4])
def test_gms_with_a_constant_level_is_mujocos_bundle_of_plastic_springs(dt: float) -> None:
    """Maxwell-slip elements as tendons that yield: springyield = a_i g/k_i."""
    shares, springs = shares_and_springs(5, 40.0, 1e5)
    tendons = "".join(
        f'<fixed stiffness="{k}" springyield="{a / k}"><joint joint="q" coef="1"/></fixed>'
        for a, k in zip(shares, springs, strict=True)
    )
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{dt}" gravity="0 0 0"/>
          <worldbody>
            <body><joint name="q" type="slide" axis="1 0 0"/><geom size="1" mass="1e9"/></body>
          </worldbody>
          <tendon>{tendons}</tendon>
        </mujoco>""")
    data = mujoco.MjData(model)
    t = dt * np.arange(round(1.0 / dt))
    v = np.diff(travelled(np.append(t, t[-1] + dt))) / dt
    theirs = np.empty(len(t))
    for k in range(len(t)):
        data.qpos[0], data.qvel[0] = travelled(t[k]), v[k]
        mujoco.mj_step(model, data)
        theirs[k] = -data.qfrc_passive[0]
    middle = along(friction("gms", **ELEMENTS, Fc=1.0, Fs=1.0, sigma2=0.0), v, dt)
    ours = np.zeros(len(v))  # at the start of each sample, as theirs
    for k in range(len(v) - 1):
        ours[k + 1] = 2.0 * middle[k] - ours[k]
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["gms", "modified_leuven"])
def test_elements_given_one_by_one(name: str) -> None:
    """Published a_i and k_i: with spread 1, share_i = a_i and stiff_i = k_i."""
    a, k = np.array([0.5, 0.2, 0.3]), np.array([6e4, 1e4, 3e4])
    own = {f"share_{i + 1}": float(a[i]) for i in range(3)}
    own |= {f"stiff_{i + 1}": float(k[i]) for i in range(3)}
    given = friction(
        name, elements=3, spread=1.0, sigma0=float(k.sum()), Fc=1.5, Fs=1.5, **own,
        **({"m": 50.0, "reserve": 1.0} if name == "modified_leuven" else {}),
    )  # fmt: skip
    x = np.array([5e-6, 1.2e-5, 1.5e-5])
    wanted = np.minimum(np.outer(x, k), 1.5 * a).sum(axis=1)
    np.testing.assert_allclose(at_turns(given, x), wanted, rtol=2e-4)
