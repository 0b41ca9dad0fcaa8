"""When force and position of one sample were: the channel delay, and when each log began.

A command that acts later than its time stamp is a physical delay, for which the catalogue has
effects. One that seems to act earlier is not physical: the time stamps of the channels disagree, or
the log holds every n-th sample of a faster controller, whose mean force is earlier than the logged
sample. Such a delay is removed from the log and reported.

A pump or a fan runs on while logs are started at any moment: its force has one frequency in all
logs, and in each a phase of its own. By that phase the time origins of the logs are set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.spectrum import lines_in_time
from identify.estimation.evidence import effective_samples, evidence, rms
from identify.estimation.fit import LINES, Fit, Outcome, finished, fit_axis
from identify.estimation.force_balance import averaged_force, residual
from identify.estimation.least_squares import ROUNDING, unabsorbed
from identify.estimation.residual_dependence import SAME_PERIOD
from identify.estimation.variable_projection import fit_multistart
from identify.rules import RULE
from twin.checks.axis import PHYSICAL
from twin.effect import Kind
from twin.model.machine import AxisModel
from twin.signals import Array

# of the error; by more samples than a recorder makes of one, many a missing effect lags a little
HALVED = 0.5
SETTLED = 1e-3  # of a sample, from which on a channel delay is where it stays


def fit_aligned(axis: AxisModel, dataset: Dataset) -> tuple[Dataset, Fit]:
    """The fit of an axis, and the dataset with its channel delay removed.

    The time origins of its logs are set by the phase of what repeats in time. A model that was
    fitted before begins with the channel delay that it was found with, or that its values tell:
    without it, the fit would leave them.
    """
    known = _moved_by_values(axis, realigned(dataset, axis.channel_delay))
    delays = dict.fromkeys((dataset.channel_delay, known.channel_delay))
    begun = (_shifted(axis, realigned(dataset, delay)) for delay in delays)
    dataset, fit = min(begun, key=lambda one: one[1].error)
    if not depends_on_time_origin(fit.axis, dataset):
        return synchronised(fit, dataset)
    dataset = with_time_origins(fit.axis, dataset)
    return dataset, fit_multistart(fit.axis, dataset, fit.begun)


def _shifted(axis: AxisModel, dataset: Dataset) -> tuple[Dataset, Fit]:
    """The fit of an axis, and the dataset without the channel delay that the fit finds."""
    fit = fit_multistart(axis, dataset)
    while shift := misalignment(fit, dataset):
        moved = realigned(dataset, dataset.channel_delay + shift)
        again = fit_multistart(fit.axis, moved, fit.begun)
        if again.error > RULE.fallen * fit.error:
            break
        dataset, fit = moved, again
    for _ in range(5 if dataset.channel_delay else 0):  # to its best value, which few steps reach
        last, _, _ = _linear_shift(fit, dataset)
        moved = realigned(dataset, max(dataset.channel_delay + last, 0.0))
        again = replace(fit_axis(fit.axis, moved.training), begun=fit.begun)
        # by how much a fit's error is not known, where it ended at another place
        if again.error > 1.001 * fit.error:
            break
        dataset, fit = moved, again
        if abs(last) < SETTLED * dataset.training[0].motion.sample_period:
            break
    return dataset, fit


def aligned(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset with the channel delay and the time origins that a model with these values finds.

    No parameter is fitted; ``fit_aligned`` does the same together with a fit.
    """
    begun = realigned(dataset, axis.channel_delay)
    return with_time_origins(axis, _moved_by_values(axis, begun))


