"""Frictions against solvers of others: SciPy's stiff one and MuJoCo's plastic springs."""

import mujoco
import numpy as np
import pytest
from axis_runs import effect, pushed
from friction_runs import PAPER, along, at_turns, friction, travelled
from scipy.integrate import solve_ivp

from twin.signals import Array

# The stage of the thesis; the stiff one of the paper; a soft one with exponent 1.
STAGE = {
    "Fc": 0.285, "Fs": 0.335, "v0": 0.01, "sigma2": 0.018, "sigma0": 260.0, "sigma1": 0.6, "n": 2.0
}  # fmt: skip
STIFF = {**PAPER, "n": 2.0}
SOFT = {
    "Fc": 0.2, "Fs": 0.5, "v0": 5e-3, "sigma2": 0.1, "sigma0": 2e3, "sigma1": 5.0, "n": 1.0
}  # fmt: skip


def rms(a: Array) -> float:
    return float(np.sqrt(np.mean(a**2)))


@pytest.mark.parametrize(
    ("p", "mass", "spring", "speed", "duration", "slips"),
    [(STAGE, 1.0, 5.0, 0.005, 4.0, 0),
     (STIFF, 1.0, 2.0, 0.1, 16.0, 2),  # stick-slip of the 1995 paper, by the same reconstruction
     (SOFT, 0.5, 50.0, 0.02, 3.0, 4)],
    ids=["stage", "paper", "soft"],
)  # fmt: skip
def test_lugre_converges_to_the_stiff_solver_on_a_mass_pulled_by_a_spring(
    p, mass, spring, speed, duration, slips
):
    """The spring's far end moves at a speed. The error halves with the step."""

    def rates(t: float, y: Array) -> list[float]:
        x, v, z = y
        level = p["Fc"] + (p["Fs"] - p["Fc"]) * np.exp(-(abs(v / p["v0"]) ** p["n"]))
        dz = v - p["sigma0"] * abs(v) * z / level
        force = p["sigma0"] * z + p["sigma1"] * dz + p["sigma2"] * v
        return [v, (spring * (speed * t - x) - force) / mass, dz]

    times = np.arange(0.0, duration, 2e-3)
    exact = solve_ivp(
        rates, (0.0, duration), [0.0, 0.0, 0.0], method="LSODA", t_eval=times, rtol=1e-10,
        atol=1e-13,
    ).y  # fmt: skip
    assert np.sum((exact[1, 1:] > speed) & (exact[1, :-1] <= speed)) == slips
    effects, errors = (effect("lugre", **p), effect("cable_slab", k1=spring)), []
    for dt in (2e-4, 1e-4, 5e-5):
        pull = spring * speed * dt * np.arange(round(duration / dt))
        run, every = pushed(mass, effects, pull, rate=1.0 / dt), round(2e-3 / dt)
        errors.append([rms(run.x[::every] - exact[0]), rms(run.v[::every] - exact[1])])
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.03)


def mujoco_slide(dt: float, inside: str, elements: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{dt}" gravity="0 0 0"/>
          <worldbody>
            <body><joint name="q" type="slide" axis="1 0 0"/>{inside}</body>
          </worldbody>
          {elements}
        </mujoco>""")
    return model, mujoco.MjData(model)


def test_gms_with_a_constant_level_is_mujocos_bundle_of_plastic_springs() -> None:
    """Maxwell-slip elements as tendons that yield: springyield = a_i g/k_i."""
    dt = 1e-3
    springs = 40.0 ** (-np.arange(5) / 4)
    springs *= 1e5 / springs.sum()
    tendons = "".join(
        f'<fixed stiffness="{k}" springyield="{0.2 / k}"><joint joint="q" coef="1"/></fixed>'
        for k in springs
    )
    model, data = mujoco_slide(dt, '<geom size="1" mass="1e9"/>', f"<tendon>{tendons}</tendon>")
    t = dt * np.arange(round(1.0 / dt))
    v = np.diff(travelled(np.append(t, t[-1] + dt))) / dt
    theirs = np.empty(len(t))
    for k in range(len(t)):
        data.qpos[0], data.qvel[0] = travelled(t[k]), v[k]
        mujoco.mj_step(model, data)
        theirs[k] = -data.qfrc_passive[0]
    gms = friction("gms", elements=5, spread=40.0, Fc=1.0, Fs=1.0, sigma2=0.0)
    middle = along(gms, v, dt)
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
    own |= {"m": 50.0, "reserve": 1.0} if name == "modified_leuven" else {}
    given = friction(name, elements=3, spread=1.0, sigma0=float(k.sum()), Fc=1.5, Fs=1.5, **own)
    x = np.array([5e-6, 1.2e-5, 1.5e-5])
    wanted = np.minimum(np.outer(x, k), 1.5 * a).sum(axis=1)
    np.testing.assert_allclose(at_turns(given, x), wanted, rtol=2e-4)
