"""The acceptance test: whether one model explains the logs better than another, and by how much.

One function, used wherever something is decided: an effect more, an effect less, one effect against
another, a free curve, an exponent, two effects together. Three numbers are compared with three
thresholds (``RULE``), less strictly where all other logs prove a change, choosing in turn
(``Score.in_turn``):

* part: of what the smaller model leaves of the squared force error above the noise floor, the part
  that the larger one takes. It is computed of the whole error and of a typical block (geometric
  mean), and the larger counts, as a few blocks may hold most of an error; where the whole error
  rises, the whole counts. It is computed on the training logs and on logs that were not fitted,
  and the smaller counts, as either alone can be imitated.
* t: the logarithmic gain over blocks over its standard error; on the training logs less what as
  many parameters take of noise. Each group of logs has to show it by itself, and the more changes
  were tried, the more is asked of both together (Bonferroni, Stouffer).
* control: the part that the same change takes by chance, after a shift in time (``controls``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.noise_floor import NoiseFloor, noise_beside
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.evidence import (
    blocks_of,
    by_chance,
    colour_of,
    effective_samples,
    left_out,
    rms,
    samples_alike,
    taken_by_lag,
)
from identify.estimation.fit import Fit, has_nonparametric, smoothing
from identify.estimation.force_balance import residual
from identify.rules import RULE
from identify.selection.refusal import ByChance, Refusal, TakesLittle, Uncertain

Array = NDArray[np.float64]

TINY = np.finfo(float).tiny  # N^2, of a residual that is nothing
FEWEST_TURNS = 2  # other logs that prove a law: with those that choose most of all logs see it
IN_OTHERS = 0.5  # of what a finding takes: fitted to other logs, it may make as much more or less


@dataclass(frozen=True)
class Taken:
    """What a change takes of the squared error of some logs.

    t: logarithmic gain over blocks, over its standard error. whole, typical: part of what is left
    above the noise floor, of all of it and of that of a typical block, at most 1. apart: the mean
    square of what the two models predict differently, over that of what is left.
    """

    t: float
    whole: float
    typical: float
    apart: float = 1.0

    @property
    def part(self) -> float:
        """The larger of the two parts; that of the whole where this rises."""
        return larger(self.whole, self.typical)


@dataclass(frozen=True)
class Score:
    """A change against the model without it, on the training logs and on logs not fitted to.

    control: the part that all but one in twenty of its controls stay below. among: of how many
    changes it was chosen. in_turn: where all other logs, two or more, prove it, choosing in turn,
    the least that it takes of any of them. Then it stands where those that choose see it too and
    are not sure of it alone; and where they hardly excite it, by the others.
    """

    training: Taken
    other: Taken
    control: float = 0.0
    among: int = 1
    in_turn: Taken | None = None

    @property
    def judging(self) -> Taken:
        """What it takes of logs not fitted to: those that choose, or the others in turn.

        These where those that choose hardly excite it; then the least of them has to be sure alone.
        """
        if self.in_turn is None or self.other.apart >= IN_OTHERS * RULE.least_part:
            return self.other
        return self.in_turn if self.in_turn.t >= least_t(self.among) else self.other

    @property
    def t(self) -> float:
        """The smaller of the two."""
        return min(self.training.t, self.judging.t)

    @property
    def together(self) -> float:
        """The t of both groups of logs together (S. A. Stouffer)."""
        return float((self.training.t + self.judging.t) / np.sqrt(2.0))

    @property
    def part(self) -> float:
        """The smaller of the two."""
        return min(self.training.part, self.judging.part)

    @property
    def is_seen(self) -> bool:
        """Whether it takes half as much as a change is to take, sure or not, and not by chance."""
        return self.part > max(IN_OTHERS * RULE.least_part, self.control) and self.t > 0.0

    @property
    def refused(self) -> Refusal | None:
        """Why the change is not accepted; None where it is."""
        if self.in_turn is not None and self.is_seen:
            return None
        if self.part < RULE.least_part:
            return TakesLittle(self.part)
        for t, least in ((self.t, least_t(1)), (self.together, least_t(self.among))):
            if t < least:
                return Uncertain(t, least)
        return ByChance(self.control) if self.part <= self.control else None

    @property
    def accepted(self) -> bool:
        """Whether the larger model is the better one."""
        return self.refused is None


@dataclass(frozen=True, eq=False)
class Judged:
    """A fit with what it leaves of logs that it was not fitted to: the selection logs.

    Where there are none, of each block of the training logs by a fit to the others.
    """

    fit: Fit
    dataset: Dataset

    @cached_property
    def training(self) -> Array:
        """Residual (n,) N of the training logs; not a number where it tells nothing."""
        out = np.full(len(self.fit.kept), np.nan)
        out[self.fit.kept] = self.fit.residual
        return out

    @cached_property
    def other(self) -> Array:
        """The same (m,) N of logs that were not fitted."""
        fit, logs = self.fit, self.dataset.selection
        if logs:
            return left_on(fit, logs)
        columns, out = fit.jacobian, np.full(len(fit.kept), np.nan)
        rows = self._smoothing
        out[fit.kept] = left_out(fit.residual, columns, rows.T @ rows)
        return out

    def tell(self) -> None:
        """Compute what a score asks for, and let go of the matrices that it takes."""
        _ = self.training, self.other, self.parameters
        self.fit.forget()

    @property
    def _smoothing(self) -> Array:
        """Penalty rows (m, k) of the free curves of the fit, N per unit."""
        return smoothing(self.fit.axis, self.fit.scaling.where, len(self.fit.residual))

    @cached_property
    def other_error(self) -> float:
        """RMS of it, N; no number where all of it rests."""
        return rms(self.other[np.isfinite(self.other)])

    @cached_property
    def other_floor(self) -> float:
        """Noise floor of the logs that were not fitted, N RMS.

        At most the force that was logged, which a model of nothing leaves: the noise of a motion
        grows with the inertia, and a wrong inertia would have it explain what the model lacks.
        """
        holdout = self.dataset.selection
        if not holdout:
            return self.fit.floor
        logged = rms(np.concatenate([log.command for log in holdout])[np.isfinite(self.other)])
        return min(self._other_noise.value, logged or np.inf)

    @cached_property
    def _other_noise(self) -> NoiseFloor:
        return noise_beside(self.fit.axis, self.dataset.selection)

    @cached_property
    def parameters(self) -> float:
        """Free parameters; of a free curve the effective ones, by how smooth it is."""
        return len(self.fit.residual) * self.by_chance(np.ones(1))

    def by_chance(self, colour: Array) -> float:
        """Part of the square of noise of a colour (m,) that its parameters take on average.

        Of free curves as far as they are free to, at the frequencies at which they are passed.
        """
        fit = self.fit
        if has_nonparametric(fit.axis):
            return by_chance(self._taken, colour)
        return len(fit.scaling.where) * samples_alike(colour) / max(len(fit.residual), 1)

    @cached_property
    def _taken(self) -> Array:
        rows = self._smoothing
        return taken_by_lag(self.fit.jacobian, rows.T @ rows)

    @property
    def other_at_floor(self) -> bool:
        """Whether noise is all that is left on logs that were not fitted; not of none."""
        if not self.dataset.selection:
            return False
        sure = max(RULE.at_floor * self.other_floor, self._other_noise.most)
        return self.other_error < sure

    @property
    def at_floor(self) -> bool:
        """Whether noise is all that is left, on the training logs and on those not fitted."""
        tells = self.dataset.selection and np.isfinite(self.other_error)
        return self.fit.at_floor and (self.other_at_floor or not tells)


def left_on(fit: Fit, logs: Sequence[PreparedLog]) -> Array:
    """Residual (n,) N of a fit on other logs; not a number where it tells nothing."""
    kept = moving(logs, sticks(fit.axis))
    return np.where(kept, residual(fit.axis, logs), np.nan)


def proved_in_turn(turns: Sequence[Score | None]) -> Taken | None:
    """The least that a change takes of logs that choose in turn, where all of them prove it.

    turns: its score, asked alone, where each of them chooses; None where it was not asked there.
    """
    scores = [s for s in turns if s is not None and replace(s, among=1).accepted]
    if not FEWEST_TURNS <= len(scores) == len(turns):
        return None
    return min((s.other for s in scores), key=lambda taken: taken.t)


def least_t(among: int) -> float:
    """The t that chance reaches once in twenty times in the best of so many (Bonferroni)."""
    return NormalDist().inv_cdf(1.0 - RULE.chance / max(among, 1))


def score(before: Judged, after: Judged, control: float = 0.0, among: int = 1) -> Score:
    """What ``after`` takes of the error that ``before`` leaves; see Score."""
    colour = colour_of(after.fit.residual)
    charge = max(after.by_chance(colour) - before.by_chance(colour), 0.0)
    training = taken(before.training, after.training, before.fit.floor, charge)
    other = taken(before.other, after.other, before.other_floor)
    return Score(training, other, control, among)


def prefers(one: Judged, other: Judged) -> bool:
    """Whether the logs clearly prefer one model to another, where both explain them.

    Logs on which the two predict nearly the same force do not vote; at the noise floor these are
    the ones on which they differ by less than noise allows to see. All that vote must agree. Above
    the floor the better one must also take a part that matters, as what is left may be taken by
    chance.
    """
    by = score(other, one)
    groups = (by.training, by.other)
    if one.at_floor:
        most = (
            most_evidence(other.training, one.training, other.fit.floor),
            most_evidence(other.other, one.other, other.other_floor),
        )
        least = RULE.least_bic
        sure = any(g.t >= least**0.5 and e >= least for g, e in zip(groups, most, strict=True))
        return sure and min(g.t for g in groups) > -least_t(1)
    telling = [g for g in groups if g.apart >= RULE.least_part]
    clear = (g.t >= least_t(1) and g.part >= RULE.least_part for g in telling)
    return bool(telling) and all(clear)


def taken(before: Array, after: Array, floor: float, charge: float = 0.0) -> Taken:
    """What ``after`` takes of residuals (n,) N, where both tell something.

    floor: N RMS. charge: logarithmic gain that the added parameters alone would bring.
    """
    both = np.isfinite(before) & np.isfinite(after)
    if not both.any():
        return Taken(0.0, 0.0, 0.0, 0.0)
    spans, quiet = blocks_of(int(both.sum())), floor**2
    first = [span.start for span in spans]
    count = np.array([span.stop - span.start for span in spans])
    squares = [np.add.reduceat(r[both] ** 2, first) / count + TINY for r in (before, after)]
    gains = np.log((squares[0] + quiet) / (squares[1] + quiet))
    spread = gains.std(ddof=1) / np.sqrt(len(gains)) if len(gains) > 1 else np.inf
    t = (gains.mean() - charge) / spread if spread > 0.0 else 0.0
    left = _left(float(np.average(squares[0], weights=count)), quiet)
    apart = float(np.mean((before - after)[both] ** 2)) / left
    return Taken(float(t), *parts(squares[0], squares[1], count, quiet), apart)


def most_evidence(before: Array, after: Array, floor: float) -> float:
    """Twice the most log likelihood that there can be between two models of residuals (n,) N.

    By how far apart they predict the force, in units of the noise floor (N RMS).
    """
    both = np.isfinite(before) & np.isfinite(after)
    if not both.any():
        return 0.0
    apart = float(np.mean((before - after)[both] ** 2))
    return effective_samples(after[both]) * apart / max(floor**2, TINY)


def parts(before: Array, after: Array, count: Array, quiet: float) -> tuple[float, float]:
    """Part that is taken of mean squares (b,) N^2 of blocks with so many samples each (b,).

    Of the whole and of a typical block. quiet: squared noise floor, N^2.
    """

    def whole(squares: Array) -> float:
        return float(np.average(squares, weights=count))

    def typical(squares: Array) -> float:
        return float(np.exp(np.log(squares + quiet).mean())) - quiet

    first, second = ((of(before), of(after)) for of in (whole, typical))
    return part_of(*first, quiet), part_of(*second, quiet)


def larger(whole: float, typical: float) -> float:
    """The larger part, but nothing is taken typically by what makes the whole error rise."""
    return max(whole, typical) if whole > 0.0 else whole


def part_of(before: float, after: float, quiet: float) -> float:
    """Part that is taken of a mean square N^2 above the squared noise floor (N^2), at most 1."""
    return min((before - after) / _left(before, quiet), 1.0)


def _left(square: float, quiet: float) -> float:
    """What is left above a floor: never less than that by which this is uncertain; all N^2."""
    return max(square - quiet, (RULE.at_floor**2 - 1.0) * quiet, TINY)
