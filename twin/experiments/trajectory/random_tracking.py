"""Random tracking: the rich motion on which models are fitted and tested."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twin.errors import CannotRun
from twin.experiments.trajectory.jerk_limited import Phases, join, move, rest
from twin.experiments.trajectory.limits import (
    FloatArray,
    Limits,
    axis_name,
    require_not_negative,
    require_positive,
    travel_box,
)
from twin.experiments.trajectory.setpoint import SAMPLE_RATE, PlannedSetpoint, require_length

_CLOSING_REST = 0.05  # s, too short for another move


def random_tracking(
    limits: Sequence[Limits],
    duration: float,
    rng: np.random.Generator,
    *,
    slowest: float = 5e-4,
    cruise: float = 1.0,
    longest_dwell: float = 0.2,
    sample_rate: float = SAMPLE_RATE,
) -> PlannedSetpoint:
    """Tracking: random straight moves of all axes over the whole travel, from rest to rest.

    Each move draws its speed from `slowest` to the limit (uniform in the logarithm, one in five
    at the limit), its acceleration and jerk from a tenth of the limit to the limit (likewise),
    and its target within reach from an arcsine distribution, which favours the ends of the
    travel. Half of the moves are followed by a pause. The last ones are shortened to fit.

    Args:
        limits: one per axis; the motion starts in the middle of the travel.
        duration: exact length, rounded to samples, s.
        rng: the same generator state gives the same setpoint.
        slowest: lowest speed, m/s.
        cruise: about the longest time at one speed, s; it bounds the length of slow moves.
        longest_dwell: longest pause, s.
        sample_rate: Hz.

    Raises:
        InputError: `slowest` above a velocity limit (CannotRun), or a number that makes no motion.
    """
    require_length(duration, sample_rate)
    _require_motion(limits, slowest, cruise, longest_dwell)
    samples = round(duration * sample_rate)
    left = (samples - 1) / sample_rate
    place = np.mean(travel_box(limits), axis=0)
    parts: list[Phases] = []
    while left > _CLOSING_REST:
        drawn = _drawn_limits(limits, slowest, rng)
        target = _drawn_target(drawn, place, cruise, rng)
        while (step := move(drawn, place, target)).total > left:
            target = (place + target) / 2.0
        # At least one sample, so that the loop ends whatever is drawn.
        pause = rest(target, max(longest_dwell * rng.uniform(-1.0, 1.0), 1.0 / sample_rate))
        parts += [step, pause]
        left -= step.total + pause.total
        place = target
    return PlannedSetpoint(join([*parts, rest(place, 0.0)]), samples, sample_rate)


def _drawn_target(
    drawn: Sequence[Limits], place: FloatArray, cruise: float, rng: np.random.Generator
) -> FloatArray:
    """A place in the travel that each axis reaches in about `cruise` seconds."""
    low, high = travel_box(drawn)
    reach = cruise * np.array([axis.velocity for axis in drawn])
    low, high = np.maximum(low, place - reach), np.minimum(high, place + reach)
    target: FloatArray = low + (high - low) * rng.beta(0.5, 0.5, place.size)
    return target


def _require_motion(
    limits: Sequence[Limits], slowest: float, cruise: float, longest_dwell: float
) -> None:
    require_positive("slowest speed", slowest, limits[0].units.velocity if limits else "m/s")
    require_positive("cruise time", cruise, "s")
    require_not_negative("longest dwell", longest_dwell, "s")
    for index, axis in enumerate(limits):
        if slowest > axis.velocity:
            raise CannotRun(
                f"slowest speed {slowest:g} {axis.units.velocity} is above the limit of axis "
                f"{axis_name(index)}, {axis.velocity:g} {axis.units.velocity}: give a lower one"
            )


def _drawn_limits(
    limits: Sequence[Limits], slowest: float, rng: np.random.Generator
) -> list[Limits]:
    """Limits of one random move; all axes share the draws, so that none slows down the others."""
    pace = min(1.0, 1.25 * rng.random())
    effort = 10.0 ** rng.uniform(-1.0, 0.0)
    return [
        replace(
            axis,
            velocity=slowest * (axis.velocity / slowest) ** pace,
            acceleration=effort * axis.acceleration,
            jerk=effort * axis.jerk,
        )
        for axis in limits
    ]
