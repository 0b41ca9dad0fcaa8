"""The experiments among which a plan chooses: a fixed family, each within the machine's limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from twin.errors import CannotRun
from twin.experiments.experiment import Experiment, OneAxis, gentle, machine_limits
from twin.experiments.kinds import (
    Moves,
    Multisine,
    Passes,
    Rests,
    Staircase,
    Steps,
    Sweep,
    Tracking,
)
from twin.experiments.named import ALLOWED, lasting
from twin.experiments.trajectory import Limits
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import LINEAR, AxisUnits
from twin.numbers import neat

USED = 0.9  # part of the travel that passes cover
SLOWEST = 5e-4  # m/s, of a velocity map,
SLOW = 0.1  # but no more than this part of the fastest
SHORT = ((2e-5, 5e-5), (2e-4, 1e-3), (2e-3, 4e-3), (0.02, 1.0))  # m and m/s, of short passes
STILL = (0.01, 2e-3)  # m and m/s, of passes while the other axis moves
RESTED = (2e-3, 4e-3)  # m and m/s, of moves after rests
STAGE = 0.34  # m, travel of the linear stage for which these are; of angles see _scale
SEEN = 50.0  # times the noise and the step of the encoder, that an angle must be
LOWEST = 2.0  # Hz, where a sweep begins
SWEPT = (60.0, 120.0)  # Hz, where it ends: the shortest test functions pass little above
PERIODS = 6  # of a multisine, of which the first and the last begin and end it
EFFORTS = (1.0, 0.3)  # parts of the acceleration limit that steps use in turn
STEP_DWELL = 0.05  # s
MARGIN = 0.5  # part of the allowed force that a sweep uses; the loop adds to it near its bandwidth
GENTLE = 0.5  # part of the acceleration limit that the passes under a sweep use
FORCE_USED = 0.4  # part of the force limit that moves use; the rest is for friction and the loop
MOST_REPEATS = 1000


@dataclass(frozen=True)
class NotRun:
    """An experiment that the machine cannot run, and the reason.

    truth: the explanation with which it cannot run, where another one allows it. units: of its
    axis.
    """

    experiment: Experiment
    reason: str
    units: AxisUnits = LINEAR
    truth: str | None = None


def proposals(
    model: MachineModel, axis: str, duration: float
) -> tuple[list[Experiment], tuple[NotRun, ...]]:
    """Experiments of that duration (s) for one axis, all within the machine's limits.

    Also those of the family that are not among them, with the reason. Raises CannotRun where the
    travel is not known, and where none fits.
    """
    own, limits = model.axis(axis), dict(zip(model.axes, machine_limits(model), strict=True))
    others = [v.travel for name, v in limits.items() if name != axis]
    other = neat(USED * (others[0][1] - others[0][0])) if len(others) == 1 else 0.0
    effort = min(
        1.0, FORCE_USED * own.hardware.force_limit / (own.weighed.mass * own.hardware.acceleration)
    )
    limit, scale = gentle(limits[axis], effort), _scale(own)
    room = _Room(own, axis, limit, other, duration, scale, model.sample_rate)
    kinds = room.general(), room.passing(), room.reversing(), room.accelerating(), room.swept()
    found, not_run = [], []
    for draft in itertools.chain(*kinds):
        if effort < 1.0 and isinstance(draft, OneAxis):  # its moves no harder than the motor allows
            draft = replace(draft, effort=neat(effort * draft.effort))
        experiment = lasting(draft, model, duration)
        try:
            _require_fit(experiment, model, duration)
        except CannotRun as why:
            not_run.append(NotRun(experiment, str(why), own.units))
        else:
            found.append(experiment)
    if not found:
        raise CannotRun(
            f"no experiment of {duration:g} s fits axis {axis}; give a longer duration (s)"
        )
    return found, tuple(not_run)


def _require_fit(experiment: Experiment, model: MachineModel, duration: float) -> None:
    """Raise CannotRun unless the machine can run it, in not more than that time (s)."""
    setpoint = experiment.setpoint(model, np.random.default_rng(0))
    if setpoint.duration > (1.0 + ALLOWED) * duration:
        raise CannotRun(
            f"takes {setpoint.duration:.3g} s, more than the {duration:g} s planned; give a longer "
            "duration (s)"
        )


def _scale(axis: AxisModel) -> float:
    """Of a stage's lengths and speeds, rad a metre: for as large a part of the travel, or seen."""
    h = axis.hardware
    if not axis.rotary or h.travel is None:
        return 1.0
    travel = h.travel[1] - h.travel[0]
    seen = SEEN * max(h.encoder_noise, h.encoder_resolution)
    return min(max(travel / STAGE, seen / SHORT[0][0]), USED * travel / SHORT[-1][0])


