"""Force and position channels that were not sampled together, found before physics is blamed.

A command that acts later than its stamp is a delay, which the catalogue has effects for. One that
seems to act earlier cannot be physics: the channels' time stamps disagree, or the log holds every
n-th sample of a faster controller, whose mean force lies ahead of the sample logged. Such a shift
is taken off the log, and said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.clocks import reads_clock, synchronised, with_clocks
from identify.evidence import LEAST_BIC, evidence
from identify.fit import Fit, fit_axis
from identify.residual import Windowed
from identify.search import fit_thoroughly
from identify.study import Study
from identify.subspace import orthonormal, unabsorbed
from twin.model import AxisModel

Array = NDArray[np.float64]

LEAST_SHIFT = 0.05  # samples
MOST_SHIFT = 3.0  # samples; more is a fault of the log, which its check finds
LEAST_FALL = 0.1  # part of the squared error that a shift must take away
ROUNDS = 3


def fit_aligned(axis: AxisModel, study: Study) -> tuple[Study, Fit]:
    """The fit of an axis, and the study with its force channel moved to where it acted.

    The study's clocks are set by what repeats in time.
    """
    fit = fit_thoroughly(axis, study)
    for _ in range(ROUNDS):
        shift = misalignment(fit, study)
        if shift == 0.0:
            break
        moved = realigned(study, study.shift + shift)
        again = fit_thoroughly(fit.axis, moved)
        if again.error > np.sqrt(1.0 - LEAST_FALL) * fit.error:
            break
        study, fit = moved, replace(again, begun=fit.begun)
    if not reads_clock(fit.axis, study):
        return synchronised(fit, study)
    study = with_clocks(fit.axis, study)
    return study, replace(fit_thoroughly(fit.axis, study), begun=fit.begun)


def misalignment(fit: Fit, study: Study) -> float:
    """How much earlier than its stamp the force seems to act, s; 0 where nothing says so.

    One linear step: the residual against the rate of the command, beside the fit's own parameters.
    """
    rate = np.concatenate([w.fine.acceleration(w.motion.raw[1]) for w in study.fit])[fit.kept]
    basis = orthonormal(fit.jacobian)
    left, own = unabsorbed(fit.residual, basis), unabsorbed(rate, basis)
    power = float(own @ own)
    if power <= 1e-12 * float(rate @ rate):
        return 0.0
    shift = -float(own @ left) / power
    after = left + shift * own
    sample = study.fit[0].motion.sample_period
    fall = 1.0 - float(after @ after) / max(float(left @ left), 1e-300)
    told = fall > LEAST_FALL and evidence(left, after, 1).delta_bic > LEAST_BIC
    return shift if told and LEAST_SHIFT * sample < shift < MOST_SHIFT * sample else 0.0


def moved_by(fit: Fit, study: Study) -> Study | None:
    """The study with its force channel where a larger model says that it acted, if elsewhere.

    What the smaller model lacked can have passed for a shift, or hidden one.
    """
    if ahead := misalignment(fit, study):
        return realigned(study, study.shift + ahead)
    if study.shift == 0.0:
        return None
    back = realigned(study, 0.0)
    better = np.sqrt(1.0 - LEAST_FALL) * fit.error
    return back if fit_axis(fit.axis, back.fit).error < better else None


def realigned(study: Study, shift: float) -> Study:
    """The study with the force channel of its logs moved ahead by ``shift`` (s) in all."""
    more = shift - study.shift
    return replace(
        study, fit=_moved(study.fit, more), holdout=_moved(study.holdout, more), shift=shift
    )


def _moved(logs: Sequence[Windowed], shift: float) -> tuple[Windowed, ...]:
    return tuple(Windowed.of(w.motion.with_force_ahead(shift), w.window.length) for w in logs)


def shift_in_words(study: Study) -> str | None:
    """A sentence on the shift that was taken off the logs, or None."""
    if study.shift == 0.0:
        return None
    samples = study.shift / study.fit[0].motion.sample_period
    return (
        f"axis {study.axis}: the force acts {1e6 * study.shift:.0f} us ({samples:.2f} samples) "
        "before its time stamp, which no drive can do; the log was corrected. Check how force and "
        "position are sampled"
    )
