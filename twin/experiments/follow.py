"""The twin follows a setpoint, and what its machine would record becomes a log, part by part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import replace

import numpy as np

from twin.core.control import Controller
from twin.core.loop import COMMAND_COLUMN, POSITION_COLUMN, READING_COLUMN, VELOCITY_COLUMN
from twin.experiments.trajectory.setpoint import AnySetpoint, Setpoint
from twin.logs import AxisLog, Log
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS, joined
from twin.logs.writer import software_version
from twin.model.file import format_model
from twin.model.machine import AxisModel, MachineModel
from twin.simulator import MujocoSimulator, Progress, ReducedSimulator, Run, run_parts

DRAWN = 1 << 16  # numbers at once


def follow(
    model: MachineModel,
    setpoint: AnySetpoint,
    noise: tuple[np.random.Generator, np.random.Generator],
    *,
    name: str,
    seed: int,
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = MujocoSimulator,
    controllers: Mapping[str, Controller] | None = None,
    progress: Progress | None = None,
) -> Log:
    """The log of the twin that follows a setpoint. noise: draws that of encoders and currents.

    name, seed: for the log's metadata. controllers: by axis; the model's own where None.
    """
    return joined(
        follow_parts(
            model, setpoint, noise, name=name, seed=seed, simulator=simulator,
            controllers=controllers, progress=progress,
        )
    )  # fmt: skip


def follow_parts(
    model: MachineModel,
    setpoint: AnySetpoint,
    noise: tuple[np.random.Generator, np.random.Generator],
    *,
    name: str,
    seed: int,
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = MujocoSimulator,
    controllers: Mapping[str, Controller] | None = None,
    progress: Progress | None = None,
) -> Iterator[Log]:
    """``follow`` in parts, one after the other."""
    head = Log(model.sample_rate, {}, _metadata(name, seed), {}, _attachments(model))
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
        yield replace(head, axes=axes, truth=truth)
        first += len(part)


def _one_after_the_other(
    rng: np.random.Generator, count: int, samples: int
) -> list[np.random.Generator]:
    """Generators, each of which draws the normal numbers that follow those of the one before."""
    out = []
    for _ in range(count):
        out.append(deepcopy(rng))
        for first in range(0, samples, DRAWN):
            rng.standard_normal(min(DRAWN, samples - first))
    return out


def _recorded(
    axis: AxisModel, setpoint: Setpoint, part: Run, index: int, rng: np.random.Generator
) -> AxisLog:
    """What the machine records of an axis; rng draws the noise of its current."""
    signals = part.signals[:, index]
    constant = axis.hardware.force_constant
    noise = axis.hardware.current_noise * rng.standard_normal(len(signals))
    current = signals[:, COMMAND_COLUMN] / constant + noise
    return AxisLog(
        columns={
            "setpoint_position": setpoint.position[:, index].copy(),
            "setpoint_velocity": setpoint.velocity[:, index].copy(),
            "setpoint_acceleration": setpoint.acceleration[:, index].copy(),
            "position": signals[:, READING_COLUMN].copy(),
            "current": current,
            "force": constant * current,
        },
        units=ROTARY_UNITS if axis.rotary else LINEAR_UNITS,
        force_constant=constant,
    )


def _truth(name: str, part: Run, index: int) -> dict[str, np.ndarray]:
    signals = part.signals[:, index]
    return {
        "position": signals[:, POSITION_COLUMN].copy(),
        "velocity": signals[:, VELOCITY_COLUMN].copy(),
        **_of_axis(name, part.table.labels, part.forces),
        **_of_axis(name, part.state_names, part.states),
    }


def _metadata(experiment: str, seed: int) -> dict[str, str]:
    return {
        "source": "simulation",
        "experiment": experiment,
        "seed": str(seed),
        "software": f"proton-twin {software_version()}",
        "mujoco": software_version("mujoco"),
    }


def _attachments(model: MachineModel) -> dict[str, bytes]:
    attachments = {"model.toml": format_model(model).encode()}
    if model.mjcf:
        attachments["model.xml"] = model.mjcf.encode()
    return attachments


def _of_axis(
    axis: str, names: tuple[tuple[str, str], ...], columns: np.ndarray
) -> dict[str, np.ndarray]:
    return {n: columns[:, i].copy() for i, (a, n) in enumerate(names) if a == axis}
