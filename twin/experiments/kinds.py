"""The kinds of experiment, each with the setpoint that it makes.

Every setpoint starts and ends at rest. Passes, staircases, reversals and open-loop sines are those
of L. Jia, Friction Identification on the Gantry Stage, TU Delft 2023; tracking is the rich motion
on which models are fitted. Steps, sweeps and rests excite effects that those do not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from twin.errors import CannotRun, InputError
from twin.experiments.experiment import (
    Driven,
    Experiment,
    OneAxis,
    counted,
    gentle,
    given,
    machine_limits,
)
from twin.experiments.trajectory import (
    AnySetpoint,
    FloatArray,
    Limits,
    Phases,
    PlannedSetpoint,
    Setpoint,
    concatenate,
    inside_travel,
    join,
    move,
    point_to_point,
    require_length,
    rest,
    travel_box,
    whole_motion,
)
from twin.model.machine import AxisModel, MachineModel


@dataclass(frozen=True)
class Tracking(Experiment):
    """Random straight moves of all axes over the whole travel, from rest to rest.

    Each draws its speed from the slowest to the limit (uniform in the logarithm, one in five at the
    limit), its acceleration and jerk from a tenth of the limit to the limit (likewise), and its
    target within reach from an arcsine distribution, which favours the ends of the travel. Half of
    the moves are followed by a pause. The last ones are shortened to fit.
    """

    summary = "random moves of all axes over the whole travel"

    duration: float = given("s", "exact length")
    slowest: float = given("m/s", "lowest speed", 5e-4)

    def setpoint(self, model: MachineModel, rng: np.random.Generator) -> AnySetpoint:
        limits, rate = machine_limits(model), model.sample_rate
        require_length(self.duration, rate)
        for axis in limits:
            if self.slowest > axis.velocity:
                unit = axis.units.velocity
                raise CannotRun(
                    f"slowest speed {self.slowest:g} {unit} is above the limit of axis "
                    f"{axis.name}, {axis.velocity:g} {unit}: give a lower one"
                )
        samples = round(self.duration * rate)
        low, high = travel_box(limits)
        left, place = (samples - 1) / rate, np.mean((low, high), axis=0)
        parts: list[Phases] = []
        while left > 0.05:  # s at the end of tracking, too short for another move
            drawn = self._drawn(limits, rng)
            cruise = 1.0  # s, about the longest time at one speed of tracking; it bounds slow moves
            reach = cruise * np.array([axis.velocity for axis in drawn])
            near, far = np.maximum(low, place - reach), np.minimum(high, place + reach)
            target = near + (far - near) * rng.beta(0.5, 0.5, place.size)
            while (step := move(drawn, place, target)).total > left:
                target = (place + target) / 2.0
            # At least one sample, so that the loop ends whatever is drawn.
            pause = rest(target, max(0.2 * rng.uniform(-1.0, 1.0), 1.0 / rate))  # s, of tracking
            parts += [step, pause]
            left -= step.total + pause.total
            place = target
        return PlannedSetpoint(join([*parts, rest(place, 0.0)]), samples, rate)

    def _drawn(self, limits: Sequence[Limits], rng: np.random.Generator) -> list[Limits]:
        """Limits of a move; all axes share the draws, so that none slows down the others."""
        pace = min(1.0, 1.25 * rng.random())
        effort = 10.0 ** rng.uniform(-1.0, 0.0)
        speeds = (self.slowest * (axis.velocity / self.slowest) ** pace for axis in limits)
        slower = (replace(axis, velocity=v) for axis, v in zip(limits, speeds, strict=True))
        return [gentle(axis, effort) for axis in slower]


@dataclass(frozen=True)
class Moves(Experiment):
    """Point-to-point moves of all axes together, between random places."""

    summary = "fastest point-to-point moves of all axes together"

    count: int = counted("places")
    dwell: float = given("s", "rest at each place", 0.1, zero=True)
    duration: float = given("s", "length, for as many places as fit; 0: of all", 0.0, zero=True)

    def setpoint(self, model: MachineModel, rng: np.random.Generator) -> AnySetpoint:
        limits = machine_limits(model)
        low, high = travel_box(limits)
        random_ends = (0.02, 0.98)  # parts of the travel between which random places lie
        places = low + (high - low) * rng.uniform(*random_ends, (self.count, len(limits)))
        if not self.duration:
            return point_to_point(limits, places, self.dwell, model.sample_rate)
        total, count = self.dwell, 1
        for start, target in pairwise(places):
            longer = total + move(limits, start, target).total + self.dwell
            if longer > self.duration and count > 1:  # two places at least
                break
            total, count = longer, count + 1
        dwell = max(self.dwell + (self.duration - total) / count, 0.0)
        return point_to_point(limits, places[:count], dwell, model.sample_rate)


@dataclass(frozen=True)
class Passes(OneAxis):
    """One axis back and forth at one speed."""

    summary = "one axis back and forth at one speed"

    span: float = given("m", "length of a pass, centred on the place")
    speed: float = given("m/s", "held over at least half of the span")
    repeats: int = counted("passes each way")
    dwell: float = given("s", "rest at each end", 0.1, zero=True)

    def on(self, driven: Driven) -> AnySetpoint:
        return _passes(driven, self.span, self.speed, self.dwell, self.repeats)


@dataclass(frozen=True)
class Staircase(OneAxis):
    """Velocity map: one axis there and back at each of several speeds.

    Every move is centred on the place, because friction depends on position, and holds its speed
    over at least half of its length.
    """

    summary = "one axis at a staircase of speeds, both ways"

    speeds: tuple[float, ...] = given("m/s", "in the order in which they are run")
    span: float = given("m", "length of a move; slow ones are shorter")
    longest_plateau: float = given("s", "longest time at one speed", 5.0)
    dwell: float = given("s", "rest before and after each move", 0.1, zero=True)

    def on(self, driven: Driven) -> AnySetpoint:
        parts: list[Phases] = []
        limits, own = driven.limits, driven.limits[driven.index]
        for speed in self.speeds:
            own.require_plateau(speed, self.span)
            ramp = own.ramp_time(speed)
            length = min(self.span, speed * (max(self.longest_plateau, ramp) + ramp))
            cycle = _there_and_back(driven, length / 2.0, speed, self.dwell)
            begin = cycle[-1]  # the rest where it starts and ends
            if parts:
                parts.append(move(limits, parts[-1].position[-1], begin.position[0]))
            parts += [begin, *cycle]
        return whole_motion(parts, driven.model.sample_rate)


@dataclass(frozen=True)
class Reversals(OneAxis):
    """One axis a small distance back and forth."""

    summary = "one axis a small distance back and forth"

    repeats: int = counted("moves each way")
    amplitude: float = given("m", "distance to each side of the place", 4e-6)
    dwell: float = given("s", "rest at each reversal", 0.1, zero=True)

    def on(self, driven: Driven) -> AnySetpoint:
        cycle = _there_and_back(driven, self.amplitude, math.inf, self.dwell)
        return _repeated(cycle, self.repeats, driven.model.sample_rate)


@dataclass(frozen=True)
class OpenLoopSine(OneAxis):
    """A sinusoidal force on one axis, no feedback."""

    summary = "sinusoidal force on one axis, no feedback"
    closed_loop = False

    duration: float = given("s", "exact length")
    amplitude: float = given("N", "below the breakaway force the motion is pre-sliding", 0.21)
    period: float = given("s", "of the sine", 3.0)

    def on(self, driven: Driven) -> AnySetpoint:
        rate = driven.model.sample_rate
        require_length(self.duration, rate)
        if self.period < 2.0 / rate:
            raise InputError(
                f"period {self.period:g} s is not a sine at {rate:g} Hz: give at least "
                f"{2.0 / rate:g} s"
            )
        samples = round(self.duration * rate)
        still = PlannedSetpoint(rest(driven.place, self.duration), samples, rate)
        angle = 2.0 * np.pi / self.period * (np.arange(samples) / rate)
        return _with_force(still, driven, self.amplitude * np.sin(angle))


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

    def on(self, driven: Driven) -> AnySetpoint:
        if max(self.efforts) > 1.0:
            raise InputError(
                f"efforts = {max(self.efforts):g}: give parts of the limit, above 0 up to 1"
            )
        count = max(round(self.span / self.step), 1)
        way = np.tile(driven.place, (2 * count + 1, 1))
        there = np.linspace(-0.5 * self.span, 0.5 * self.span, count + 1)
        way[:, driven.index] += np.concatenate([there, there[-2::-1]])
        slower = ([gentle(limit, part) for limit in driven.limits] for part in self.efforts)
        rate = driven.model.sample_rate
        return concatenate([point_to_point(limits, way, self.dwell, rate) for limits in slower])


@dataclass(frozen=True)
class Rests(OneAxis):
    """One axis there and back after rests of several lengths."""

    summary = "one axis there and back, after rests of several lengths"

    span: float = given("m", "length of a move, centred on the place")
    speed: float = given("m/s", "held over at least half of the span")
    rests: tuple[float, ...] = given("s", "before each pair of moves")

    def on(self, driven: Driven) -> AnySetpoint:
        rests = (0.5 * seconds for seconds in self.rests)
        return concatenate([_passes(driven, self.span, self.speed, half, 1) for half in rests])


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

    def on(self, driven: Driven) -> AnySetpoint:
        axis, rate = driven.model.axes[self.axis], driven.model.sample_rate
        allowed, unit = self.most_force(axis), axis.units.force
        if not self.amplitude <= allowed:
            raise CannotRun(
                f"amplitude = {self.amplitude:g} {unit}: at {self.highest:g} Hz it goes beyond the "
                f"limits of axis {self.axis}; give at most {allowed:.4g} {unit}, or a lower effort"
            )
        if not self.lowest < self.highest < 0.5 * rate:
            raise (CannotRun if self.lowest < self.highest else InputError)(
                f"lowest = {self.lowest:g} Hz, highest = {self.highest:g} Hz: give them in rising "
                f"order, below half the sample rate of {rate:g} Hz"
            )
        passes = _passes(driven, self.span, self.speed, self.dwell, self.repeats)
        # the frequency grows exponentially
        growth, samples = math.log(self.highest / self.lowest), len(passes)
        cycles = self.lowest * passes.duration / growth
        phase = 2.0 * np.pi * (cycles * np.expm1(growth * np.arange(samples) / samples))
        return _with_force(passes, driven, self.amplitude * np.sin(phase))

    def most_force(self, axis: AxisModel) -> float:
        """Largest amplitude in N that stays within what the moves leave of the axis' limits."""
        h = axis.hardware
        steepest = min(h.acceleration, h.jerk / (2.0 * math.pi * self.highest))
        return min((1.0 - self.effort) * axis.weighed.mass * steepest, 0.5 * h.force_limit)


