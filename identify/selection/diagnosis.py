"""What a diagnosis of one axis is: its verdict, its findings, and what is left beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property

from identify.dataset.dataset import Dataset
from identify.dataset.time_scale import TEST_FUNCTIONS
from identify.estimation.errors import Errors
from identify.estimation.fit import Fit, finished, fit_axis
from identify.estimation.residual_dependence import Dependence, Repeat, find_dependence, not_general
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, control
from identify.selection.doubts import Conclusion, concluded
from identify.selection.findings import Finding, FindingKind
from identify.selection.lengths import at_another_length
from identify.selection.odd_logs import surely_odd, without_odd_log
from identify.selection.refusal import Refusal
from identify.selection.roles import RoleDependent, role_dependent, with_exchanged
from identify.selection.search import Found, Step
from twin.effects import Catalogue
from twin.parallel import Progress, silent


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
    findings: what each of these explains. contradicted: findings that the test logs refuse, which
    the final fit is without. doubted: by name of each law that was taken out at the end,
    why. unexplained: what the residual depends on, where it is
    not noise. also_seen: effects that the data show and that take too little to matter. repeat: a
    force that repeats along the track in each log, but at other places in each. depends_on_roles:
    laws that are proved or not by which log chooses.
    """

    dataset: Dataset
    base: Fit
    ranking: tuple[Candidate, ...]
    steps: tuple[Step, ...]
    final: Fit
    verdict: Verdict
    findings: tuple[Finding, ...] = ()
    contradicted: tuple[Finding, ...] = ()
    doubted: Mapping[str, Refusal] = field(default_factory=dict)
    unexplained: Dependence | None = None
    also_seen: tuple[str, ...] = ()
    repeat: Repeat | None = None
    depends_on_roles: tuple[RoleDependent, ...] = ()

    def __repr__(self) -> str:
        answer = f"{self.verdict.name.lower()} {list(self.answers)}"
        return f"<AxisDiagnosis of {self.dataset.axis}: {answer}>"

    @property
    def missing(self) -> tuple[Finding, ...]:
        """The findings that name an effect: which the model lacks, or has with another value."""
        return tuple(f for f in self.findings if f.kind is not FindingKind.WRONG_SHAPE)

    @property
    def named(self) -> tuple[str, ...]:
        """Names of these effects, in the order they were found."""
        return tuple(f.effect for f in self.missing)

    @property
    def answers(self) -> tuple[tuple[str, ...], ...]:
        """Each of these effects, followed by those that explain as much."""
        return tuple((f.effect, *f.tied) for f in self.missing)

    @cached_property
    def tested(self) -> Errors:
        """Test errors without and with what was found; without test logs, of those that chose."""
        return Errors.of(self.base, self.final, self.dataset, self.dataset.tested_on)

    @cached_property
    def chosen(self) -> Errors:
        """The same errors on the logs that chose."""
        return Errors.of(self.base, self.final, self.dataset, self.dataset.chosen_on)

    def beside(self, final: Fit, dataset: Dataset) -> AxisDiagnosis:
        """The diagnosis with its fits made again on a dataset whose bodies are others by now.

        What was found stays; its values and errors, and what is left, are told anew. Beside others
        the error without a finding is what it was: as much of it is theirs now as before.
        """
        if dataset is self.dataset:
            return self
        base = final
        if self.final is not self.base:
            base = replace(fit_axis(self.base.axis, dataset.training), begun=self.base.begun)
        quiet = final.at_floor or Judged(final, dataset).other_at_floor

        def anew(errors: Errors) -> Errors:
            now = Errors.of(base, final, dataset, errors.on)
            return now if not self.findings[1:] else replace(errors, after=now.after)

        def values(f: Finding) -> dict[str, float]:
            there = f.effect in final.axis.names
            return dict(final.axis[f.effect].values) if there else f.parameters

        findings = tuple(
            replace(f, tested=anew(f.tested), chosen=anew(f.chosen), parameters=values(f))
            for f in self.findings
        )
        return replace(
            self, dataset=dataset, base=base, final=final, findings=findings,
            verdict=_verdict(findings, quiet), repeat=None if quiet else self.repeat,
            unexplained=None if quiet else find_dependence(final, dataset),
        )  # fmt: skip

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
    base: Fit,
    dataset: Dataset,
    catalogue: Catalogue,
    progress: Progress = silent,
    lengths: Sequence[float] = TEST_FUNCTIONS,
) -> AxisDiagnosis:
    """Find what one fitted axis lacks, and what each finding explains.

    lengths: s, of test functions with which it is asked again.
    """
    if any(log.force_noise for log in dataset.training):  # an effect may explain it yet
        dataset = dataset.with_force_noise(0.0)
        base = finished(base.axis, base.begun, dataset.training, base.outcome)

    def conclude(fit: Fit, some: Dataset) -> Conclusion:
        ended = concluded(fit, some, catalogue, progress)
        return at_another_length(ended, lengths, catalogue, progress)

    ended, odd = without_odd_log(base, dataset, conclude)
    found, final = ended.found, ended.found.final
    by_roles = role_dependent(found, ended.findings)
    findings = with_exchanged(ended.findings, by_roles)
    # Either may be known by too low a floor; what the logs differ by is told.
    quiet = final.fit.at_floor or final.other_at_floor
    return AxisDiagnosis(
        dataset=replace(found.dataset, odd=odd or surely_odd(ended, dataset)),
        base=found.base.fit,
        ranking=found.ranking,
        steps=found.passed,
        final=final.fit,
        verdict=_verdict(findings, quiet),
        findings=findings,
        contradicted=ended.contradicted,
        doubted=ended.doubted,
        unexplained=None if quiet else find_dependence(final.fit, found.dataset),
        also_seen=_small(found),
        repeat=None if final.fit.at_floor else not_general(final.fit, found.dataset),
        depends_on_roles=by_roles,
    )


def _verdict(findings: tuple[Finding, ...], quiet: bool) -> Verdict:
    if any(f.kind is not FindingKind.WRONG_SHAPE for f in findings):
        return Verdict.MISSING_EFFECTS
    if findings:
        return Verdict.WRONG_SHAPE
    return Verdict.NOTHING_MISSING if quiet else Verdict.UNEXPLAINED


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
