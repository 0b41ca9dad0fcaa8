"""A free curve in the place of a law competes with absent effects in the same selection.

Where a law that is there has another shape than the machine's force, what it leaves hides other
effects, or is taken for one. Where its free curve leaves clearly less of the held-out logs than the
best absent effect, the selection goes on beside the curve. The curves of friction hold those of
what modifies friction too, and must leave less by every measure.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.decision import RULE
from identify.estimation.errors import Errors, error_in, gain_held_out
from identify.estimation.fit import Fit
from identify.selection.bends import bent, held_bends, is_needed
from identify.selection.nonparametric import fit_in_place
from identify.selection.ranking import less
from identify.selection.scoring import Candidate, score
from identify.selection.unpredictable import is_unpredictable
from identify.selection.wrong_shape import WrongShape, wrong_shapes

MOST_TRIED = 3  # effects beside which a curve is sought
MOST_CURVES = 3  # on one axis
BY_REFIT = 0.3  # of the squared error that a curve's linear step leaves, a refit leaves at least


@dataclass(frozen=True, eq=False)
class Reshaped:
    """A law's free curve, the fit beside which it was found, and the fit with it.

    tied: absent effects that explain about as much, with values that are hardly their own, such as
    an end stop as soft as a cable.
    """

    shape: WrongShape
    before: Fit
    fit: Fit
    tied: tuple[str, ...] = ()


def curve_in_place(
    fit: Fit, dataset: Dataset, ranking: Sequence[Candidate], given: Collection[str]
) -> Reshaped | None:
    """The free curve that the selection should go on beside; None where there is none.

    Also where what the fit leaves may be noise, or it has as many as MOST_CURVES. given: names of
    the effects that the model had before the selection. The law of one that it added is asked about
    where no other is supported: a curve over one pitch can hold the force of many.
    """
    curves = [f for f in fit.axis.effects if f.effect.free_shape]
    if fit.may_be_noise or len(curves) >= MOST_CURVES:
        return None
    alone = _reshaped(fit, dataset, ranking)
    if alone and alone.shape.effect not in given and any(c.supported for c in ranking):
        return None
    if alone:
        return replace(alone, tied=_level(alone, dataset, ranking))
    if any(c.supported for c in ranking) or is_unpredictable(fit, dataset):
        return None
    return _beside_an_effect(fit, dataset, ranking)


def _reshaped(fit: Fit, dataset: Dataset, ranking: Sequence[Candidate]) -> Reshaped | None:
    """The free curve that does clearly better than each absent effect; None where none does.

    That which takes most, by what bends the law's own curve where the law has such a parameter; the
    next where that is of a friction that does not do clearly better.
    """
    rivals = [c for c in ranking if c.supported]
    for shape in wrong_shapes(fit, dataset):
        if by_bend := _bent(shape, fit, dataset, rivals):
            return by_bend
        by_curve = _in_place(shape, fit, dataset, rivals)
        if by_curve or not shape.shape.curve.rubs:
            return by_curve
    return None


def bent_in_place(
    fit: Fit, dataset: Dataset, ranking: Sequence[Candidate], given: Collection[str]
) -> Fit | None:
    """The fit with the law of an added effect bent; None where the data do not ask for it.

    given: names of the effects that the model had before the selection.
    """
    rivals = [c for c in ranking if c.supported]
    for law in fit.axis.effects:
        for bend in held_bends(law) if law.effect.name not in given else ():
            tried = bent(fit, dataset, law, bend)
            if is_needed(tried, fit) and _is_better(tried, rivals):
                return tried.fit
    return None


def _in_place(
    shape: WrongShape, fit: Fit, dataset: Dataset, rivals: Sequence[Candidate]
) -> Reshaped | None:
    """A law with its free curve, where that does clearly better."""
    whole, typical = _least_left(rivals)
    least = BY_REFIT * (1.0 - max(shape.taken, shape.proof.gain))
    if least * error_in(dataset.chosen_on, fit, dataset) ** 2 > whole and least > typical:
        return None
    curve = fit_in_place(fit, dataset, shape.shape)
    better = _is_clearly_better if shape.shape.curve.rubs else _is_better
    if not (better(curve, rivals) and better(curve, _bent_rivals(rivals, fit, dataset))):
        return None
    return Reshaped(shape, fit, curve.fit)


def _bent_rivals(rivals: Sequence[Candidate], fit: Fit, dataset: Dataset) -> list[Candidate]:
    """The rivals whose laws can be bent, as they are with what bends them free."""
    laws = [(c, c.fit.axis[c.effect.name]) for c in rivals]
    every = [bent(c.fit, dataset, law, bend) for c, law in laws for bend in held_bends(law)]
    return [score(fit, c.fit, dataset, c.effect) for c in every]


def _bent(
    shape: WrongShape, fit: Fit, dataset: Dataset, rivals: Sequence[Candidate]
) -> Reshaped | None:
    """A law with what bends its own curve free, where that does clearly better."""
    bend = shape.shape.curve.bent_by
    if bend is None or bend not in held_bends(law := fit.axis[shape.effect]):
        return None
    curve = bent(fit, dataset, law, bend)
    return (
        Reshaped(shape, fit, curve.fit) if curve.supported and _is_better(curve, rivals) else None
    )


def _is_clearly_better(curve: Candidate, rivals: Sequence[Candidate]) -> bool:
    """Whether a curve leaves clearly less than each rival of the whole and of a typical block.

    The curves of a friction hold those of other frictions, and of what modifies it.
    """
    gain, (whole, typical) = curve.gain, _least_left(rivals)
    less_of_all = gain.after**2 <= RULE.beside_decoys * whole
    return less_of_all and gain.typical <= RULE.beside_decoys * typical


def _is_better(curve: Candidate, rivals: Sequence[Candidate]) -> bool:
    """Whether a curve leaves clearly less than each rival.

    Less of the whole squared test error; or of that of a typical block, and no more on the fit
    logs: a force at a few places of the test logs decides their whole error alone. Or no more of
    either, where the fit logs part them.
    """
    gain, (whole, typical) = curve.gain, _least_left(rivals)
    if gain.after**2 <= RULE.beside_decoys * whole:
        return True
    if gain.typical <= RULE.beside_decoys * typical:
        return all(curve.fit.error <= c.fit.error for c in rivals)
    parted = all(curve.evidence.over(c.evidence) > RULE.least_separation for c in rivals)
    return parted and gain.after**2 <= whole and gain.typical <= typical


def _level(found: Reshaped, dataset: Dataset, ranking: Sequence[Candidate]) -> tuple[str, ...]:
    """The candidates that would leave about as little as a curve, were their values their own.

    Not those of which too few cycles are seen: they are any force of position by another name.
    """
    gain = gain_held_out(found.before, found.fit, dataset)
    if gain is None:
        return ()

    def is_level(c: Candidate) -> bool:
        as_little = RULE.near * c.gain.after**2 <= gain.after**2
        return as_little or RULE.near * c.gain.typical <= gain.typical

    hardly = [c for c in ranking if c.effect.is_itself and not c.plausible]
    proven = [c for c in hardly if replace(c, plausible=True).supported]
    return tuple(c.effect.name for c in proven if is_level(c))


def _least_left(rivals: Sequence[Candidate]) -> tuple[float, float]:
    """What the best leaves of the squared test error, N^2, and of a typical block's, as a part."""
    whole = min((c.gain.after**2 for c in rivals), default=np.inf)
    return whole, min((c.gain.typical for c in rivals), default=np.inf)


