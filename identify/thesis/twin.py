"""Chapter "twin": the machine is identified; its twin follows the same reference and is, too.

Fits of both must agree within their uncertainties, and the closed loops must move alike. Of a
machine that was changed the comparison must say what changed. A simulated machine is stepped ten
times finer than its twin; ``identify.analysis.following`` takes the log of a real one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.analysis.following import closed_loop_errors, identified, twin_of
from identify.analysis.maps import only_axis
from identify.dataset.dataset import datasets
from identify.thesis.chapter import Chapter
from identify.validation.agreement import Agreement, agreement
from twin.effect import Kind
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.log import Log
from twin.model.machine import Fitted, MachineModel
from twin.progress import Progress
from twin.simulator import FineSimulator, MujocoSimulator, ReducedSimulator

HEAVIER = 0.01  # of the mass, by which the changed machine differs


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


CHAPTER = Chapter(("proton_xy",), FULL, SMALL, run, of_logs)
