"""The twin follows a setpoint, and what its machine would record becomes a log, part by part.

The setpoint is a planned one, or the reference that a log recorded: the thesis prints no generator
of its motion platform, so planned moves are this project's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy

import numpy as np
from numpy.random import Generator

from twin.errors import InputError
from twin.experiments.trajectory import AnySetpoint, Setpoint
from twin.logs import AxisLog, Log
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, joined
from twin.logs.writer import software_version
from twin.model.file import format_model
from twin.model.machine import AxisModel, MachineModel
from twin.signals import Array, rate
from twin.simulation.loop import (
    COMMAND_COLUMN,
    POSITION_COLUMN,
    READING_COLUMN,
    VELOCITY_COLUMN,
    Controller,
)
from twin.simulation.simulators import MujocoSimulator, Progress, Run, Simulator, run_parts


def follow_parts(
    model: MachineModel,
    setpoint: AnySetpoint,
    noise: tuple[Generator, Generator],
    *,
    name: str,
    seed: int,
    simulator: Simulator = MujocoSimulator,
    controllers: Mapping[str, Controller] | None = None,
    progress: Progress | None = None,
) -> Iterator[Log]:
    """The log of the twin that follows a setpoint, in parts that come one after the other.

    noise: draws that of encoders and currents. name, seed: for the log's metadata. controllers: by
    axis; the model's own where None.
    """
    metadata = {"source": "simulation", "experiment": name, "seed": str(seed)}
    metadata["software"] = f"proton-twin {software_version()}"
    metadata["mujoco"] = software_version("mujoco")
    attachments = {"model.toml": format_model(model).encode()}
    if model.mjcf:
        attachments["model.xml"] = model.mjcf.encode()
    currents = _one_after_the_other(noise[1], len(model.axes), len(setpoint))
    first = 0
    for part in run_parts(
        model, setpoint, noise[0], simulator=simulator, controllers=controllers, progress=progress
    ):
        wanted = setpoint.part(first, first + len(part))
        axes = {
            axis: _recorded(model.axes[axis], wanted, part, i, currents[i])
            for i, axis in enumerate(model.axes)
        }
        truth = {axis: _truth(axis, part, i) for i, axis in enumerate(model.axes)}
        yield Log(model.sample_rate, axes, metadata, truth, attachments)
        first += len(part)


def _one_after_the_other(rng: Generator, count: int, samples: int) -> list[Generator]:
    """Generators, each of which draws the normal numbers that follow those of the one before."""
    out = []
    for _ in range(count):
        out.append(deepcopy(rng))
        drawn = 1 << 16  # numbers drawn at once, to be thrown away
        for first in range(0, samples, drawn):
            rng.standard_normal(min(drawn, samples - first))
    return out


def _recorded(
    axis: AxisModel, setpoint: Setpoint, part: Run, index: int, rng: Generator
) -> AxisLog:
    """What the machine records of an axis; rng draws the noise of its current."""
    signals = part.signals[:, index]
    constant = axis.hardware.force_constant
    noise = axis.hardware.current_noise * rng.standard_normal(len(signals))
    current = signals[:, COMMAND_COLUMN] / constant + noise
    columns = {
        "setpoint_position": setpoint.position[:, index].copy(),
        "setpoint_velocity": setpoint.velocity[:, index].copy(),
        "setpoint_acceleration": setpoint.acceleration[:, index].copy(),
        "position": signals[:, READING_COLUMN].copy(),
        "current": current,
        "force": constant * current,
    }
    return AxisLog(columns, ROTARY_UNITS if axis.rotary else LINEAR_UNITS, constant)


def _truth(name: str, part: Run, index: int) -> dict[str, Array]:
    signals = part.signals[:, index]
    return {
        "position": signals[:, POSITION_COLUMN].copy(),
        "velocity": signals[:, VELOCITY_COLUMN].copy(),
        **_of_axis(name, part.table.labels, part.forces),
        **_of_axis(name, part.state_names, part.states),
    }


def _of_axis(axis: str, names: tuple[tuple[str, str], ...], columns: Array) -> dict[str, Array]:
    return {n: columns[:, i].copy() for i, (a, n) in enumerate(names) if a == axis}


def recorded_setpoint(model: MachineModel, log: Log) -> Setpoint:
    """The reference of a log, for the axes of a model; InputError where the log has none.

    Velocity and acceleration are those of the log, or the rates of its reference position. An axis
    that is not in the log rests at zero.
    """
    if not set(model.axes) & set(log.axes):
        raise InputError(
            f"the log has {', '.join(log.axes)}, the model {', '.join(model.axes)}; name the axes "
            "alike"
        )
    columns = [_reference(log, name) for name in model.axes]
    position, velocity, acceleration = np.stack(columns, axis=2)
    return Setpoint(position, velocity, acceleration, np.zeros_like(position), log.sample_rate)


def _reference(log: Log, name: str) -> Array:
    """Position, velocity and acceleration of one axis, (3, n)."""
    if name not in log.axes:
        return np.zeros((3, len(log)))
    recorded: AxisLog = log.axes[name]
    position = recorded.columns.get("setpoint_position")
    if position is None:
        raise InputError(
            f"axis {name}: the log has no setpoint_position, so there is nothing to follow; record "
            "it, or name its column in the import map"
        )
    velocity = recorded.columns.get("setpoint_velocity", rate(position, log.period))
    acceleration = recorded.columns.get("setpoint_acceleration", rate(velocity, log.period))
    return np.stack([position, velocity, acceleration])


def replay(
    model: MachineModel,
    log: Log,
    *,
    setpoint: Setpoint | None = None,
    controllers: Mapping[str, Controller] | None = None,
    seed: int = 0,
    simulator: Simulator = MujocoSimulator,
    progress: Progress | None = None,
) -> Log:
    """The log of the twin that follows the reference of another log, at that log's sample rate.

    setpoint: in place of the reference of the log, where its controller uses another. controllers:
    by axis; the model's own where None. Raises InputError for a log without a reference, and where
    the rates differ.
    """
    if log.sample_rate != model.sample_rate:
        raise InputError(
            f"the log is sampled at {log.sample_rate:g} Hz, the model at {model.sample_rate:g} Hz; "
            "set sample_rate in the model"
        )
    followed = recorded_setpoint(model, log) if setpoint is None else setpoint
    first, second = np.random.default_rng(seed).spawn(2)
    return joined(
        follow_parts(
            model, followed, (first, second), name="replay", seed=seed, simulator=simulator,
            controllers=controllers, progress=progress,
        )
    )  # fmt: skip
