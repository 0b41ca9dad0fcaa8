"""The named experiments.

Setpoints follow the experiments of L. Jia (2023): cable pass, velocity map, reversals, open-loop
sine; tracking is the rich motion on which models are fitted and tested.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from twin.errors import CannotRun, InputError, near
from twin.experiments.experiment import Experiment, OneAxis, machine_limits
from twin.experiments.kinds import (
    Moves,
    Multisine,
    OpenLoopSine,
    Passes,
    Rests,
    Reversals,
    Staircase,
    Steps,
    Tracking,
)
from twin.experiments.trajectory import Limits, require_length
from twin.model.machine import MachineModel
from twin.numbers import neat

MAP_SPEEDS = (0.0005, 0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.02, 0.04, 0.08)  # m/s
DURATION = 20.0  # s
ALLOWED = 0.05  # part of what was asked by which the length may be off

Kind = TypeVar("Kind", bound=Experiment)
Length = Callable[[Experiment], float]


def lasting(draft: Kind, model: MachineModel, seconds: float) -> Kind:
    """The experiment, filling that time (s); as it is where it cannot run, or takes longer.

    Where its moves alone take longer it is as short as it can be.
    """

    def length(experiment: Experiment) -> float:
        return experiment.setpoint(model, np.random.default_rng(0)).duration

    other = draft.other if isinstance(draft, OneAxis) else 0.0
    given: Any = draft
    alone = replace(given, other=0.0) if other else given
    try:
        found = _filled(_fitted(alone, seconds, length), seconds, length)
    except CannotRun:
        return draft
    return replace(found, other=other) if other else found


def missed(asked: float, lasts: float) -> str | None:
    """A sentence where an experiment does not last what was asked (both s)."""
    if abs(lasts - asked) <= ALLOWED * asked:
        return None
    why = "it has no rests to be filled with"
    if lasts > asked:
        why = "its moves take that long within the limits of the machine"
    return f"the experiment lasts {lasts:.3g} s, not {asked:.3g} s as asked: {why}"


def _fitted(draft: Any, seconds: float, length: Length) -> Any:
    """With as many repeats, or as long plateaus, as take no longer than that."""
    if hasattr(draft, "repeats"):
        once, twice = (length(replace(draft, repeats=n)) for n in (1, 2))
        more = math.floor((seconds - once) / (twice - once) * (1.0 + 1e-9))
        return replace(draft, repeats=1 + max(more, 0))
    if isinstance(draft, Steps):
        while length(draft) > seconds and len(draft.efforts) > 1:
            draft = replace(draft, efforts=draft.efforts[:-1])
    if isinstance(draft, Staircase):
        for _ in range(10):  # of the plateaus of a staircase
            if length(draft) <= seconds:
                break
            draft = replace(draft, longest_plateau=neat(0.5 * draft.longest_plateau))
    return draft


def _filled(draft: Any, seconds: float, length: Length) -> Any:
    """With its rests longer, or shorter, by what is left of the time."""
    now = length(draft)
    if isinstance(draft, Rests):
        longer = length(replace(draft, rests=tuple(2.0 * rest for rest in draft.rests))) - now
        factor = max(1.0 + (seconds - now) / longer, 0.05)
        return replace(draft, rests=tuple(neat(factor * rest) for rest in draft.rests))
    if not hasattr(draft, "dwell") or hasattr(draft, "duration"):
        return draft
    longer = length(replace(draft, dwell=draft.dwell + 1.0)) - now  # s for each s of rest
    dwell = draft.dwell + (seconds - now) / longer
    least_dwell = 0.02  # s, to which rests are shortened where the moves need the time
    return replace(draft, dwell=neat(max(dwell, min(least_dwell, draft.dwell or least_dwell))))


@dataclass(frozen=True)
class Named:
    """A named experiment. make: (model, name of the axis, duration s) -> Experiment.

    of_one_axis: whether it moves one of them, and not all.
    """

    summary: str
    make: Callable[[MachineModel, str, float], Experiment]
    of_one_axis: bool = True


def _limit(model: MachineModel, axis: str) -> Limits:
    return machine_limits(model)[list(model.axes).index(axis)]


def _cable_pass(model: MachineModel, axis: str, duration: float) -> Experiment:
    limit = _limit(model, axis)
    low, high = limit.travel
    span = 0.88 * (high - low)  # of the travel
    speed = min(0.1, limit.fastest_plateau(span))  # m/s
    return lasting(Passes(axis, span=span, speed=speed, repeats=1), model, duration)


def _velocity_map(model: MachineModel, axis: str, duration: float) -> Experiment:
    map_span = 0.02  # m
    fastest = _limit(model, axis).fastest_plateau(map_span)
    speeds = tuple(s for s in MAP_SPEEDS if s <= fastest)
    longest = duration / 4.0 / len(speeds)
    draft = Staircase(axis, speeds=speeds, span=map_span, longest_plateau=longest)
    return lasting(draft, model, duration)


def _multisine(model: MachineModel, axis: str, duration: float) -> Experiment:
    """Four periods, between one in which it begins and one in which it ends."""
    limit, period = _limit(model, axis), duration / 6.0
    low, high = limit.travel
    # The slow motion takes a quarter of each limit at most.
    turn = 2.0 * np.pi / period
    most = min(limit.velocity / turn, limit.acceleration / turn**2, limit.jerk / turn**3)
    span = min(0.2 * (high - low), 0.1 * most)
    highest = min(0.4 * model.sample_rate, 10.0 * model.axes[axis].hardware.bandwidth)
    return Multisine(axis, period, 4, span, min(4.0 / period, 0.5 * highest), highest, 1)


EXPERIMENTS: Mapping[str, Named] = {
    "tracking": Named(Tracking.summary, lambda model, axis, duration: Tracking(duration), False),
    "moves": Named(
        Moves.summary,
        # a move every 0.1 s or so
        lambda model, axis, duration: Moves(max(int(duration / 0.1), 2), duration=duration),
        of_one_axis=False,
    ),
    "cable_pass": Named("one axis back and forth at 0.1 m/s over the travel", _cable_pass),
    "velocity_map": Named(Staircase.summary, _velocity_map),
    "reversals": Named(
        "one axis 4 um back and forth",
        lambda model, axis, duration: lasting(Reversals(axis, repeats=1), model, duration),
    ),
    "open_loop_sine": Named(
        "sinusoidal force of 0.21 N and 3 s on one axis, no feedback",
        lambda model, axis, duration: OpenLoopSine(axis, duration),
    ),
    "multisine": Named(Multisine.summary, _multisine),
}


def find_experiment(
    name: str, model: MachineModel, axis: str | None = None, duration: float = DURATION
) -> Experiment:
    """The experiment of that name for this machine, on its first axis where None is given.

    duration: s. InputError names the nearest where there is none, and for an axis that is not
    there; CannotRun for a duration of no sample, or beyond the longest setpoint.
    """
    if name not in EXPERIMENTS:
        raise InputError(
            f"unknown experiment '{name}'; {near(name, EXPERIMENTS)}there are "
            f"{', '.join(EXPERIMENTS)}"
        )
    if axis is not None:
        model.axis(axis)
    require_length(duration, model.sample_rate)
    return EXPERIMENTS[name].make(model, axis or next(iter(model.axes)), duration)
