"""The actual force behind the command of a log, and the true motion behind its readings.

A delay or a lag is a fraction of a millisecond, and an encoder ripple a few micrometres long,
so these effects are stepped sample by sample, not over blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.motion import Motion
from twin.core.native import walk, walk_sensing
from twin.effect import Effect, Kind
from twin.model.machine import AxisModel, axis_table
from twin.signals import between

Array = NDArray[np.float64]

LESSENED = 0.5  # of the commanded force; below it errors are divided by actual over commanded
PASSES = 3  # iterations from a reading to the true position


def parts_of(axis: AxisModel, *kinds: Kind) -> AxisModel:
    """The axis with its effects of these kinds alone."""
    return replace(axis, effects=tuple(f for f in axis.effects if f.effect.kind in kinds))


def is_noise(effect: Effect) -> bool:
    """Whether an effect adds only noise to the readings, so that none of it can be fitted."""
    return effect.kind is Kind.SENSING and all(p.fixed for p in effect.parameters)


def actual_force(axis: AxisModel, motion: Motion) -> Array:
    """The command after the axis' actuation effects, (n,) N at the log's own rate."""
    command = motion.raw[1]
    part = parts_of(axis, Kind.ACTUATION)
    if not part.effects:
        return command
    signals = motion.at_samples(0.5)
    table = axis_table({motion.axis: part})
    rows = np.zeros((len(table.entries), len(command)))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        signals, np.zeros_like(signals), motion.sample_period, 0, rows, axis.mass,
        motion.time_origin,
    )  # fmt: skip
    return command + rows.sum(axis=0)


def forces_lessened(axis: AxisModel, motions: Sequence[Motion]) -> float:
    """RMS force of the motor over the RMS command, where that is less than half; else 1.

    At least 1e-6, so that one can divide by it.
    """
    if not parts_of(axis, Kind.ACTUATION).effects:
        return 1.0
    given = np.linalg.norm([np.linalg.norm(actual_force(axis, m)) for m in motions])
    asked = np.linalg.norm([np.linalg.norm(m.raw[1]) for m in motions])
    return 1.0 if given >= LESSENED * asked else max(float(given / asked), 1e-6)


def true_motion(axis: AxisModel, motion: Motion) -> tuple[Motion, Array]:
    """The true motion behind the readings, and the rate of their error, (n,) m/s.

    The error is sampled at the log's own rate.
    """
    sensing = parts_of(axis, Kind.SENSING)
    part = replace(sensing, effects=tuple(f for f in sensing.effects if not is_noise(f.effect)))
    if not part.effects:
        return motion, np.zeros(motion.raw.shape[1])
    error, rate = reading_error(part, motion)
    blocks = motion.signals.copy()
    blocks[:2] -= np.stack([error, rate]).reshape(2, blocks.shape[1], -1).mean(axis=2)
    raw = np.stack([motion.raw[0] - rate, motion.raw[1]])
    return replace(motion, signals=blocks, raw=raw), rate


def reading_error(sensing: AxisModel, motion: Motion) -> tuple[Array, Array]:
    """The error that these sensing effects add to the readings, (n,) m, and its rate, m/s.

    The error depends on the true position, which is the reading less the error: a fixed-point
    iteration that starts from the reading. The readings are smoothed first, because inverting a
    delay would amplify their noise.
    """
    table = axis_table({motion.axis: sensing})
    _, _, _, first, last = table.axes[0]
    path = motion.smoothed_position
    true, reading = np.stack([path, *motion.raw]), np.empty(len(path))
    for _ in range(PASSES):
        walk_sensing(
            table.entries, first, last, table.parameters, np.zeros(table.n_states), true,
            motion.sample_period, reading,
        )  # fmt: skip
        error = reading - true[0]
        true[0] = path - error
    return error, np.append(between(error, motion.sample_period), 0.0)
