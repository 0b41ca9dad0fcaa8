"""Chapter "twin": the machine is identified; its twin follows the same reference and is, too.

Fits of both must agree within their uncertainties, and the closed loops must move alike. Of a
machine that was changed the comparison must say what changed. A simulated machine is stepped ten
times finer than its twin; ``twin_of`` and ``closed_loop_errors`` take the log of a real one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import datasets
from identify.dataset.motion import motion_of
from identify.estimation.channel_delay import fit_aligned
from identify.estimation.intervals import scatter
from identify.measure import only_axis
from identify.thesis.chapter import Chapter
from identify.validation.agreement import Agreement, agreement
from twin.core.control import Controller
from twin.effect import Kind
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.experiments.replay import replay
from twin.experiments.trajectory.setpoint import Setpoint
from twin.log import Log
from twin.model.machine import Fitted, MachineModel
from twin.progress import Progress
from twin.signals import local_parabola, rate
from twin.simulator import FineSimulator, MujocoSimulator, ReducedSimulator

Array = NDArray[np.float64]

HEAVIER = 0.01  # of the mass, by which the changed machine differs
SMOOTHED = 10e-3  # s, over which positions are smoothed before they are differentiated


@dataclass(frozen=True)
class Size:
    """duration: s of the log."""

    duration: float
    simulator: type[MujocoSimulator] | type[ReducedSimulator]


FULL = Size(20.0, MujocoSimulator)
SMALL = Size(6.0, ReducedSimulator)


@dataclass(frozen=True, eq=False)
class TwinResult:
    """The chapter's results.

    alike: machine and twin. changed: the machine before and after its mass was changed by ``added``
    (kg). errors: of the closed loop, twin less machine over machine (RMS), by signal.
    """

    alike: Agreement
    changed: Agreement
    added: float
    errors: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class TwinOfLogs:
    """By log: the fit of the machine beside that of its twin, and the errors of the closed loop."""

    alike: Mapping[str, Agreement]
    errors: Mapping[str, Mapping[str, float]]


def of_logs(model: MachineModel, logs: Mapping[str, Log]) -> TwinOfLogs:
    """The chapter on logs that hold a reference; the twin has the controller of the model.

    Raises InputError where a log has no reference, or where more than one axis moves.
    """
    name, _ = only_axis(datasets(model, logs, {}), None)
    model = MachineModel(model.name, {name: model.axes[name]}, model.sample_rate)
    alike, errors, catalogue = {}, {}, load_catalogue()
    for label, log in logs.items():
        fitted = identified(model, log)
        follower = twin_of(fitted, log)
        alike[label] = agreement(fitted, identified(model, follower), catalogue)
        errors[label] = closed_loop_errors(log, follower, name)
    return TwinOfLogs(alike, errors)


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> TwinResult:
    """Run the chapter on the first axis of a machine, whose dry friction is drawn anew."""
    (model,) = models
    name = next(iter(model.axes))
    model = MachineModel(model.name, {name: model.axes[name]}, model.sample_rate)
    machine = _drawn(model, name, rng)
    heavier = machine.axes[name].mass * HEAVIER
    changed = machine.with_axis(
        name, replace(machine.axes[name], mass=machine.axes[name].mass + heavier)
    )
    seeds = [int(seed) for seed in rng.integers(2**31, size=2)]
    fits, logs = [], []
    for i, (stage, seed) in enumerate(zip((machine, changed), seeds, strict=True)):
        progress("machine and twin", i, 3)
        log = simulate(
            stage, "tracking", seed=seed, duration=size.duration, simulator=FineSimulator
        )
        logs.append(log)
        fits.append(identified(model, log))
    progress("machine and twin", 2, 3)
    follower = twin_of(fits[0], logs[0], simulator=size.simulator)
    return TwinResult(
        alike=agreement(fits[0], identified(model, follower), catalogue),
        changed=agreement(fits[0], fits[1], catalogue),
        added=heavier,
        errors=closed_loop_errors(logs[0], follower, name),
    )


def _drawn(model: MachineModel, name: str, rng: np.random.Generator) -> MachineModel:
    """The machine with its dry friction scaled by one random factor."""
    axis, factor = model.axes[name], rng.uniform(0.8, 1.25)
    for fitted in axis.effects:
        if fitted.effect.kind is Kind.FRICTION:
            dry = {p.name for p in fitted.effect.parameters if p.dry}
            values = {k: v * factor if k in dry else v for k, v in fitted.values.items()}
            axis = axis.with_effect(Fitted(fitted.effect, values, fitted.fixed))
    return model.with_axis(name, axis)


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


CHAPTER = Chapter(("proton_xy",), FULL, SMALL, run, of_logs)
