"""The actual force behind the command of a log, and the true motion behind its readings.

A delay or a lag is a fraction of a millisecond, and an encoder ripple a few micrometres long,
so these effects are stepped sample by sample, not over blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.blocks import Blocks
from identify.dataset.motion import SMOOTHED, Motion
from twin.core.walks import walk, walk_sensing
from twin.effect import Kind
from twin.model.machine import AxisModel, axis_table
from twin.signals import between, local_parabola

Array = NDArray[np.float64]

PASSES = 3  # iterations from a reading to the true position


def parts_of(axis: AxisModel, *kinds: Kind) -> AxisModel:
    """The axis with its effects of these kinds alone."""
    return replace(axis, effects=tuple(f for f in axis.effects if f.effect.kind in kinds))


def knows_rounding(axis: AxisModel, motions: Sequence[Motion]) -> bool:
    """Whether an axis rounds readings as these logs are: by an effect, or by its encoder's step."""
    # 0.9 of the step that logs show, from which an encoder's is that
    step = 0.9 * max(m.resolution for m in motions)
    return axis.hardware.encoder_resolution >= step > 0.0 or any(
        f.effect.is_noise for f in axis.effects
    )


def actual_force(axis: AxisModel, motion: Motion) -> Array:
    """The command after the axis' actuation effects, (n,) N at the log's own rate."""
    part = parts_of(axis, Kind.ACTUATION)
    return _behind_command(Valued.of(part), motion) if part.effects else motion.raw[1]


@lru_cache(maxsize=16)  # while a fit moves other parameters, the actual force stays
def _behind_command(actuation: Valued, motion: Motion) -> Array:
    fine = motion.at_samples(0.5)
    return motion.raw[1] + _added(actuation.axis, motion, fine, motion.sample_period)


def added_on_blocks(axis: AxisModel, motion: Motion) -> Array:
    """Force (n,) N that the axis' actuation effects add to the command, of means over blocks."""
    part = parts_of(axis, Kind.ACTUATION)
    return _added(part, motion, motion.signals, motion.period)


def _added(actuation: AxisModel, motion: Motion, signals: Array, period: float) -> Array:
    """Force (n,) N that actuation effects add to the command of signals (3, n) at a period (s)."""
    table = axis_table({motion.axis: actuation})
    rows = np.zeros((len(table.entries), signals.shape[1]))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        signals, np.zeros_like(signals), period, 0, rows, actuation.mass, motion.time_origin,
    )  # fmt: skip
    return np.asarray(rows.sum(axis=0))


@dataclass(frozen=True)
class Valued:
    """Effects of an axis, the same where their names and values are, and the mass if they read it.

    values: of each effect, its name and vector of values.
    """

    values: tuple[tuple[str, tuple[float, ...]], ...]
    mass: float | None
    axis: AxisModel = field(compare=False)

    @classmethod
    def of(cls, axis: AxisModel) -> Valued:
        """All effects of an axis."""
        values = tuple((f.effect.name, tuple(f.vector())) for f in axis.effects)
        heavy = any(f.effect.reads(slot) for f in axis.effects for slot in ("MASS", "MOVED"))
        return cls(values, axis.mass if heavy else None, axis)


def true_motion(axis: AxisModel, motion: Motion) -> tuple[Motion, Array]:
    """The true motion behind the readings, and the rate of their error, (n,) m/s.

    The error is sampled at the log's own rate.
    """
    sensing = [f for f in axis.effects if f.effect.kind is Kind.SENSING and not f.effect.is_noise]
    if not sensing:
        return motion, np.broadcast_to(0.0, motion.raw.shape[1])
    return _behind(Valued.of(replace(axis, effects=tuple(sensing))), motion)


@lru_cache(maxsize=8)  # while a fit moves other parameters, the true motion stays
def _behind(sensing: Valued, motion: Motion) -> tuple[Motion, Array]:
    error, rate = reading_error(sensing.axis, motion)
    blocks = motion.signals.copy()
    for block, at_samples in zip(blocks, (error, rate), strict=False):
        block -= at_samples.reshape(blocks.shape[1], -1).mean(axis=1)
    raw = np.stack([motion.raw[0] - rate, motion.raw[1]])
    path = None if motion.path is None else motion.path.less(error)
    return replace(motion, track=Blocks(blocks, raw), path=path), rate


def reading_error(
    sensing: AxisModel, motion: Motion, path: Array | None = None, passes: int = PASSES
) -> tuple[Array, Array]:
    """The error that these sensing effects add to the readings, (n,) m, and its rate, m/s.

    The error depends on the true position, which is the reading less the error: a fixed-point
    iteration that starts from the reading, of which one pass is exact to first order in the error.
    The readings less their error are smoothed, because inverting a delay would amplify their noise:
    path, (n,) m, is that of the readings, made of the motion where it is not at hand.
    """
    table = axis_table({motion.axis: sensing})
    _, _, _, first, last = table.axes[0]
    path = motion.smoothed_position if path is None else path
    true, reading = np.stack([path, motion.raw[0]]), np.empty(len(path))
    error = np.zeros(len(path))
    for k in range(passes):
        if k:
            true[0] = path - local_parabola(error, SMOOTHED)
        walk_sensing(
            table.entries, first, last, table.parameters, np.zeros(table.n_states), true,
            motion.sample_period, reading,
        )  # fmt: skip
        error = reading - true[0]
    return error, np.append(between(error, motion.sample_period), 0.0)
