"""What actuator and encoder make of a log: the actual force, and the error of the reading.

A delay or a lag is a fraction of a millisecond, and an encoder ripple a few micrometres long,
so these effects are stepped sample by sample, not over blocks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.motion import Motion
from twin.effect import Kind
from twin.model import AxisModel, axis_table
from twin.native import walk, walk_sensing

Array = NDArray[np.float64]


def parts_of(axis: AxisModel, *kinds: Kind) -> AxisModel:
    """The axis with its effects of these kinds alone."""
    return replace(axis, effects=tuple(f for f in axis.effects if f.effect.kind in kinds))


def actual_force(axis: AxisModel, motion: Motion) -> Array:
    """The command after the axis' actuation effects, (n,) N at the log's own rate."""
    command = motion.raw[1]
    part = parts_of(axis, Kind.ACTUATION)
    if not part.effects:
        return command
    signals = _signals(motion)
    table = axis_table({motion.axis: part})
    rows = np.zeros((len(table.entries), len(command)))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        signals, np.zeros_like(signals), motion.sample_period, 0, rows, axis.mass,
    )  # fmt: skip
    return command + rows.sum(axis=0)


def reading_error(axis: AxisModel, motion: Motion) -> Array:
    """Encoder reading less position, (n,) m at the log's own rate, taken at the measured motion."""
    part = parts_of(axis, Kind.SENSING)
    signals = _signals(motion)
    table = axis_table({motion.axis: part})
    readings = np.zeros(signals.shape[1])
    _, _, _, first, last = table.axes[0]
    walk_sensing(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), signals,
        motion.sample_period, readings,
    )  # fmt: skip
    return readings - signals[0]


def _signals(motion: Motion) -> Array:
    """Position m, velocity m/s and command N at the log's own rate, (3, n)."""
    velocity, command = motion.raw
    position = motion.signals[0, 0] + np.cumsum(velocity) * motion.sample_period
    return np.ascontiguousarray(np.stack([position, velocity, command]))