@dataclass(frozen=True)
class _Room:
    """What the experiments of one axis may use.

    limit: as far as the motor's force allows. other: m, span of the other axis, 0 where there is
    none, or are several. duration: s. scale: of the lengths and speeds of a stage. rate: Hz, of the
    machine's samples.
    """

    model: AxisModel
    axis: str
    limit: Limits
    other: float
    duration: float
    scale: float
    rate: float

    def general(self) -> Iterator[Experiment]:
        """Motion of all axes."""
        yield Tracking(self.duration)
        # s: hardly a rest, and one in which a bristle creeps
        for dwell in (0.1, 1.0):
            yield Moves(max(int(self.duration / dwell), 2), dwell=dwell, duration=self.duration)

    def span(self, part: float = 1.0) -> float:
        """A part of the travel that passes cover, m."""
        return neat(part * USED * (self.limit.travel[1] - self.limit.travel[0]))

    def passes(self, span: float, speed: float) -> Passes:
        """As many passes as fit in the time, at the speed or as fast as the span allows."""
        speed = neat(min(speed, self.limit.fastest_plateau(span)))
        # 0.1 s, that a pass dwells at its end
        once = span / speed + self.limit.ramp_time(speed) + 0.1
        repeats = min(max(int(self.duration / once / 2), 1), MOST_REPEATS)
        return Passes(self.axis, span, speed, repeats=repeats)

    def passing(self) -> Iterator[Experiment]:
        """Passes over the whole travel, the other axis at rest and moving; and a velocity map."""
        span = self.span()
        slow, fast = 2.0 * span / self.duration, self.limit.fastest_plateau(span)
        # 1.1 of the slowest that still passes twice in the time
        for speed in (1.1 * slow, (slow * fast) ** 0.5, fast):
            passes = self.passes(span, speed)
            yield passes
            if self.other:
                yield replace(passes, other=self.other)
        # 0.3 of the travel, so that ten speeds fit in the time
        map_span = neat(0.3 * span)
        fastest = self.limit.fastest_plateau(map_span)
        speeds = np.geomspace(min(SLOWEST * self.scale, SLOW * fastest), fastest, 10)
        # a fortieth of the time: ten speeds, both ways, as long again between them
        yield Staircase(self.axis, tuple(map(neat, speeds)), map_span, neat(self.duration / 40.0))

    def reversing(self) -> Iterator[Experiment]:
        """Short passes, slow and fast, and starts after rests of several lengths."""
        *short, still, move = (
            self.passes(neat(self.scale * span), self.scale * speed)
            for span, speed in (*SHORT, STILL, RESTED)
        )
        yield from short
        if self.other:
            yield replace(still, other=self.other)
        # s: from hardly a rest to a third of the time
        rests = np.geomspace(0.1, self.duration / 3.0, 5)
        # 0.55 of the time; moves take the rest
        rests *= 0.55 * self.duration / rests.sum()
        yield Rests(self.axis, move.span, move.speed, tuple(map(neat, rests)))

    def accelerating(self) -> Iterator[Experiment]:
        """Steps through the travel at high and low acceleration: many forces at each place."""
        # all of the travel and a third of it, in short steps and in long ones
        for part, count in itertools.product((1.0, 0.3), (60, 15, 3)):
            span, left, efforts = self.span(part), self.duration, []
            for effort in itertools.cycle(EFFORTS):
                moving = _move_time(gentle(self.limit, effort), span / count) + STEP_DWELL
                left -= 2 * count * moving
                if left < 0.0:
                    break
                efforts.append(effort)
            if efforts:
                yield Steps(self.axis, span, neat(span / count), tuple(efforts), STEP_DWELL)

    def swept(self) -> Iterator[Experiment]:
        """A force sweep on slow passes, over the whole travel and at one place; many sines."""
        # all of the travel, and a tenth: one place
        for part, highest in itertools.product((1.0, 0.1), SWEPT):
            span = self.span(part)
            # 2.4 spans in the time: there and back, and the ramps
            speed = neat(min(2.4 * span / self.duration, self.limit.fastest_plateau(span)))
            weak = Sweep(self.axis, span, speed, 1, 1.0, LOWEST, highest, effort=GENTLE)
            yield replace(weak, amplitude=neat(MARGIN * weak.most_force(self.model)))
        # 0.4 of the rate: what is above, the log does not tell
        period, highest = neat(self.duration / PERIODS), min(SWEPT[-1], 0.4 * self.rate)
        if highest > LOWEST:
            # a tenth of the travel: one place
            yield Multisine(self.axis, period, 1, self.span(0.1), LOWEST, highest, phases=1)


def _move_time(limit: Limits, distance: float) -> float:
    """About the time (s) of the fastest move over a distance (m)."""
    speed = min(limit.velocity, math.sqrt(distance * limit.acceleration))
    steep = limit.acceleration / limit.jerk
    return distance / speed + speed / limit.acceleration + steep
