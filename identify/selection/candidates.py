"""One effect as a candidate: scan its shape, refit the model with it, score it against the base."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.drive import forces_lessened, is_noise
from identify.dataset.noise_floor import floor_of, unrounded_floor_of
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.decision import RULE
from identify.estimation.evidence import (
    Evidence,
    Gain,
    effective_samples,
    evidence,
    held_out_gain,
    left_out,
    noise_gain,
)
from identify.estimation.fit import Fit, Outcome, error_on, finished, fit_axis, rms
from identify.estimation.force_balance import residual
from identify.estimation.time_origin import phases_found
from identify.estimation.variable_projection import Start, fit_thoroughly, one_linear_step, starts
from identify.selection.decoys import proof
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, MachineModel

Array = NDArray[np.float64]

FIRST_EVALUATIONS = 12  # of a refit, after which it must show some evidence to go on
HEAD_EVALUATIONS = 12  # of a friction fitted on the heads of the logs
EDGE = 1e-3  # relative distance from a bound at which a value ended there
RIDGE = 1e-4  # keeps cross-validation finite for parameters that the motion does not excite


@dataclass(frozen=True, eq=False, repr=False)
class Candidate:
    """A model with one effect more: its refit, evidence and held-out gain.

    plausible: whether the axis travels far enough for what repeats along the track to be seen to,
    as one cycle over all of the travel is any smooth force of position; and no time, length or
    frequency of the law ended at its bound, beyond which it is another law. beats_decoys: whether
    it was set against them, and held.
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
    def is_noise(self) -> bool:
        """Whether the effect lowers no error but raises the noise floor."""
        return is_noise(self.effect)


def absent_effects(axis: AxisModel, catalogue: Catalogue) -> list[Effect]:
    """Effects that could be added to the axis; another friction replaces the present one."""
    has_friction = any(f.effect.kind is Kind.FRICTION for f in axis.effects)
    return [
        e
        for e in catalogue.after(axis.names)
        if axis.can_have(e)
        and (e.kind is not Kind.MODIFIER or has_friction)
        and not e.is_nonparametric
    ]


def usable(catalogue: Catalogue, model: MachineModel) -> Catalogue:
    """The effects of a catalogue that a machine with as many axes can have."""
    return Catalogue([e for e in catalogue.values() if model.can_use(e)])


@dataclass(frozen=True, eq=False)
class Look:
    """What a cheap estimate tells of an effect: its starts, best first, or the candidate it is.

    share: part of the base's squared error that one linear step takes; None for a friction, which
    no linear step can put in the place of another. candidate: None where a refit is promising.
    """

    effect: Effect
    starts: tuple[Start, ...]
    share: float | None
    candidate: Candidate | None


def try_effect(base: Fit, dataset: Dataset, effect: Effect) -> Candidate:
    """Refit the model together with the effect and score it against the base.

    Where a look at it is far from any evidence, that is scored and no refit is made.
    """
    look = look_at(base, dataset, effect)
    return look.candidate or refitted(base, dataset, look)


def look_at(base: Fit, dataset: Dataset, effect: Effect) -> Look:
    """One linear step beside the base; for a friction a fit to the heads of the logs."""
    found = tuple(starts(base, dataset, effect))
    best, share = found[0], None
    fit: Fit | None = None
    if is_noise(effect):
        axis = base.axis.with_effect(best.fitted)
        fit = finished(axis, base.begun, dataset.fit, base.outcome)
    elif effect.kind is Kind.FRICTION:
        fit, best = _fitted_to_heads(base, dataset, found)
        found = (best, *(s for s in found if s is not best))
    else:
        share = 1.0 - best.squared_error / max(float(base.residual @ base.residual), 1e-300)
        fit = None if _promising(base, best) else one_linear_step(base, best)
    candidate = None if fit is None else score(base, fit, dataset, effect)
    return Look(effect, found, share, candidate)


def as_looked(base: Fit, dataset: Dataset, look: Look) -> Candidate:
    """The candidate as its linear step predicts it, without a refit."""
    return score(base, one_linear_step(base, look.starts[0]), dataset, look.effect)


