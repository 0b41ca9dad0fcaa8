"""What a diagnosis of one axis is: its verdict, its findings, and what is left beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

from identify.dataset.dataset import Dataset
from identify.estimation.fit import Errors, Fit, finished, fit_axis, fit_roughly
from identify.estimation.residual_dependence import Dependence, Repeat, find_dependence, not_general
from identify.estimation.residual_noise import with_own_noise
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Screening, control
from identify.selection.findings import Finding, FindingKind, findings_of, without_law
from identify.selection.search import Found, Step, is_tied, search
from identify.selection.trying import Tried
from twin.effect import Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted
from twin.parallel import Progress, silent

ALIKE = (Kind.FRICTION, Kind.STRUCTURE)  # whose values of one name mean the same in each


class Verdict(Enum):
    """The answer of a diagnosis."""

    MISSING_EFFECTS = "missing effects"
    NOTHING_MISSING = "nothing missing"
    WRONG_SHAPE = "wrong shape"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True, eq=False, repr=False)
class AxisDiagnosis:
    """Diagnosis of one axis.

    base: the fitted model. ranking: absent effects beside it, proved ones first. steps: every
    change that was accepted on the way. final: the fit with those that are needed at the end.
    findings: what each of these explains. unexplained: what the residual depends on, where it is
    not noise. small: effects that the data show and that take too little to matter. repeat: a force
    that repeats along the track in each log, but at other places in each.
    """

    dataset: Dataset
    base: Fit
    ranking: tuple[Candidate, ...]
    steps: tuple[Step, ...]
    final: Fit
    verdict: Verdict
    findings: tuple[Finding, ...] = ()
    unexplained: Dependence | None = None
    small: tuple[str, ...] = ()
    repeat: Repeat | None = None

    def __repr__(self) -> str:
        answer = f"{self.verdict.name.lower()} {list(self.answers)}"
        return f"<AxisDiagnosis of {self.dataset.axis}: {answer}>"

    @property
    def missing(self) -> tuple[Finding, ...]:
        """The findings that name an effect which the model lacks."""
        return tuple(f for f in self.findings if f.kind is not FindingKind.WRONG_SHAPE)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the effects that are missing, in the order they were found."""
        return tuple(f.effect for f in self.missing)

    @property
    def answers(self) -> tuple[tuple[str, ...], ...]:
        """Each missing effect, followed by those that explain as much."""
        return tuple((f.effect, *f.tied) for f in self.missing)

    @property
    def with_named(self) -> Fit:
        """The fit with what was found, beside which a remainder is left."""
        return self.final

    @cached_property
    def tested(self) -> Errors:
        """Test errors without and with what was found; without test logs, of those that chose."""
        return Errors.of(self.base, self.final, self.dataset, self.dataset.tested_on)

    @cached_property
    def chosen(self) -> Errors:
        """The same errors on the logs that chose."""
        return Errors.of(self.base, self.final, self.dataset, self.dataset.chosen_on)

    @property
    def explained(self) -> float:
        """Part of the squared error above the noise floor that all findings together remove."""
        return self.tested.share_of(self.tested.before, self.base.floor)

    @property
    def in_part(self) -> bool:
        """Whether the logs were so long that their beginnings were searched."""
        return any(len(c.fit.kept) < len(self.base.kept) for c in self.ranking)

    @property
    def best(self) -> Candidate | None:
        """The candidate that is named first, where one is."""
        added = (s.tried.candidate for s in self.steps if isinstance(s.change, Added))
        return next((c for c in added if c.effect.name in self.named[:1]), None)

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Effects that explain as much as the one named first."""
        return self.missing[0].tied if self.missing else ()


def diagnose_axis(
    base: Fit, dataset: Dataset, catalogue: Catalogue, progress: Progress = silent
) -> AxisDiagnosis:
    """Find what one fitted axis lacks, and what each finding explains."""
    if any(log.force_noise for log in dataset.training):  # an effect may explain it yet
        dataset = dataset.with_force_noise(0.0)
        base = finished(base.axis, base.begun, dataset.training, base.outcome)
    searched = search(base, dataset, catalogue, progress)
    progress("what each finding explains", 0, 1)
    found, findings = _proved(_with_ties(searched))
    final = found.final
    # Either may be known by too low a floor; what the logs differ by is told.
    quiet = final.fit.at_floor or final.other_at_floor
    return AxisDiagnosis(
        dataset=found.dataset,
        base=found.base.fit,
        ranking=found.ranking,
        steps=found.passed,
        final=final.fit,
        verdict=_verdict(findings, quiet),
        findings=findings,
        unexplained=None if quiet else find_dependence(final.fit, found.dataset),
        small=_small(found),
        repeat=None if final.fit.at_floor else not_general(final.fit, found.dataset),
    )


def _verdict(findings: tuple[Finding, ...], quiet: bool) -> Verdict:
    if any(f.kind is not FindingKind.WRONG_SHAPE for f in findings):
        return Verdict.MISSING_EFFECTS
    if findings:
        return Verdict.WRONG_SHAPE
    return Verdict.NOTHING_MISSING if quiet else Verdict.UNEXPLAINED


def _proved(found: Found) -> tuple[Found, tuple[Finding, ...]]:
    """What was found and is accepted beside all else at the end, the weakest left out first."""
    ended = _with_own_noise(found)
    findings = findings_of(ended)
    # A curve whose band holds the law everywhere tells nothing beside other findings.
    sure = [f for f in findings if f.is_sure] or findings
    no = {f.effect: f.doubt or replace(f.score, among=1).refused for f in findings}
    doubted = [f for f in findings if no[f.effect] or f not in sure]
    if not doubted:
        return ended, findings
    weakest = min(doubted, key=lambda f: f.score.part)
    rest = _proved(without_law(weakest.effect, found))  # what is noise beside it is so no more
    if no[weakest.effect] or len(rest[1]) == len(findings) - 1:
        return rest
    return ended, findings  # others need the curve, whatever its band


def _with_own_noise(found: Found) -> Found:
    """What a search found, with what is left at the end as noise, where nothing predicts it."""
    noisy, final = with_own_noise(found.final.fit, found.dataset)
    if noisy is found.dataset:
        return found
    begun, ended = found.base.fit, Judged(final, noisy)
    if found.final.fit is begun:
        return replace(found, dataset=noisy, base=ended, final=ended)
    base = finished(begun.axis, begun.begun, noisy.training, begun.outcome)
    return replace(found, dataset=noisy, base=Judged(base, noisy), final=ended)


def _with_ties(found: Found) -> Found:
    """What a search found, with ties decided beside all that was found.

    When an early change was compared with its rivals, the later ones were still missing. Of a
    friction or a resonance all others are rivals, whatever their own fits ended in.
    """
    if len(found.steps) < 2 and not any(_others_alike(s, found) for s in found.steps):
        return found
    return replace(found, steps=tuple(_compared_again(s, found) for s in found.steps))


def _compared_again(step: Step, found: Found) -> Step:
    final, names = found.final, {s.change.name for s in found.steps}
    axis = step.change.undone(final.fit.axis, found.base.fit.axis)
    if axis is None:
        return replace(step, tied=())
    own = replace(step.tried, judged=final)

    def beside(rival: Tried) -> bool:
        if rival.change.name in names:
            return False
        if not isinstance(rival.change, Added):
            return True
        law = rival.judged.fit.axis[rival.change.name]
        laws = [law] if rival.candidate.score else []
        if law.effect.kind in ALIKE:  # whose values were those of another model
            laws.append(_as_free_as(final.fit.axis[step.change.name], law))
        return any(
            _is_tied_with(axis.with_effect(each), rival, own, found.dataset) for each in laws
        )

    rivals = {t.change.name: t for t in (*_others_alike(step, found), *step.tied)}
    return replace(step, tied=tuple(t for t in rivals.values() if beside(t)))


def _is_tied_with(axis: AxisModel, rival: Tried, own: Tried, dataset: Dataset) -> bool:
    """Whether a rival that is itself is level with what was found, as this axis begins its fit."""
    effect = rival.change.effect

    def is_tied_by(fit: Fit) -> bool:
        if effect.imitation(fit.axis[effect.name].values, dataset.excitation):
            return False
        return is_tied(replace(rival, judged=Judged(fit, dataset)), own)

    rough = fit_roughly(axis, dataset.training)  # a better fit is no less level
    return is_tied_by(rough) or is_tied_by(fit_axis(rough.axis, dataset.training))


def _others_alike(step: Step, found: Found) -> list[Tried]:
    """All others of the catalogue, where a friction or a resonance was added."""
    kind = step.change.effect.kind
    if not isinstance(step.change, Added) or kind not in ALIKE:
        return []
    own = {p.name for p in step.change.effect.parameters if not p.strength}
    others = (c for c in found.ranking if c.effect.kind is kind and not c.doubt)
    rivals = [c for c in others if own & {p.name for p in c.effect.parameters}]
    changes = [Added(c.effect) for c in rivals]
    return [
        Tried(change, Screening(change, 0.0), Judged(c.fit, found.dataset), c)
        for change, c in zip(changes, rivals, strict=True)
    ]


def _as_free_as(other: Fitted, law: Fitted) -> Fitted:
    """A law with the values of another, and as free, where both have a parameter of that name."""
    free = {n: v for n, v in other.values.items() if n in law.values and n not in other.fixed}
    return replace(law, values={**law.values, **free}, fixed=law.fixed.difference(free))


def _small(found: Found) -> tuple[str, ...]:
    """Effects that the data show beside what was found, each too small to matter."""
    if found.final.at_floor:
        return ()
    seen = (3.0, 0.02)  # t and part from which a change is real, and worth a word, though too small
    added = [t for t in found.last if isinstance(t.change, Added) and not t.candidate.doubt]
    return tuple(
        t.change.name
        for t in added
        if (s := t.candidate.score)
        and s.t > seen[0]
        and seen[1] < s.part < RULE.least_part
        and s.part > control(t.change, found.final, t.judged)
    )
