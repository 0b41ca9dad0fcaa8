"""Seconds in which a recorded force stays at a limit that the motion exceeds.

A recorder, or a command that is limited on its way to the log, keeps its extreme while the motor
makes more: there the log tells nothing. A drive that is at its own limit makes what it records, and
there the log tells as much as anywhere. So the motion is asked. Mass, friction, a constant and a
spring are fitted to all that no log has at its extreme (least squares of test functions); where
these ask for clearly more than the extreme, what acted was more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from identify.dataset.test_function import OVERLAP, TestFunction
from twin.logs import Log
from twin.signals import Array, between, held_at_extreme

Mask = NDArray[np.bool_]

# s, of test functions: within a half of an oscillation of 10 Hz, and over the quicker ones that
# a model of one mass lacks
LENGTHS = (0.04, 0.1)
FEWEST = 20  # test functions away from every extreme, of which five values are known
BEYOND = 1.0  # of what the fit leaves elsewhere, RMS, by which the extreme is exceeded on average
OFTEN = 0.9  # of the test functions at the extreme, in which it is: an error has either sign


def clipped_in(logs: Mapping[str, Log], axis: str) -> dict[str, Mask]:
    """By log that has them, in which samples (n,) the force of an axis was more than recorded."""
    held = {name: _held(log, axis) for name, log in logs.items()}
    held = {name: sides for name, sides in held.items() if sides.any()}
    if not held:
        return {}
    exceeded = {name for length in LENGTHS for name in _exceeded(logs, axis, held, length)}
    return {name: sides != 0.0 for name, sides in held.items() if name in exceeded}


def _exceeded(
    logs: Mapping[str, Log], axis: str, held: Mapping[str, Array], length: float
) -> Iterator[str]:
    """The logs whose motion asks for more than their extremes, by test functions of a length, s."""
    rows = {
        name: _rows(log, axis, held.get(name, np.zeros(len(log))), length)
        for name, log in logs.items()
    }
    free = np.concatenate([r[(s == 0.0) & ways] for r, s, ways in rows.values()])
    if len(free) < FEWEST:
        return
    size = np.abs(free).max(axis=0)
    size[size == 0.0] = 1.0
    force, columns = free[:, 0], free[:, 1:] / size[1:]
    step = np.linalg.lstsq(columns, force, rcond=None)[0] / size[1:]
    least = BEYOND * float(np.sqrt(np.mean((force - free[:, 1:] @ step) ** 2)))
    for name in held:
        own, side, ways = rows[name]
        at_it = ways & (np.abs(side) > 0.5)  # of the weight of a test function
        more = side[at_it] * (own[at_it, 1:] @ step - own[at_it, 0])
        if len(more) >= OVERLAP and more.mean() > least and np.mean(more > 0.0) > OFTEN:
            yield name


def _held(log: Log, axis: str) -> Array:
    """At which extreme (n,) the force stays: 1 the highest, -1 the lowest, 0 at none."""
    force, least = log.axes[axis].force, max(round(5e-3 / log.period), 5)  # s, or so many samples
    high, low = (held_at_extreme(force, e, least) for e in (force.max(), force.min()))
    return high.astype(float) - low


def _rows(log: Log, axis: str, sides: Array, length: float) -> tuple[Array, Array, Mask]:
    """By test functions the force and what it is for (m, 6), and how much of each is at an extreme.

    The latter (m,), by its sign; exactly 0 of one that touches none. And in which (m,) the axis
    moves one way throughout: at rest friction holds any force.
    """
    w = TestFunction.at_least(length, log.period)
    position, force = log.axes[axis].position, log.axes[axis].force
    velocity = between(position, log.period)
    way = np.sign(velocity)
    means = w.mean(np.stack([force[:-1], velocity, way, position[:-1], sides[:-1]]))
    rows = np.stack([means[0], w.acceleration(velocity), *means[1:4], np.ones(means.shape[1])], 1)
    return rows, means[4], np.abs(means[2]) > 0.98  # of its time
