"""The laws of the baseline - LuGre, cable slab, roller spikes - fused by hand in one function.

What the product gains by generality is measured against this: the same equations, written as one
would for this machine alone.
"""

from __future__ import annotations

from math import copysign, exp, expm1, floor

import numba
import numpy as np

from benchmarks.timing import Array
from twin.model.machine import AxisModel
from twin.simulation.loop import (
    COMMAND_COLUMN,
    POSITION_COLUMN,
    READING_COLUMN,
    RESOLUTION,
    VELOCITY_COLUMN,
    command,
    measure,
)

EFFECTS = ("lugre", "cable_slab", "roller_spikes")
TURN = 2e-5  # m
TURNED = 1e-12
GONE = 40.0
SHORT = 0.05


def constants(axis: AxisModel) -> Array:
    """The 16 numbers of the laws, in the order in which ``force`` takes them."""
    return np.array([v for name in EFFECTS for v in axis[name].vector()])


@numba.njit(cache=True, error_model="numpy", inline="always")
def force(c, state, x, v, dt, when):
    """Cable, spikes and friction on the axis, N.

    c (16,): see ``constants``; state: z m, direction; when: see twin.effect.WHEN.
    """
    speed = abs(v)
    q = speed / c[2]
    depth = q * q
    fall = exp(-depth) if depth < GONE else 0.0
    level = c[0] + (c[1] - c[0]) * fall
    a = speed * (c[4] * dt / level)
    if a < SHORT:
        b = a * a
        sinh = a * (1.0 + b * (1 / 6 + b * (1 / 120 + b * (1 / 5040))))
        grown = sinh - b * (1 / 2 + b * (1 / 24 + b * (1 / 720 + b * (1 / 40320))))
    else:
        grown = -expm1(-a)
    change = (copysign(level / c[4], v) - state[0]) * grown
    friction = c[4] * (state[0] + when * change) + c[5] / dt * change + c[3] * v
    state[0] += change
    cable = -(c[7] + x * (c[8] + x * (c[9] + x * c[10])))
    direction = state[1]
    if v != 0.0:
        turn = copysign(1.0, v) - direction
        if abs(turn) > TURNED:
            turn *= -expm1(-speed * dt / TURN)
        state[1] += turn
        direction += when * turn
    turns = (x - c[13]) / c[11]
    r = 2.0 * (turns - floor(turns + 0.5)) * c[11] / c[12]
    bump = (1.0 - r * r) * (1.0 - r * r) if abs(r) < 1.0 else 0.0
    spikes = -0.5 * ((c[14] + c[15]) * direction + (c[14] - c[15])) * bump
    return cable, spikes, friction


@numba.njit(cache=True, error_model="numpy", nogil=True)
def along(c, position, velocity, dt, out):
    """Force (n,) N of the laws along a measured motion, at its own rate: one pass."""
    state = np.zeros(2)
    for k in range(position.shape[0]):
        cable, spikes, friction = force(c, state, position[k], velocity[k], dt, 0.5)
        out[k] = cable + spikes - friction


@numba.njit(cache=True, error_model="numpy", nogil=True)
def stepped(
    c, masses, dt, motion, state, first, gains, controllers, setpoints, noise,
    signals, forces, states,
):  # fmt: skip
    """Run the reduced model of some axes as twin.simulation.loop.run_reduced does, for these laws.

    c (n_axes, 16); motion (n_axes, 2): x m, v m/s; state (n_axes, 2): z m, direction. The other
    arguments are those of run_reduced.
    """
    n, n_axes = noise.shape
    for k in range(n):
        for a in range(n_axes):
            x, v = motion[a, 0], motion[a, 1]
            position = x - 0.5 * dt * v
            reading = measure(position, noise[k, a], gains[a, RESOLUTION])
            u = command(gains[a], controllers[a], setpoints[k, a], reading, dt, first + k == 0)
            signals[k, a, READING_COLUMN] = reading
            signals[k, a, COMMAND_COLUMN] = u
            signals[k, a, POSITION_COLUMN] = position
            signals[k, a, VELOCITY_COLUMN] = v
            cable, spikes, friction = force(c[a], state[a], x, v, dt, 1.0)
            forces[k, 3 * a] = cable
            forces[k, 3 * a + 1] = spikes
            forces[k, 3 * a + 2] = -friction
            v += dt / masses[a] * (cable + spikes - friction + u)
            motion[a, 0], motion[a, 1] = x + dt * v, v
            states[k, 2 * a], states[k, 2 * a + 1] = state[a, 1], state[a, 0]
