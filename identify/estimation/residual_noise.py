"""Whether what a fit leaves is noise: nothing that was measured predicts it.

Slow force noise, such as of a cooling hose or of an amplifier, stands above the noise floor that
sensors tell, and no spectrum of a sensor shows it. It is told from the residual itself, by one
test: curves over each coordinate of the motion, and what moved before, are learned on most blocks
of the logs and predict the block that is left out. The controls are the residual itself, shifted
in time within each log: as large, as slow, and owed to nothing. All are tried with the same shifts,
so that the best of them is set against the best of its controls (P. H. Westfall, S. S. Young,
Resampling-Based Multiple Testing, 1993). The same is asked of its size: a force whose size the
motion predicts is one that a law of the motion makes. So is what goes alike from the beginning of
each log, beside controls that are shifted by another part of each. What curves cannot tell is asked
of its spectrum and of its distribution: noise has no line, and no amplitude that it keeps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import gathered
from identify.dataset.dataset import Dataset
from identify.dataset.odd_log import FEWEST
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.spectrum import ScatteredSignal, find_lines
from identify.dataset.test_function import OVERLAP
from identify.estimation.errors import error_on
from identify.estimation.evidence import SURE, blocks_of, by_blocks, effective_samples, rms
from identify.estimation.fit import LINES, Fit, Outcome, finished
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.rules import RULE
from twin.model.machine import AxisModel
from twin.signals import Array

HATS = 16  # knots of a curve over a coordinate; finer ones would learn the noise
MOVED = ("velocity", "acceleration", "direction")
CONTROLS = 40  # of which none may do as well: 1 noise in 41 is refused
SHIFTS = (0.1, 0.9)  # of a log, by which its residual is shifted
ALIKE = 1.5  # times the error of other logs that noise may have in one


@dataclass(frozen=True, eq=False)
class Remainder:
    """What a fit leaves of some logs, beside where the motion was.

    force (n,): N, less what the fit's own parameters can add, basis (n, k). known (n,): N, of the
    motor, as the model has it. where: coordinates (n,) by name. past (n, p): what moved before.
    logs (n,): the number of the log of each.
    """

    force: Array
    basis: Array
    known: Array
    where: dict[str, Array]
    past: Array
    logs: NDArray[np.int64]

    @classmethod
    def of(cls, fit: Fit, logs: Sequence[PreparedLog]) -> Remainder:
        kept = moving(logs, sticks(fit.axis))
        force = residual(fit.axis, logs)[kept]
        basis = orthonormal(jacobian(fit.axis, logs, fit.scaling.where, kept))
        log = np.repeat(np.arange(len(logs)), [len(each) for each in logs])
        every = gathered(logs)
        where = {name: values[kept] for name, values in every.items()}
        known = np.concatenate([each.command for each in logs])[kept] - force
        past = _past(every, log)[kept]
        return cls(unabsorbed(force, basis), basis, known, where, past, log[kept])

    def is_predictable(self) -> bool:
        """Whether a part of the force that matters follows from something measured."""
        return self._predictable(self.force, self.basis) or self._drifts()

    def size_is_predictable(self) -> bool:
        """The same of its size, the logarithm of its square; a few large values do not decide."""
        size = np.log1p(self.force**2 / max(np.mean(self.force**2), np.finfo(float).tiny))
        return self._predictable(size - size.mean(), np.zeros((len(size), 0)))

    def _predictable(self, values: Array, basis: Array) -> bool:
        """Whether values (n,) are predicted by something; basis (n, k): of what was fitted."""
        columns = (unabsorbed(c, basis) for c in self._predictors())
        at_random = np.random.default_rng(0).uniform(size=(CONTROLS, len(self._spans)))
        return self._stand_out(values, basis, columns, at_random)

    def _drifts(self) -> bool:
        """Whether the logs go alike from their beginnings, as what warms."""
        count = len(self._spans)
        at_random = np.random.default_rng(0).uniform(size=(CONTROLS, 1))
        apart = (at_random + np.arange(count) / count) % 1.0  # shifted alike, they would go alike
        columns = unabsorbed(self._over("time"), self.basis)
        return count > 1 and self._stand_out(self.force, self.basis, [columns], apart)

    @cached_property
    def _spans(self) -> list[NDArray[np.int64]]:
        """Where each log is."""
        edges = np.flatnonzero(np.diff(self.logs)) + 1
        return np.split(np.arange(len(self.force)), edges)

    def _stand_out(
        self, values: Array, basis: Array, columns: Iterable[Array], turns: Array
    ) -> bool:
        """Whether a part of values (n,), and more than of any control, is predicted by columns.

        turns (m, logs): 0..1, by which the controls are shifted within each log.
        """
        tried = np.empty((len(values), 1 + len(turns)))
        tried[:, 0] = values
        shifts = SHIFTS[0] + (SHIFTS[1] - SHIFTS[0]) * turns
        for column, row in zip(tried[:, 1:].T, shifts, strict=True):
            for at, shift in zip(self._spans, row, strict=True):
                column[at] = np.roll(values[at], round(shift * len(at)))
        tried -= basis @ (basis.T @ tried)
        whole = np.maximum(np.sum(tried**2, axis=0), np.finfo(float).tiny)
        best = np.max([self._parts(c, tried) / whole for c in columns], axis=0)
        return bool(best[0] > RULE.least_fall and best[0] > best[1:].max())

    def _parts(self, columns: Array, tried: Array) -> Array:
        """Of the squared sum of each force (n, m) what columns (n, k) predict, (m,).

        Each block by what the others teach; ridge regression, by inner products of blocks.
        """
        spans = blocks_of(len(tried))
        squares, products = by_blocks(columns, columns, spans), by_blocks(columns, tried, spans)
        own = squares.sum(axis=0).diagonal().mean() * np.eye(columns.shape[1])
        others = squares.sum(axis=0) - squares, products.sum(axis=0) - products
        parts = []
        # 0.01, 1 of a column's square: for many samples, and for few that slow noise leaves
        for ridge in (0.01, 1.0):
            learned = np.linalg.solve(others[0] + ridge * own, others[1])
            told = 2.0 * products - squares @ learned
            parts.append(np.sum(learned * told, axis=(0, 1)))
        return np.asarray(np.max(parts, axis=0))

    def _predictors(self) -> Iterator[Array]:
        """Columns (n, k) over each coordinate, of the past, and of values that vary.

        These are the inertia and the motor's gain: to them the force is in proportion.
        """
        for name in self.where.keys() - {"time", "direction"}:
            yield self._over(name)
        yield self.past
        for along in (self.where["acceleration"], self.known):
            for name in ("time", "position", "velocity"):
                yield self._hats(name) * (along / rms(along))[:, None]

    def _over(self, name: str) -> Array:
        """Curves over a coordinate (n, k), alike both ways and not."""
        hats = self._hats(name)
        return np.hstack([hats, hats * self.where["direction"][:, None]])

    def _hats(self, name: str) -> Array:
        """A curve over a coordinate, by its knots (n, k)."""
        at = self.where[name]
        knots = np.unique(np.quantile(at, np.linspace(0.0, 1.0, HATS)))
        return np.stack([np.interp(at, knots, unit) for unit in np.eye(len(knots))], axis=1)

    def has_line(self) -> bool:
        """Whether it repeats, in time or along the track."""
        runs = np.flatnonzero(np.diff(self.logs)) + 1
        in_time = _repeats(self.force, self.where["time"], runs)
        return in_time or _repeats(self.force, self.where["position"], ())


def is_noise(fit: Fit, dataset: Dataset) -> bool:
    """Whether what a fit leaves is noise, so that its size is a part of the noise floor."""
    gaussian, laplace = 3.0, 6.0  # kurtosis of these noises
    # One log does not tell: where it is once predicts nothing.
    logs = (*dataset.training, *dataset.selection)
    command = np.concatenate([log.command for log in fit.logs])[fit.kept]
    # 0.5 of the force, RMS: a larger rest is of another machine
    if len(logs) == 1 or fit.error > 0.5 * rms(command):
        return False
    rest = Remainder.of(fit, logs)
    kurtosis = _kurtosis(rest.force)
    # 24/n is the variance of the kurtosis of n normal samples
    least = gaussian - SURE * np.sqrt(24.0 / effective_samples(rest.force))
    if kurtosis < least or rest.is_predictable() or rest.has_line() or _hidden(fit, logs):
        return False
    if fit.noise.follows_motion:
        return True
    if kurtosis > laplace:
        return False
    larger = dataset.selection and rms(error_on(fit.axis, dataset.selection)) > ALIKE * fit.error
    return not larger and not rest.size_is_predictable()


def foretells_aliases(fit: Fit, dataset: Dataset) -> bool:
    """Whether something measured predicts what is left, where most of the noise floor is aliases.

    These are told from a spectrum, which a force that the model lacks may resemble.
    """
    if fit.noise.parts["aliasing"] ** 2 < 0.5 * fit.noise.value**2:
        return False
    return Remainder.of(fit, (*dataset.training, *dataset.selection)).is_predictable()


def _hidden(fit: Fit, logs: Sequence[PreparedLog]) -> bool:
    """Whether one log, louder than the others, hides what something measured predicts of them."""
    left = [error_on(fit.axis, [log]) for log in logs]
    loudest = max(range(len(logs)), key=lambda k: rms(left[k]) if left[k].size else 0.0)
    others = [*logs[:loudest], *logs[loudest + 1 :]]
    theirs = np.concatenate([*left[:loudest], *left[loudest + 1 :]])
    if len(others) + 1 < FEWEST or rms(left[loudest]) < ALIKE * rms(theirs):
        return False
    return Remainder.of(fit, others).is_predictable()


def with_own_noise(fit: Fit, dataset: Dataset) -> tuple[Dataset, Fit]:
    """Dataset and fit with what is left as part of the noise floor, where it is noise."""
    if fit.at_floor or not is_noise(fit, dataset):
        return dataset, fit
    own = np.sqrt(fit.error**2 - fit.floor**2 + dataset.force_noise**2)
    dataset = dataset.with_force_noise(float(own))
    return dataset, finished(fit.axis, fit.begun, dataset.training, fit.outcome)


def noise_known(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset with what an axis, as it is given, leaves as part of the noise, if it is."""
    return with_own_noise(finished(axis, axis, dataset.training, Outcome.CONVERGED), dataset)[0]


