"""The position controller: feedback and feedforward on the encoder reading, at the sample rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.core.compiled import compiled
from twin.model.machine import AxisModel

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
        late = np.exp(-2j * np.pi * frequency * period)
        kept = math.exp(-2.0 * math.pi * self.filter_bandwidth * period)
        speed = (1.0 - kept) / (1.0 - kept * late) * (1.0 - late) / period
        summed = period * late / (1.0 - late)
        return np.asarray(self.proportional + self.derivative * speed + self.integral * summed)


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
