"""Whether what a fit leaves is noise: nothing that was measured foretells it.

Slow force noise, such as of a cooling hose or of an amplifier, stands above the noise floor that
sensors tell, and no spectrum of a sensor shows it. It is told from the residual itself, by one
test: curves over each coordinate of the motion, and what moved before, are learned on most blocks
of the logs and foretell the block that is left out. The controls are the residual itself, shifted
in time within each log: as large, as slow, and owed to nothing. All are tried with the same shifts,
so that the best of them is set against the best of its controls (P. H. Westfall, S. S. Young,
Resampling-Based Multiple Testing, 1993). The same is asked of its square: a force whose size the
motion foretells is one that a law of the motion makes. What curves cannot tell is asked of its
spectrum and of its distribution: noise has no line, and no amplitude that it keeps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import gathered
from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.spectral_lines import find_lines
from identify.dataset.spectrum import Record
from identify.estimation.evidence import blocks_of, by_blocks, effective_samples, rms
from identify.estimation.fit import Fit, Outcome, finished
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.subspace import orthonormal, unabsorbed
from twin.model.machine import AxisModel
from twin.signals import Array

HATS = 16  # knots of a curve over a coordinate; finer ones would learn the noise
LAGS = (1, 2, 4, 8, 16, 32, 64)  # test functions, by which what moved before may act
MOVED = ("velocity", "acceleration", "direction")
RIDGE = 1e-3  # of the largest column's square: what is seldom visited stays small
CONTROLS = 40  # of which none may do as well: 1 noise in 41 is refused
SHIFTS = (0.1, 0.9)  # of a log, by which its residual is shifted
SEED = 0  # of the shifts
LEAST_LOGS = 2  # one does not tell: where an axis comes by once nothing is foretold
MOST = 0.5  # of the force, RMS: a larger rest is of another machine
ALL = 1.1  # of the floor: it is known to a tenth, and nothing more is left
ALIKE = 1.5  # times the error of the fit logs that noise may have on others
FORETOLD = 0.1  # of its square, below which what is foretold is too little to matter
FORETOLD_SIZE = 0.05  # of its square's variance: the square scatters by itself
LINE = (1e-3, 0.2)  # chance and share of a spectral line that is no noise
CYCLES, SAMPLES = 2.0, 4.0  # of a line: least over the span, least test functions a period
KURTOSIS = 3.0  # standard errors by which a tone's kurtosis is below that of noise


@dataclass(frozen=True, eq=False)
class Remainder:
    """What a fit leaves of some logs, beside where the motion was.

    force (n,): N, less what the fit's own parameters can add, basis (n, k). where: coordinates
    (n,) by name. past (n, p): what moved before. logs (n,): the number of the log of each.
    """

    force: Array
    basis: Array
    where: dict[str, Array]
    past: Array
    logs: NDArray[np.int64]

    @classmethod
    def of(cls, fit: Fit, logs: Sequence[PreparedLog]) -> Remainder:
        kept = moving(logs, sticks(fit.axis))
        force = residual(fit.axis, logs)[kept]
        basis = orthonormal(jacobian(fit.axis, logs, fit.scaling.where)[kept])
        log = np.repeat(np.arange(len(logs)), [len(each) for each in logs])
        every = gathered(logs)
        where = {name: values[kept] for name, values in every.items()}
        return cls(unabsorbed(force, basis), basis, where, _past(every, log)[kept], log[kept])

    def foretold(self, force: Array, least: float) -> bool:
        """Whether a part of a force (n,), and more than of any control, is foretold by something.

        least: part of its square, 0..1.
        """
        tried = np.column_stack([force, self._controls(force)])
        tried = unabsorbed(tried - tried.mean(axis=0), self.basis)
        best = np.max([self._parts(columns, tried) for columns in self._predictors()], axis=0)
        return bool(best[0] > least and best[0] > best[1:].max())

    def _controls(self, force: Array) -> Array:
        """The force shifted within each log, (n, CONTROLS)."""
        spans = np.split(np.arange(len(force)), np.flatnonzero(np.diff(self.logs)) + 1)
        shifts = np.random.default_rng(SEED).uniform(*SHIFTS, (CONTROLS, len(spans)))
        rolled = [
            [np.roll(force[at], round(s * len(at))) for s, at in zip(row, spans, strict=True)]
            for row in shifts
        ]
        return np.stack([np.concatenate(parts) for parts in rolled], axis=1)

    def _parts(self, columns: Array, tried: Array) -> Array:
        """Part of the square of each force (n, m) that columns (n, k) foretell, (m,).

        Each block by what the others teach; ridge regression, by inner products of blocks.
        """
        columns = unabsorbed(columns, self.basis)
        spans = blocks_of(len(tried))
        squares, products = by_blocks(columns, columns, spans), by_blocks(columns, tried, spans)
        whole = squares.sum(axis=0)
        small = RIDGE * max(float(whole.diagonal().max()), np.finfo(float).tiny)
        learned = np.linalg.solve(
            whole - squares + small * np.eye(len(whole)), products.sum(axis=0) - products
        )
        missed = 2.0 * np.einsum("bkm,bkm->m", learned, products)
        missed -= np.einsum("bkm,bkl,blm->m", learned, squares, learned, optimize=True)
        return np.asarray(missed / np.maximum(np.sum(tried**2, axis=0), np.finfo(float).tiny))

    def _predictors(self) -> Iterator[Array]:
        """Columns (n, k) over each coordinate, alike both ways and not, and of the past."""
        for name in self.where.keys() - {"time", "direction"}:
            at = self.where[name]
            knots = np.unique(np.quantile(at, np.linspace(0.0, 1.0, HATS)))
            hats = np.stack([np.interp(at, knots, unit) for unit in np.eye(len(knots))], axis=1)
            yield np.hstack([hats, hats * self.where["direction"][:, None]])
        yield self.past

    def has_line(self) -> bool:
        """Whether it repeats, in time or along the track."""
        runs = np.flatnonzero(np.diff(self.logs)) + 1
        in_time = _repeats(self.force, self.where["time"], runs)
        return in_time or _repeats(self.force, self.where["position"], ())


def is_noise(fit: Fit, dataset: Dataset) -> bool:
    """Whether what a fit leaves is noise, so that its size is a part of the noise floor."""
    logs = (*dataset.fit, *dataset.holdout)
    command = np.concatenate([log.command for log in fit.logs])[fit.kept]
    if len(logs) < LEAST_LOGS or fit.error > MOST * rms(command):
        return False
    rest = Remainder.of(fit, logs)
    if rms(rest.force) > ALIKE * fit.error or keeps_its_amplitude(rest.force):
        return False
    if rest.foretold(rest.force, FORETOLD) or rest.has_line():
        return False
    return fit.noise.follows_motion or not rest.foretold(rest.force**2, FORETOLD_SIZE)


def with_own_noise(fit: Fit, dataset: Dataset) -> tuple[Dataset, Fit]:
    """Dataset and fit with what is left as part of the noise floor, where it is noise."""
    if fit.ratio < ALL or not is_noise(fit, dataset):
        return dataset, fit
    own = np.sqrt(fit.error**2 - fit.floor**2 + dataset.force_noise**2)
    dataset = dataset.with_force_noise(float(own))
    return dataset, finished(fit.axis, fit.begun, dataset.fit, fit.outcome)


def noise_known(axis: AxisModel, dataset: Dataset) -> Dataset:
    """The dataset with what an axis, as it is given, leaves as part of the noise, if it is."""
    return with_own_noise(finished(axis, axis, dataset.fit, Outcome.CONVERGED), dataset)[0]


def keeps_its_amplitude(force: Array) -> bool:
    """Whether a force (n,) swings between bounds, as a tone does, also one of moving frequency.

    By its kurtosis: 3 of Gaussian noise, 1.5 of a sine; that of n samples scatters by sqrt(24 / n)
    (R. A. Fisher, Statistical Methods for Research Workers, section 14).
    """
    squares = force**2
    kurtosis = np.mean(squares**2) / np.mean(squares) ** 2
    return bool(kurtosis < 3.0 - KURTOSIS * np.sqrt(24.0 / effective_samples(force)))


def _repeats(force: Array, at: Array, runs: Sequence[int] | NDArray[np.int64]) -> bool:
    """Whether a force (n,) has a line over a coordinate; runs: where another record begins."""
    span = float(np.ptp(at))
    if span == 0.0:
        return False
    chance, share = LINE
    parts = zip(np.split(at, runs), np.split(force, runs), strict=True)
    highest = len(force) / (SAMPLES * span)
    found = find_lines(
        [Record(*part) for part in parts], CYCLES / span, highest, most=1, chance=chance
    )
    return any(line.share > share for line in found)


def _past(where: dict[str, Array], logs: NDArray[np.int64]) -> Array:
    """What moved some test functions ago, (n, p) of unit size; nothing before a log began."""
    moved = np.stack([where[name] for name in MOVED], axis=1)
    moved /= np.maximum(np.sqrt(np.mean(moved**2, axis=0)), np.finfo(float).tiny)
    parts = []
    for lag in LAGS:
        late = np.roll(moved, lag, axis=0)
        late[np.roll(logs, lag) != logs] = 0.0
        late[:lag] = 0.0
        parts.append(late)
    return np.hstack(parts)
