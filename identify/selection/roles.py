"""What only the choice of the logs' roles decides.

A law is fitted to the training logs and judged by the selection logs. Which of like logs does which
is the user's choice, and no property of the machine. So it is asked again with other logs choosing
in turn: of each law that was found whether it is still proved. What is proved only then, the search
has noted at its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from identify.rules import RULE
from identify.selection.acceptance import Judged, Score, least_t, proved_in_turn, score
from identify.selection.changes import control
from identify.selection.findings import Finding
from identify.selection.search import Found
from identify.selection.trying import refitted_on
from twin.record import Number, record


@record
class RoleDependent:
    """A law that is proved or not by which log chooses."""

    effect: str
    named: bool
    """Whether it is proved as the roles are; else it is where other logs choose."""
    part: Number
    """Of the score that does not prove it, or hardly, as t and control are."""
    t: Number
    control: Number = 0.0
    """The part that it takes by chance, shifted in time."""


def role_dependent(found: Found, findings: Sequence[Finding]) -> tuple[RoleDependent, ...]:
    """The laws on which the answer depends by the roles of the logs; none without selection logs.

    Of long logs their beginnings tell it.
    """
    turns = found.dataset.part.exchanged
    if not turns or (found.final.at_floor and not findings):
        return ()
    finals = _in_turn(found)
    return (*_lost(found, findings, finals), *_unsure(findings), *_gained(found))


def with_turns(found: Found, findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Findings, with those marked that all other logs prove in turn where these are unsure.

    All logs testify: which of them chooses is no property of the machine.
    """
    asked = [f for f in findings if not f.doubt and f.refused]
    finals = _in_turn(found) if asked else []
    turns = {f.effect: proved_in_turn(_scores(found, f, finals)) for f in asked}
    return tuple(
        replace(f, score=replace(f.score, in_turn=in_turn))
        if (in_turn := turns.get(f.effect))
        else f
        for f in findings
    )


def _in_turn(found: Found) -> list[Judged]:
    """All that was found, fitted where other logs choose; of long logs by their beginnings."""
    axis, fit = found.final.fit.axis, found.final.fit
    return [refitted_on(axis, Judged(fit, dataset)) for dataset in found.dataset.part.exchanged]


def with_exchanged(
    findings: Sequence[Finding], laws: Sequence[RoleDependent]
) -> tuple[Finding, ...]:
    """Findings with what they take where exchanged roles do not prove them."""
    lost = {law.effect: (law.part, law.t) for law in laws if law.named}
    return tuple(replace(f, exchanged=lost.get(f.effect)) for f in findings)


def _lost(
    found: Found, findings: Sequence[Finding], finals: Sequence[Judged]
) -> Iterator[RoleDependent]:
    """Of the findings those that are not surely proved where other logs choose."""
    for finding in findings:
        if refused := [s for s in _scores(found, finding, finals) if not _surely(s)]:
            worst = min(refused, key=lambda s: s.t)
            yield RoleDependent(finding.effect, True, worst.part, worst.t, worst.control)


def _scores(found: Found, finding: Finding, finals: Sequence[Judged]) -> list[Score]:
    """Of a law beside all others where other logs choose; none of noise, which lowers no error.

    One whose force a curve makes that was found later takes nothing: another order, which finds the
    curve first, does not find it.
    """
    base = found.base.fit.axis
    steps = [s for s in found.steps if s.change.name == finding.effect]
    if any(s.tried.candidate.is_noise for s in steps):
        return []
    scores = []
    for final in finals:
        axis = final.fit.axis
        for step in reversed(steps):
            axis = step.change.undone(axis, base) or axis
        without = refitted_on(axis, final)
        there = score(without, final)
        taken = control(steps[0].change, without, final) if there.accepted else 0.0
        scores.append(replace(there, control=taken))
    return scores


def _unsure(findings: Sequence[Finding]) -> Iterator[RoleDependent]:
    """Of the findings those that other logs alone prove, choosing in turn."""
    for f in findings:
        if f.score.in_turn:
            groups = f.score.training, f.score.other
            part, t = (min(some) for some in zip(*((g.part, g.t) for g in groups), strict=True))
            yield RoleDependent(f.effect, False, part, t, f.score.control)


def _gained(found: Found) -> Iterator[RoleDependent]:
    """Of the laws that are proved with the roles exchanged those that are not as they are."""
    for tried in found.exchanged:
        own = tried.candidate.score
        if own is not None and not own.accepted:
            yield RoleDependent(tried.change.name, False, own.part, own.t, own.control)


def _surely(there: Score) -> bool:
    """Whether it still is where it is fitted a little otherwise, as another order would fit it."""
    # a t has a spread of one; parts of like logs are often half as much again, and as often less
    clear = there.t >= least_t(1) + 1.0 and there.part >= 1.5 * RULE.least_part
    return clear and there.accepted
