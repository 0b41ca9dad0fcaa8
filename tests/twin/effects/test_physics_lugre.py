"""Our LuGre friction against SciPy's stiff solver, MuJoCo's own LuGre and closed forms."""

from collections.abc import Callable
from functools import cache

import mujoco
import numpy as np
import pytest
from effect_runs import CATALOGUE
from scipy.integrate import solve_ivp

from twin.core.control import Controller
from twin.core.loop import POSITION_COLUMN, VELOCITY_COLUMN
from twin.effect import OUT
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import Array, Motion, forces, trace
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import MujocoSimulator, ReducedSimulator, run

LUGRE = CATALOGUE["lugre"]
Lugre = dict[str, float]

# The stage of the thesis; the stiff one of table I of Canudas de Wit et al., IEEE TAC 40 (1995), as
# A. Manurung's reconstruction of that paper's simulations gives it (github.com/auralius/LuGre,
# demo2.m; the paper itself could not be opened); a soft one with exponent 1.
STAGE = {
    "Fc": 0.285, "Fs": 0.335, "v0": 0.01, "sigma2": 0.018, "sigma0": 260.0, "sigma1": 0.6, "n": 2.0
}  # fmt: skip
STIFF = {
    "Fc": 1.0, "Fs": 1.5, "v0": 1e-3, "sigma2": 0.4, "sigma0": 1e5, "sigma1": 1e5**0.5, "n": 2.0
}  # fmt: skip
SOFT = {
    "Fc": 0.2, "Fs": 0.5, "v0": 5e-3, "sigma2": 0.1, "sigma0": 2e3, "sigma1": 5.0, "n": 1.0
}  # fmt: skip
SETS = pytest.mark.parametrize("p", [STAGE, STIFF, SOFT], ids=["stage", "stiff", "soft"])
# A mass (kg) pulled by a spring (N/m) whose far end moves at a speed (m/s), over a time (s).
PULLS = pytest.mark.parametrize(
    ("p", "mass", "spring", "speed", "duration", "slips"),
    [(STAGE, 1.0, 5.0, 0.005, 4.0, 0), (STIFF, 1.0, 30.0, 0.05, 4.0, 3),
     (STIFF, 1.0, 2.0, 0.1, 16.0, 2),  # stick-slip of the 1995 paper, by the same reconstruction
     (SOFT, 0.5, 50.0, 0.02, 3.0, 4)],
    ids=["stage", "stiff", "paper", "soft"],
)  # fmt: skip


def level(p: Lugre, v: Array | float) -> Array | float:
    """The Stribeck curve g(v), N."""
    return p["Fc"] + (p["Fs"] - p["Fc"]) * np.exp(-(np.abs(v / p["v0"]) ** p["n"]))


def bristle_rate(p: Lugre, v: Array | float, z: Array | float) -> Array | float:
    """dz/dt, m/s."""
    return v - p["sigma0"] * np.abs(v) * z / level(p, v)


def friction(p: Lugre, v: Array | float, z: Array | float) -> Array | float:
    """The friction force, N."""
    return p["sigma0"] * z + p["sigma1"] * bristle_rate(p, v, z) + p["sigma2"] * v


def along(v: Array, dt: float) -> Motion:
    """That velocity, at one place and without a command."""
    return Motion(dt, np.zeros_like(v), v, np.zeros_like(v))


def simulated(p: Lugre, v: Array, dt: float) -> tuple[Array, Array]:
    """Our law as a simulation steps it: friction N and bristle deflection m after every sample."""
    stepped = trace(LUGRE, p, along(v, dt))
    return stepped.after[:, OUT], stepped.states[:, 0]


def measured(p: Lugre, v: Array, dt: float) -> Array:
    """Our friction along a measured motion, as identification sees it, N."""
    return -forces([Fitted.at_start(LUGRE, p)], along(v, dt))["lugre"]


def wavy(t: Array | float) -> Array | float:
    """A velocity with inner loops: it turns before the bristles have turned."""
    return 0.02 * np.sin(2.0 * np.pi * t) + 0.008 * np.sin(6.6 * np.pi * t)


def rms(a: Array) -> float:
    return float(np.sqrt(np.mean(a**2)))


def require_first_order(error: Callable[[float], float], coarsest: float, halvings: int) -> None:
    """The error halves with the step, every time."""
    np.testing.assert_allclose(falls(error, coarsest, halvings), 2.0, rtol=0.03)


def falls(error: Callable[[float], float], coarsest: float, halvings: int) -> Array:
    """Factors by which the error falls when the step is halved, again and again."""
    errors = np.array([error(coarsest / 2**i) for i in range(halvings + 1)])
    return errors[:-1] / errors[1:]


