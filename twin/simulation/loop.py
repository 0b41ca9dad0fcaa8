"""The controller and the compiled control loop: sense, control, step, log, once per sample.

The same loop drives MuJoCo and the reduced model; only the step differs. Both integrate as MuJoCo's
Euler does: v += dt a, then x += dt v with the new v. That x leads the exact motion under a force
held over the sample by dt v/2, so the true position at t_k is x - dt v/2, and a log of the twin has
no delay that the machine does not have.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.core.compiled import borrow, call_at, compiled, doubles_at
from twin.core.native import LAST_ACCELERATION, axis_force, sense
from twin.effect import (
    A_OTHER,
    DT,
    INDEX,
    IO_SIZE,
    MASS,
    MOVED,
    TIME,
    V_OTHER,
    WHEN,
    X_OTHER,
    U,
    V,
    X,
)
from twin.model.machine import AxisModel
from twin.mujoco.callback import USER_HEADER, summed, word_at

# Columns of the gain table, one row an axis.
KP, KI, KD, SMOOTHING, MASS_FF, LIMIT, RESOLUTION = range(7)
# Columns of the controller's state.
INTEGRAL, PREVIOUS, SPEED = range(3)


@dataclass(frozen=True)
class Controller:
    """PID with filtered derivative and mass feedforward, for one axis.

    With all zero the loop is open: only the setpoint's force acts.
    """

    proportional: float = 0.0
    """N/m."""
    integral: float = 0.0
    """N/(m s)."""
    derivative: float = 0.0
    """N s/m, on the speed taken from the reading."""
    filter_bandwidth: float = 0.0
    """Hz, of that speed."""
    mass: float = 0.0
    """kg, of the feedforward."""

    @classmethod
    def for_axis(cls, axis: AxisModel) -> Controller:
        """Gains for the axis' bandwidth: double the phase lead of a PD at damping 0.7."""
        omega = 2.0 * math.pi * axis.hardware.bandwidth
        mass = axis.mass if axis.joint is None else axis.weighed.mass
        return cls(
            proportional=mass * omega**2 / 3.0,
            integral=mass * omega**3 / 30.0,
            derivative=mass * omega,
            filter_bandwidth=6.0 * axis.hardware.bandwidth,
            mass=mass,
        )

    def response(self, frequency: NDArray[np.float64], period: float) -> NDArray[np.complex128]:
        """Force over reading, less its sign, (k,) N/m at frequencies (k,) Hz; see ``command``."""
        late: NDArray[np.complex128] = np.exp(-2j * np.pi * frequency * period)
        kept = math.exp(-2.0 * math.pi * self.filter_bandwidth * period)
        speed = (1.0 - kept) / (1.0 - kept * late) * (1.0 - late) / period
        summed = period * late / (1.0 - late)
        return self.proportional + self.derivative * speed + self.integral * summed


def gain_table(
    controllers: Mapping[str, Controller], axes: Mapping[str, AxisModel], period: float
) -> NDArray[np.float64]:
    """(n_axes, 7) gains for the compiled loop."""
    rows = []
    for name, axis in axes.items():
        c = controllers[name]
        smoothing = 1.0 - math.exp(-2.0 * math.pi * c.filter_bandwidth * period)
        rows.append(
            (c.proportional, c.integral, c.derivative, smoothing, c.mass,
             axis.hardware.force_limit, axis.hardware.encoder_resolution)
        )  # fmt: skip
    return np.array(rows)


@compiled(inline=True)
def measure(position, noise, resolution):
    """Encoder reading: noise added, then rounded to the resolution."""
    if resolution > 0.0:
        return np.rint((position + noise) / resolution) * resolution
    return position + noise


@compiled(inline=True)
def command(gains, state, setpoint, reading, dt, first):
    """Force command in N. setpoint: position m, velocity m/s, acceleration m/s^2, force N."""
    if first:
        state[PREVIOUS] = reading
        state[SPEED] = setpoint[1]
    speed = (reading - state[PREVIOUS]) / dt
    state[PREVIOUS] = reading
    state[SPEED] += gains[SMOOTHING] * (speed - state[SPEED])
    error = setpoint[0] - reading
    force = (
        setpoint[3]
        + gains[MASS_FF] * setpoint[2]
        + gains[KP] * error
        + gains[KD] * (setpoint[1] - state[SPEED])
        + gains[KI] * state[INTEGRAL]
    )
    limited = min(max(force, -gains[LIMIT]), gains[LIMIT])
    if limited == force:  # anti-windup: no integration while the force is saturated
        state[INTEGRAL] += error * dt
    return limited


# --- the loop -------------------------------------------------------------------------------------

# Columns of the logged signals of one axis.
READING_COLUMN, COMMAND_COLUMN, POSITION_COLUMN, VELOCITY_COLUMN = range(4)
N_SIGNALS = 4


