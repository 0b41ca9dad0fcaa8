"""When each log began, by the phase of what repeats in time whatever the axis does.

A pump or a fan runs on while logs are started at any moment: its force has one frequency in all
logs, and in each a phase of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.spectrum import lines_in_time
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Fit
from identify.estimation.force_balance import averaged_force, residual
from identify.rules import RULE
from twin.effect import Kind
from twin.model.machine import AxisModel
from twin.signals import Array

TRIED = 6  # frequencies at which the residual repeats
LATER = 1e-3  # s, by which a clock is moved to see what reads it
SAME = 0.02  # of a period, within which clocks agree


def with_time_origins(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset with its logs' clocks set by the phase of a line in time.

    The line is that of the axis' own forces that read the clock; where it has none, the strongest
    that several logs share, by the first of them. As it is where there is no such line.
    """
    logs = dataset.logs
    rest = without_timed_forces(axis, logs[0])
    seen = [_left(rest, log) for log in logs]
    line = _own_line(axis, rest, logs[0])
    if line is None and len(logs) > 1:
        line = _common_line(logs[: len(dataset.fit)], seen[: len(dataset.fit)])
    if line is None:
        return dataset
    frequency, phase = line
    pairs = zip(logs, seen, strict=True)
    phases = np.angle([_amplitude(log.time, left, frequency) for log, left in pairs])
    turns = (phases - phase) / (2.0 * np.pi)
    turns -= np.rint(turns)
    turns[np.abs(turns) < SAME] = 0.0
    pairs = zip(logs, turns / frequency, strict=True)
    return dataset.with_logs(_set(log, float(c)) for log, c in pairs)


def synchronised(fit: Fit, dataset: Dataset) -> tuple[Dataset, Fit]:
    """The dataset with its clocks set by what a fit leaves, and the fit on it.

    A fit that holds a force that reads the clock stays on the clocks it was found with.
    """
    if depends_on_time_origin(fit.axis, dataset):
        return dataset, fit
    found = with_time_origins(fit.axis, dataset)
    same = np.array_equal(time_origins(found), time_origins(dataset))
    return found, fit if same else replace(fit, logs=found.fit)


def time_origins(dataset: Dataset) -> Array:
    """When each log began, s; training logs first."""
    return np.array([log.motion.time_origin for log in dataset.logs])


def with_given_origins(dataset: Dataset, begun: Array) -> Dataset:
    """The dataset with its logs begun at these times (n,) s, in the order of ``time_origins``."""
    pairs = zip(dataset.logs, begun, strict=True)
    return dataset.with_logs(_set(log, float(at)) for log, at in pairs)


def depends_on_time_origin(axis: AxisModel, dataset: Dataset) -> bool:
    """Whether a force of the axis depends on when a log began."""
    return len(without_timed_forces(axis, dataset.fit[0]).effects) < len(axis.effects)


def phases_found(axis: AxisModel, effect: str, dataset: Dataset) -> int:
    """How many phases of training logs an effect of the axis has, beside its parameters."""
    found = [log for log in dataset.fit if log.motion.time_origin]
    alone = replace(axis, effects=(axis[effect],))
    return len(found) if found and depends_on_time_origin(alone, dataset) else 0


def without_timed_forces(axis: AxisModel, log: PreparedLog) -> AxisModel:
    """The axis less the physical forces that read the clock."""
    later = _set(log, log.motion.time_origin + LATER)
    for fitted in axis.effects:
        if fitted.effect.kind is Kind.FORCE and not fitted.effect.is_nonparametric:
            alone = replace(axis, effects=(fitted,))
            now, then = (averaged_force(alone, [w]) for w in (log, later))
            axis = axis if np.array_equal(now, then) else axis.without(fitted.effect.name)
    return axis


def _set(log: PreparedLog, time_origin: float) -> PreparedLog:
    if log.motion.time_origin == time_origin:
        return log  # with all that was computed of it
    return replace(log, motion=replace(log.motion, time_origin=time_origin))


def _left(axis: AxisModel, log: PreparedLog) -> Array:
    """Residual (n,) N of one log, zero where the axis may stick."""
    return np.asarray(residual(axis, [log]) * moving([log], sticks(axis)))


def _own_line(axis: AxisModel, rest: AxisModel, log: PreparedLog) -> tuple[float, float] | None:
    """Frequency (Hz) and phase (rad) of the forces of an axis that read the clock, if any."""
    own = replace(axis, effects=tuple(f for f in axis.effects if f.effect.name not in rest.names))
    force = averaged_force(own, [_set(log, 0.0)]) if own.effects else np.zeros(0)
    tried = lines_in_time([(force, log.test_function.stride * log.test_function.period)], most=1)
    if not tried:
        return None
    # A residual is what the model's force is to cancel.
    return tried[0], float(np.angle(_amplitude(log.time, -force, tried[0])))


def _common_line(logs: Sequence[PreparedLog], left: Sequence[Array]) -> tuple[float, float] | None:
    """Frequency (Hz), and phase (rad) in the first log, of the line that explains most of all logs.

    None where it may be chance.
    """
    steps = [log.test_function.stride * log.test_function.period for log in logs]
    tried = lines_in_time(list(zip(left, steps, strict=True)), most=TRIED)
    if not tried:
        return None

    def explained(frequency: float) -> float:
        pairs = zip(logs, left, strict=True)
        return sum(
            0.5 * len(part) * abs(_amplitude(log.time, part, frequency)) ** 2 for log, part in pairs
        )

    best = max(tried, key=explained)
    every = np.concatenate(left)
    gain = -np.log(max(1.0 - explained(best) / float(np.sum(every**2)), 1e-12))
    samples = effective_samples(every)
    told = samples * gain - 2 * len(logs) * np.log(samples) > RULE.least_bic
    return (best, float(np.angle(_amplitude(logs[0].time, left[0], best)))) if told else None


def _amplitude(time: Array, force: Array, frequency: float) -> complex:
    """Complex amplitude (N) of a line: force ~ Re(amplitude exp(2 pi i f t))."""
    turn = np.exp(-2j * np.pi * frequency * time)
    return complex(2.0 * np.mean((force - force.mean()) * turn))