def stiff_solution(p: Lugre, times: Array) -> Array:
    """The friction on the wavy velocity, N, by SciPy."""
    z = solve_ivp(
        lambda t, z: bristle_rate(p, wavy(t), z), (0.0, times[-1]), [0.0], method="LSODA",
        t_eval=times, rtol=1e-11, atol=1e-15, max_step=1e-3,
    ).y[0]  # fmt: skip
    return friction(p, wavy(times), z)


@SETS
def test_force_along_a_measured_motion_converges_with_the_square_of_the_step(p: Lugre) -> None:
    times = np.arange(1000) * 1e-3
    wanted = stiff_solution(p, times)

    def error(dt: float) -> float:
        every = round(1e-3 / dt)
        return rms(measured(p, wavy(dt * np.arange(1000 * every)), dt)[::every] - wanted)

    np.testing.assert_allclose(falls(error, 5e-4, 2), 4.0, rtol=0.1)
    assert error(1e-4) < 1e-3 * rms(wanted)


def pulled(
    p: Lugre,
    mass: float,
    spring: float,
    speed: float,
    duration: float,
    dt: float,
    stage: type[MujocoSimulator] | type[ReducedSimulator],
) -> Array:
    """The twin's true position m and velocity m/s of the pulled mass, (n, 2)."""
    effects = (
        Fitted.at_start(LUGRE, p),
        Fitted.at_start(CATALOGUE["cable_slab"], {"k1": spring}),
    )
    model = MachineModel("pull", {"x": AxisModel(mass, effects=effects)}, sample_rate=1.0 / dt)
    force = spring * speed * dt * np.arange(round(duration / dt))[:, None]
    still = np.zeros_like(force)
    done = run(
        model, Setpoint(still, still, still, force, 1.0 / dt), np.random.default_rng(0),
        simulator=stage, controllers={"x": Controller()},
    )  # fmt: skip
    return done.signals[:, 0, [POSITION_COLUMN, VELOCITY_COLUMN]]


@PULLS
def test_converges_to_the_stiff_solver_on_a_spring_pulled_mass(
    p: Lugre, mass: float, spring: float, speed: float, duration: float, slips: int
) -> None:
    def motion(t: float, y: Array) -> list[float]:
        x, v, z = y
        return [v, (spring * (speed * t - x) - friction(p, v, z)) / mass, bristle_rate(p, v, z)]

    times = np.arange(0.0, duration, 2e-3)
    exact = solve_ivp(
        motion, (0.0, duration), [0.0, 0.0, 0.0], method="LSODA",
        t_eval=times, rtol=1e-10, atol=1e-13,
    ).y  # fmt: skip
    assert np.sum((exact[1, 1:] > speed) & (exact[1, :-1] <= speed)) == slips

    @cache
    def run_at(dt: float) -> Array:
        return pulled(p, mass, spring, speed, duration, dt, ReducedSimulator)

    for column in (0, 1):

        def error(dt: float, column: int = column) -> float:
            return rms(run_at(dt)[:: round(2e-3 / dt), column] - exact[column])

        require_first_order(error, 2e-4, halvings=2)


def mujoco_lugre(p: Lugre, dt: float, mass: float = 1.0, spring: float = 0.0) -> mujoco.MjModel:
    """A slide with MuJoCo's own LuGre element, and a motor."""
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{dt}" gravity="0 0 0"/>
          <worldbody>
            <body>
              <joint name="slide" type="slide" axis="1 0 0" stiffness="{spring}"/>
              <geom type="sphere" size="0.1" mass="{mass}"/>
            </body>
          </worldbody>
          <actuator>
            <dcmotor joint="slide" input="none" resistance="1" motorconst="0 0"
              lugre="{p["sigma0"]} {p["sigma1"]} {p["Fc"]} {p["Fs"]} {p["v0"]}"
              damping="{p["sigma2"]}"/>
            <motor name="pull" joint="slide"/>
          </actuator>
        </mujoco>""")


GAUSSIAN = pytest.mark.parametrize("p", [STAGE, STIFF], ids=["stage", "stiff"])  # MuJoCo has n = 2


@GAUSSIAN
def test_agrees_with_mujocos_lugre_on_a_given_velocity(p: Lugre) -> None:
    def difference(dt: float) -> float:
        v = wavy(dt * np.arange(round(1.0 / dt)))
        model = mujoco_lugre(p, dt)
        data = mujoco.MjData(model)
        theirs, bristles = np.empty((2, len(v)))
        for k in range(len(v)):
            data.qvel[0] = v[k]
            mujoco.mj_step(model, data)
            theirs[k] = -data.actuator_force[0] - data.qfrc_passive[0]
            bristles[k] = data.act[0]
        force, deflection = simulated(p, v, dt)
        np.testing.assert_allclose(deflection, bristles, rtol=0, atol=1e-10 * np.ptp(bristles))
        return rms(force - theirs)

    require_first_order(difference, 4e-4, halvings=2)
