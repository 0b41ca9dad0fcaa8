"""The motion of an axis, made of a log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.motion import Bodies, Motion, OtherAxis
from identify.dataset.reading_ripple import ripple, ripple_periods
from identify.dataset.velocity import together
from twin.errors import InputError
from twin.logs import AxisLog, Log
from twin.model.machine import MOST_AXES_OF_A_PAIR
from twin.model.units import LINEAR
from twin.signals import Array, between, rate, white_noise

SHORTEST_BLOCK = 1e-3  # s
LONGEST_BLOCK = 1e-2  # s
SPEED_NOISE = 1e-3  # velocity noise allowed, as a part of the highest speed
SHORTEST_LOG = 0.5  # s, a few test functions
FEWEST_SAMPLES = 64  # of a log; more than those of 1 s where they are slow
EQUAL = 1e-9  # relative difference by which whole samples may miss a length
FOLLOWS = 0.5  # squared correlation of position and setpoint from which the loop is closed


def motion_of(
    log: Log,
    axis: str,
    name: str,
    machine: Sequence[str] = (),
    longest_block: float = LONGEST_BLOCK,
    ripples: tuple[float, ...] | None = None,
    bodies: Bodies | None = None,
) -> Motion:
    """The motion of one axis of a log.

    machine: the axes of the machine; on one of two axes others that were logged do not matter.
    longest_block: s; a noisy position asks for long blocks. ripples: m, sought where None. bodies:
    of a joint.
    Raises InputError where the axis is not in the log, does not move, or is too short.
    """
    if axis not in log.axes:
        raise InputError(f"{name}: has no axis '{axis}'; it has {', '.join(log.axes)}")
    readings = log.axes[axis].position
    least = max(SHORTEST_LOG, FEWEST_SAMPLES * log.period)
    if len(log) * log.period < least:
        raise InputError(
            f"{name}: lasts {len(log) * log.period:.3g} s; identification needs {least:.3g} s at "
            f"{log.sample_rate:g} Hz, so record longer"
        )
    if np.ptp(readings) == 0.0:
        raise InputError(f"{name}: axis {axis} stands still; give a log in which it moves")
    told = together(readings, log.axes[axis].columns.get("velocity"), log.period)
    position = told.position
    ripples = ripple_periods(position) if ripples is None else ripples
    noise = white_noise(position - ripple(position, ripples))
    block = _block_samples(position, noise, log.period, longest_block)
    force = log.axes[axis].force
    signals = _blocks(*_midpoints(position, force, log.period), block)
    found = {a: _other(log, a, block) for a in other_axes(log, axis, machine)}
    several = len(found) > 1 or len(machine) > MOST_AXES_OF_A_PAIR
    other = None if several else next(iter(found.values()), None)
    return Motion(
        name=name,
        axis=axis,
        signals=signals,
        others=np.zeros_like(signals) if other is None else other.signals,
        period=block * log.period,
        start=0.5 * block * log.period,
        sample_period=log.period,
        units=log.axes[axis].kind,
        other_units=LINEAR if other is None else other.units,
        beside=found if several else {},
        position_noise=noise,
        raw=np.stack([between(position, log.period), force[:-1]])[:, : block * signals.shape[1]],
        follows=_follows(log.axes[axis]),
        velocity_weight=told.weight,
        ripples=ripples,
        bodies=None if bodies is None else bodies.during(slice(block * signals.shape[1])),
    )


def _follows(signals: AxisLog) -> bool | None:
    """Whether position and setpoint share at least half of their variance; None without setpoint.

    A setpoint that stands still is not followed.
    """
    if "setpoint_position" not in signals.columns:
        return None
    wanted, position = signals.columns["setpoint_position"], signals.position
    if np.ptp(wanted) == 0.0 or np.ptp(position) == 0.0:
        return False
    return bool(np.corrcoef(wanted, position)[0, 1] ** 2 > FOLLOWS)


def other_axes(log: Log, axis: str, machine: Sequence[str]) -> list[str]:
    """The other axes of the log, of the machine alone where that has two."""
    pair = len(machine) == MOST_AXES_OF_A_PAIR
    return [a for a in log.axes if a != axis and (a in machine or not pair)]


def _other(log: Log, axis: str, block: int) -> OtherAxis:
    """Another axis of a log in blocks of some samples."""
    x = log.axes[axis].position
    position, velocity, _ = _blocks(*_midpoints(x, x, log.period), block)
    acceleration = rate(velocity, block * log.period)
    return OtherAxis(np.stack([position, velocity, acceleration]), log.axes[axis].kind)


def _block_samples(position: Array, noise: float, period: float, longest: float) -> int:
    """Samples a block: 1 ms, or as long as the encoder's noise asks for, up to a length (s)."""
    span = max(round(SHORTEST_BLOCK / period), 1)
    fastest = np.abs(position[span:] - position[:-span]).max() / (span * period)
    quiet = np.sqrt(2.0) * noise / (SPEED_NOISE * fastest)
    most = int(longest / period * (1.0 + EQUAL))
    return max(min(round(max(SHORTEST_BLOCK, quiet) / period), most), 1)


def _midpoints(position: Array, force: Array, period: float) -> tuple[Array, Array, Array]:
    return (
        0.5 * (position[1:] + position[:-1]),
        between(position, period),
        force[:-1],
    )


def _blocks(position: Array, velocity: Array, force: Array, samples: int) -> Array:
    whole = len(position) // samples * samples
    stacked = np.stack([position[:whole], velocity[:whole], force[:whole]])
    return np.ascontiguousarray(stacked.reshape(3, -1, samples).mean(axis=2))
