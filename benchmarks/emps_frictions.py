"""EMPS with four parameters, simulated without the product: what dry friction costs at standstill.

Mass, viscous and Coulomb friction and a constant force, begun at the first reading, as fast as the
first readings say. Twice: with Coulomb friction that stops and lets go at the exact instants, also
between two samples, and with MuJoCo's `frictionloss`, which yields at standstill and is what
mujoco.sysid fits. The first is searched all over the ranges for the least error on the first
record, the second, which is smooth, from there. The second gives the published figure to its last
digit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize

Array = NDArray[np.float64]
Simulated = Callable[[Array, Array, float, float], Array]  # values, force, position, velocity

PERIOD = 1e-3  # s
BEGIN = np.arange(11)  # samples through which a cubic tells how fast a record begins
RANGES = [(80.0, 105.0), (150.0, 260.0), (15.0, 30.0), (-5.0, 8.0)]  # kg, N s/m, N, N
MJCF = f"""
<mujoco>
  <option timestep="{PERIOD}" gravity="0 0 0"/>
  <worldbody><body>
    <joint name="x" type="slide" axis="1 0 0" damping="1" frictionloss="1"/>
    <geom type="box" size=".1 .1 .1" mass="1" contype="0" conaffinity="0"/>
  </body></worldbody>
  <actuator><motor joint="x"/></actuator>
</mujoco>"""


@njit(cache=True)
def exact(values: Array, force: Array, position: float, velocity: float) -> Array:
    """Positions (n,) m under a held force (n,) N; each stop at the instant at which it happens."""
    mass, viscous, coulomb, constant = values
    rate, x, v = viscous / mass, position, velocity
    out = np.empty(len(force))
    for k in range(len(force)):
        out[k] = x
        left, pushed = PERIOD, force[k] + constant
        while left > 0.0 and (v != 0.0 or abs(pushed) > coulomb):
            way = np.sign(v) if v != 0.0 else np.sign(pushed)
            last = (pushed - way * coulomb) / viscous  # m/s, which the speed tends to
            spent = left
            if way * (last + (v - last) * np.exp(-rate * left)) < 0.0:
                spent = np.log((v - last) / -last) / rate
            fall = np.exp(-rate * spent)
            x += last * spent + (v - last) * (1.0 - fall) / rate
            v = last + (v - last) * fall if spent == left else 0.0
            left -= spent
    return out


def mujoco() -> Simulated:
    """The same with MuJoCo's own friction."""
    import mujoco as mj
    from mujoco import rollout

    model = mj.MjModel.from_xml_string(MJCF)
    data = mj.MjData(model)
    state = np.zeros((1, mj.mj_stateSize(model, mj.mjtState.mjSTATE_FULLPHYSICS)))

    def simulated(values: Array, force: Array, position: float, velocity: float) -> Array:
        model.body_mass[1], model.dof_damping[0], model.dof_frictionloss[0], constant = values
        mj.mj_setConst(model, data)
        state[0, 1:3] = position, velocity
        states, _ = rollout.rollout(model, data, state, (force + constant)[None, :-1, None])
        return np.r_[position, states[0, :, 1]]

    return simulated


def error(simulated: Simulated, values: Array, position: Array, force: Array) -> float:
    """RMS of simulated less measured position, m."""
    _, velocity, *_ = np.polynomial.polynomial.polyfit(PERIOD * BEGIN, position[: len(BEGIN)], 3)
    run = simulated(values, force, float(position[0]), float(velocity))
    return float(np.sqrt(np.mean((run - position) ** 2)))


def least(simulated: Simulated, start: Array, position: Array, force: Array) -> Array:
    """Values (4,) of the least error near a start, by a simplex."""

    def cost(values: Array) -> float:
        return error(simulated, values, position, force)

    options = {"xatol": 1e-4, "fatol": 1e-9}
    return np.asarray(minimize(cost, start, method="Nelder-Mead", options=options).x)


def least_of_all(simulated: Simulated, position: Array, force: Array) -> Array:
    """Values (4,) of the least error over the ranges, by a population and a simplex."""

    def cost(values: Array) -> float:
        return error(simulated, values, position, force)

    found = differential_evolution(cost, RANGES, popsize=40, tol=1e-6, rng=0, polish=False).x
    return least(simulated, found, position, force)
