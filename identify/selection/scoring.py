"""A candidate: the model with one effect more, and what speaks for the effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.drive import is_noise
from identify.dataset.noise_floor import floor_of, unrounded_floor_of
from identify.estimation.decision import RULE
from identify.estimation.errors import gain_held_out
from identify.estimation.evidence import (
    Evidence,
    Gain,
    effective_samples,
    evidence,
    held_out_gain,
    left_out,
    noise_gain,
    rms,
)
from identify.estimation.fit import Fit, error_on
from identify.estimation.time_origin import phases_found
from identify.selection.decoys import proof
from twin.effect import Effect, Kind

Array = NDArray[np.float64]

MOST_INERTIA = (
    3.0  # times the moved mass of the base or its start, that an effect may leave or ask for
)
EDGE = 1e-3  # relative distance from a bound at which a value ended there
RIDGE = 1e-4  # keeps cross-validation finite for parameters that the motion does not excite


@dataclass(frozen=True, eq=False, repr=False)
class Candidate:
    """A model with one effect more: its refit, evidence and held-out gain.

    plausible: whether the axis travels far enough for what repeats along the track to be seen to,
    as one cycle over all of the travel is any smooth force of position; and no time, length or
    frequency of the law ended at its bound, beyond which it is another law. beats_decoys: whether
    it was set against them, and held; of a friction, which has none, whether it leaves clearly
    less.
    """

    effect: Effect
    axis: str
    fit: Fit
    evidence: Evidence
    gain: Gain
    plausible: bool = True
    beats_decoys: bool = False

    def __repr__(self) -> str:
        return f"<Candidate {self.effect.name} on {self.axis}: evidence {self.delta_bic:.4g}>"

    @property
    def delta_bic(self) -> float:
        """BIC without minus BIC with the effect; positive supports it."""
        return self.evidence.delta_bic

    @property
    def supported(self) -> bool:
        """Whether evidence and held-out logs support the effect, and its values are plausible."""
        held_out = self.gain.t > RULE.least_t or self.beats_decoys
        return (
            self.delta_bic > RULE.least_bic and held_out and self.plausible
            and (self.is_noise or self.gain.after < self.gain.before)
        )  # fmt: skip

    @property
    def is_beyond_doubt(self) -> bool:
        """Whether the evidence is enough where noise may be all that is left."""
        return self.delta_bic > RULE.beyond_doubt

    def is_added_to(self, base: Fit) -> bool:
        """Whether the effect is added to the fit without it; at the noise floor it needs far more.

        The noise floor is an estimate, so an effect may be significant although the error is at it.
        """
        return self.supported and (self.is_beyond_doubt or not base.may_be_noise)

    @property
    def is_noise(self) -> bool:
        """Whether the effect lowers no error but raises the noise floor."""
        return is_noise(self.effect)


def score(base: Fit, fit: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """Evidence for a fitted larger model over the base, on the test functions both can use."""
    if is_noise(effect):
        return _score_noise(fit, dataset, effect)
    shared = base.kept & fit.kept

    def both(left: Callable[[Fit], Array]) -> list[Array]:
        # An effect that makes the motor's force small makes every force and error small with it.
        return [left(f) / f.lessened for f in (base, fit)]

    before, after = both(lambda f: f.residual[shared[f.kept]])
    added = max(len(fit.scaling.where) - len(base.scaling.where), 1)
    added += phases_found(fit.axis, effect.name, dataset)
    found = evidence(before, after, added)
    gain = gain_held_out(base, fit, dataset)
    if gain is None:  # without evidence it is not supported, whatever cross-validation would give
        crossed = found.delta_bic > RULE.least_bic
        pair = both(lambda f: _cross_validated(f, shared[f.kept])) if crossed else [before, after]
        gain = held_out_gain(pair[0], pair[1], base.floor)
    candidate = Candidate(effect, dataset.axis, fit, found, gain)
    if found.delta_bic < RULE.least_bic:
        return candidate
    return replace(
        candidate,
        plausible=_is_plausible(fit, effect, dataset) and _keeps_inertia(base, fit),
        beats_decoys=gain.t < RULE.least_t and _beats_decoys(base, candidate, dataset),
    )


def _beats_decoys(base: Fit, candidate: Candidate, dataset: Dataset) -> bool:
    """Whether a held-out gain that is uneven over the blocks is the effect's own.

    Where much else is left, blocks differ by that; a few may hold most of it, so that the whole
    error hardly falls although that of a typical block does.
    """
    if not (candidate.gain.t > 0.0 and candidate.gain.after < candidate.gain.before):
        return False
    fitted = candidate.fit.axis[candidate.effect.name]
    beside = proof(base, fitted, dataset, candidate.gain if dataset.holdout else None)
    if beside is None:
        return _is_clear(candidate)
    return beside.holds


def _is_clear(candidate: Candidate) -> bool:
    """Whether a friction, which has no decoys, leaves clearly less of the held-out square."""
    gain, rubs = candidate.gain, candidate.effect.kind is Kind.FRICTION
    clearly = gain.left < RULE.beside_decoys
    return bool(rubs and gain.t > RULE.friction_t and clearly)


def _keeps_inertia(base: Fit, fit: Fit) -> bool:
    """Whether an effect leaves the moved mass about what the base found, or began with.

    In a motion that repeats in time, a sine in time can hold the force of the inertia. Without the
    effect, as a motor's saturation, the base may have found a mass that is none.
    """
    after = fit.axis.mass
    return any(
        max(mass, after) <= MOST_INERTIA * min(mass, after)
        for mass in (base.axis.mass, base.begun.mass)
    )


def _is_plausible(fit: Fit, effect: Effect, dataset: Dataset) -> bool:
    """Whether the values that an effect was fitted with are its own; see Candidate."""
    found = [f for f in fit.axis.effects if f.effect.name == effect.name]
    scales = [
        (f.values[p.name], p)
        for f in found
        for p in effect.parameters
        if 0.0 < p.lower < p.upper and p.name not in f.fixed
    ]
    if any(v <= p.lower * (1.0 + EDGE) or v >= p.upper * (1.0 - EDGE) for v, p in scales):
        return False
    itself = effect.is_itself
    if itself and not all(itself(f.values, dataset.excitation) for f in found):
        return False
    periods = [f.values[p.name] for f in found for p in effect.parameters if p.period]
    if not periods:
        return True
    travel = np.ptp(np.concatenate([log.motion.position for log in fit.logs]))
    return bool(travel > RULE.fewest_cycles * max(periods))


def _score_noise(fit: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """Evidence for an effect that is noise, over the floor that readings without it would have.

    It counts where it makes a good part of the error on all logs that choose, and no more than it.
    """
    logs = (*dataset.fit, *dataset.holdout)
    error = error_on(fit.axis, logs)
    less, floor = unrounded_floor_of(fit.axis, logs), floor_of(fit.axis, logs)
    part = (floor**2 - less**2) / rms(error) ** 2
    explained = part > RULE.least_part and floor < RULE.at_floor * rms(error)
    gain = noise_gain(error, less, floor) if explained else 0.0
    samples = effective_samples(error)
    return Candidate(
        effect=effect,
        axis=dataset.axis,
        fit=fit,
        evidence=Evidence(gain, 1, samples),
        gain=Gain(rms(error), rms(error), float(np.sqrt(max(samples * gain, 0.0)))),
    )


def _cross_validated(fit: Fit, rows: NDArray[np.bool_]) -> Array:
    columns = fit.jacobian[rows]
    return left_out(fit.residual[rows], columns, RIDGE * np.linalg.norm(columns, axis=0))


def on_equal_samples(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates with at most the effective sample size of the one that explains most.

    Each residual has its own colour, and evidence on different sample sizes is not comparable.
    """
    if not candidates:
        return []
    most = max(candidates, key=lambda c: c.evidence.log_gain).evidence.samples
    return [
        replace(c, evidence=replace(c.evidence, samples=min(c.evidence.samples, most)))
        for c in candidates
    ]
