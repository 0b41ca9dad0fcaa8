"""Setpoints of the named experiments.

The thesis drives its stage through the Prodrive Motion Platform (PMP) and prints no generator of
setpoints, so the jerk-limited profile of every move is this project's assumption. Nothing depends
on it: whatever is run takes a `Setpoint`, and `recorded_setpoint` (twin.experiments.replay) makes
one of the reference that a log recorded.

Every generator returns a setpoint that starts and ends at rest, so that setpoints can be put one
after the other with `concatenate`. Sample k is the setpoint at t = k / sample_rate. Positions are
absolute positions on the machine in metres; `at` is the place of the experiment, one position per
axis, where the axes that do not take part rest.

Source of the experiments: L. Jia, Friction Identification on the Gantry Stage, TU Delft 2023.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.errors import InputError
from twin.experiments.trajectory.jerk_limited import Phases, move, rest
from twin.experiments.trajectory.limits import (
    FloatArray,
    Limits,
    as_positions,
    inside_travel,
    require_axis,
    require_count,
    require_not_negative,
    require_plateau,
    require_positive,
)
from twin.experiments.trajectory.setpoint import (
    SAMPLE_RATE,
    PlannedSetpoint,
    Setpoint,
    require_length,
    whole_motion,
)
from twin.model.units import LINEAR


def point_to_point(
    limits: Sequence[Limits],
    waypoints: npt.ArrayLike,
    *,
    dwell: float = 0.1,
    sample_rate: float = SAMPLE_RATE,
) -> PlannedSetpoint:
    """Fastest straight moves from waypoint to waypoint, all axes together.

    Args:
        limits: one per axis.
        waypoints: m, shape (k, n_axes), k >= 2; the machine starts at rest at the first.
        dwell: rest at every waypoint, the first and the last included, s.
        sample_rate: Hz.

    Raises:
        InputError: a waypoint outside the travel, or an argument that makes no motion.
    """
    places = as_positions("waypoints", waypoints)
    if places.ndim != 2 or places.shape[0] < 2:
        raise InputError(
            f"waypoints of shape {places.shape} make no move: "
            f"give at least two rows of {len(limits)} positions in m"
        )
    places = inside_travel(limits, places)
    require_not_negative("dwell", dwell, "s")
    parts = [rest(places[0], dwell)]
    for start, target in pairwise(places):
        parts += [move(limits, start, target), rest(target, dwell)]
    return whole_motion(parts, sample_rate)


def constant_speed_passes(
    limits: Sequence[Limits],
    axis: int,
    *,
    span: float = 0.3,
    speed: float = 0.1,
    repeats: int = 10,
    at: npt.ArrayLike = (0.0, 0.0),
    dwell: float = 0.1,
    sample_rate: float = SAMPLE_RATE,
) -> PlannedSetpoint:
    """Cable pass: one axis back and forth at one speed (thesis: +-0.1 m/s over +-0.15 m, 10 times).

    Args:
        limits: one per axis.
        axis: index of the moving axis.
        span: length of the pass, centred on the place `at`, m.
        speed: m/s, held over at least half of the span.
        repeats: passes each way.
        at: place of the experiment, m, shape (n_axes,).
        dwell: rest at each end of the pass, s.
        sample_rate: Hz.

    Raises:
        InputError: the pass leaves the travel, the speed is out of reach within the span, or an
            argument that makes no motion.
    """
    require_plateau(limits, axis, speed, span)
    low, high = _around(limits, axis, at, span / 2.0)
    cycle = _back_and_forth(_slowed(limits, speed), low, high, dwell)
    return _repeated(cycle, repeats, sample_rate)


def velocity_staircase(
    limits: Sequence[Limits],
    axis: int,
    speeds: Sequence[float],
    *,
    span: float = 0.01,
    longest_plateau: float = 5.0,
    at: npt.ArrayLike = (0.0, 0.0),
    dwell: float = 0.1,
    sample_rate: float = SAMPLE_RATE,
) -> PlannedSetpoint:
    """Velocity map: one move each way at every speed (thesis: 0.1 mm/s to 0.25 m/s over 10 mm).

    Every move is centred on the place `at`, because friction depends on position, and holds its
    speed over at least half of its length.

    Args:
        limits: one per axis.
        axis: index of the moving axis.
        speeds: m/s, in the order in which they are run.
        span: length of the moves, m; slow ones are shorter, see `longest_plateau`.
        longest_plateau: time at one speed after which a move ends before the end of the span, s.
        at: place of the experiment, m, shape (n_axes,).
        dwell: rest before and after each move, s.
        sample_rate: Hz.

    Raises:
        InputError: a move leaves the travel, a speed is out of reach within the span, or an
            argument that makes no motion.
    """
    if len(speeds) == 0:
        unit = limits[axis].units.velocity if 0 <= axis < len(limits) else LINEAR.velocity
        raise InputError(f"no speeds given: give at least one, in {unit}")
    require_positive("longest plateau", longest_plateau, "s")
    parts: list[Phases] = []
    for speed in speeds:
        require_plateau(limits, axis, speed, span)
        ramp = limits[axis].ramp_time(speed)
        length = min(span, speed * (max(longest_plateau, ramp) + ramp))
        low, high = _around(limits, axis, at, length / 2.0)
        if parts:
            parts.append(move(limits, parts[-1].position[-1], low))
        parts += [rest(low, dwell), *_back_and_forth(_slowed(limits, speed), low, high, dwell)]
    return whole_motion(parts, sample_rate)


def micro_reversals(
    limits: Sequence[Limits],
    axis: int,
    *,
    amplitude: float = 4e-6,
    repeats: int = 50,
    at: npt.ArrayLike = (0.0, 0.0),
    dwell: float = 0.1,
    sample_rate: float = SAMPLE_RATE,
) -> PlannedSetpoint:
    """Reversals: one axis between `at` - amplitude and `at` + amplitude (thesis: 4 um, 50 times).

    Pass limits of lower velocity for slow reversals.

    Args:
        limits: one per axis.
        axis: index of the moving axis.
        amplitude: m.
        repeats: moves each way.
        at: place of the experiment, m, shape (n_axes,).
        dwell: rest at each reversal, s.
        sample_rate: Hz.

    Raises:
        InputError: a reversal outside the travel, or an argument that makes no motion.
    """
    require_axis(axis, len(limits))
    require_positive("amplitude", amplitude, limits[axis].units.position)
    low, high = _around(limits, axis, at, amplitude)
    return _repeated(_back_and_forth(limits, low, high, dwell), repeats, sample_rate)


def open_loop_sine(
    axis: int,
    *,
    amplitude: float = 0.21,
    period: float = 3.0,
    offset: float = 0.0,
    duration: float = 30.0,
    at: npt.ArrayLike = (0.0, 0.0),
    sample_rate: float = SAMPLE_RATE,
) -> Setpoint:
    """Open-loop sine: force offset + amplitude sin(2 pi t / period) on one axis, without feedback.

    Args:
        axis: index of the driven axis.
        amplitude: N; below the breakaway force the motion is pre-sliding.
        period: s.
        offset: N, the cable force at this place, so that the axis stays there.
        duration: s.
        at: place of the experiment, m, shape (n_axes,).
        sample_rate: Hz.

    Raises:
        InputError: a number that is not finite or makes no sine at this sample rate.
    """
    place = as_positions("coordinates of the place", at)
    if place.ndim != 1:
        raise InputError(f"place of shape {place.shape} is not allowed: give one position per axis")
    require_axis(axis, place.size)
    require_positive("amplitude", amplitude, "N")
    require_positive("period", period, "s")
    require_length(duration, sample_rate)
    if period < 2.0 / sample_rate:
        raise InputError(
            f"period {period:g} s is not a sine at {sample_rate:g} Hz: "
            f"give at least {2.0 / sample_rate:g} s"
        )
    if not math.isfinite(offset):
        raise InputError(f"offset {offset:g} N is not finite: give the cable force at the place")
    samples = round(duration * sample_rate)
    still = PlannedSetpoint(rest(place, duration), samples, sample_rate).part(0, samples)
    force = np.zeros_like(still.force)
    angle = 2.0 * np.pi / period * (np.arange(force.shape[0]) / sample_rate)
    force[:, axis] = offset + amplitude * np.sin(angle)
    return replace(still, force=force)


def _around(
    limits: Sequence[Limits], axis: int, at: npt.ArrayLike, half: float
) -> tuple[FloatArray, FloatArray]:
    """The places `half` (m) below and above `at` along the axis, each of shape (n_axes,)."""
    require_axis(axis, len(limits))
    place = inside_travel(limits, as_positions("coordinates of the place", at))
    if place.ndim != 1:
        raise InputError(f"place of shape {place.shape} is not allowed: give one position per axis")
    low, high = place.copy(), place.copy()
    low[axis] -= half
    high[axis] += half
    return inside_travel(limits, low), inside_travel(limits, high)


def _slowed(limits: Sequence[Limits], speed: float) -> list[Limits]:
    """The limits with no axis faster than `speed`, m/s."""
    return [replace(axis, velocity=min(axis.velocity, speed)) for axis in limits]


def _back_and_forth(
    limits: Sequence[Limits], low: FloatArray, high: FloatArray, dwell: float
) -> list[Phases]:
    """From low to high and back, with a rest after each move."""
    require_not_negative("dwell", dwell, "s")
    return [move(limits, low, high), rest(high, dwell), move(limits, high, low), rest(low, dwell)]


def _repeated(cycle: list[Phases], repeats: int, sample_rate: float) -> PlannedSetpoint:
    """The rest that ends the cycle, then the cycle `repeats` times."""
    require_count("repeats", repeats)
    require_length(repeats * sum(part.total for part in cycle), sample_rate)
    return whole_motion([cycle[-1], *cycle * repeats], sample_rate)
