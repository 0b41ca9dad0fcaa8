"""Noise that no sensor makes: what is left of a force and follows from nothing that was measured.

Slow force noise, such as of a cooling hose or of an amplifier, stands above the noise floor that
sensors tell, and no effect explains it. What cannot be predicted is noise: neither curves over a
coordinate of the motion, nor what moved before, learned on some logs, foretell the residual of the
others, or its size, better than the same shifted in time; it has no line in its spectrum, and does
not swing between bounds as a tone of moving frequency does.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, sticks
from identify.estimation.decision import RULE
from identify.estimation.errors import holdout_error
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.fit import Fit, Outcome, finished
from identify.selection.old_decoys import Trial
from identify.selection.residual_dependence import coordinates_of, find_dependence, gathered
from twin.model.machine import AxisModel
from twin.signals import Array

HATS = 16  # over a coordinate
LAGS = (1, 2, 4, 8, 16, 32, 64)  # test functions, by which what moved before may act
MOVED = ("velocity", "acceleration", "direction")
RIDGE = 0.03  # of a column's length, which keeps hats that are seldom visited small
DECOYS = 20
LEAST_LOGS = 2
MOST_NOISE = 0.5  # of the force, RMS, that its noise may be
ALIKE = 1.5  # times the error of the fit logs that noise may have on the held-out ones

Columns = Callable[[Sequence[PreparedLog]], list[Array]]


def with_own_noise(fit: Fit, dataset: Dataset) -> tuple[Dataset, Fit]:
    """Dataset and fit with what is left as part of the noise, where nothing predicts it."""
    if fit.at_floor or not is_unpredictable(fit, dataset):
        return dataset, fit
    own = float(np.sqrt(fit.error**2 - fit.floor**2))
    dataset = dataset.with_force_noise(own)
    return dataset, finished(fit.axis, fit.begun, dataset.fit, fit.outcome)


def noise_known(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset with what an axis, as it is given, leaves as part of the noise, if it is."""
    return with_own_noise(finished(axis, axis, dataset.fit, Outcome.CONVERGED), dataset)[0]


@lru_cache(maxsize=1)  # a selection asks it of one fit for its curves, its pairs and its end
def is_unpredictable(fit: Fit, dataset: Dataset) -> bool:
    """Whether neither the motion nor its past foretells the residual, and it swings as noise does.

    Neither on the held-out logs nor on blocks left out of the fit logs; noise is as large on both.
    No line stands out of its spectrum, and it has no amplitude that it keeps. One log alone does
    not tell: what depends on where the axis is cannot be foretold where it comes by once. What is
    nearly as large as the whole force is no noise: the force may be of another machine.
    """
    command = np.concatenate([log.command for log in fit.logs])[fit.kept]
    if fit.error > MOST_NOISE * rms(command):
        return False
    if len(dataset.fit) + len(dataset.holdout) < LEAST_LOGS or keeps_its_amplitude(fit.residual):
        return False
    held = holdout_error(fit, dataset)
    if held is not None and held > ALIKE * fit.error:
        return False
    if find_dependence(fit, dataset).period is not None:
        return False
    trial, sticking = Trial.of(fit, dataset), sticks(fit.axis)
    own = replace(trial, held=None)
    trials = [(t, RULE.least_share) for t in (trial, own)]
    trials += [(t.of_power(), RULE.foretold) for t in (trial, own)]
    predictors = [_kept_small(columns, dataset) for columns in _predictors(dataset)]
    return not any(
        _foretells(t, columns, least, sticking)
        for (t, least), columns in itertools.product(trials, predictors)
    )


def keeps_its_amplitude(force: Array) -> bool:
    """Whether a force (n,) swings between bounds, as a tone does, also one of moving frequency.

    By its kurtosis: 3 of Gaussian noise, 1.5 of a sine; that of n samples scatters by sqrt(24 / n)
    (R. A. Fisher, Statistical Methods for Research Workers, section 14).
    """
    squares = force**2
    kurtosis = np.mean(squares**2) / np.mean(squares) ** 2
    return bool(kurtosis < 3.0 - RULE.least_t * np.sqrt(24.0 / effective_samples(force)))


def _foretells(trial: Trial, columns: Columns, least: float, sticking: bool) -> bool:
    """Whether columns take at least a part of the squared test error, and more than any decoy.

    Many are tried, so that one decoy in twenty would let noise be foretold by some of them.
    """
    proof, _ = trial.proofs(columns, sticking=sticking, decoys=0)
    if proof.gain < least:
        return False
    proof, _ = trial.proofs(columns, sticking=sticking, decoys=DECOYS, rare=0.0)
    return proof.gain > proof.decoy


def _kept_small(columns: Columns, dataset: Dataset) -> Columns:
    """The same for strengths with a unit penalty that is weak beside what is often visited."""
    every = np.sqrt(sum(np.einsum("ij,ij->j", part, part) for part in columns(dataset.fit)))
    size = RIDGE * np.maximum(every, RIDGE * every.max())

    def small(logs: Sequence[PreparedLog]) -> list[Array]:
        parts = columns(logs)
        for part in parts:
            part /= size
        return parts

    return small


def _predictors(dataset: Dataset) -> Iterator[Columns]:
    """Columns over each coordinate, alike in both directions and not, and of the past."""
    where = gathered(dataset.fit)
    for name in where.keys() - {"time", "direction"}:
        knots = np.unique(np.quantile(where[name], np.linspace(0.0, 1.0, HATS)))
        yield _Hats(name, knots, turned=False)
        yield _Hats(name, knots, turned=True)
    yield _past


@dataclass(frozen=True, eq=False)
class _Hats:
    """Hats over a coordinate, with knots (k,) in its unit; turned: with the direction of motion."""

    name: str
    knots: Array
    turned: bool

    def __call__(self, logs: Sequence[PreparedLog]) -> list[Array]:
        return [self._of(coordinates_of(log)) for log in logs]

    def _of(self, where: dict[str, Array]) -> Array:
        at = where[self.name]
        hats = np.empty((len(at), len(self.knots)))
        for k, unit in enumerate(np.eye(len(self.knots))):
            hats[:, k] = np.interp(at, self.knots, unit)
        if self.turned:
            hats *= where["direction"][:, None]
        return hats


def _past(logs: Sequence[PreparedLog]) -> list[Array]:
    """What moved some test functions ago, (m, k) of each log; nothing before it began."""
    out = []
    for log in logs:
        where = coordinates_of(log)
        moved = np.stack([where[name] for name in MOVED], axis=1)
        parts = [np.concatenate([np.zeros((lag, len(MOVED))), moved])[: len(moved)] for lag in LAGS]
        out.append(np.hstack(parts))
    return out
