"""Noise that no sensor makes: what is left of a force and follows from nothing that was measured.

Slow force noise, such as of a cooling hose or of an amplifier, stands above the noise floor that
sensors tell, and no effect explains it. What cannot be predicted is noise: neither curves over a
coordinate of the motion, nor what moved before, learned on some logs, foretell the residual of the
others, or its size, better than the same shifted in time; and it has no line in its spectrum.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, sticks
from identify.estimation.decision import RULE
from identify.estimation.fit import Fit, finished
from identify.selection.decoys import Trial
from identify.selection.residual_dependence import coordinates_of, find_dependence, gathered
from twin.signals import Array

HATS = 16  # over a coordinate
LAGS = (1, 2, 4, 8, 16, 32, 64)  # test functions, by which what moved before may act
MOVED = ("velocity", "acceleration", "direction")
RIDGE = 0.03  # of a column's length, which keeps hats that are seldom visited small
DECOYS = 20

Columns = Callable[[Sequence[PreparedLog]], list[Array]]


def with_own_noise(fit: Fit, dataset: Dataset) -> tuple[Dataset, Fit]:
    """Dataset and fit with what is left as part of the noise, where nothing predicts it."""
    if fit.at_floor or not is_unpredictable(fit, dataset):
        return dataset, fit
    own = float(np.sqrt(fit.error**2 - fit.floor**2))
    dataset = dataset.with_force_noise(own)
    return dataset, finished(fit.axis, fit.begun, dataset.fit, fit.outcome)


def is_unpredictable(fit: Fit, dataset: Dataset) -> bool:
    """Whether neither the motion nor its past foretells the residual, and no line stands out."""
    if find_dependence(fit, dataset).period is not None:
        return False
    force, sticking = Trial.of(fit, dataset), sticks(fit.axis)
    for trial, columns in itertools.product((force, force.of_power()), _predictors(dataset)):
        proof = trial.proof(columns, sticking=sticking, ridge=RIDGE, decoys=0)
        if proof.gain < (RULE.least_share if trial is force else RULE.foretold):
            continue
        beside = trial.proof(columns, sticking=sticking, ridge=RIDGE, decoys=DECOYS)
        if beside.gain > beside.best_decoy:
            return False
    return True


def _predictors(dataset: Dataset) -> Iterator[Columns]:
    """Columns over each coordinate, alike in both directions and not, and of the past."""
    where = gathered(dataset.fit)
    for name in where.keys() - {"time", "direction"}:
        knots = np.unique(np.quantile(where[name], np.linspace(0.0, 1.0, HATS)))
        yield _Hats(name, knots, turned=False)
        yield _Hats(name, knots, turned=True)
    yield _past


class _Hats:
    """Hats over a coordinate, of which a force that turns with the direction is made, or not."""

    def __init__(self, name: str, knots: Array, *, turned: bool) -> None:
        self.name, self.knots, self.turned = name, knots, turned

    def __call__(self, logs: Sequence[PreparedLog]) -> list[Array]:
        return [self._of(coordinates_of(log)) for log in logs]

    def _of(self, where: dict[str, Array]) -> Array:
        hats = [np.interp(where[self.name], self.knots, unit) for unit in np.eye(len(self.knots))]
        return np.stack(hats, axis=1) * (where["direction"][:, None] if self.turned else 1.0)


def _past(logs: Sequence[PreparedLog]) -> list[Array]:
    """What moved some test functions ago, (m, k) of each log; nothing before it began."""
    out = []
    for log in logs:
        where = coordinates_of(log)
        moved = np.stack([where[name] for name in MOVED], axis=1)
        parts = [np.concatenate([np.zeros((lag, len(MOVED))), moved])[: len(moved)] for lag in LAGS]
        out.append(np.hstack(parts))
    return out
