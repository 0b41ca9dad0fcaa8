"""Ties: changes that explain the logs as well as one that was found, beside all else that was.

When a search compared an early change with its rivals, the later ones were still missing. So they
are compared again at its end: every one that was level with it or came near, and of a friction, a
resonance or a delay all others of the catalogue, whatever their own fits ended in. A rival is one
that was fitted in its place, whose values can be its own there, and that takes a part of what is
left without.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from identify.dataset.dataset import Dataset
from identify.estimation.fit import fit_axis, fit_roughly
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.beside_kin import as_free_as
from identify.selection.candidates import candidate_of, doubt
from identify.selection.changes import Added, Screening
from identify.selection.search import Found, Step, is_tied, replaced, simplest
from identify.selection.trying import Tried, fitted_anew, parameters, refitted_on
from twin.effect import Effect, Kind
from twin.model.machine import AxisModel, Fitted

ALIKE = (Kind.FRICTION, Kind.STRUCTURE)  # whose values of one name mean the same in each


def with_ties(found: Found) -> Found:
    """What a search found, with the rivals of each change as they are beside all that was found.

    Where the logs ask for a rival rather than for what was found, it takes its place.
    """
    for step in found.steps:
        there = any(s is step for s in found.steps)  # it may have gone with a law that was replaced
        if there and _rivals(step, found):
            found = _compared_again(step, found)
    return found


@dataclass(frozen=True, eq=False)
class _Beside:
    """Logs as the final model leaves them, with a change that was found and without it."""

    own: Tried
    without: Judged


def _beside(own: Tried, without: AxisModel, dataset: Dataset) -> _Beside:
    final = own.judged
    if dataset is not final.dataset:
        final = refitted_on(final.fit.axis, replace(final, dataset=dataset))
    return _Beside(replace(own, judged=final), refitted_on(without, final))


def _compared_again(step: Step, found: Found) -> Found:
    final, taken = found.final, {s.change.name for s in found.steps}
    axis, dataset = step.change.undone(final.fit.axis, found.base.fit.axis), final.dataset
    if axis is None:
        return _with_step(found, step, replace(step, tied=()), final)
    own = replace(step.tried, judged=final)
    first, is_long = _beside(own, axis, dataset.part), dataset.part is not dataset
    rivals = [t for t in _rivals(step, found) if t.change.name not in taken]
    begun = [(t, list(_begun(t, first) if is_long else _starts(t, first))) for t in rivals]
    whole = _beside(own, axis, dataset) if is_long and any(axes for _, axes in begun) else first
    fitted = (_in_its_place(t, axes, whole) for t, axes in begun)
    tied = [t for t in fitted if t is not None]
    # Another shape of a law cannot lead, as it can imitate any that may be missing; nor does
    # what was found where its values cannot be its own and those of a rival can, nor what was
    # doubted: it would be doubted again, without an end.
    added = (t for t in tied if isinstance(t.change, Added))
    leading = [t for t in added if t.change.name not in found.barred]
    is_own = not tied or not doubt(
        whole.without, final.fit, own.change.effect, parameters(own.change)
    )
    leader = simplest([own, *leading] if is_own or not leading else leading)
    others = tuple(t for t in ((own, *tied) if is_own else tied) if t is not leader)
    if leader is own:
        return _with_step(found, step, replace(step, tied=others), final)
    anew = fitted_anew(leader.judged)
    if not doubt(whole.without, anew.fit, leader.change.effect, parameters(leader.change)):
        leader = replace(leader, judged=anew)
    led = _with_step(found, step, replace(step, tried=leader, tied=others), leader.judged)
    return _less_replaced(step.change.name, led)


def _starts(rival: Tried, beside: _Beside) -> Iterator[AxisModel]:
    """Axes to fit a rival from in the place of what was found; a curve has its own values."""
    axis = beside.without.fit.axis
    if isinstance(rival.change, Added):
        yield from (axis.with_effect(law) for law in _values_of(rival, beside.own))
    elif rival.change.name in axis.names:
        yield axis


def _begun(rival: Tried, first: _Beside) -> Iterator[AxisModel]:
    """Of long logs, whose beginnings are ``first``, the same where they leave the rival level."""
    for axis in _starts(rival, first):
        if not isinstance(rival.change, Added):
            if _curve(rival, first):
                yield axis
            continue
        there = refitted_on(axis, first.without)
        if is_tied(replace(rival, judged=there), first.own):
            yield there.fit.axis


def _rivals(step: Step, found: Found) -> list[Tried]:
    """What may be level with a step beside all that was found since; each law once."""
    near = (t for t in step.kin if isinstance(t.change, Added))
    every = (*_others_alike(step, found), *near, *step.tied)
    return [*{t.change.name: t for t in every if t.change.name != step.change.name}.values()]


def _less_replaced(name: str, found: Found) -> Found:
    """What was found without other changes of a law that has gone: they were no other law's.

    And of a friction that has gone with it, as a friction takes the place of any other.
    """
    axis = found.final.fit.axis
    others = replaced(axis, found.steps)
    gone = [s for s in found.steps if s.change.name == name or s in others]
    for step in reversed(gone):
        axis = step.change.undone(axis, found.base.fit.axis) or axis
    final = found.final if axis is found.final.fit.axis else refitted_on(axis, found.final)
    return replace(found, steps=tuple(s for s in found.steps if s not in gone), final=final)


def _with_step(found: Found, old: Step, new: Step, final: Judged) -> Found:
    steps = tuple(new if s is old else s for s in found.steps)
    return replace(found, steps=steps, final=final)


def _in_its_place(rival: Tried, begun: Sequence[AxisModel], beside: _Beside) -> Tried | None:
    """A rival fitted in the place of what was found; None where it is none."""
    if isinstance(rival.change, Added):
        return next((t for axis in begun if (t := _level(axis, rival, beside))), None)
    return _curve(rival, beside) if begun else None


def _curve(rival: Tried, beside: _Beside) -> Tried | None:
    """Another shape of a law, fitted beside all that was found; None where it is not level."""
    without = beside.without
    fit = replace(rival.change.refit(without, rival.screening), begun=without.fit.begun)
    again = replace(rival, judged=Judged(fit, without.dataset))
    return again if is_tied(again, beside.own) else None


def _values_of(rival: Tried, own: Tried) -> Iterator[Fitted]:
    """The values to fit a rival from: its own, if it was refitted, and those of what was found."""
    law = rival.judged.fit.axis[rival.change.name]
    if rival.candidate.score or law.effect.delays:
        yield law
    if law.effect.kind in ALIKE:  # whose values were those of another model
        yield as_free_as(own.judged.fit.axis[own.change.name], law)


def _level(axis: AxisModel, rival: Tried, beside: _Beside) -> Tried | None:
    """A rival that is level with what was found, as this axis begins its fit; None if it is not."""
    own, without = beside.own, beside.without
    dataset, effect = without.dataset, rival.change.effect
    rough = fit_roughly(axis, dataset.training)  # a better fit is no less level
    for fit in (lambda: rough, lambda: fit_axis(rough.axis, dataset.training)):
        judged = Judged(replace(fit(), begun=without.fit.begun), dataset)
        if is_tied(replace(rival, judged=judged), own):
            candidate = candidate_of(without, judged, effect, parameters(rival.change))
            if not candidate.doubt and candidate.part >= RULE.least_part:
                return replace(rival, judged=judged, candidate=candidate)
    return None


def _others_alike(step: Step, found: Found) -> list[Tried]:
    """All others of the catalogue that are alike, where a law was added."""
    own = step.change.effect
    if not isinstance(step.change, Added):
        return []
    rivals = [c for c in found.ranking if _are_alike(c.effect, own) and not c.doubt]
    changes = [Added(c.effect) for c in rivals]
    return [
        Tried(change, Screening(change, 0.0), Judged(c.fit, found.dataset), c)
        for change, c in zip(changes, rivals, strict=True)
    ]


def _are_alike(one: Effect, other: Effect) -> bool:
    """Whether two laws are both late, or frictions or resonances with a parameter in common."""
    names = [{p.name for p in e.parameters if not p.strength} for e in (one, other)]
    same = one.kind is other.kind and one.kind in ALIKE and bool(names[0] & names[1])
    return same or (one.delays and other.delays)
