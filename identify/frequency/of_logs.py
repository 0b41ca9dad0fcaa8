"""The frequency responses of the axes of logs, and of a model that follows the same setpoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identify.analysis.first_model import first_model
from identify.frequency.plant import Banded, Loop, Plant, loop_of, plant_of
from identify.frequency.response import LoopSignals, Response, response
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.logs.log import AxisLog
from twin.model.machine import MachineModel
from twin.model.units import AxisUnits
from twin.parallel import Progress, silent
from twin.record import Number, record
from twin.simulation.follow import replay
from twin.simulation.loop import Controller
from twin.simulation.simulators import quickest


@dataclass(frozen=True, eq=False)
class Shown:
    """A response, the plant read off it, and the loop; None where the response does not tell."""

    response: Response
    plant: Plant | None
    loop: Loop | None


@record
class Bias:
    """That a mass, kg, is not what the response shows."""

    own: Number
    """The model's, whose simulation is shown. Without one that of least squares with friction."""
    back: Banded | None
    """What the response shows of it; null: it shows none."""


@dataclass(frozen=True, eq=False)
class AxisFrequency:
    """One axis: as the logs show it, and as the model in their place does; None without one.

    bias: where friction is so much of the force that a known mass does not come back; then neither
    plant nor loop is read off.
    """

    units: AxisUnits
    measured: Shown
    modelled: Shown | None
    bias: Bias | None = None


def responses_of(
    logs: Mapping[str, Log], model: MachineModel | None = None, progress: Progress = silent
) -> dict[str, AxisFrequency]:
    """By axis that moves in all of the logs; see identify.workflow.frequency_response."""
    first = next(iter(logs.values()))
    names = [a for a in first.axes if all(_moves(log, a) for log in logs.values())]
    names = [a for a in names if model is None or a in model.axes]
    if not names:
        raise InputError(
            "no axis has in all of the logs a force that changes and a setpoint that moves (a "
            "position, where none is logged); give logs of one axis that moves, named as in the "
            "model"
        )
    simulated = {} if model is None else _simulated(logs, model, progress)
    axes = {}
    for i, name in enumerate(names):
        progress("frequency response", i, len(names))
        controller = None if model is None else Controller.for_axis(model.axes[name])
        kind, measured = first.axes[name].kind, _shown(logs, name, controller)
        if model is None:
            bias = _bias(_with_friction(logs, name), measured.plant)
            axes[name] = AxisFrequency(kind, _less(measured, bias), None, bias)
            continue
        modelled = _shown(simulated, name, controller)
        bias = _bias(None if model.joints else model.axes[name].weighed.mass, modelled.plant)
        axes[name] = AxisFrequency(kind, _less(measured, bias), _less(modelled, bias), bias)
    return axes


def _less(shown: Shown, bias: Bias | None) -> Shown:
    return shown if bias is None else replace(shown, plant=None, loop=None)


def _bias(own: float | None, plant: Plant | None) -> Bias | None:
    """Of a mass, kg, that is known; None where it is not, or comes back."""
    back = None if plant is None else plant.mass
    near = 0.1  # of a mass, to which a response of little friction tells it
    if own is None or (back and abs(back.value - own) < near * own):
        return None
    return Bias(own, back)


def _with_friction(logs: Mapping[str, Log], name: str) -> float | None:
    """The mass, kg, that least squares find beside much dry friction; None where there is little.

    Of a machine whose elasticity a rigid model has as friction the response is what tells.
    """
    alone = {n: Log(log.sample_rate, {name: log.axes[name]}) for n, log in logs.items()}
    try:
        axis = first_model(alone, name, load_catalogue()).axes[name]
    except (InputError, KeyError):
        return None
    dry = axis.friction.values.get("Fc", 0.0) if axis.friction else 0.0
    force = np.concatenate([log.axes[name].force for log in logs.values()])
    much = 0.5  # of the force, RMS, from which dry friction is much
    return axis.mass if dry > much * float(np.std(force)) else None


def _moves(log: Log, name: str) -> bool:
    """Whether an axis of a log is moved: its setpoint where it has one, else the axis."""
    axis = log.axes.get(name)
    if axis is None or not np.ptp(axis.force):
        return False
    return bool(np.ptp(axis.columns.get("setpoint_position", axis.position)))


def _simulated(logs: Mapping[str, Log], model: MachineModel, progress: Progress) -> dict[str, Log]:
    """The logs that the model makes in the place of the machine, with the same setpoints."""
    out = {}
    for i, (name, log) in enumerate(logs.items()):
        progress("simulating the model", i, len(logs))
        sampled = replace(model, sample_rate=log.sample_rate)
        out[name] = replay(sampled, log, simulator=quickest(model))
    return out


def _shown(logs: Mapping[str, Log], name: str, controller: Controller | None) -> Shown:
    found = response([_record(log.axes[name], log.period) for log in logs.values()])
    known = None if controller is None else controller.response(found.frequency, found.period)
    try:
        plant = plant_of(found)
    except InputError:
        plant = None
    return Shown(found, plant, loop_of(found, known))


def _record(axis: AxisLog, period: float) -> LoopSignals:
    return LoopSignals(axis.columns.get("setpoint_position"), axis.force, axis.position, period)
