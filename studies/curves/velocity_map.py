"""Friction by speed and place, from logs with stretches of constant speed, without a fit.

friction = command + the other effects' force - mass x acceleration, averaged over the last part of
each plateau, where the friction has left its state at the reversal behind (L. Jia 2023 uses the
second half of each move). The weight is one test function, so that what is left of the controller's
transient costs no accuracy. Friction is counted positive where it opposes the motion. No values are
planted beside a map, so what is told is the map, the curve through each direction with intervals,
and the mean of both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.drive import parts_of
from identify.dataset.motion import Motion
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import total_force
from identify.dataset.test_function import TestFunction
from studies.curves.friction_curve import MapCurve, curve_through
from twin.effect import RUBBING, Kind
from twin.errors import InputError
from twin.logs import GivenLogs, logs_by_name
from twin.model.machine import AxisModel, MachineModel, axis_table
from twin.model.units import AxisUnits
from twin.signals import Array, stretches

USED = 0.5  # last part of a plateau, by time, that is averaged
STEADY = 0.02  # of its velocity, by which a plateau's may change within one test function
DIRECTIONS = (1.0, -1.0)


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
        return VelocityMap(*(column[kept] for column in astuple(self)))

    @classmethod
    def joined(cls, maps: Sequence[VelocityMap]) -> VelocityMap:
        """Maps of several logs as one."""
        return cls(*map(np.concatenate, zip(*map(astuple, maps), strict=True)))

    @classmethod
    def of(cls, axis: AxisModel, motion: Motion, used: float = USED) -> VelocityMap:
        """The map of one log. axis: its mass and its effects beside friction are taken off.

        used: last part of each plateau that is averaged. Raises InputError without a plateau.
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
        return cls(*np.array(rows).T)


def _averaged(
    mass: float, motion: Motion, force: Array, first: int, last: int
) -> tuple[float, float, float, float]:
    """Velocity, friction, position and effective samples of the blocks [first, last)."""
    per_block = round(motion.period / motion.sample_period)
    signals = np.stack([motion.position, motion.velocity, force])[:, first:last]
    whole = TestFunction.of_length((last - first) * motion.period, motion.period)
    acceleration = whole.acceleration(signals[1])[0]
    whole = whole.sharpened(per_block)
    position, velocity, pushing = (float(whole.mean(signal)[0]) for signal in signals)
    friction = np.sign(velocity) * (pushing - mass * acceleration)
    return velocity, friction, position, per_block / float(np.sum(whole.weights**2))


def plateaus(motion: Motion) -> list[tuple[int, int]]:
    """Blocks [first, last) of each stretch of constant velocity, in order.

    From the end of its first test function to the start of its last, so that no ramp is inside.
    """
    length = 0.02  # s of the test functions that tell where the velocity is constant
    window = TestFunction.at_least(length, motion.period)
    velocity = window.mean(motion.velocity)
    change = np.abs(window.acceleration(motion.velocity)) * window.length
    moving = np.abs(velocity) > STEADY * np.abs(motion.velocity).max()
    steady = moving & (change < STEADY * np.abs(velocity))
    blocks = [
        (int(first * window.stride) + len(window.weights), int((last - 1) * window.stride))
        for first, last in stretches(steady)
    ]
    fewest = 32  # blocks that make a plateau: fewer average too little noise
    return [(start, end) for start, end in blocks if end - start >= fewest]


@dataclass(frozen=True, eq=False, repr=False)
class FrictionMap:
    """A velocity-friction map, and the curve through each direction (+1, -1)."""

    map: VelocityMap
    curves: Mapping[float, MapCurve]
    units: AxisUnits

    @classmethod
    def of(cls, found: VelocityMap, units: AxisUnits) -> FrictionMap:
        """The curves through a map; raises InputError where one direction tells none."""
        ways = {way: found.towards(way) for way in DIRECTIONS}
        curves = {
            way: curve_through(np.abs(one.velocity), one.friction, one.samples)
            for way, one in ways.items()
        }
        return cls(found, curves, units)

    def __repr__(self) -> str:
        return f"<FrictionMap of {len(self.map)} plateaus: {self.both}>"

    @property
    def position(self) -> float:
        """The middle of its plateaus, m."""
        return float(self.map.position.mean())

    @property
    def both(self) -> dict[str, float]:
        """Parameters by name, the mean of both directions."""
        ahead, back = (self.curves[way].values for way in DIRECTIONS)
        return {name: 0.5 * (ahead[name] + back[name]) for name in ahead if name in back}

    @property
    def differing(self) -> list[str]:
        """Parameters whose two 90 % intervals, by direction, do not meet."""
        ahead, back = (self.curves[way] for way in DIRECTIONS)
        apart = {n: abs(ahead.values[n] - back.values[n]) for n in self.both}
        return [n for n, value in apart.items() if value > ahead.half[n] + back.half[n]]


def velocity_map(model: MachineModel, logs: GivenLogs, *, axis: str | None = None) -> VelocityMap:
    """Friction against velocity, from logs with stretches of constant speed (L. Jia 2023).

    The forces of the model's other effects are taken off. axis: the only one that moves where None.
    Raises InputError where no log holds a constant speed.
    """
    return VelocityMap.joined(_maps(model, logs, axis)[1])


def friction_map(model: MachineModel, logs: GivenLogs, *, axis: str | None = None) -> FrictionMap:
    """The map of all logs with its curves; raises InputError where they hold none both ways."""
    own, found = _maps(model, logs, axis)
    return FrictionMap.of(VelocityMap.joined(found), own.units)


def along_track(
    model: MachineModel, logs: GivenLogs, *, axis: str | None = None
) -> list[FrictionMap]:
    """A map for each place of the track that logs of moves visit, from one end to the other.

    Logs whose plateaus overlap along the track are of one place. Raises InputError for one place.
    """
    own, found = _maps(model, logs, axis)
    groups: list[list[VelocityMap]] = []
    reached = -np.inf
    for one in sorted(found, key=lambda m: float(m.position.min())):
        if one.position.min() > reached:
            groups.append([])
        groups[-1].append(one)
        reached = max(reached, float(one.position.max()))
    if len(groups) < 2:
        raise InputError(
            "all logs are of one place of the track; give logs of moves at several places, or use "
            "friction_map for one map"
        )
    return [FrictionMap.of(VelocityMap.joined(group), own.units) for group in groups]


def only_axis(found: Mapping[str, Dataset], axis: str | None) -> tuple[str, Dataset]:
    """The axis of that name, or the only one that moves; InputError where it is not clear."""
    if axis is None and len(found) > 1:
        raise InputError(f"{', '.join(found)} move in the logs; give the axis")
    name = axis or next(iter(found))
    if name not in found:
        raise InputError(f"axis {name} does not move in the logs; there moves {', '.join(found)}")
    return name, found[name]


def _maps(
    model: MachineModel, logs: GivenLogs, axis: str | None
) -> tuple[AxisModel, list[VelocityMap]]:
    """The axis, and the map of each log."""
    name, dataset = only_axis(datasets(model, logs_by_name(logs), {}), axis)
    own = model.axes[name]
    return own, [VelocityMap.of(own, log.motion) for log in dataset.training]
