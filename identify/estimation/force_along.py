"""The force of an axis' effects along a motion that is made up, under no command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.dataset.blocks import Blocks
from identify.dataset.drive import parts_of
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import total_force
from twin.effect import RUBBING, Kind
from twin.model.machine import AxisModel, axis_table
from twin.signals import Array


def force_along(
    axis: AxisModel, position: Array, velocity: Array, period: float, *kinds: Kind
) -> Array:
    """Force (n,) N of the axis' effects of these kinds, under no command.

    position m and velocity m/s (n,) at the middle of samples that are ``period`` s long.
    """
    signals = np.stack([position, velocity, np.zeros_like(velocity)])
    motion = Motion(
        name="", axis="", track=Blocks(signals, signals[1:]), others=np.zeros_like(signals),
        period=period, start=0.0, sample_period=period, position_noise=0.0,
    )  # fmt: skip
    return total_force(axis_table({"": parts_of(axis, *kinds)}), motion)


def steady_friction(axis: AxisModel, place: float, velocity: float) -> float:
    """Friction (N, positive where it opposes the motion) after a long way at one place.

    place: m; velocity: m/s, not zero.
    """
    rubbing = tuple(f for f in axis.effects if f.effect.kind in RUBBING)
    return float(-np.sign(velocity) * steady_force(replace(axis, effects=rubbing), place, velocity))


def steady_force(
    axis: AxisModel, place: float, velocity: float, way: float = 0.1, steps: int = 2000
) -> float:
    """Force (N) of an axis' forces and friction after a long way at one place.

    place: m; velocity: m/s, not zero. way: m over which a law settles, in so many steps.
    """
    period = way / steps / abs(velocity)
    places, velocities = np.repeat([[place], [velocity]], steps, axis=1)
    return float(force_along(axis, places, velocities, period, Kind.FORCE, *RUBBING)[-1])
