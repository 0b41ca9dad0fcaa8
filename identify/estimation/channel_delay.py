"""Channel delay: force and position of one sample that are not of one instant.

A command that acts later than its time stamp is a physical delay, for which the catalogue has
effects. One that seems to act earlier is not physical: the time stamps of the channels disagree, or
the log holds every n-th sample of a faster controller, whose mean force is earlier than the logged
sample. Such a delay is removed from the log and reported.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import evidence, rms
from identify.estimation.fit import Fit, Outcome, error_on, finished, fit_axis
from identify.estimation.least_squares import unabsorbed
from identify.estimation.time_origin import depends_on_time_origin, synchronised, with_time_origins
from identify.estimation.variable_projection import fit_multistart
from identify.rules import RULE
from twin.model.machine import AxisModel

ROUNDS = 3


def fit_aligned(axis: AxisModel, dataset: Dataset) -> tuple[Dataset, Fit]:
    """The fit of an axis, and the dataset with its channel delay removed.

    The time origins of its logs are set by the phase of what repeats in time.
    """
    fit = fit_multistart(axis, dataset)
    for _ in range(ROUNDS):
        shift = misalignment(fit, dataset)
        if shift == 0.0:
            break
        moved = realigned(dataset, dataset.channel_delay + shift)
        again = fit_multistart(fit.axis, moved, fit.begun)
        if again.error > np.sqrt(1.0 - RULE.least_fall) * fit.error:
            break
        dataset, fit = moved, again
    if not depends_on_time_origin(fit.axis, dataset):
        return synchronised(fit, dataset)
    dataset = with_time_origins(fit.axis, dataset)
    return dataset, fit_multistart(fit.axis, dataset, fit.begun)


def aligned(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset with the channel delay and the time origins that a model with these values finds.

    No parameter is fitted; ``fit_aligned`` does the same together with a fit.
    """
    for _ in range(ROUNDS):
        fit = finished(axis, axis, dataset.fit, Outcome.CONVERGED)
        if not len(fit.residual) or (shift := misalignment(fit, dataset)) == 0.0:
            break
        moved = realigned(dataset, dataset.channel_delay + shift)
        error = rms(error_on(axis, moved.fit))
        if error > np.sqrt(1.0 - RULE.least_fall) * fit.error:
            break
        dataset = moved
    return with_time_origins(axis, dataset)


def misalignment(fit: Fit, dataset: Dataset) -> float:
    """How much earlier than its time stamp the force seems to act, s; 0 without evidence for it.

    One linear step: the residual regressed on the rate of the command, beside the parameters of the
    fit. Where the dataset has a channel delay already, the result is the change of it; the delay as
    a whole is never negative.
    """
    rate = np.concatenate([w.fine.acceleration(w.motion.raw[1]) for w in dataset.fit])[fit.kept]
    left, own = unabsorbed(fit.residual, fit.basis), unabsorbed(rate, fit.basis)
    power = float(own @ own)
    if power <= 1e-12 * float(rate @ rate):
        return 0.0
    shift = -float(own @ left) / power
    after = left + shift * own
    sample = max(log.motion.sample_period for log in dataset.fit)
    fall = 1.0 - float(after @ after) / max(float(left @ left), 1e-300)
    significant = fall > RULE.least_fall and evidence(left, after, 1).delta_bic > RULE.least_bic
    in_all = dataset.channel_delay + shift
    return (
        shift
        if significant and RULE.least_shift * sample < in_all < RULE.most_shift * sample
        else 0.0
    )


def moved_by(fit: Fit, dataset: Dataset) -> Dataset | None:
    """The dataset with the channel delay that a larger model finds, or None if it is the same.

    An effect that the smaller model lacked may have looked like a delay, or hidden one.
    """
    if ahead := misalignment(fit, dataset):
        return realigned(dataset, dataset.channel_delay + ahead)
    if dataset.channel_delay == 0.0:
        return None
    back = realigned(dataset, 0.0)
    better = np.sqrt(1.0 - RULE.least_fall) * fit.error
    return back if fit_axis(fit.axis, back.fit).error < better else None


def realigned(dataset: Dataset, shift: float) -> Dataset:
    """The dataset with a channel delay of ``shift`` (s) removed, counted from the original logs."""
    more = shift - dataset.channel_delay
    moved = dataset.with_logs(
        replace(
            PreparedLog.of(w.motion.with_force_ahead(more), w.test_function.length, w.reach),
            force_noise=w.force_noise,
        )
        for w in dataset.logs
    )
    return replace(moved, channel_delay=shift)
