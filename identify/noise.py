"""The noise floor of a force residual, from the data alone.

The raw residual u - m a, with a from second differences, is all noise at high frequency: white
noise of the measured force, S = A, and of the encoder, S = B (m (2 - 2 cos(w dt))/dt^2)^2. A and B
are fitted to its spectrum above the band of the effects, and give what passes the windows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import welch

from identify.actuation import actual_force
from identify.motion import Motion
from identify.weak import Window
from twin.model import AxisModel

Array = NDArray[np.float64]

SEGMENT = 0.25  # s; short, so that most segments hold neither a reversal nor a spike
BAND = (50.0, 0.1, 0.45)  # fit from 50 Hz or this part of the sample rate, to that part of it


def noise_floor(axis: AxisModel, logs: Sequence[tuple[Motion, Window]]) -> float:
    """RMS in N of what measurement noise leaves in the windowed residual of these logs."""
    parts = [_variance(axis, motion, window) for motion, window in logs]
    weights = [motion.signals.shape[1] for motion, _ in logs]
    return float(np.sqrt(np.average(parts, weights=weights)))


def _variance(axis: AxisModel, motion: Motion, window: Window) -> float:
    frequency, passed, segment = noise_spectrum(axis, motion)
    response = window.response(motion.sample_period, segment)
    return float(np.trapezoid(passed * response, frequency))


def noise_spectrum(axis: AxisModel, motion: Motion) -> tuple[Array, Array, int]:
    """What measurement noise leaves in a force residual: frequencies (k,) Hz, power (k,) N^2/Hz.

    One-sided, before any window; and the samples that the frequencies belong to.
    """
    dt = motion.sample_period
    mass = axis.mass
    velocity = motion.raw[0]
    # The loop's own noise is in the command and moves the axis; a delay left out would tear the two
    # apart and pass for measurement noise.
    command = actual_force(axis, motion)
    raw = 0.5 * (command[1:] + command[:-1]) - mass * np.diff(velocity) / dt
    # The median over segments passes by those with spikes and reversals.
    segment = min(max(round(SEGMENT / dt), 256), len(raw))
    frequency, power = welch(raw, 1.0 / dt, nperseg=segment, average="median", detrend="linear")
    half = np.cos(np.pi * frequency * dt) ** 2
    bend = ((2.0 - 2.0 * np.cos(2.0 * np.pi * frequency * dt)) * mass / dt**2) ** 2
    band = (frequency > min(BAND[0], BAND[1] / dt)) & (frequency < BAND[2] / dt)
    levels = _fit_levels(np.stack([half, bend], axis=1)[band], power[band])
    return frequency, levels[0] + levels[1] * bend, segment


def _fit_levels(shapes: Array, power: Array) -> Array:
    """Non-negative levels by least squares on the relative error, repeated: a Whittle fit."""
    model = power.copy()
    levels = np.zeros(shapes.shape[1])
    for _ in range(6):
        levels, _ = nnls(shapes / model[:, None], power / model)
        model = np.maximum(shapes @ levels, 1e-12 * power.max())
    return levels
