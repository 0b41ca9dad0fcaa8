"""The answer of a diagnosis in a sentence, a headline and a label."""

from __future__ import annotations

from collections.abc import Sequence

from identify.output.numbers import capitalised, listed, percent, spaced
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Finding, FindingKind

WORTH = 0.01  # of the squared test error, below which a finding is told behind the others

VERDICTS = {
    Verdict.NOTHING_MISSING: "Nothing is missing: the force error is at its noise floor.",
    Verdict.WRONG_SHAPE: (
        "The model has the effect, but its law has another shape than the force of the machine."
    ),
    Verdict.UNEXPLAINED: (
        "The error is above the noise floor, and no effect of the catalogue explains it."
    ),
}


def verdict_in_words(found: AxisDiagnosis) -> str:
    """The answer of a diagnosis, what the logs cannot separate, and what test logs contradict."""
    said = [VERDICTS.get(found.verdict) or _proved(found)]
    if found.verdict is Verdict.NOTHING_MISSING and not found.final.at_floor:
        said = [
            "The selection logs show nothing that is missing: there the force error is at its "
            f"noise floor. That of the training logs is {found.final.ratio:.1f} times theirs: "
            "noise of another size, or something that only they excite. Record a selection log "
            "like them."
        ]
    elif found.verdict is Verdict.NOTHING_MISSING and found.dataset.force_noise:
        times = found.final.error / found.final.noise.known
        said = [
            "Nothing that is missing shows. The force error is "
            f"{times:.1f} times what is known to make noise: nothing that was measured predicts "
            "what is left, and its origin is not known."
        ]
    odd = found.dataset.odd
    if odd and not odd.at_rest and not found.findings:
        said.append(f"{odd.log} disagrees with the other logs: see the notes.")
    if reshaped := _reshaped(found):
        said.append(f"The law of {listed(reshaped)} has another shape too.")
    said += [f"The logs cannot tell {ties}."] if (ties := _ties(found)) else []
    if against := [f.effect for f in found.contradicted]:
        ask = "The training logs ask" if not found.dataset.selection else "The logs that chose ask"
        more = " too" if found.findings else ""
        said.append(
            f"{ask} for {listed(against)}{more}, but the test logs contradict "
            f"{'them' if against[1:] else 'it'}: their error rises, so the model is without."
        )
    return " ".join(said)


def _proved(found: AxisDiagnosis) -> str:
    lacking, others = _lacking(found), other_values(found)
    said = []
    if lacking:
        said.append(f"the model lacks {'several effects' if lacking[1:] else 'an effect'}")
    if others:
        values = "values of the machine's file are" if others[1:] else "a value of the file is"
        said.append(f"{values} not the machine's")
    proof = _proof(found, "them" if len(found.missing) > 1 else "it")
    return capitalised(f"{' and '.join(said)}: {proof}")


def _proof(found: AxisDiagnosis, them: str) -> str:
    """What proves the findings; some stand by other logs, choosing in turn."""
    if not found.dataset.selection:
        return f"the training logs prove {them}, block by block; there is no selection log"
    in_turn = [f.effect for f in found.missing if f.score.in_turn]
    if len(in_turn) == len(found.missing):
        return f"the training logs and all others, choosing in turn, prove {them}"
    proof = f"the training logs and the selection logs prove {them}"
    return f"{proof}, {listed(in_turn)} only with other logs choosing" if in_turn else proof


def _lacking(found: AxisDiagnosis) -> list[Finding]:
    """The findings of effects that the model does not have."""
    return [f for f in found.missing if f.kind is not FindingKind.WRONG_VALUE]


def other_values(found: AxisDiagnosis) -> list[str]:
    """The effects of which the file of the machine states another value than the logs show."""
    return [f.effect for f in found.findings if f.kind is FindingKind.WRONG_VALUE]


def _reshaped(found: AxisDiagnosis) -> list[str]:
    """The effects whose law has another shape, beside those that are missing."""
    reshaped = [f.effect for f in found.findings if f.kind is FindingKind.WRONG_SHAPE]
    return reshaped if found.missing else []


def _ties(found: AxisDiagnosis) -> str:
    """E.g. "cogging from wear, or lugre from gms", each pair once."""
    ties = {f.effect: f.tied for f in found.findings}
    said: list[str] = []
    for name, alike in ties.items():
        if {*alike} - {other for other in said if name in ties[other]}:
            said.append(name)
    return ", or ".join(f"{name} from {' or '.join(tied_in_words(name, found))}" for name in said)


def tied_in_words(name: str, found: AxisDiagnosis) -> list[str]:
    """What the logs cannot tell from a finding; a law of the model is so by another shape."""
    tied = next(f.tied for f in found.findings if f.effect == name)
    given = found.base.axis.names
    return [f"another shape of {other}" if other in given else other for other in tied]


def headline_in_words(found: AxisDiagnosis) -> str:
    """E.g. "cogging or quadratic drag, and lugre are missing"."""
    match found.verdict:
        case Verdict.MISSING_EFFECTS:
            lacking, others = _lacking(found), other_values(found)
            said = [f"{named_in_words(found)} {_are(lacking)} missing"] if lacking else []
            said += [f"{listed(others)} {_are(others)} not as the file says"] if others else []
            if reshaped := _reshaped(found):
                said.append(f"{listed(reshaped)} has another shape")
            answer = ", and ".join(said)
        case Verdict.WRONG_SHAPE:
            answer = f"{found.findings[0].effect} has another shape"
        case Verdict.UNEXPLAINED:
            answer = "something outside the catalogue is missing"
        case Verdict.NOTHING_MISSING:
            unknown = found.dataset.force_noise or not found.final.at_floor
            answer = "nothing that is missing shows" if unknown else "nothing is missing"
    against = ", ".join(f.effect for f in found.contradicted)
    return spaced(f"{answer} (contradicted by the test logs: {against})" if against else answer)


def _are(several: Sequence[object]) -> str:
    return "are" if len(several) > 1 else "is"


def named_in_words(found: AxisDiagnosis) -> str:
    """Every effect that is missing, e.g. "cogging or wear, and lugre"; empty where none is.

    What explains next to nothing beside the others is told as such.
    """
    lacking = _lacking(found)
    large = [f for f in lacking if f.explains >= WORTH] or lacking
    said = _each_in_words(found, large)
    if small := [f for f in lacking if f not in large]:
        said += f", and for less than {percent(WORTH)} of the squared error "
        said += _each_in_words(found, small)
    return said


def _each_in_words(found: AxisDiagnosis, some: Sequence[Finding]) -> str:
    """Some of the missing effects, each with those that explain as much."""
    each = [
        " or ".join((
            f"something like {f.effect}" if f.kind is FindingKind.RESEMBLES else f.effect,
            *tied_in_words(f.effect, found),
        ))
        for f in some
    ]  # fmt: skip
    return ", and ".join(each) if any(f.tied for f in some) or not each else listed(each)


def all_found(found: AxisDiagnosis) -> str:
    """A label for what was found: the effect where it is one; "" where nothing was."""
    if found.final is found.base:
        return ""
    if len(found.findings) != 1:
        return "all that was found"
    (only,) = found.findings
    reshaped = only.kind is FindingKind.WRONG_SHAPE
    return spaced(f"another shape of {only.effect}" if reshaped else only.effect)
