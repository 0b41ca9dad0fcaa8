"""The laws that are preferred to a free curve, which has shown that something is missing.

A law says more than a curve, and whatever else is missing bends the curve too. But a law of some
cycles may follow most of a curve of another form: then the logs do not tell which of them it is.
"""

from __future__ import annotations

from collections.abc import Sequence

from identify.rules import RULE
from identify.selection.acceptance import Judged, least_t, score
from identify.selection.changes import Reshaped
from identify.selection.trying import Tried, judged_change

NEARLY = 0.66  # of the part that the best takes, from which another law does nearly as well


def laws_for(curve: Tried, judged: Judged, tried: Sequence[Tried]) -> list[Tried]:
    """The laws that take about as much as a free curve, which are preferred to it.

    It has shown that something is missing, so none of them has to be the best of many by itself.
    A further one of a law that the model has takes as much: a few sines imitate any curve.
    """

    def least(t: Tried) -> float:
        # A curve of ten numbers can imitate any law.
        return (1.0 if t.change.effect.number > 1 else NEARLY) * curve.candidate.part

    laws = [t for t in tried if not isinstance(t.change, Reshaped) and t.candidate.part >= least(t)]
    alone = (
        t if t.candidate.supported else judged_change(judged, t.screening, t.judged.fit)
        for t in laws
    )
    return [t for t in alone if t.candidate.supported]


def follows(law: Tried, curve: Tried) -> bool:
    """Whether a law may only follow the form of a curve, to which it is preferred.

    The curve then clearly betters it, by too little to be found after it, and the law is not asked
    for beside the curve. Where the curve takes more, it is found after the law, and whether this is
    needed still is asked then.
    """
    fit = curve.change.refit(law.judged, curve.screening)
    both = judged_change(law.judged, curve.screening, fit)
    more = both.candidate.score
    if more is None or not 0.0 < more.part < RULE.least_part or more.t < least_t(1):
        return False
    return not score(curve.judged, both.judged).accepted


def takes_as_much(unsure: Tried, proved: Tried) -> bool:
    """Whether a law that is not proved by itself takes as much of either group of logs.

    That something is there, the other one has proved; which of the two it is, they do not tell.
    """
    its, own = unsure.candidate.score, proved.candidate.score
    if its is None or own is None or its.accepted or unsure.candidate.doubt:
        return False
    more = its.training.part >= own.training.part and its.other.part >= own.other.part
    return more and its.part > its.control and not isinstance(unsure.change, Reshaped)
