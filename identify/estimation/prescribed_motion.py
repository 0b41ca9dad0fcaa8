"""Forces of laws along a motion that is prescribed, without a machine or a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.drive import parts_of
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import total_force
from twin.effect import RUBBING, Kind
from twin.model.machine import AxisModel, axis_table

Array = NDArray[np.float64]

STEADY_TRAVEL, STEPS = 0.1, 2000  # m and steps over which a law settles at one place


def force_along(
    axis: AxisModel, position: Array, velocity: Array, period: float, *kinds: Kind
) -> Array:
    """Force (n,) N of the axis' effects of these kinds, under no command.

    position m and velocity m/s (n,) at the middle of samples that are ``period`` s long.
    """
    signals = np.stack([position, velocity, np.zeros_like(velocity)])
    motion = Motion(
        name="", axis="", signals=signals, others=np.zeros_like(signals), period=period, start=0.0,
        sample_period=period, position_noise=0.0, raw=signals[1:],
    )  # fmt: skip
    return total_force(axis_table({"": parts_of(axis, *kinds)}), motion)


def steady_friction(axis: AxisModel, place: float, velocity: float) -> float:
    """Friction (N, positive where it opposes the motion) after a long way at one place.

    place: m; velocity: m/s, not zero.
    """
    rubbing = tuple(f for f in axis.effects if f.effect.kind in RUBBING)
    return float(-np.sign(velocity) * steady_force(replace(axis, effects=rubbing), place, velocity))


def steady_force(axis: AxisModel, place: float, velocity: float) -> float:
    """Force (N) of an axis' forces and friction after a long way at one place.

    place: m; velocity: m/s, not zero.
    """
    period = STEADY_TRAVEL / STEPS / abs(velocity)
    places, velocities = np.repeat([[place], [velocity]], STEPS, axis=1)
    return float(force_along(axis, places, velocities, period, Kind.FORCE, *RUBBING)[-1])
