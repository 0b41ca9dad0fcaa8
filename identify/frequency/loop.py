"""The closed loop that a frequency response shows: sensitivity, crossover and margins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.frequency.response import Complex, Response
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class Loop:
    """A position loop at the frequencies of a response; no number where it does not tell.

    Margins are no number where the loop does not cross within the frequencies that are told.
    """

    sensitivity: Complex
    """(k,) What is left of a disturbance of the position."""
    crossover: float
    """Hz, the highest at which the open loop falls below 1."""
    phase_margin: float
    """rad, there."""
    gain_margin: float
    """Times which the gain may grow until the loop is unstable."""
    peak: float
    """Largest sensitivity; its inverse is the modulus margin."""
    by_controller: bool
    """Whether the controller is that of a model. Else the sensitivity is the error over the
    setpoint, which a feedforward lowers: then the margins are not those of the loop."""


def loop_of(found: Response, controller: Complex | None) -> Loop | None:
    """The loop with a controller's response (k,) N/m, or by the setpoint; None without either.

    A sensitivity that exceeds 1 nowhere is that of no loop (H. W. Bode, Network Analysis and
    Feedback Amplifier Design, 1945): then the setpoint is fed forward, and its error tells none.
    """
    told = found.tells
    if controller is not None:
        open_loop = controller * found.plant
        sensitivity = 1.0 / (1.0 + open_loop)
    elif np.isfinite(found.closed).all():
        sensitivity = 1.0 - found.closed
        open_loop = found.closed / sensitivity
    else:
        return None
    if not told.any():
        return None
    where, along = found.frequency[told], open_loop[told]
    crossover, turn = _crossing(np.log(np.abs(along)), np.unwrap(np.angle(along)), where)
    below = np.angle(-along)  # zero where the phase is -180 degrees
    falls = np.flatnonzero((below[:-1] > 0.0) & (below[1:] <= 0.0) & (np.abs(along[1:]) < 1.0))
    gain = 1.0 / float(np.abs(along[falls[0] + 1])) if len(falls) else np.nan
    peak = float(np.abs(sensitivity[told]).max())
    if controller is None and peak <= 1.0:
        return None
    return Loop(
        np.where(told, sensitivity, np.nan), crossover, float(np.angle(-np.exp(1j * turn))), gain,
        peak, controller is not None,
    )  # fmt: skip


def _crossing(level: Array, phase: Array, frequency: Array) -> tuple[float, float]:
    """Where a logarithm falls through zero for the last time, Hz, and the phase there, rad."""
    falls = np.flatnonzero((level[:-1] > 0.0) & (level[1:] <= 0.0))
    if not len(falls):
        return np.nan, np.nan
    i = falls[-1]
    part = level[i] / (level[i] - level[i + 1])
    between = np.log(frequency[i]) + part * np.log(frequency[i + 1] / frequency[i])
    return float(np.exp(between)), float(phase[i] + part * (phase[i + 1] - phase[i]))
