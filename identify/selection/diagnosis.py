"""What a diagnosis of one axis is: its verdict, its findings, and the steps that led there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

from identify.dataset.dataset import Dataset
from identify.estimation.decision import RULE
from identify.estimation.errors import Errors
from identify.estimation.fit import Fit
from identify.selection.findings import (
    Finding,
    FindingKind,
    as_a_whole,
    found,
    found_reshaped,
    found_wrong,
    squared_left,
    with_shape,
)
from identify.selection.ranking import less
from identify.selection.repeating_force import Repeat, not_general
from identify.selection.reshaping import Reshaped
from identify.selection.residual_dependence import Dependence
from identify.selection.scoring import Candidate
from identify.selection.wrong_shape import gain_on_fit_logs, likely_shape, wrong_shape
from twin.effect import Kind


class Verdict(Enum):
    """The answer of a diagnosis."""

    MISSING_EFFECTS = "missing effects"
    NOTHING_MISSING = "nothing missing"
    WRONG_SHAPE = "wrong shape"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True, eq=False)
class Step:
    """One added effect, and the earlier ones that are not needed any more beside it.

    tied: effects that explain as much. beside: for a pair, the other effect, without which this one
    has no evidence. rivals: candidates that explained about as much when it was added. proved:
    whether it is named where steps are.
    """

    candidate: Candidate
    tied: tuple[str, ...]
    dropped: tuple[str, ...] = ()
    beside: str | None = None
    rivals: tuple[Candidate, ...] = ()
    proved: bool = True


@dataclass(frozen=True, eq=False)
class SelectionState:
    """The steps so far, and the fit with the effects that they added."""

    steps: tuple[Step, ...]
    fit: Fit


@dataclass(frozen=True, eq=False, repr=False)
class AxisDiagnosis:
    """Diagnosis of one axis.

    base: the fitted model. ranking: candidates beside it, by falling evidence. steps: the effects
    added one after another while there was evidence. final: the fit with those that were kept.
    unexplained: what the residual depends on, where it is not noise. findings: what each named
    effect explains, by ``with_findings``. curves: those in the place of laws, beside which effects
    were added.
    """

    dataset: Dataset
    base: Fit
    ranking: tuple[Candidate, ...]
    steps: tuple[Step, ...]
    final: Fit
    verdict: Verdict
    unexplained: Dependence | None
    findings: tuple[Finding, ...] = ()
    curves: tuple[Reshaped, ...] = ()

    def __repr__(self) -> str:
        answer = f"{self.verdict.name.lower()} {list(self.answers)}"
        return f"<AxisDiagnosis of {self.dataset.axis}: {answer}>"

    @cached_property
    def repeat(self) -> Repeat | None:
        """A force that repeats along the track in each log, but at other places in each."""
        return None if self.final.at_floor else not_general(self.final, self.dataset)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing, in the order they were found."""
        return tuple(answer[0] for answer in self.answers)

    @property
    def answers(self) -> tuple[tuple[str, ...], ...]:
        """Each missing effect, followed by those that explain as much."""
        if self.verdict is not Verdict.MISSING_EFFECTS:
            return ()
        return tuple((s.candidate.effect.name, *s.tied) for s in self._proved)

    @property
    def with_named(self) -> Fit:
        """The fit with what is named, beside which a remainder is left."""
        return self.final if self.named or self.curves else self.base

    @cached_property
    def tested(self) -> Errors:
        """Test errors without and with what is named; without test logs, of those that chose."""
        return Errors.of(self.base, self.with_named, self.dataset, self.dataset.tested_on)

    @cached_property
    def chosen(self) -> Errors:
        """The same errors on the logs that chose."""
        return Errors.of(self.base, self.with_named, self.dataset, self.dataset.chosen_on)

    @property
    def best(self) -> Candidate | None:
        """The candidate that is named first, where one is."""
        return self._proved[0].candidate if self.named else None

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Effects that explain as much as the one named first."""
        return self._proved[0].tied if self.named else ()

    def with_findings(self) -> AxisDiagnosis:
        """The same with what each named effect explains, and with laws of the wrong shape.

        It takes a refit for each. Where error remains beside what is named, a law of the wrong
        shape is sought there.
        """
        each = [self._found(step) for step in (self._proved if self.named else ())]
        findings = tuple(finding for finding, _ in each)
        for curve in self.curves:
            wrong = found_reshaped(
                curve.shape, self.base, curve.before, self.with_named, self.dataset
            )
            tied = tuple(name for name in curve.tied if name not in self.named)
            findings = with_shape(findings, replace(wrong, tied=tied))
        for finding, without in each:
            if finding in findings:  # not one that a missing effect resembles
                findings = self._against_shapes(finding, without, findings)
        beside = self.with_named
        is_open = self.unexplained is not None and not beside.may_be_noise
        if is_open and (shape := wrong_shape(beside, self.dataset)):
            wrong = found_wrong(shape, self.base, beside, self.dataset)
            findings = with_shape(findings, wrong)
        # A curve whose band holds the law everywhere tells nothing beside other findings.
        findings = tuple(f for f in findings if f.is_sure) or findings
        shapes = bool(findings) and all(f.kind is FindingKind.WRONG_SHAPE for f in findings)
        verdict = Verdict.WRONG_SHAPE if shapes else self.verdict
        findings = as_a_whole(findings, self.with_named, self.dataset)
        return replace(self, findings=findings, verdict=verdict)

    def beside(self, base: Fit, curves: tuple[Reshaped, ...]) -> AxisDiagnosis:
        """The same of a base before some of its laws were given free curves."""
        if not curves:
            return self
        beside = replace(self, base=base, curves=curves)
        if self.verdict in (Verdict.NOTHING_MISSING, Verdict.UNEXPLAINED):
            beside = replace(beside, steps=tuple(replace(s, proved=False) for s in self.steps))
        verdict = Verdict.MISSING_EFFECTS if beside._proved else Verdict.WRONG_SHAPE
        return replace(beside, verdict=verdict)

    def _found(self, step: Step) -> tuple[Finding, Fit]:
        """What an effect explains, and the fit without it.

        Of one whose law has a free curve now, before it had that.
        """
        effect = step.candidate.effect
        own = (c.before for c in self.curves if c.shape.effect == effect.name)
        final = next(own, self.with_named)
        rest = {*final.axis.names} - {effect.name}
        alone = effect.kind is not Kind.FRICTION and rest == {*self.base.axis.names}
        without = self.base if alone else less(effect, final, self.base, self.dataset)
        return found(effect, step.tied, self.base, final, without, self.dataset), without

    def _against_shapes(
        self, finding: Finding, without: Fit, findings: tuple[Finding, ...]
    ) -> tuple[Finding, ...]:
        """The findings after a free curve of a law that the model has competed with one of them.

        It is the answer in its place where it leaves clearly less error, and beside it where it
        leaves about as little; in both cases it must leave about as little on the fit logs too. One
        that is not proved by itself must take as much of the error. Not of friction, whose curves
        hold its modifiers. without: the fit without what was found.
        """
        shape = likely_shape(without, self.dataset)
        if shape is None or shape.shape.curve.rubs or shape.effect not in self.base.axis.names:
            return findings
        wrong = found_wrong(shape, self.base, without, self.dataset)
        if not (shape.proof.holds or _takes_as_much(wrong, finding)):
            return findings
        if RULE.near * squared_left(wrong) > squared_left(finding):
            return findings
        unfitted = (1.0 - gain_on_fit_logs(shape, without, self.dataset)) * without.error**2
        if RULE.near * unfitted > self.with_named.error**2:
            return findings
        others = tuple(f for f in findings if f is not finding)
        clearly = squared_left(wrong) < RULE.beside_decoys * squared_left(finding)
        if clearly and shape.proof.holds:
            return with_shape(others, wrong)
        tied = replace(finding, tied=(*finding.tied, wrong.effect))
        return with_shape((*others, tied), replace(wrong, tied=(finding.effect,)))

    @property
    def _proved(self) -> list[Step]:
        """Steps that are named; also those of effects whose law a free curve has replaced.

        Of an effect that the model has, the law beside its own free curve is part of that shape.
        Nor is an effect an alternative to another that was needed beside it, until a curve took its
        place.
        """
        reshaped = {c.shape.effect for c in self.curves}

        def is_named(step: Step) -> bool:
            name = step.candidate.effect.name
            return name not in self.base.axis.names if name in reshaped else step.proved

        own = {s.candidate.effect.name for s in self.steps if s.proved} if self.curves else ()
        return [
            replace(s, tied=tuple(name for name in s.tied if name not in own))
            for s in kept(self.steps)
            if is_named(s)
        ]


def _takes_as_much(wrong: Finding, finding: Finding) -> bool:
    """Whether a curve beats its decoys, and takes about as much error on the logs that chose."""
    taken, needed = (f.chosen.before**2 - f.chosen.after**2 for f in (wrong, finding))
    beats = wrong.proof is not None and wrong.proof.gain > wrong.proof.decoy
    return beats and taken > RULE.near * needed > 0.0


def kept(steps: Sequence[Step]) -> list[Step]:
    """The steps whose effects were not dropped then or later; a name may come again."""
    gone = [{name for s in steps[i:] for name in s.dropped} for i in range(len(steps))]
    return [s for s, names in zip(steps, gone, strict=True) if s.candidate.effect.name not in names]
