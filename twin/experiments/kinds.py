"""The kinds of experiment.

Passes, staircases, reversals and open-loop sines are those of L. Jia (2023); tracking is the rich
motion on which models are fitted. Steps, sweeps and rests excite effects that those do not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from twin.errors import CannotRun, InputError
from twin.experiments import trajectory
from twin.experiments.experiment import Experiment, OneAxis, counted, gentle, given, machine_limits
from twin.experiments.trajectory import Limits
from twin.experiments.trajectory.setpoint import AnySetpoint
from twin.model.machine import AxisModel, MachineModel

RANDOM_ENDS = (0.02, 0.98)  # parts of the travel between which random places lie


@dataclass(frozen=True)
class Tracking(Experiment):
    """Random moves of all axes over the whole travel, at all speeds and accelerations."""

    summary = "random moves of all axes over the whole travel"

    duration: float = given("s", "exact length")
    slowest: float = given("m/s", "lowest speed", 5e-4)

    def setpoint(self, model: MachineModel, rng: np.random.Generator) -> AnySetpoint:
        """See Experiment."""
        return trajectory.random_tracking(
            machine_limits(model), self.duration, rng, slowest=self.slowest,
            sample_rate=model.sample_rate,
        )  # fmt: skip


@dataclass(frozen=True)
class Moves(Experiment):
    """Point-to-point moves of all axes together, between random places."""

    summary = "fastest point-to-point moves of all axes together"

    count: int = counted("places")
    dwell: float = given("s", "rest at each place", 0.1, zero=True)
    duration: float = given("s", "length, for as many places as fit; 0: of all", 0.0, zero=True)

    def setpoint(self, model: MachineModel, rng: np.random.Generator) -> AnySetpoint:
        """See Experiment."""
        limits = machine_limits(model)
        low, high = np.array([limit.travel for limit in limits]).T
        places = low + (high - low) * rng.uniform(*RANDOM_ENDS, (self.count, len(limits)))
        count, dwell = self._in_time(limits, places) if self.duration else (len(places), self.dwell)
        return trajectory.point_to_point(
            limits, places[:count], dwell=dwell, sample_rate=model.sample_rate
        )

    def _in_time(self, limits: Sequence[Limits], places: np.ndarray) -> tuple[int, float]:
        """How many of the places fit into the time, two at least, and the rest at each, s."""
        total, count = self.dwell, 1
        for start, target in pairwise(places):
            longer = total + trajectory.move(limits, start, target).total + self.dwell
            if longer > self.duration and count > 1:
                break
            total, count = longer, count + 1
        return count, max(self.dwell + (self.duration - total) / count, 0.0)


@dataclass(frozen=True)
class Passes(OneAxis):
    """One axis back and forth at one speed."""

    summary = "one axis back and forth at one speed"

    span: float = given("m", "length of a pass, centred on the place")
    speed: float = given("m/s", "held over at least half of the span")
    repeats: int = counted("passes each way")
    dwell: float = given("s", "rest at each end", 0.1, zero=True)

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        return trajectory.constant_speed_passes(
            limits, axis, span=self.span, speed=self.speed, repeats=self.repeats, at=place,
            dwell=self.dwell, sample_rate=model.sample_rate,
        )  # fmt: skip


@dataclass(frozen=True)
class Staircase(OneAxis):
    """Velocity map: one axis there and back at each of several speeds."""

    summary = "one axis at a staircase of speeds, both ways"

    speeds: tuple[float, ...] = given("m/s", "in the order in which they are run")
    span: float = given("m", "length of a move; slow ones are shorter")
    longest_plateau: float = given("s", "longest time at one speed", 5.0)
    dwell: float = given("s", "rest before and after each move", 0.1, zero=True)

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        return trajectory.velocity_staircase(
            limits, axis, self.speeds, span=self.span, longest_plateau=self.longest_plateau,
            at=place, dwell=self.dwell, sample_rate=model.sample_rate,
        )  # fmt: skip


@dataclass(frozen=True)
class Reversals(OneAxis):
    """One axis a small distance back and forth."""

    summary = "one axis a small distance back and forth"

    repeats: int = counted("moves each way")
    amplitude: float = given("m", "distance to each side of the place", 4e-6)
    dwell: float = given("s", "rest at each reversal", 0.1, zero=True)

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        return trajectory.micro_reversals(
            limits, axis, amplitude=self.amplitude, repeats=self.repeats, at=place,
            dwell=self.dwell, sample_rate=model.sample_rate,
        )  # fmt: skip


@dataclass(frozen=True)
class OpenLoopSine(OneAxis):
    """A sinusoidal force on one axis, no feedback."""

    summary = "sinusoidal force on one axis, no feedback"
    closed_loop = False

    duration: float = given("s", "exact length")
    amplitude: float = given("N", "below the breakaway force the motion is pre-sliding", 0.21)
    period: float = given("s", "of the sine", 3.0)

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        return trajectory.open_loop_sine(
            axis, amplitude=self.amplitude, period=self.period, duration=self.duration, at=place,
            sample_rate=model.sample_rate,
        )  # fmt: skip


@dataclass(frozen=True)
class Steps(OneAxis):
    """One axis through a span in short steps and back, once with each acceleration.

    The force at one place then takes many values.
    """

    summary = "one axis in short steps through a span and back, at several accelerations"

    span: float = given("m", "centred on the place")
    step: float = given("m", "length of a step")
    efforts: tuple[float, ...] = given("1", "parts of the acceleration limit, one a round")
    dwell: float = given("s", "rest after each step", 0.05, zero=True)

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        if max(self.efforts) > 1.0:
            raise InputError(
                f"efforts = {max(self.efforts):g}: give parts of the limit, above 0 up to 1"
            )
        count = max(round(self.span / self.step), 1)
        way = np.tile(np.asarray(place, dtype=float), (2 * count + 1, 1))
        there = np.linspace(-0.5 * self.span, 0.5 * self.span, count + 1)
        way[:, axis] += np.concatenate([there, there[-2::-1]])
        rounds = [
            trajectory.point_to_point(
                [gentle(limit, effort) for limit in limits], way, dwell=self.dwell,
                sample_rate=model.sample_rate,
            )
            for effort in self.efforts
        ]  # fmt: skip
        return trajectory.concatenate(*rounds)


@dataclass(frozen=True)
class Rests(OneAxis):
    """One axis there and back after rests of several lengths."""

    summary = "one axis there and back, after rests of several lengths"

    span: float = given("m", "length of a move, centred on the place")
    speed: float = given("m/s", "held over at least half of the span")
    rests: tuple[float, ...] = given("s", "before each pair of moves")

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        rounds = [
            trajectory.constant_speed_passes(
                limits, axis, span=self.span, speed=self.speed, repeats=1, at=place,
                dwell=0.5 * rest, sample_rate=model.sample_rate,
            )
            for rest in self.rests
        ]  # fmt: skip
        return trajectory.concatenate(*rounds)


@dataclass(frozen=True)
class Sweep(OneAxis):
    """A force of rising frequency on top of the loop, while one axis passes back and forth.

    The passes keep friction from reversing. What the force adds to acceleration and jerk must fit
    into the part of the limits that the moves leave: give ``effort`` below 1.
    """

    summary = "force of rising frequency on top of slow passes of one axis"

    span: float = given("m", "length of a pass, centred on the place")
    speed: float = given("m/s", "held over at least half of the span")
    repeats: int = counted("passes each way")
    amplitude: float = given("N", "of the force")
    lowest: float = given("Hz", "frequency at the start")
    highest: float = given("Hz", "frequency at the end")
    dwell: float = given("s", "rest at each end", 0.05, zero=True)

    def on(
        self, limits: Sequence[Limits], axis: int, place: tuple[float, ...], model: MachineModel
    ) -> AnySetpoint:
        """See OneAxis."""
        driven = list(model.axes.values())[axis]
        allowed, unit = self.most_force(driven), driven.units.force
        if not self.amplitude <= allowed:
            raise CannotRun(
                f"amplitude = {self.amplitude:g} {unit}: at {self.highest:g} Hz it goes beyond the "
                f"limits of axis {self.axis}; give at most {allowed:.4g} {unit}, or a lower effort"
            )
        if not self.lowest < self.highest < 0.5 * model.sample_rate:
            raise (CannotRun if self.lowest < self.highest else InputError)(
                f"lowest = {self.lowest:g} Hz, highest = {self.highest:g} Hz: give them in rising "
                f"order, below half the sample rate of {model.sample_rate:g} Hz"
            )
        passes = trajectory.constant_speed_passes(
            limits, axis, span=self.span, speed=self.speed, repeats=self.repeats, at=place,
            dwell=self.dwell, sample_rate=model.sample_rate,
        )  # fmt: skip
        force = passes.force.copy()
        force[:, axis] = self.amplitude * np.sin(self._phase(passes.duration, len(force)))
        return replace(passes.part(0, len(passes)), force=force)

    def most_force(self, axis: AxisModel) -> float:
        """Largest amplitude in N that stays within what the moves leave of the axis' limits."""
        h = axis.hardware
        steepest = min(h.acceleration, h.jerk / (2.0 * math.pi * self.highest))
        return min((1.0 - self.effort) * axis.mass * steepest, 0.5 * h.force_limit)

    def _phase(self, duration: float, samples: int) -> np.ndarray:
        """Phase (samples,) in radians of a sine whose frequency grows exponentially."""
        growth = math.log(self.highest / self.lowest)
        cycles = self.lowest * duration / growth * np.expm1(growth * np.arange(samples) / samples)
        return 2.0 * np.pi * cycles


KINDS: Mapping[str, type[Experiment]] = {
    "tracking": Tracking,
    "moves": Moves,
    "passes": Passes,
    "staircase": Staircase,
    "reversals": Reversals,
    "open_loop_sine": OpenLoopSine,
    "steps": Steps,
    "rests": Rests,
    "sweep": Sweep,
}


def kind_of(experiment: Experiment) -> str:
    """Name of an experiment's kind, as in KINDS."""
    return next(name for name, kind in KINDS.items() if type(experiment) is kind)