@compiled(inline=True)
def control_axis(a, x, v, lead, table, sensing_states, gains, states, setpoint, noise, io, out):
    """Read the encoder, compute the command, log both with the true motion; returns the command.

    lead: s, by which the integrated x is ahead of the exact motion.
    """
    entries, axes, parameters = table
    dt = io[DT]
    io[X] = x
    io[V] = v
    position = x - lead * v
    reading = position
    if axes[a, 4] > axes[a, 3]:
        reading = sense(entries, axes[a, 3], axes[a, 4], parameters, sensing_states, io, position)
    reading = measure(reading, noise, gains[a, RESOLUTION])
    force = command(gains[a], states[a], setpoint, reading, dt, io[INDEX] == 0.0)
    out[READING_COLUMN] = reading
    out[COMMAND_COLUMN] = force
    out[POSITION_COLUMN] = position
    out[VELOCITY_COLUMN] = v
    return force


@compiled(nogil=True)
def run_mujoco(
    step, model, data, off, attached, first_sample, dt, table, sensing_states, gains,
    controller_states, setpoints, noise, watched, signals, forces, states,
):  # fmt: skip
    """Run some samples in MuJoCo.

    attached: userdata, axes and parts as ``Attached`` has them. setpoints (n, n_axes, 4), noise
    (n, n_axes) m. watched: indices of the states to log. Filled: signals (n, n_axes, 4), forces
    (n, n_entries), states (n, n_watched).
    """
    n, n_axes = noise.shape
    n_entries = forces.shape[1]
    n_states = sensing_states.shape[0]
    io = np.zeros(IO_SIZE)
    user_at, where, parts = attached
    (where, parts, table, sensing_states, gains, controller_states, setpoints, signals) = borrow(
        (where, parts, table, sensing_states, gains, controller_states, setpoints, signals)
    )
    userdata, qpos_at, qvel_at, ctrl_at = off
    qpos = doubles_at(word_at(data + qpos_at))
    qvel = doubles_at(word_at(data + qvel_at))
    ctrl = doubles_at(word_at(data + ctrl_at))
    user = doubles_at(word_at(data + userdata))
    origin = user[user_at + 1]
    after = user_at + USER_HEADER + n_states
    io[DT] = dt
    for k in range(n):
        io[INDEX] = first_sample + k
        io[TIME] = origin + (first_sample + k) * dt
        for a in range(n_axes):
            ctrl[where[a, 2]] = control_axis(
                a, summed(where[a], parts, 0, qpos), summed(where[a], parts, 1, qvel), 0.5 * dt,
                table, sensing_states, gains, controller_states, setpoints[k, a], noise[k, a],
                borrow(io), signals[k, a],
            )  # fmt: skip
        call_at(step, (model, data))
        for i in range(n_entries):
            forces[k, i] = user[after + n_states + i]
        for i in range(watched.shape[0]):
            states[k, i] = user[after + watched[i]]


@compiled(nogil=True)
def run_reduced(
    motion, effect_states, masses, substeps, first_sample, origin, dt, table, sensing_states, gains,
    controller_states, setpoints, noise, watched, signals, forces, states,
):  # fmt: skip
    """Run some samples of the reduced model; motion (n_axes, 2) holds x m and v m/s.

    substeps: integration steps a sample, over which the command is held; forces are those of the
    last. origin: s, when sample 0 was. The other arrays are those of run_mujoco.
    """
    n, n_axes = noise.shape
    (effect_states, table, sensing_states, gains, controller_states, setpoints, signals, forces) = (
        borrow(
            (effect_states, table, sensing_states, gains, controller_states, setpoints, signals,
             forces)
        )
    )  # fmt: skip
    entries, axes, parameters = table
    io = np.zeros(IO_SIZE)
    before = np.zeros((n_axes, 3))  # x m, v m/s, last a m/s^2 of every axis as a step begins
    commands = np.zeros(n_axes)
    step = dt / substeps
    drive = step / masses
    io[WHEN] = 1.0
    for k in range(n):
        io[DT] = dt
        io[INDEX] = first_sample + k
        io[TIME] = origin + (first_sample + k) * dt
        for a in range(n_axes):
            commands[a] = control_axis(
                a, motion[a, 0], motion[a, 1], 0.5 * step, table, sensing_states, gains,
                controller_states, setpoints[k, a], noise[k, a], borrow(io), signals[k, a],
            )  # fmt: skip
        io[DT] = step
        for j in range(substeps):
            io[INDEX] = (first_sample + k) * substeps + j
            io[TIME] = origin + ((first_sample + k) * substeps + j) * step
            if n_axes == 2:  # no law of a larger machine reads the other axis (MachineModel)
                for a in range(2):
                    before[a, 0] = motion[a, 0]
                    before[a, 1] = motion[a, 1]
                    before[a, 2] = effect_states[axes[a, 2] + LAST_ACCELERATION]
            for a in range(n_axes):
                io[X] = motion[a, 0]
                io[V] = motion[a, 1]
                io[U] = commands[a]
                io[MASS] = masses[a]
                io[MOVED] = masses[a]
                if n_axes == 2:
                    io[X_OTHER] = before[1 - a, 0]
                    io[V_OTHER] = before[1 - a, 1]
                    io[A_OTHER] = before[1 - a, 2]
                force, structure = axis_force(
                    entries, axes[a, 0], axes[a, 1], parameters, effect_states, axes[a, 2],
                    borrow(io), forces, k,
                )  # fmt: skip
                motion[a, 1] += drive[a] * (force + structure)
                motion[a, 0] += step * motion[a, 1]
        for i in range(watched.shape[0]):
            states[k, i] = effect_states[watched[i]]
