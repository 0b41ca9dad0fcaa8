"""The named experiments, run on the twin and logged.

Setpoints follow the experiments of L. Jia (2023): cable pass, velocity map, reversals, open-loop
sine; tracking is the rich motion on which models are fitted and tested.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from twin.core.control import Controller
from twin.entries import near
from twin.errors import InputError
from twin.experiments.experiment import Experiment, driven_units, machine_limits
from twin.experiments.file import format_experiment, setpoint_of
from twin.experiments.follow import follow_parts
from twin.experiments.kinds import (
    Moves,
    Multisine,
    OpenLoopSine,
    Passes,
    Reversals,
    Staircase,
    Tracking,
    kind_of,
)
from twin.experiments.lasting import lasting
from twin.experiments.trajectory import Limits, require_length
from twin.logs import Log
from twin.logs.log import joined
from twin.model.machine import MachineModel
from twin.numbers import require_seed
from twin.simulator import MujocoSimulator, Progress, ReducedSimulator

MAP_SPEEDS = (0.0005, 0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.02, 0.04, 0.08)  # m/s
MAP_SPAN = 0.02  # m
PASS_SPEED = 0.1  # m/s
PASS_PART = 0.88  # of the travel
DURATION = 20.0  # s
REST = 0.1  # s between moves


@dataclass(frozen=True)
class Named:
    """A named experiment. make: (model, name of the axis, duration s) -> Experiment."""

    summary: str
    make: Callable[[MachineModel, str, float], Experiment]


def _limit(model: MachineModel, axis: str) -> Limits:
    return machine_limits(model)[list(model.axes).index(axis)]


def _moves(model: MachineModel, axis: str, duration: float) -> Experiment:
    return Moves(count=max(int(duration / REST), 2), duration=duration)


def _cable_pass(model: MachineModel, axis: str, duration: float) -> Experiment:
    limit = _limit(model, axis)
    low, high = limit.travel
    span = PASS_PART * (high - low)
    speed = min(PASS_SPEED, limit.fastest_plateau(span))
    return lasting(Passes(axis, span=span, speed=speed, repeats=1), model, duration)


def _velocity_map(model: MachineModel, axis: str, duration: float) -> Experiment:
    fastest = _limit(model, axis).fastest_plateau(MAP_SPAN)
    speeds = tuple(s for s in MAP_SPEEDS if s <= fastest)
    longest = duration / 4.0 / len(speeds)
    draft = Staircase(axis, speeds=speeds, span=MAP_SPAN, longest_plateau=longest)
    return lasting(draft, model, duration)


def _reversals(model: MachineModel, axis: str, duration: float) -> Experiment:
    return lasting(Reversals(axis, repeats=1), model, duration)


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
    "tracking": Named(Tracking.summary, lambda model, axis, duration: Tracking(duration)),
    "moves": Named(Moves.summary, _moves),
    "cable_pass": Named("one axis back and forth at 0.1 m/s over the travel", _cable_pass),
    "velocity_map": Named(Staircase.summary, _velocity_map),
    "reversals": Named("one axis 4 um back and forth", _reversals),
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


def simulate(
    model: MachineModel,
    experiment: str | Experiment,
    *,
    seed: int = 0,
    duration: float | None = None,
    axis: str | None = None,
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = MujocoSimulator,
    progress: Progress | None = None,
) -> Log:
    """Run an experiment on the twin and return its log, with the truth topics.

    experiment: a name, or an experiment with its own parameters. Of a named one: duration in s (20
    where None), kept by all but those whose moves take longer; axis, the one
    that moves where the experiment moves one, the first where None. The same seed gives the same
    log. Raises InputError for an unknown experiment or axis, and for a setpoint outside the travel.
    """
    return joined(
        simulate_parts(
            model, experiment, seed=seed, duration=duration, axis=axis, simulator=simulator,
            progress=progress,
        )
    )  # fmt: skip


def simulate_parts(
    model: MachineModel,
    experiment: str | Experiment,
    *,
    seed: int = 0,
    duration: float | None = None,
    axis: str | None = None,
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = MujocoSimulator,
    progress: Progress | None = None,
) -> Iterator[Log]:
    """``simulate`` in parts of two seconds or so, to be recorded while the twin runs."""
    require_seed(seed)
    _, noise_rng, current_rng = np.random.default_rng(seed).spawn(3)
    if isinstance(experiment, str):
        name, attached = experiment, dict[str, bytes]()
        seconds = DURATION if duration is None else duration
        chosen = find_experiment(experiment, model, axis, seconds)
    else:
        if duration is not None or axis is not None:
            raise InputError("an experiment has its own duration and axis; leave them out")
        name, chosen = kind_of(experiment), experiment
        text = format_experiment(experiment, units=driven_units(experiment, model))
        attached = {"experiment.toml": text.encode()}
    setpoint = setpoint_of(chosen, model, seed)
    controllers = None if chosen.closed_loop else {a: Controller() for a in model.axes}
    for part in follow_parts(
        model, setpoint, (noise_rng, current_rng), name=name, seed=seed, simulator=simulator,
        controllers=controllers, progress=progress,
    ):  # fmt: skip
        yield replace(part, attachments={**part.attachments, **attached})


class Reach:
    """How far each axis of a model went; ``take`` the parts of a log of the twin one by one."""

    def __init__(self, model: MachineModel) -> None:
        self._model = model
        self._farthest: dict[str, tuple[float, float, float]] = {}  # and the ends of the travel

    def take(self, log: Log) -> Log:
        """Look at the next part, which is returned."""
        for name, axis in self._model.axes.items():
            if axis.hardware.travel is None:
                continue
            low, high = axis.hardware.travel
            before = self._farthest.get(name, (low,))[0]
            position = np.append(log.truth[name]["position"], before)
            out = np.maximum(low - position, position - high)
            self._farthest[name] = float(position[np.argmax(out)]), low, high
        return log

    def warnings(self) -> tuple[str, ...]:
        """A sentence for each axis that left its travel."""
        said = []
        for name, (farthest, low, high) in self._farthest.items():
            units, hardware = self._model.axes[name].units, self._model.axes[name].hardware
            if not low <= farthest <= high:
                said.append(
                    f"axis {name} went to {farthest:.6g} {units.position}, outside its travel of "
                    f"{low:g} to {high:g} {units.position}: the drive does not hold it; move more "
                    f"gently, or check force_limit ({hardware.force_limit:g} {units.force}), "
                    "bandwidth and the effects"
                )
        return tuple(said)


def outside_travel(model: MachineModel, log: Log) -> tuple[str, ...]:
    """A sentence for each axis of the model that left its travel in a log of the twin."""
    reach = Reach(model)
    reach.take(log)
    return reach.warnings()
