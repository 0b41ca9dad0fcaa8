"""The velocity-friction map: friction averaged where the axis moves at constant speed.

friction = command + the other effects' force - mass x acceleration, averaged over the last part of
each plateau, where the friction has left its state at the reversal behind (L. Jia 2023 uses the
second half of each move). The weight is one test function, so that what is left of the controller's
transient costs no accuracy. Friction is counted positive where it opposes the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.drive import parts_of
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import total_force
from identify.dataset.test_function import TestFunction
from twin.effect import RUBBING, Kind
from twin.errors import InputError
from twin.model.machine import AxisModel, axis_table

Array = NDArray[np.float64]

USED = 0.5  # last part of a plateau, by time, that is averaged
STEADY = 0.02  # of its velocity, by which a plateau's may change within one test function
LENGTH = 0.02  # s of the test functions that tell where the velocity is constant
FEWEST = 32  # blocks that make a plateau


@dataclass(frozen=True, eq=False)
class VelocityMap:
    """Friction at constant speeds, one entry a plateau, in the order in which they were run.

    velocity (n,) m/s, signed. friction (n,) N, positive where it opposes the motion. position (n,)
    m, where it was averaged. samples (n,): effective number of samples in the average.
    """

    velocity: Array
    friction: Array
    position: Array
    samples: Array

    def __len__(self) -> int:
        return len(self.velocity)

    def towards(self, direction: float) -> VelocityMap:
        """The plateaus in one direction (+1 or -1), by rising speed."""
        kept = np.flatnonzero(np.sign(self.velocity) == direction)
        kept = kept[np.argsort(np.abs(self.velocity[kept]), kind="stable")]
        return VelocityMap(*(column[kept] for column in self._columns()))

    def _columns(self) -> tuple[Array, Array, Array, Array]:
        return self.velocity, self.friction, self.position, self.samples

    @classmethod
    def joined(cls, maps: Sequence[VelocityMap]) -> VelocityMap:
        """Maps of several logs as one."""
        columns = zip(*(m._columns() for m in maps), strict=True)
        return cls(*(np.concatenate(column) for column in columns))


def velocity_map(axis: AxisModel, motion: Motion, used: float = USED) -> VelocityMap:
    """The map of one log. axis: its mass and its effects beside friction are taken off the force.

    used: last part of each plateau that is averaged. Raises InputError where no plateau is found.
    """
    beside = parts_of(axis, *(set(Kind) - {*RUBBING}))
    force = motion.command + total_force(axis_table({"": beside}), motion)
    rows = [
        _averaged(axis.mass, motion, force, last - round(used * (last - first)), last)
        for first, last in plateaus(motion)
    ]
    if not rows:
        raise InputError(
            f"{motion.name}: axis {motion.axis} holds no constant speed for long enough; a "
            "velocity map needs moves that do (`twin simulate velocity_map`)"
        )
    return VelocityMap(*np.array(rows).T)


def _averaged(
    mass: float, motion: Motion, force: Array, first: int, last: int
) -> tuple[float, float, float, float]:
    """Velocity, friction, position and effective samples of the blocks [first, last)."""
    per_block = round(motion.period / motion.sample_period)
    part = slice(first, last)
    whole = TestFunction.of_length((last - first) * motion.period, motion.period)
    acceleration = whole.acceleration(motion.velocity[part])[0]
    whole = whole.sharpened(per_block)
    position, velocity, pushing = (
        float(whole.mean(signal[part])[0]) for signal in (motion.position, motion.velocity, force)
    )
    friction = np.sign(velocity) * (pushing - mass * acceleration)
    return velocity, friction, position, per_block / float(np.sum(whole.weights**2))


def plateaus(motion: Motion) -> list[tuple[int, int]]:
    """Blocks [first, last) of each stretch of constant velocity, in order.

    From the end of its first test function to the start of its last, so that no ramp is inside.
    """
    window = TestFunction.at_least(LENGTH, motion.period)
    velocity = window.mean(motion.velocity)
    change = np.abs(window.acceleration(motion.velocity)) * window.length
    moving = np.abs(velocity) > STEADY * np.abs(motion.velocity).max()
    steady = moving & (change < STEADY * np.abs(velocity))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], steady, [0]])))
    found = []
    for first, last in edges.reshape(-1, 2):
        start = int(first * window.stride) + len(window.weights)
        end = int((last - 1) * window.stride)
        if end - start >= FEWEST:
            found.append((start, end))
    return found
