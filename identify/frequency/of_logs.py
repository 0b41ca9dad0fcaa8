"""The frequency responses of the axes of logs, and of a model that follows the same setpoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identify.frequency.loop import Loop, loop_of
from identify.frequency.plant import Banded, Plant, plant_of
from identify.frequency.response import Record, Response, response
from twin.core.control import Controller
from twin.errors import InputError
from twin.experiments.follow import replay
from twin.logs import Log
from twin.logs.log import AxisLog
from twin.model.machine import MachineModel
from twin.model.units import AxisUnits
from twin.progress import Progress, silent
from twin.simulator import quickest

NEAR = 0.1  # of a mass, to which a response of little friction tells it


@dataclass(frozen=True, eq=False)
class Shown:
    """A response, the plant read off it, and the loop; None where the response does not tell."""

    response: Response
    plant: Plant | None
    loop: Loop | None


@dataclass(frozen=True, eq=False)
class Bias:
    """That a model's own mass, kg, is not what its simulated response shows; None: shows none."""

    own: float
    back: Banded | None


@dataclass(frozen=True, eq=False)
class AxisFrequency:
    """One axis: as the logs show it, and as the model in their place does; None without one.

    bias: where friction is so much of the force that not even the model's own mass comes back; then
    no plant is read off either.
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
            "no axis moves under a changing force in all of the logs; give logs of one axis that "
            "moves, named as in the model"
        )
    simulated = {} if model is None else _simulated(logs, model, progress)
    axes = {}
    for i, name in enumerate(names):
        progress("frequency response", i, len(names))
        controller = None if model is None else Controller.for_axis(model.axes[name])
        kind, measured = first.axes[name].kind, _shown(logs, name, controller)
        axes[name] = AxisFrequency(kind, measured, None)
        if model is not None:
            modelled = _shown(simulated, name, controller)
            bias = None if model.joints else _bias(model.axes[name].weighed.mass, modelled.plant)
            if bias is not None:
                measured, modelled = (replace(s, plant=None) for s in (measured, modelled))
            axes[name] = AxisFrequency(kind, measured, modelled, bias)
    return axes


def _bias(own: float, plant: Plant | None) -> Bias | None:
    """Of the mass of a model, kg, that its response shows; None where it comes back."""
    back = None if plant is None else plant.mass
    if back and abs(back.value - own) < max(back.band, NEAR * own):
        return None
    return Bias(own, back)


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


def _record(axis: AxisLog, period: float) -> Record:
    return Record(axis.columns.get("setpoint_position"), axis.force, axis.position, period)
