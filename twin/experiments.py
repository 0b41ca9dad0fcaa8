"""The named experiments, run on the twin and logged.

Setpoints follow the experiments of L. Jia (2023): cable pass, velocity map, reversals, open-loop
sine; tracking is the rich motion on which models are fitted and held out.
"""

from __future__ import annotations

import difflib
import importlib.metadata
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from twin import trajectory
from twin.control import Controller
from twin.errors import InputError
from twin.log import AxisLog, Log
from twin.loop import COMMAND_COLUMN, POSITION_COLUMN, READING_COLUMN, VELOCITY_COLUMN
from twin.model import StageModel
from twin.model_file import format_model
from twin.simulator import MujocoStage, Progress, ReducedStage, Run, run
from twin.trajectory import Limits
from twin.trajectory.setpoint import Setpoint

MAP_SPEEDS = (0.0005, 0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.02, 0.04, 0.08)  # m/s


@dataclass(frozen=True)
class Experiment:
    """One experiment: how its setpoint is made, and whether the position loop is closed.

    setpoint: (model, axis index, duration s, random generator) -> Setpoint.
    """

    summary: str
    setpoint: Callable[[StageModel, int, float, np.random.Generator], Setpoint]
    closed_loop: bool = True


def stage_limits(model: StageModel) -> list[Limits]:
    """Motion limits of every axis of the model; InputError where its travel is not known."""
    limits = []
    for name, axis in model.axes.items():
        h = axis.hardware
        if h.travel is None:
            raise InputError(f"axis {name} has no travel; give travel = [low, high] in m")
        limits.append(Limits(h.travel, h.velocity, h.acceleration, h.jerk))
    return limits


def _middle(model: StageModel) -> np.ndarray:
    return np.array([sum(limit.travel) / 2.0 for limit in stage_limits(model)])


def _tracking(model: StageModel, axis: int, duration: float, rng: np.random.Generator) -> Setpoint:
    return trajectory.random_tracking(
        stage_limits(model), duration, rng, sample_rate=model.sample_rate
    )


def _moves(model: StageModel, axis: int, duration: float, rng: np.random.Generator) -> Setpoint:
    limits = stage_limits(model)
    low, high = np.array([limit.travel for limit in limits]).T
    count = max(int(duration / 1.5), 2)
    places = low + (high - low) * rng.uniform(0.02, 0.98, (count, len(limits)))
    return trajectory.point_to_point(limits, places, sample_rate=model.sample_rate)


def _cable_pass(
    model: StageModel, axis: int, duration: float, rng: np.random.Generator
) -> Setpoint:
    limits = stage_limits(model)
    low, high = limits[axis].travel
    span = 0.88 * (high - low)
    speed = min(0.1, limits[axis].fastest_plateau(span))
    return trajectory.constant_speed_passes(
        limits, axis, span=span, speed=speed, repeats=max(int(duration * speed / span / 2), 1),
        at=_middle(model), sample_rate=model.sample_rate,
    )  # fmt: skip


def _velocity_map(
    model: StageModel, axis: int, duration: float, rng: np.random.Generator
) -> Setpoint:
    limits = stage_limits(model)
    speeds = [s for s in MAP_SPEEDS if s <= limits[axis].fastest_plateau(0.02)]
    return trajectory.velocity_staircase(
        limits, axis, speeds, span=0.02, longest_plateau=duration / 4.0 / len(speeds),
        at=_middle(model), sample_rate=model.sample_rate,
    )  # fmt: skip


def _reversals(model: StageModel, axis: int, duration: float, rng: np.random.Generator) -> Setpoint:
    return trajectory.micro_reversals(
        stage_limits(model), axis, repeats=max(int(duration / 0.25), 1), at=_middle(model),
        sample_rate=model.sample_rate,
    )  # fmt: skip


def _open_loop_sine(
    model: StageModel, axis: int, duration: float, rng: np.random.Generator
) -> Setpoint:
    place = _middle(model)
    return trajectory.open_loop_sine(
        axis, duration=duration, at=place, sample_rate=model.sample_rate
    )