@dataclass(frozen=True)
class Multisine(OneAxis):
    """Many sines at once on a slow motion of one axis back and forth, again and again.

    The slow motion keeps friction from sticking but at its two reversals a period. The sines are
    all multiples of the period's frequency between two bounds, with random phases and equal
    accelerations, so that their amplitude falls with the square of the frequency; together they use
    what the slow motion leaves of the limits. They begin within a period before and end within one
    after.
    """

    summary = "many sines at once on a slow motion of one axis, for its frequency response"

    period: float = given("s", "of the motion; its inverse is the distance of the frequencies")
    repeats: int = counted("periods, between one in which it begins and one in which it ends")
    span: float = given("m", "of the slow motion, centred on the place")
    lowest: float = given("Hz", "frequency of the slowest sine")
    highest: float = given("Hz", "frequency of the fastest sine")
    phases: int = counted("which random phases; others are another realisation")

    def on(self, driven: Driven) -> AnySetpoint:
        rate, limits = driven.model.sample_rate, driven.limits
        require_length((self.repeats + 2) * self.period, rate)
        samples = round(self.period * rate)
        first, last = (f * samples / rate for f in (self.lowest, self.highest))
        lines = np.arange(math.ceil(first - 1e-9), math.floor(last + 1e-9) + 1)
        if not (len(lines) and lines[0] >= 1 and 2 * lines[-1] < samples):
            raise InputError(
                f"lowest = {self.lowest:g} Hz, highest = {self.highest:g} Hz: give them in rising "
                f"order, at least {rate / samples:.3g} Hz, below half the sample rate of {rate:g} "
                "Hz"
            )
        slow, sines = np.zeros((2, samples // 2 + 1), dtype=complex)
        slow[1] = 0.25 * self.span * samples
        turns = np.random.default_rng(self.phases).uniform(0.0, 2.0 * np.pi, len(lines))
        sines[lines] = np.exp(1j * turns) / lines**2
        both = [_begun_and_ended(s, samples, rate, self.repeats) for s in (slow, sines)]
        motion = both[0] + _most(limits[driven.index], *both) * both[1]
        columns = np.zeros((3, motion.shape[1], len(limits)))
        columns[0] = driven.place
        columns[:, :, driven.index] += motion[:3]
        position = inside_travel(limits, columns[0])
        return Setpoint(position, columns[1], columns[2], np.zeros_like(position), rate)


def _begun_and_ended(spectrum: np.ndarray, samples: int, rate: float, repeats: int) -> FloatArray:
    """(4, n) periodic motion and its three rates, from rest within a period and back within one."""
    turn = 2j * np.pi * np.fft.rfftfreq(samples, 1.0 / rate)
    periodic = np.fft.irfft(spectrum * turn ** np.arange(4)[:, None], samples)
    periodic = np.tile(periodic, repeats + 2)
    rises = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    along = np.arange(samples) / samples
    weights, out = np.zeros_like(periodic), np.zeros_like(periodic)
    weights[0] = 1.0
    for k in range(4):
        own = rises.deriv(k)(along) * (rate / samples) ** k
        weights[k, :samples] = own
        weights[k, -samples:] = (-1) ** k * own[::-1]
        out[k] = sum(math.comb(k, j) * weights[j] * periodic[k - j] for j in range(k + 1))
    return out


def _most(limit: Limits, slow: FloatArray, sines: FloatArray) -> float:
    """Times which sines (4, n) may be added to a slow motion within the limits of an axis."""
    allowed = np.array([limit.velocity, limit.acceleration, limit.jerk])[:, None]
    left = allowed - np.abs(slow[1:])
    if left.min() <= 0.0:
        raise CannotRun(
            f"the slow motion alone goes beyond the limits of axis {limit.name}; give a longer "
            "period, a shorter span or more effort"
        )
    moved = np.abs(sines[1:]) > 0.0
    return float(np.min(left[moved] / np.abs(sines[1:][moved])))


def _there_and_back(driven: Driven, half: float, speed: float, dwell: float) -> list[Phases]:
    """From `half` (m) below the place to as far above it and back, no axis faster than `speed`."""
    ends = np.tile(inside_travel(driven.limits, driven.place), (2, 1))
    ends[:, driven.index] += -half, half
    low, high = inside_travel(driven.limits, ends)
    slow = [replace(limit, velocity=min(limit.velocity, speed)) for limit in driven.limits]
    return [move(slow, low, high), rest(high, dwell), move(slow, high, low), rest(low, dwell)]


def _passes(driven: Driven, span: float, speed: float, dwell: float, times: int) -> PlannedSetpoint:
    """There and back again and again, the speed held over at least half of the span."""
    driven.limits[driven.index].require_plateau(speed, span)
    cycle = _there_and_back(driven, span / 2.0, speed, dwell)
    return _repeated(cycle, times, driven.model.sample_rate)


def _repeated(cycle: list[Phases], repeats: int, sample_rate: float) -> PlannedSetpoint:
    """The rest that ends the cycle, then the cycle `repeats` times."""
    require_length(repeats * sum(part.total for part in cycle), sample_rate)
    return whole_motion([cycle[-1], *cycle * repeats], sample_rate)


def _with_force(planned: PlannedSetpoint, driven: Driven, force: FloatArray) -> Setpoint:
    """The setpoint with a force (n,), N, on the axis."""
    setpoint = planned.part(0, len(planned))
    setpoint.force[:, driven.index] = force
    return setpoint


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
    "multisine": Multisine,
}


def kind_of(experiment: Experiment) -> str:
    """Name of an experiment's kind, as in KINDS."""
    return next(name for name, kind in KINDS.items() if type(experiment) is kind)
