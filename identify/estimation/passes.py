"""Passes at constant speed in both directions, on one grid of positions.

Of what the axis feels, command - mass x acceleration, the part that is the same in both directions
is a force of position, the part that turns with direction is friction: L. Jia 2023, cable pass,
F_cable = -(F_pos + F_neg)/2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.force_balance import residual
from twin.errors import InputError
from twin.model.machine import AxisModel

Array = NDArray[np.float64]

STEADY = 0.05  # of the pass speed, by which the speed may differ on a pass
SHORTEST = 0.5  # of the longest pass, below which a stretch is no pass
UNSETTLED = 0.03  # of the track at its ends, where friction still remembers the reversal
GRID = 600  # positions
SMOOTHING = 0.02  # of the track, standard deviation of the Gaussian weights
ORDER = 2  # of the local polynomials


@dataclass(frozen=True, eq=False)
class Passes:
    """position (k,) m; forwards, backwards (p, k) N: what drove the axis there on each pass."""

    position: Array
    forwards: Array
    backwards: Array

    def part(self, positions: slice) -> Passes:
        """The same at some of the positions."""
        return Passes(
            self.position[positions], self.forwards[:, positions], self.backwards[:, positions]
        )

    @property
    def alike(self) -> Array:
        """(p, k) N, the force of position by pairs of passes: -(F_pos + F_neg)/2."""
        return -0.5 * (self.forwards + self.backwards)

    @property
    def turning(self) -> Array:
        """(p, k) N, what opposes the motion either way: (F_pos - F_neg)/2."""
        return 0.5 * (self.forwards - self.backwards)


def passes(axis: AxisModel, logs: Sequence[PreparedLog]) -> Passes:
    """The passes of some logs, on the stretch that all of them cover.

    Raises InputError where there are not at least two in each direction, or nothing in common.
    """
    bare = replace(axis, effects=())
    ways: dict[bool, list[tuple[Array, Array]]] = {True: [], False: []}
    for log in logs:
        velocity = log.test_function.mean(log.motion.velocity)
        position = log.test_function.mean(log.motion.position)
        force = residual(bare, [log])
        for first, last in _stretches(velocity):
            ahead = bool(velocity[first] > 0.0)
            step = 1 if ahead else -1  # positions must rise
            ways[ahead].append((position[first:last][::step], force[first:last][::step]))
    forwards, backwards = (_long(ways[way]) for way in (True, False))
    count = min(len(forwards), len(backwards))
    if count < 2:
        raise InputError(
            f"the logs hold {len(forwards)} passes forwards and {len(backwards)} backwards at "
            "constant speed; the force of the cable needs two each way (`twin simulate cable_pass`)"
        )
    every = [*forwards, *backwards]
    low, high = max(x[0] for x, _ in every), min(x[-1] for x, _ in every)
    if high <= low:
        raise InputError(
            f"the {len(every)} passes at constant speed have no stretch of the track in common; "
            "give logs of passes over the same stretch (`twin simulate cable_pass`)"
        )
    cut = UNSETTLED * (high - low)
    grid = np.linspace(low + cut, high - cut, GRID)
    on_grid = [
        np.stack([np.interp(grid, x, f) for x, f in p[:count]]) for p in (forwards, backwards)
    ]
    return Passes(grid, *on_grid)


def _stretches(velocity: Array) -> list[tuple[int, int]]:
    """Runs [first, last) at the fastest constant speed of the log, by its velocity (n,) m/s."""
    speed = float(np.quantile(np.abs(velocity), 0.9))
    steady = np.abs(np.abs(velocity) - speed) < STEADY * speed
    signed = np.where(steady, np.sign(velocity), 0.0)
    edges = [0, *(np.flatnonzero(np.diff(signed)) + 1), len(signed)]
    return [(int(a), int(b)) for a, b in pairwise(edges) if signed[a] and b - a > 1]


def _long(found: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    longest = max((len(x) for x, _ in found), default=0)
    return [(x, f) for x, f in found if len(x) > SHORTEST * longest]


def smoother(position: Array, kept: NDArray[np.bool_]) -> Array:
    """Matrix (k, k) from forces on the grid to their local polynomials, of what is kept."""
    r = (position - position[:, None]) / (SMOOTHING * float(np.ptp(position)))
    weight = np.exp(-0.5 * r**2) * kept
    moments = np.stack([np.sum(weight * r**n, axis=1) for n in range(2 * ORDER + 1)], axis=1)
    powers = np.arange(ORDER + 1)
    normal = moments[:, powers[:, None] + powers]
    value = np.zeros((len(position), ORDER + 1, 1))
    value[:, 0] = 1.0
    share = np.linalg.solve(normal, value)[..., 0]
    return np.asarray(weight * sum(share[:, [n]] * r**n for n in powers))