EXPERIMENTS: Mapping[str, Experiment] = {
    "tracking": Experiment("random moves of all axes over the whole travel", _tracking),
    "moves": Experiment("fastest point-to-point moves of all axes together", _moves),
    "cable_pass": Experiment("one axis back and forth at 0.1 m/s over the travel", _cable_pass),
    "velocity_map": Experiment("one axis at a staircase of speeds, both ways", _velocity_map),
    "reversals": Experiment("one axis 4 um back and forth", _reversals),
    "open_loop_sine": Experiment(
        "sinusoidal force of 0.21 N and 3 s on one axis, no feedback", _open_loop_sine, False
    ),
}


def find_experiment(name: str) -> Experiment:
    """The experiment of that name; InputError names the nearest where there is none."""
    if name in EXPERIMENTS:
        return EXPERIMENTS[name]
    near = difflib.get_close_matches(name, EXPERIMENTS, n=1, cutoff=0.4)
    hint = f"did you mean '{near[0]}'? " if near else ""
    raise InputError(f"unknown experiment '{name}'; {hint}there are {', '.join(EXPERIMENTS)}")


def simulate(
    model: StageModel,
    experiment: str,
    *,
    seed: int = 0,
    duration: float = 20.0,
    axis: str | None = None,
    stage: type[MujocoStage] | type[ReducedStage] = MujocoStage,
    progress: Progress | None = None,
) -> Log:
    """Run an experiment on the twin and return its log, with the truth topics.

    duration: s, exact for tracking and open_loop_sine, about right for the others. axis: the one
    that moves where the experiment moves one; the first by default. The same seed gives the same
    log. Raises InputError for an unknown experiment or axis, and for a setpoint outside the travel.
    """
    chosen = find_experiment(experiment)
    if axis is not None:
        model.axis(axis)
    index = list(model.axes).index(axis) if axis else 0
    motion_rng, noise_rng, current_rng = np.random.default_rng(seed).spawn(3)
    setpoint = chosen.setpoint(model, index, duration, motion_rng)
    controllers = None if chosen.closed_loop else {name: Controller() for name in model.axes}
    result = run(
        model, setpoint, noise_rng, stage=stage, controllers=controllers, progress=progress
    )
    return _log(model, experiment, seed, setpoint, result, current_rng)


def _log(
    model: StageModel,
    experiment: str,
    seed: int,
    setpoint: Setpoint,
    result: Run,
    rng: np.random.Generator,
) -> Log:
    axes, truth = {}, {}
    for i, (name, axis) in enumerate(model.axes.items()):
        signals = result.signals[:, i]
        constant = axis.hardware.force_constant
        noise = axis.hardware.current_noise * rng.standard_normal(len(signals))
        current = signals[:, COMMAND_COLUMN] / constant + noise
        axes[name] = AxisLog(
            columns={
                "setpoint_position": setpoint.position[:, i].copy(),
                "setpoint_velocity": setpoint.velocity[:, i].copy(),
                "setpoint_acceleration": setpoint.acceleration[:, i].copy(),
                "position": signals[:, READING_COLUMN].copy(),
                "current": current,
                "force": constant * current,
            },
            force_constant=constant,
        )
        truth[name] = {
            "position": signals[:, POSITION_COLUMN].copy(),
            "velocity": signals[:, VELOCITY_COLUMN].copy(),
            **_of_axis(name, result.table.labels, result.forces),
            **_of_axis(name, result.state_names, result.states),
        }
    text = format_model(model)
    metadata = {
        "source": "simulation",
        "experiment": experiment,
        "seed": str(seed),
        "software": f"proton-twin {importlib.metadata.version('proton-twin')}",
        "mujoco": mujoco.__version__,
    }
    attachments = {"model.toml": text.encode()}
    if model.mjcf:
        attachments["model.xml"] = model.mjcf.encode()
    return Log(model.sample_rate, axes, metadata, truth, attachments)


def _of_axis(
    axis: str, names: tuple[tuple[str, str], ...], columns: np.ndarray
) -> dict[str, np.ndarray]:
    return {n: columns[:, i].copy() for i, (a, n) in enumerate(names) if a == axis}
