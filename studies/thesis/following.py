"""A machine is identified, and its twin follows the same reference and is identified, too.

Fits of both must agree within their uncertainties (`identify.agree`), and the closed loops must
move alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.estimation.alignment import fit_aligned
from identify.estimation.intervals import scatter
from twin.experiments.trajectory import Setpoint
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.signals import Array, local_parabola, rate
from twin.simulation.follow import replay
from twin.simulation.loop import Controller
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

SMOOTHED = 10e-3  # s, over which positions are smoothed before they are differentiated


def identified(model: MachineModel, log: Log, test_function: float | None = None) -> MachineModel:
    """The model fitted to one log, with the scatter of its values, to be compared."""
    for axis, dataset in datasets(model, {"log": log}, {}, test_function).items():
        _, fit = fit_aligned(model.axes[axis], dataset)
        model = model.with_axis(axis, fit.axis)
        model = model.with_intervals(axis, scatter(fit))
    return model


def twin_of(
    fitted: MachineModel,
    log: Log,
    *,
    setpoint: Setpoint | None = None,
    controllers: Mapping[str, Controller] | None = None,
    seed: int = 0,
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = MujocoSimulator,
) -> Log:
    """The log of the twin that follows the reference of a machine's log, as noisy as that one.

    setpoint, controllers: of the machine, where they are not those of the model.
    """
    for name, axis in fitted.axes.items():
        if not (axis.hardware.encoder_noise or axis.hardware.encoder_resolution):
            noise = motion_of(log, name, "log").position_noise
            noisy = replace(axis.hardware, encoder_noise=noise)
            fitted = fitted.with_axis(name, replace(axis, hardware=noisy))
    return replay(
        fitted, log, setpoint=setpoint, controllers=controllers, seed=seed, simulator=simulator
    )


def closed_loop_errors(machine: Log, follower: Log, axis: str) -> dict[str, float]:
    """RMS of twin less machine over RMS of the machine, by signal.

    Velocity and acceleration are rates of the smoothed position.
    """
    errors = {}
    pairs = zip(_signals(machine, axis).items(), _signals(follower, axis).values(), strict=True)
    for (signal, own), other in pairs:
        errors[signal] = float(np.linalg.norm(other - own) / np.linalg.norm(own))
    return errors


def _signals(log: Log, axis: str) -> dict[str, Array]:
    position = log.axes[axis].position
    smooth = local_parabola(position, 2 * round(0.5 * SMOOTHED * log.sample_rate) + 1)
    velocity = rate(smooth, log.period)
    return {
        "position": position,
        "velocity": velocity,
        "acceleration": rate(velocity, log.period),
        "force": log.axes[axis].force,
    }