def refitted(base: Fit, dataset: Dataset, look: Look) -> Candidate:
    """The candidate with all parameters fitted, from where the look ended."""
    effect, (best, *others) = look.effect, look.starts
    fit = fit_axis(base.axis.with_effect(best.fitted), dataset.fit, FIRST_EVALUATIONS)
    first = score(base, fit, dataset, effect)
    if first.delta_bic < 0.0:
        return first
    if fit.outcome is Outcome.NOT_CONVERGED:
        fit = fit_axis(fit.axis, dataset.fit)
    fit = simplified(fit, dataset, effect)
    first = first if fit is first.fit else score(base, fit, dataset, effect)
    if first.fit.at_floor or first.delta_bic < RULE.least_bic:
        return first
    # It helps but does not explain everything. The effect was missing when the base was fitted,
    # which distorts its values, so the fit also starts from where the base started.
    fits = [first.fit, fit_axis(base.begun.with_effect(best.fitted), dataset.fit)]
    fits += [fit_axis(base.axis.with_effect(other.fitted), dataset.fit) for other in others]
    best_fit = min(fits, key=lambda f: f.error)
    if not best_fit.at_floor:
        best_fit = fit_thoroughly(best_fit.axis, dataset)
    return score(base, simplified(best_fit, dataset, effect), dataset, effect)


def _promising(base: Fit, start: Start) -> bool:
    """Whether the gain of the linear step is large enough that a refit may give evidence."""
    free = len(start.fitted.effect.parameters) - len(start.fitted.fixed)
    asked = RULE.least_bic + free * np.log(base.samples)
    return bool(start.gain(base) > RULE.promise * asked)


def _fitted_to_heads(
    base: Fit, dataset: Dataset, found: Sequence[Start]
) -> tuple[Fit | None, Start]:
    """Another friction fitted to the heads, if it is no better there than the present one.

    And the start that led furthest.
    """
    if sum(map(len, dataset.heads)) > 0.5 * sum(map(len, dataset.fit)):
        return None, found[0]
    old = _on_heads(base, dataset)
    fits = [
        fit_axis(base.axis.with_effect(s.fitted), dataset.heads, HEAD_EVALUATIONS) for s in found
    ]
    new, start = min(zip(fits, found, strict=True), key=lambda pair: pair[0].error)
    either = moving(dataset.heads, sticks(old.axis) or sticks(new.axis))
    before, after = (residual(f.axis, dataset.heads)[either] for f in (old, new))
    gain = effective_samples(before) * evidence(before, after, 1).log_gain
    if gain > RULE.promise * RULE.least_bic:
        return None, start
    return finished(new.axis, base.begun, dataset.fit, new.outcome), start


@lru_cache(maxsize=1)  # every friction is compared with the same base
def _on_heads(base: Fit, dataset: Dataset) -> Fit:
    return fit_axis(base.axis, dataset.heads)


def simplified(fit: Fit, dataset: Dataset, effect: Effect) -> Fit:
    """The fit with the simplest values of the effect, where they explain as much."""
    if effect.simplest is None:
        return fit
    fitted = fit.axis[effect.name]
    simple = effect.simplest(fitted.values)
    if simple == dict(fitted.values):
        return fit
    again = fit_axis(fit.axis.with_effect(replace(fitted, values=simple)), dataset.fit)
    return again if again.error < RULE.same_error * fit.error else fit


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
    if dataset.holdout:
        held = moving(dataset.holdout, sticks(base.axis) or sticks(fit.axis))
        motions = [log.motion for log in dataset.holdout]  # it may differ from the fit logs
        pair = [
            residual(f.axis, dataset.holdout)[held] / forces_lessened(f.axis, motions)
            for f in (base, fit)
        ]
    elif found.delta_bic > RULE.least_bic:
        pair = both(lambda f: _cross_validated(f, shared[f.kept]))
    else:  # not supported, whatever cross-validation would give
        pair = [before, after]
    gain = held_out_gain(pair[0], pair[1], base.floor)
    candidate = Candidate(effect, dataset.axis, fit, found, gain)
    if found.delta_bic < RULE.least_bic:
        return candidate
    return replace(
        candidate,
        plausible=_is_plausible(fit, effect, dataset),
        beats_decoys=gain.t < RULE.least_t and _beats_decoys(base, candidate, dataset),
    )


def _beats_decoys(base: Fit, candidate: Candidate, dataset: Dataset) -> bool:
    """Whether a held-out gain that is large, but uneven over the blocks, is the effect's own.

    Where much else is left, blocks differ by that.
    """
    gain = candidate.gain
    if gain.after**2 > RULE.beside_decoys * gain.before**2:
        return False
    name = candidate.effect.name
    beside = proof(base, candidate.fit.axis[name], dataset)
    return beside is not None and beside.holds


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
