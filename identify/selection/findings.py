"""Findings: what a missing effect, or another shape of a law, explains of the test error.

Confidence of a finding: how often such an answer was right, on machines with a known truth.

It is read from two figures of the score (``acceptance``), each the smaller of that on the training
logs and on others: the part of what was left that the finding takes, and t, how sure its gain is
over blocks. What takes nearly all of it was nearly always right, on own machines, on those of
another simulator and on real drives with a term withheld; what takes a third may stand for
something that is not in the catalogue. A gain that hardly differs from chance was that of a wrong
name half of the time, above all where a larger effect was found before it. Three other
figures did not make the prediction better: what is left beside it, how clearly it beats its
controls, and how many rivals it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from identify.dataset.dataset import Dataset, Role
from identify.dataset.noise_floor import noise_beside
from identify.estimation.errors import Errors, error_in
from identify.estimation.evidence import BETTER
from identify.estimation.fit import Fit, finished, fit_axis, fit_themselves
from identify.estimation.found_shape import FoundShape, FreeExponent, exponent_curve, found_shape
from identify.selection.acceptance import Judged, Score, score
from identify.selection.candidates import doubt
from identify.selection.changes import Added, Change, Freed, Reshaped
from identify.selection.of_bodies import is_of_bodies
from identify.selection.of_friction import is_of_friction
from identify.selection.refusal import Instead, Refusal, is_of_position
from identify.selection.search import Found, Step, of_simplest_values
from identify.selection.ties import ALIKE
from identify.selection.trying import parameters
from twin.curve import Coordinate
from twin.knee import Imitated
from twin.model.machine import AxisModel


@dataclass(frozen=True)
class ConfidenceBin:
    """From which value on answers were right how often, 0..1."""

    least: float
    right: float


# As `python -m benchmarks confidence` fits them to 1192 answers: of four seeds of the self-test,
# three of the second simulator, one of other drives, and of real machines with a term withheld.
# Fitted to a half of the machines they hold for the other half within 6 points. The rates are
# (right + 1)/(answers + 2), and 0.99 at most; with t from 3 on 0.93 of all, but of machines that
# are not the self-test's 33 of 38 up to a t of 4: hence 0.89. Below 2.2 it is that of 30 answers.
BY_PART = (
    ConfidenceBin(0.97, 0.99),
    ConfidenceBin(0.86, 0.98),
    ConfidenceBin(0.73, 0.94),
    ConfidenceBin(0.51, 0.91),
    ConfidenceBin(0.0, 0.82),
)
BY_T = (  # as above
    ConfidenceBin(6.9, 0.99),
    ConfidenceBin(5.4, 0.98),
    ConfidenceBin(4.6, 0.96),
    ConfidenceBin(3.8, 0.95),
    ConfidenceBin(3.0, 0.89),
    ConfidenceBin(2.2, 0.82),
    ConfidenceBin(0.0, 0.75),
)


def confidence(part: float, t: float) -> float:
    """How often answers that took such a part, and with such a t, were right, 0..1."""
    return min(read(BY_PART, part), read(BY_T, t))


def read(table: Sequence[ConfidenceBin], value: float) -> float:
    """The rate of the level that a value reaches."""
    return next((level.right for level in table if value >= level.least), table[-1].right)


# --- findings -------------------------------------------------------------------------------------


class FindingKind(Enum):
    """What is wrong with the model.

    It lacks an effect; a law of it has another shape than the machine's force; it lacks an effect
    that the nearest one of the catalogue resembles, with another shape of its law; an effect of it
    has another strength than the file of the machine states.
    """

    MISSING = "missing"
    WRONG_SHAPE = "wrong_shape"
    RESEMBLES = "resembles"
    WRONG_VALUE = "wrong_value"


class Confirmation(Enum):
    """What the test logs, on which nothing was decided, say of a finding.

    With it their error falls; or it rises to more than noise, or within noise; or it is as before,
    or there are none. Noise contradicts nothing: a law with memory makes some of what the readings
    do not tell of the path.
    """

    CONFIRMED = "confirmed"
    CONTRADICTED = "contradicted"
    WITHIN_NOISE = "within_noise"
    UNTESTED = "untested"


@dataclass(frozen=True)
class Finding:
    """A missing effect, or one whose law has the wrong shape, that the data prove.

    tied: effects that these data cannot separate from it. explains: part of the squared test error
    above the noise floor that comes back when it alone is taken out, at most 1. tested: test
    errors in ``unit`` without it and with it. chosen: the same on the logs that chose; without test
    logs the test errors are these. score: the acceptance test beside the fit without it. together:
    names of the findings without which it is not accepted. parameters, parameter_units, equation:
    of its law.
    shape: the curve that is assumed and the one found, where they differ. bend: what gives the law
    that curve, where it has such a parameter. noise: the error of the test logs, in ``unit``, above
    which it is surely more than noise; none where the training logs err more with it too. left,
    left_fitted: over the noise floor, the error that all findings together leave on the logs that
    chose, and on the training logs. doubt: why
    its values cannot be its own; None where they can. imitated: what its law is on this
    motion, where no more than that is proved. exchanged: part and t of its score with training and
    selection logs exchanged, where it is not proved so; None where it is, or nobody asked.
    """

    effect: str
    tied: tuple[str, ...]
    explains: float
    tested: Errors
    chosen: Errors
    unit: str
    parameters: dict[str, float]
    score: Score
    kind: FindingKind = FindingKind.MISSING
    together: tuple[str, ...] = ()
    shape: FoundShape | None = None
    bend: FreeExponent | None = None
    noise: float = 0.0
    left: float = 1.0
    left_fitted: float = 1.0
    doubt: Refusal | None = None
    imitated: Imitated | None = None
    exchanged: tuple[float, float] | None = None
    parameter_units: dict[str, str] = field(default_factory=dict)
    equation: str = ""

    @property
    def state(self) -> Confirmation:
        """What the test logs say of it."""
        before, after = self.tested.before, self.tested.after
        if self.tested.on is not Role.TEST or not min(before, after) < BETTER * max(before, after):
            return Confirmation.UNTESTED
        if after < before:
            return Confirmation.CONFIRMED
        return Confirmation.CONTRADICTED if after > self.noise else Confirmation.WITHIN_NOISE

    @property
    def refused(self) -> Refusal | None:
        """Why it is not proved beside all else that was found; None where it is.

        It was chosen of many before; here it is asked alone.
        """
        return self.doubt or replace(self.score, among=1).refused

    @property
    def is_sure(self) -> bool:
        """Whether a wrong shape differs from the law somewhere by more than its band."""
        if self.kind is not FindingKind.WRONG_SHAPE or self.shape is None or self.bend:
            return True
        return self.shape.differs

    @property
    def confidence(self) -> float | None:
        """How often such an answer was right, 0..1; None where test logs contradict it.

        By the weaker of its scores, where the logs with their roles exchanged do not prove it.
        """
        if self.state is Confirmation.CONTRADICTED:
            return None
        own = (self.score.part, self.score.t)
        return min(confidence(*each) for each in (own, self.exchanged or own))


def findings_of(found: Found) -> tuple[Finding, ...]:
    """What each law that a search added or changed explains; it takes a refit for each.

    All changes of one law are told together: another shape of an effect that was added is what the
    missing one resembles.
    """
    found.final.tell()
    names = dict.fromkeys(s.change.name for s in found.steps)
    by_law = [[s for s in found.steps if s.change.name == name] for name in names]
    dataset, final = found.dataset, found.final
    noise = noise_beside(final.fit.axis, dataset.test).sure if dataset.test else 0.0
    out = [_finding(steps, found, noise) for steps in by_law]
    least = error_in(dataset.chosen_on, final.fit, dataset)
    left = least / (final.other_floor if dataset.selection else final.fit.floor)
    return tuple(replace(f, left=left, left_fitted=final.fit.ratio) for f in out)


def without_law(name: str, found: Found) -> Found:
    """What was found without all changes of one law, the rest fitted again from the base."""
    own = [s for s in found.steps if s.change.name == name]
    rest = tuple(s for s in found.steps if s not in own)
    return replace(found, final=_without(own, found), steps=rest, last=())


def _without(steps: Sequence[Step], found: Found) -> Judged:
    """The final fit without some steps, refitted; of long logs on the part that was searched.

    From its own values too, and from those of the base, as what is taken out had moved the others.
    """
    axis, base = found.final.fit.axis, found.base.fit.axis
    for step in reversed(steps):
        axis = step.change.undone(axis, base) or axis
    if len(steps) == len(found.steps):
        return found.base
    dataset = found.dataset
    begun = (axis, axis.begun_as(base), *_alike(axis, found.passed))
    fits = [fit_themselves(a, dataset.part.training) for a in begun]
    less = min(fits, key=lambda f: f.error)
    less = of_simplest_values(less, [s for s in found.steps if s not in steps])
    less = replace(less, begun=found.final.fit.begun)
    if dataset.part is not dataset:
        less = finished(less.axis, less.begun, dataset.training, less.outcome)
    return Judged(less, dataset)


def _alike(axis: AxisModel, passed: Sequence[Step]) -> list[AxisModel]:
    """The axes that a search passed which have the same laws with the same parameters free."""

    def laws(a: AxisModel) -> dict[str, frozenset[str]]:
        return {f.effect.name: f.fixed for f in a.effects}

    known = (s.tried.judged.fit.axis for s in passed)
    return [a for a in known if laws(a) == laws(axis)]


def _finding(steps: Sequence[Step], found: Found, noise: float) -> Finding:
    """The finding of the steps that are about one law; noise: N, of the test logs with all."""
    dataset, final, less = found.dataset, found.final, _without(steps, found)
    less.tell()  # not both fits at once, whose matrices are of whole logs
    own = steps[0].tried.candidate.score
    assert own is not None  # it was accepted
    is_noise = steps[0].tried.candidate.is_noise  # which lowers no error
    held = any(step.held for step in steps)
    alone = is_noise or held  # then the others tell nothing against it
    beside = own if alone else score(less, final, own.control, own.among)
    chosen, tested = _errors(less.fit, final.fit, dataset)
    whole = error_in(tested.on, found.base.fit, dataset)
    name = steps[0].change.name
    # A free curve may have taken the place of the law, which is then as it was before.
    fits = (final.fit, less.fit, *(s.tried.judged.fit for s in steps))
    axis = next(fit.axis for fit in fits if name in fit.axis.names)
    added = any(isinstance(s.change, Added) for s in steps)
    others = [s.change.name for s in found.steps if s.with_others and s not in steps]
    tied = (t.change.name for s in steps for t in s.tied)
    doubting = _of_values if held else _doubt
    doubted = None if is_noise else doubting(steps[0].change, less, final)
    imitated = _imitated(steps[0], doubted, found)
    kind = FindingKind.MISSING if added else FindingKind.WRONG_SHAPE
    finding = Finding(
        effect=name,
        tied=tuple(dict.fromkeys(other for other in tied if other != name)),
        explains=tested.share_of(whole, found.base.fit.floor),
        tested=tested,
        chosen=chosen,
        unit=axis.units.force,
        parameters=dict(axis[name].values),
        parameter_units=axis.parameter_units(name),
        equation=axis[name].effect.equation,
        score=beside,
        noise=noise if final.fit.error < less.fit.error else 0.0,
        kind=FindingKind.RESEMBLES if imitated else kind,
        together=tuple(others) if any(s.with_others for s in steps) else (),
        doubt=None if imitated else doubted,
        imitated=imitated,
    )
    for step in steps:
        finding = _shaped(finding, step.change, less.fit, found)
    return finding


def _imitated(step: Step, doubted: Refusal | None, found: Found) -> Imitated | None:
    """What a law is told as where it is not known to be itself; None where that is.

    A force of position stands for whatever the force of the place is: another one beside it is more
    of the same.
    """
    if doubted:
        of_position = step.of_position and is_of_position(doubted)
        return Imitated.OF_POSITION if of_position else None
    beside = any(s.of_position for s in found.steps) and isinstance(step.change, Added)
    return Imitated.OF_POSITION if beside and step.change.effect.is_of_place else None


def _of_values(change: Change, less: Judged, final: Judged) -> Refusal | None:
    """Why the values of a change cannot be its own, as beside a curve that makes its force too."""
    return doubt(less, final.fit, change.effect, parameters(change))


def _doubt(change: Change, less: Judged, final: Judged) -> Refusal | None:
    """The same, and what else of the model explains as much; None where it can be itself."""
    own = _of_values(change, less, final)
    if own is None and is_of_bodies(less, final, change.effect):
        return Instead.ROTOR_OR_BODIES
    if own is None and is_of_friction(less, final, change.effect):
        return Instead.FRICTION_OUT_OF_STEP
    return own


def _shaped(finding: Finding, change: Change, less: Fit, found: Found) -> Finding:
    """The finding with the curve that a change gives a law; that of a missing effect resembles."""
    final, dataset, name = found.final.fit, found.dataset, change.name
    without = change.undone(final.axis, final.axis)
    if without is None or isinstance(change, Added):
        return finding
    kind = FindingKind.RESEMBLES if finding.kind is FindingKind.MISSING else finding.kind
    if isinstance(change, Freed):
        bend = FreeExponent(
            change.parameter, change.held, final.axis[name].values[change.parameter],
            final.axis.units(change.effect.parameter(change.parameter).unit),
        )  # fmt: skip
        if change.is_strength:
            return replace(finding, kind=FindingKind.WRONG_VALUE, bend=bend)
        if finding.kind is FindingKind.MISSING and not bend.differs:
            return finding
        drawn = exponent_curve(without[name], final, dataset)
        tied = _alike_over(finding, drawn.over, found)
        return replace(finding, kind=kind, bend=bend, shape=drawn, tied=tied)
    assert isinstance(change, Reshaped)
    before = less if name in less.axis.names else fit_axis(without, dataset.training)
    drawn = found_shape(change.shape, before, dataset)
    tied = _alike_over(finding, change.shape.curve.over, found)
    return replace(finding, kind=kind, shape=drawn, tied=tied)


def _alike_over(finding: Finding, over: Coordinate, found: Found) -> tuple[str, ...]:
    """What a law of another shape is told with: a curve over speed is no more the one than others.

    Those that did nearly as well before it had that shape, and are drawn over the same coordinate.
    Frictions were compared as they are in the end (``ties``).
    """
    steps = (s for s in found.steps if s.change.name == finding.effect)
    kin = (t.change.effect for s in steps if s.change.effect.kind not in ALIKE for t in s.kin)
    names = (e.name for e in kin if any(c.over is over for c in e.curves))
    return tuple(dict.fromkeys((*finding.tied, *names)))


def _errors(before: Fit, after: Fit, dataset: Dataset) -> tuple[Errors, Errors]:
    """On the logs that chose, and on test logs; without these the first twice."""
    chosen = Errors.of(before, after, dataset, dataset.chosen_on)
    return chosen, Errors.of(before, after, dataset, Role.TEST) if dataset.test else chosen
