"""Signals as means over blocks of whole samples.

The command u_k is held over [t_k, t_k + dt), so the force belongs to the middle of the sample; the
position there is (x_k + x_{k+1})/2 and the velocity (x_{k+1} - x_k)/dt. Means over blocks of whole
samples keep these relations exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from twin.model.units import AxisUnits
from twin.signals import Array, between, rate


@dataclass(frozen=True, eq=False)
class Blocks:
    """Signals as they are given.

    signals (3, n): position m, velocity m/s, command N. raw (2, n * samples a block): velocity m/s
    and command N at the log's own rate.
    """

    signals: Array
    raw: Array

    def during(self, blocks: slice) -> Blocks:
        """The same of some blocks."""
        samples = self.raw.shape[1] // self.signals.shape[1]
        at = samples_of(blocks, samples, self.signals.shape[1])
        return Blocks(
            np.ascontiguousarray(self.signals[:, blocks]), np.ascontiguousarray(self.raw[:, at])
        )


@dataclass(frozen=True, eq=False)
class Columns:
    """Signals that are made of a log's columns when they are asked for, and can be let go of.

    readings (n * samples + 1,): m. force (n * samples,): N. samples: of a block. period: s, of the
    log. The signals of all joints would be half as large again as the log, which is in memory.
    """

    readings: Array
    force: Array
    samples: int
    period: float

    @cached_property
    def signals(self) -> Array:
        """As ``Blocks`` has them, (3, n)."""
        return in_blocks(self.readings, self.force, self.samples, self.period)

    @cached_property
    def raw(self) -> Array:
        """As ``Blocks`` has them, (2, n * samples)."""
        if self.samples == 1:
            return self.signals[1:]
        return np.stack([between(self.readings, self.period), self.force])

    @property
    def kept(self) -> Blocks:
        """The same without the columns."""
        return Blocks(self.signals, self.raw)

    def during(self, blocks: slice) -> Columns:
        """The same of some blocks."""
        at = samples_of(blocks, self.samples, len(self.force) // self.samples)
        readings = self.readings[at.start : at.stop + 1]
        return replace(self, readings=readings, force=self.force[at])

    def forget(self) -> None:
        """Let go of the signals."""
        for name in ("signals", "raw"):
            self.__dict__.pop(name, None)


Track = Blocks | Columns


def in_blocks(readings: Array, force: Array, samples: int, period: float) -> Array:
    """Position, velocity and force (3, n) over whole blocks of readings (m,) and a force (m,)."""
    whole = (len(readings) - 1) // samples * samples
    x = readings[: whole + 1]
    stacked = np.stack([0.5 * (x[1:] + x[:-1]), between(x, period), force[:whole]])
    return np.ascontiguousarray(stacked.reshape(3, -1, samples).mean(axis=2))


def samples_of(blocks: slice, samples: int, count: int) -> slice:
    """The samples of some of ``count`` blocks of so many samples each."""
    first, end, _ = blocks.indices(count)
    return slice(first * samples, max(first, end) * samples)


@dataclass(frozen=True, eq=False)
class OtherAxis:
    """Another axis of the machine, in the blocks of the first.

    readings (n * samples + 1,): m, as the log holds them, so that each of many axes can have all
    others. samples: of a block. sample_period: s.
    """

    readings: Array
    samples: int
    sample_period: float
    units: AxisUnits

    @property
    def signals(self) -> Array:
        """Position, velocity and acceleration (3, n), in units."""
        x = self.readings
        position, velocity, _ = in_blocks(x, x, self.samples, self.sample_period)
        return np.stack([position, velocity, rate(velocity, self.samples * self.sample_period)])

    def during(self, blocks: slice) -> OtherAxis:
        """The same of some blocks."""
        at = samples_of(blocks, self.samples, (len(self.readings) - 1) // self.samples)
        return replace(self, readings=self.readings[at.start : at.stop + 1])