def _beside_an_effect(fit: Fit, dataset: Dataset, ranking: Sequence[Candidate]) -> Reshaped | None:
    """The free curve that a fit needs together with an absent effect; its fit is without that.

    Each distorts what the other leaves, so that neither has evidence alone: what a shape of force
    leaves is smooth, and a smooth residual has few effective samples. An effect counts by what it
    takes of the test error; that with most evidence is asked about, little as it may be. Both
    together must take nearly all; or a good part, where the effect has every support beside the
    curve.
    """
    plausible = [c for c in ranking if c.plausible]
    by_gain = sorted(filter(_may_help, plausible), key=lambda c: c.gain.left)[:MOST_TRIED]
    by_evidence = sorted(plausible, key=lambda c: -c.delta_bic)[:1]
    for candidate in (*by_gain, *(c for c in by_evidence if c not in by_gain)):
        found = _reshaped(candidate.fit, dataset, ())
        if found is None or found.shape.effect == candidate.effect.name:
            continue
        lessened = _lessened(fit, found.fit, dataset)
        if lessened < RULE.least_part:
            continue
        without = less(candidate.effect, found.fit, fit, dataset)
        all_of_it = lessened > RULE.nearly_all
        if all_of_it or score(without, found.fit, dataset, candidate.effect).supported:
            return Reshaped(found.shape, candidate.fit, without)
    return None


def _may_help(candidate: Candidate) -> bool:
    """Whether an effect has evidence, or clearly lowers the test error without it."""
    gain = candidate.gain
    return candidate.delta_bic > RULE.least_bic or (gain.falls and gain.t > RULE.least_t)


def _lessened(before: Fit, after: Fit, dataset: Dataset) -> float:
    """Part of the squared test error above the noise floor that is gone, at most 1.

    Of the whole, or of a typical block's where that is more: a few places that the fit logs hardly
    reach can hold nearly all of the whole.
    """
    chosen = Errors.of(before, after, dataset, dataset.chosen_on)
    above = chosen.before**2 - before.floor**2
    whole = 1.0 - (chosen.after**2 - after.floor**2) / above if above > 0.0 else 0.0
    gain = gain_held_out(before, after, dataset)
    return whole if gain is None else max(whole, 1.0 - gain.typical)
