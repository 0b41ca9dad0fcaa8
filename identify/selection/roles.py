"""What only the choice of the logs' roles decides.

A law is fitted to the training logs and judged by the selection logs. Which of like logs does which
is the user's choice, and no property of the machine. So it is asked again with other logs choosing
in turn: of each law that was found whether it is still proved. What is proved only then, the search
has noted at its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from identify.selection.acceptance import Judged, Score, score
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
    """Of the score that refuses it, as t is."""
    t: Number


def role_dependent(found: Found, findings: Sequence[Finding]) -> tuple[RoleDependent, ...]:
    """The laws on which the answer depends by the roles of the logs; none without selection logs.

    Of long logs their beginnings tell it.
    """
    turns = found.dataset.part.exchanged
    if not turns or (found.final.at_floor and not findings):
        return ()
    axis = found.final.fit.axis
    finals = [refitted_on(axis, Judged(found.final.fit, dataset)) for dataset in turns]
    return (*_lost(found, findings, finals), *_gained(found))


def with_exchanged(
    findings: Sequence[Finding], laws: Sequence[RoleDependent]
) -> tuple[Finding, ...]:
    """Findings with what they take where exchanged roles do not prove them."""
    lost = {law.effect: (law.part, law.t) for law in laws if law.named}
    return tuple(replace(f, exchanged=lost.get(f.effect)) for f in findings)


def _lost(
    found: Found, findings: Sequence[Finding], finals: Sequence[Judged]
) -> Iterator[RoleDependent]:
    """Of the findings those that are not proved where other logs choose."""
    base = found.base.fit.axis
    for finding in findings:
        steps = [s for s in found.steps if s.change.name == finding.effect]
        if any(s.held or s.tried.candidate.is_noise for s in steps):
            continue
        scores = []
        for final in finals:
            axis = final.fit.axis
            for step in reversed(steps):
                axis = step.change.undone(axis, base) or axis
            scores.append(score(refitted_on(axis, final), final))
        if refused := [s for s in scores if not _proved(s)]:
            worst = min(refused, key=lambda s: s.t)
            yield RoleDependent(finding.effect, True, worst.part, worst.t)


def _gained(found: Found) -> Iterator[RoleDependent]:
    """Of the laws that are proved with the roles exchanged those that are not as they are."""
    for tried in found.exchanged:
        own = tried.candidate.score
        if own is not None and not own.accepted:
            yield RoleDependent(tried.change.name, False, own.part, own.t)


def _proved(there: Score) -> bool:
    """Whether a law is proved beside all others, where it alone is asked."""
    return replace(there, among=1).accepted
