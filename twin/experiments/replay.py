"""A recorded reference in place of a planned one: the twin follows what the machine followed.

The thesis prints no generator of its motion platform, so planned moves are this project's own
(jerk-limited); what a log holds is the reference itself.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.core.control import Controller
from twin.errors import InputError
from twin.experiments.follow import follow
from twin.experiments.trajectory.setpoint import Setpoint
from twin.logs import AxisLog, Log
from twin.model.machine import MachineModel
from twin.signals import Array, rate
from twin.simulator import MujocoSimulator, Progress, ReducedSimulator


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
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = MujocoSimulator,
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
    return follow(
        model, followed, (first, second), name="replay", seed=seed, simulator=simulator,
        controllers=controllers, progress=progress,
    )  # fmt: skip
