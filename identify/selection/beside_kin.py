"""What modifies a friction, beside another one in its place.

Laws of presliding are much alike, and while something that modifies the friction is missing, the
one leads that imitates it best: an asymmetric Dahl friction looks like Leuven's, or like layers
beside a dry friction, which then hide the asymmetry. What adds a force of its own is seen beside
any of them. So where nothing else is accepted, every other friction that remembers its path is put
in the place of what was found of it, with one linear step of each modifier; the one that promises
most is fitted beside it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.estimation.variable_projection import absent_effects
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.changes import Added, Screening, from_all_starts
from identify.selection.controls import ControlTest
from identify.selection.trying import Beside, Tried, judged_change, refitted_on
from twin.effect import Effect, Kind
from twin.model.machine import AxisModel, Fitted
from twin.parallel import Progress, spread


@dataclass(frozen=True, eq=False)
class FrictionPair:
    """Another friction, and what modifies it."""

    friction: Tried
    modifier: Tried


@dataclass(frozen=True, eq=False)
class _Promised:
    """A modifier beside another friction, screened."""

    friction: Effect
    there: Judged
    screening: Screening

    @property
    def may_leave(self) -> float:
        """What a refit may leave at least, N RMS: it takes more than one linear step shows.

        The floor beside a law that is wrong tells nothing of that beside the right one.
        """
        takes = min(self.screening.promise / RULE.promise, 1.0)
        return float(self.there.fit.error * np.sqrt(1.0 - max(takes, 0.0)))


def pairs_beside(judged: Judged, trial: Beside, progress: Progress) -> list[FrictionPair]:
    """The pairs that may leave less than a fit does, refitted, the best first.

    Of those whose modifier is accepted beside its friction. None of a joint beside its bodies: what
    these leave is in each of its joints.
    """
    bare, present = judged.fit.axis, judged.fit.axis.friction
    if present is None or judged.at_floor or judged.dataset.beside_bodies:
        return []
    forces = (f.effect for f in bare.effects if f.effect.kind is Kind.FORCE)
    for layers in (e for e in forces if e.remembers and e.name in trial.taken):
        bare = bare.without(layers.name)
    every = absent_effects(judged.fit.axis, trial.catalogue)
    kin = (e for e in every if e.kind is Kind.FRICTION and e.remembers)
    frictions = [e for e in kin if e.name not in trial.barred]
    beside = spread(
        lambda effect: [*_promised(judged, bare, effect, trial)],
        frictions,
        partial(progress, "another friction, and what modifies it"),
    )
    among = max(sum(map(len, beside)), 1)
    best = [max(each, key=lambda p: p.screening.promise) for each in beside if each]
    pairs = [_fitted(judged, p, among) for p in best if p.may_leave < judged.fit.error]
    proved = [p for p in pairs if p.modifier.candidate.supported]
    return sorted(proved, key=lambda p: p.modifier.judged.fit.error)


def _promised(
    judged: Judged, bare: AxisModel, friction: Effect, trial: Beside
) -> Iterator[_Promised]:
    """What each absent modifier promises beside another friction."""
    assert bare.friction is not None
    law = as_free_as(bare.friction, Fitted.at_start(friction))
    there = refitted_on(bare.with_effect(law), judged)
    controls = ControlTest.beside(there)
    for effect in trial.absent(judged):
        if effect.kind is Kind.MODIFIER:
            yield _Promised(friction, there, Added(effect).screen(there, controls))


def _fitted(judged: Judged, promised: _Promised, among: int) -> FrictionPair:
    """A pair refitted: the friction judged beside what was found, the modifier beside it."""
    there, screening = promised.there, promised.screening
    fit = screening.change.refit(there, screening)
    fit = fit if fit.at_floor else from_all_starts(there, screening, fit)
    alone = Screening(Added(promised.friction), 0.0, (there.fit.axis,))
    return FrictionPair(
        judged_change(judged, alone, there.fit, among),
        judged_change(there, screening, fit, among),
    )


def as_free_as(other: Fitted, law: Fitted) -> Fitted:
    """A law with the values of another, and as free, where both have a parameter of that name."""
    free = {n: v for n, v in other.values.items() if n in law.values and n not in other.fixed}
    return replace(law, values={**law.values, **free}, fixed=law.fixed.difference(free))
