"""What a friction does, in numbers: the plus and minus of the thesis's Table 2.1, measured.

From the logs of a machine with that friction alone (identify.thesis.behaviours).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.motion import motion_of
from identify.estimation.velocity_map import velocity_map
from identify.thesis.behaviours import PUSHES, RATE, SWING, drifting
from twin.log import Log
from twin.model.machine import MachineModel

Array = NDArray[np.float64]

NEAR = 0.2  # of the amplitude of a swing, within which a speed counts as the mean one
LONG = 20.0  # s of a small oscillation, whose last half tells a drift: bristles ring for long


@dataclass(frozen=True)
class Traits:
    """fall: N, by which the friction falls below that of the lowest speed. lag: N, by which it is
    higher where the speed rises than where it falls, at the same speed. slow, fast: N, largest
    friction under the slowest and the fastest push. drift: m/s, creep under a steady force with a
    small oscillation, both together below the break-away.
    """

    fall: float
    lag: float
    slow: float
    fast: float
    drift: float


def traits(model: MachineModel, logs: Mapping[str, Log], rng: np.random.Generator) -> Traits:
    """The traits of the only effect of a machine's only axis, from its logs of every behaviour."""
    ((name, axis),) = model.axes.items()
    (friction,) = axis.names
    found = velocity_map(axis, motion_of(logs["velocity map"], name, "map")).towards(1.0).friction
    first = round(PUSHES[0] * RATE)
    pushed = np.abs(logs["break-away"].truth[name][friction])
    moved = drifting(model, rng, LONG).truth[name]["position"]
    late = moved[len(moved) // 2 :]
    return Traits(
        fall=float(found[0] - found.min()),
        lag=_lag(logs["frictional lag"].truth[name], friction),
        slow=float(pushed[:first].max()),
        fast=float(pushed[-round(PUSHES[-1] * RATE) :].max()),
        drift=float(np.polyfit(np.arange(len(late)) / RATE, late, 1)[0]),
    )


def _lag(truth: Mapping[str, Array], friction: str) -> float:
    """Over the fastest swing, at speeds near the mean one."""
    mean, amplitude, _ = SWING
    last = slice(-round(RATE), None)
    velocity, force = truth["velocity"][last], -truth[friction][last]
    near = np.abs(velocity - mean) < NEAR * amplitude
    rising = np.diff(velocity, append=velocity[-1]) > 0.0
    return float(force[near & rising].mean() - force[near & ~rising].mean())