def _kurtosis(force: Array) -> float:
    """Kurtosis of a force (n,): 3 of Gaussian noise, 1.5 of a tone, also of moving frequency.

    That of n samples scatters by sqrt(24 / n) (R. A. Fisher, Statistical Methods for Research
    Workers, section 14). What test functions average is nearer to Gaussian than Laplace's noise,
    whose kurtosis is 6; more have forces that come in bursts.
    """
    squares = force**2
    return float(np.mean(squares**2) / np.mean(squares) ** 2)


def _repeats(force: Array, at: Array, runs: Sequence[int] | NDArray[np.int64]) -> bool:
    """Whether a force (n,) has a line over a coordinate; runs: where another record begins."""
    span = float(np.ptp(at))
    if span == 0.0:
        return False
    parts = zip(np.split(at, runs), np.split(force, runs), strict=True)
    # Of fewer cycles than its knots can follow curves tell, and slow noise has some.
    lowest, highest = 0.5 * HATS / span, len(force) / (OVERLAP * span)
    records = [ScatteredSignal(*part) for part in parts]
    found = find_lines(records, lowest, highest, most=LINES, chance=RULE.line_chance)
    return any(line.share > RULE.line_share for line in found)


def _past(where: dict[str, Array], logs: NDArray[np.int64]) -> Array:
    """What moved some test functions ago, (n, p) of unit size; nothing before a log began."""
    moved = np.stack([where[name] for name in MOVED], axis=1)
    moved /= np.maximum(np.sqrt(np.mean(moved**2, axis=0)), np.finfo(float).tiny)
    parts = []
    for lag in (1, 2, 4, 8, 16, 32, 64):  # test functions, by which what moved before may act
        late = np.roll(moved, lag, axis=0)
        late[np.roll(logs, lag) != logs] = 0.0
        late[:lag] = 0.0
        parts.append(late)
    return np.hstack(parts)
