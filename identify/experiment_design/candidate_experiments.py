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
    Passes,
    Rests,
    Staircase,
    Steps,
    Sweep,
    Tracking,
)
from twin.experiments.lasting import ALLOWED, lasting
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
    model.axis(axis)
    limits = dict(zip(model.axes, machine_limits(model), strict=True))
    effort, scale = _affordable(model, axis), _scale(model.axes[axis])
    limits[axis] = gentle(limits[axis], effort)
    drafts = (
        Tracking(duration),
        *(Moves(max(int(duration / d), 2), dwell=d, duration=duration) for d in (0.1, 1.0)),
        *_passes(limits, axis, duration, scale),
        *_reversing(limits, axis, duration, scale),
        *_accelerating(limits, axis, duration),
        *_swept(model, limits, axis, duration),
    )
    found, not_run = [], []
    for draft in drafts:
        if effort < 1.0 and isinstance(draft, OneAxis):  # its moves no harder than the motor allows
            draft = replace(draft, effort=neat(effort * draft.effort))
        experiment = lasting(draft, model, duration)
        try:
            _require_fit(experiment, model, duration)
        except CannotRun as why:
            not_run.append(NotRun(experiment, str(why), model.axes[axis].units))
        else:
            found.append(experiment)
    if not found:
        raise CannotRun(
            f"no experiment of {duration:g} s fits axis {axis}; give a longer --duration (s)"
        )
    return found, tuple(not_run)


def _affordable(model: MachineModel, axis: str) -> float:
    """Part of the acceleration limit that the motor's force allows, 0..1."""
    h, mass = model.axes[axis].hardware, model.axes[axis].mass
    return min(1.0, FORCE_USED * h.force_limit / (mass * h.acceleration))


def _require_fit(experiment: Experiment, model: MachineModel, duration: float) -> None:
    """Raise CannotRun unless the machine can run it, in not more than that time (s)."""
    setpoint = experiment.setpoint(model, np.random.default_rng(0))
    if setpoint.duration > (1.0 + ALLOWED) * duration:
        raise CannotRun(
            f"takes {setpoint.duration:.3g} s, more than the {duration:g} s planned; give a longer "
            "--duration (s)"
        )


def _other_span(limits: dict[str, Limits], axis: str) -> float:
    """Span (m) for the other axis, or 0 where there is none."""
    spans = [neat(USED * (v.travel[1] - v.travel[0])) for name, v in limits.items() if name != axis]
    return spans[0] if len(spans) == 1 else 0.0


def _scale(axis: AxisModel) -> float:
    """Of the lengths and speeds of a stage, for an axis whose travel is known: rad a metre.

    Angles are as large a part of the travel, or as the encoder asks for to see the shortest.
    """
    h = axis.hardware
    if not axis.rotary or h.travel is None:
        return 1.0
    travel = h.travel[1] - h.travel[0]
    seen = SEEN * max(h.encoder_noise, h.encoder_resolution)
    return min(max(travel / STAGE, seen / SHORT[0][0]), USED * travel / SHORT[-1][0])


def _pass(axis: str, limit: Limits, span: float, speed: float, seconds: float) -> Passes:
    """As many passes as fit in that time, at the speed or as fast as the span allows."""
    speed = neat(min(speed, limit.fastest_plateau(span)))
    once = span / speed + limit.ramp_time(speed) + 0.1
    return Passes(axis, span, speed, repeats=min(max(int(seconds / once / 2), 1), MOST_REPEATS))


def _passes(
    limits: dict[str, Limits], axis: str, duration: float, scale: float = 1.0
) -> Iterator[Experiment]:
    """Passes over the whole travel, and a velocity map; the other axis at rest, then moving."""
    limit = limits[axis]
    span = neat(USED * (limit.travel[1] - limit.travel[0]))
    slow = 2.0 * span / duration
    fast = limit.fastest_plateau(span)
    other = _other_span(limits, axis)
    for speed in (1.1 * slow, (slow * fast) ** 0.5, fast):
        passes = _pass(axis, limit, span, speed, duration)
        yield passes
        if other:
            yield Passes(axis, span, passes.speed, passes.repeats, other=other)
    map_span = neat(0.3 * span)
    fastest = limit.fastest_plateau(map_span)
    speeds = np.geomspace(min(SLOWEST * scale, SLOW * fastest), fastest, 10)
    yield Staircase(axis, tuple(map(neat, speeds)), map_span, neat(duration / 40.0))


def _reversing(
    limits: dict[str, Limits], axis: str, duration: float, scale: float = 1.0
) -> Iterator[Experiment]:
    """Short passes, slow and fast, and starts after rests of several lengths."""
    limit = limits[axis]

    def passes(span: float, speed: float) -> Passes:
        return _pass(axis, limit, neat(scale * span), scale * speed, duration)

    for short in SHORT:
        yield passes(*short)
    if other := _other_span(limits, axis):
        yield replace(passes(*STILL), other=other)
    rests = np.geomspace(0.1, duration / 3.0, 5)
    move = passes(*RESTED)
    yield Rests(
        axis, move.span, move.speed, tuple(map(neat, rests * 0.55 * duration / rests.sum()))
    )


def _accelerating(limits: dict[str, Limits], axis: str, duration: float) -> Iterator[Experiment]:
    """Steps through the travel at high and low acceleration: many forces at each place."""
    limit = limits[axis]
    for part in (1.0, 0.3):
        span = neat(part * USED * (limit.travel[1] - limit.travel[0]))
        for count in (60, 15, 3):
            left, efforts = duration, []
            for effort in itertools.cycle(EFFORTS):
                moving = _move_time(gentle(limit, effort), span / count) + STEP_DWELL
                left -= 2 * count * moving
                if left < 0.0:
                    break
                efforts.append(effort)
            if efforts:
                yield Steps(axis, span, neat(span / count), tuple(efforts), STEP_DWELL)


def _move_time(limit: Limits, distance: float) -> float:
    """About the time (s) of the fastest move over a distance (m)."""
    speed = min(limit.velocity, math.sqrt(distance * limit.acceleration))
    steep = limit.acceleration / limit.jerk
    return distance / speed + speed / limit.acceleration + steep


def _swept(
    model: MachineModel, limits: dict[str, Limits], axis: str, duration: float
) -> Iterator[Experiment]:
    """A force sweep on slow passes, over the whole travel and at one place."""
    limit = limits[axis]
    for part, highest in itertools.product((1.0, 0.1), SWEPT):
        span = neat(part * USED * (limit.travel[1] - limit.travel[0]))
        speed = neat(min(2.4 * span / duration, limit.fastest_plateau(span)))
        weak = Sweep(axis, span, speed, 1, 1.0, LOWEST, highest, effort=GENTLE)
        yield replace(weak, amplitude=neat(MARGIN * weak.most_force(model.axes[axis])))