def _moved_by_values(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset without the channel delay that an axis with its present values finds."""
    fit = finished(axis, axis, dataset.training, Outcome.CONVERGED)
    while len(fit.residual) and (shift := misalignment(fit, dataset)):
        moved = realigned(dataset, dataset.channel_delay + shift)
        again = finished(axis, axis, moved.training, Outcome.CONVERGED)
        if again.error > RULE.fallen * fit.error:
            break
        dataset, fit = moved, again
    return dataset


def misalignment(fit: Fit, dataset: Dataset) -> float:
    """How much earlier than its time stamp the force seems to act, s; 0 without evidence for it.

    One linear step: the residual regressed on the rate of the command, beside the parameters of the
    fit. Where the dataset has a channel delay already, the result is the change of it; the delay as
    a whole is never negative.
    """
    shift, left, after = _linear_shift(fit, dataset)
    longest = max(log.motion.sample_period for log in dataset.training)
    samples = (dataset.channel_delay + shift) / longest
    sampled = samples < RULE.most_shift
    possible = RULE.least_shift < samples and (sampled or samples * longest < PHYSICAL)
    fallen = rms(after) < (RULE.fallen if sampled else HALVED) * rms(left)
    told = possible and fallen and evidence(left, after, 1).delta_bic > RULE.least_bic
    return shift if told else 0.0


def _linear_shift(fit: Fit, dataset: Dataset) -> tuple[float, Array, Array]:
    """The shift of the force (s) that a linear step finds; N that is left without and with it."""
    rates = [log.fine.acceleration(log.motion.raw[1]) for log in dataset.training]
    rate = np.concatenate(rates)[fit.kept]
    left, own = unabsorbed(fit.residual, fit.basis), unabsorbed(rate, fit.basis)
    power = float(own @ own)
    if power <= ROUNDING * float(rate @ rate):
        return 0.0, left, left
    shift = -float(own @ left) / power
    return shift, left, left + shift * own


def moved_by(fit: Fit, dataset: Dataset) -> Dataset | None:
    """The dataset with the channel delay that a larger model finds, or None if it is the same.

    An effect that the smaller model lacked may have looked like a delay, or hidden one.
    """
    if ahead := misalignment(fit, dataset):
        return realigned(dataset, dataset.channel_delay + ahead)
    if dataset.channel_delay == 0.0:
        return None
    back = realigned(dataset, 0.0)
    return back if fit_axis(fit.axis, back.training).error < RULE.fallen * fit.error else None


def realigned(dataset: Dataset, shift: float) -> Dataset:
    """The dataset with a channel delay of ``shift`` (s) removed, counted from the original logs."""
    more = shift - dataset.channel_delay
    if more == 0.0:
        return dataset
    moved = dataset.with_logs(
        replace(
            PreparedLog.of(w.motion.with_force_ahead(more), w.test_function.length, w.reach),
            force_noise=w.force_noise,
        )
        for w in dataset.logs
    )
    return replace(moved, channel_delay=shift)


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
        line = _common_line(logs[: len(dataset.training)], seen[: len(dataset.training)])
    if line is None:
        return dataset
    frequency, phase = line
    pairs = zip(logs, seen, strict=True)
    phases = np.angle([_amplitude(log.time, left, frequency) for log, left in pairs])
    turns = (phases - phase) / (2.0 * np.pi)
    turns -= np.rint(turns)
    turns[np.abs(turns) < SAME_PERIOD] = 0.0
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
    return found, fit if same else replace(fit, logs=found.training)


def time_origins(dataset: Dataset) -> Array:
    """When each log began, s; training logs first."""
    return np.array([log.motion.time_origin for log in dataset.logs])


def begun_at(dataset: Dataset, begun: Array) -> Dataset:
    """The dataset with its logs begun at these times (n,) s, in the order of ``time_origins``."""
    pairs = zip(dataset.logs, begun, strict=True)
    return dataset.with_logs(_set(log, float(at)) for log, at in pairs)


def depends_on_time_origin(axis: AxisModel, dataset: Dataset) -> bool:
    """Whether a force of the axis depends on when a log began."""
    return len(without_timed_forces(axis, dataset.training[0]).effects) < len(axis.effects)


def phases_found(axis: AxisModel, effect: str, dataset: Dataset) -> int:
    """How many phases of training logs an effect of the axis has, beside its parameters."""
    found = [log for log in dataset.training if log.motion.time_origin]
    alone = replace(axis, effects=(axis[effect],))
    return len(found) if found and depends_on_time_origin(alone, dataset) else 0


def without_timed_forces(axis: AxisModel, log: PreparedLog) -> AxisModel:
    """The axis less the physical forces that read the clock."""
    later = _set(log, log.motion.time_origin + log.motion.period)
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
    tried = lines_in_time(list(zip(left, steps, strict=True)), most=LINES)
    if not tried:
        return None

    def explained(frequency: float) -> float:
        pairs = zip(logs, left, strict=True)
        return sum(
            0.5 * len(part) * abs(_amplitude(log.time, part, frequency)) ** 2 for log, part in pairs
        )

    best = max(tried, key=explained)
    every = np.concatenate(left)
    gain = -np.log(max(1.0 - explained(best) / float(np.sum(every**2)), ROUNDING))
    samples = effective_samples(every)
    told = samples * gain - 2 * len(logs) * np.log(samples) > RULE.least_bic
    return (best, float(np.angle(_amplitude(logs[0].time, left[0], best)))) if told else None


def _amplitude(time: Array, force: Array, frequency: float) -> complex:
    """Complex amplitude (N) of a line: force ~ Re(amplitude exp(2 pi i f t))."""
    turn = np.exp(-2j * np.pi * frequency * time)
    return complex(2.0 * np.mean((force - force.mean()) * turn))
