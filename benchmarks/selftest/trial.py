"""One trial: a machine with planted effects, and the answer of the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from time import process_time

import numpy as np

from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import (
    AXIS,
    Case,
    Machine,
    NotShown,
    Setting,
    machine_of,
    own_error,
    prepared,
)
from identify.dataset.dataset import Dataset, Role
from identify.estimation.alignment import fit_aligned
from identify.estimation.errors import error_in
from identify.estimation.fit import Fit
from identify.estimation.force_balance import residual
from identify.estimation.intervals import estimates, half_widths
from identify.estimation.least_squares import unabsorbed
from identify.estimation.residual_dependence import dependences
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.findings import Finding, FindingKind
from twin.curve import Coordinate
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import Fitted
from twin.model.parameters import read

OVER = {Coordinate.POSITION: "position", Coordinate.SPEED: "velocity"}  # what a curve tells
NEARLY = 0.8  # part of the strongest dependence from which a coordinate counts as right


@dataclass(frozen=True)
class Answer:
    """A finding of the diagnosis, and whether it is right.

    names: the effect, and those declared as ambiguous with it. part, t: of its score, from which
    its confidence is read. confidence: stated, 0..1. coordinate: that of the curve which it shows,
    where a law has another shape.
    """

    names: tuple[str, ...]
    kind: FindingKind
    right: bool
    part: float = np.nan
    confidence: float = np.nan
    coordinate: str | None = None
    t: float = np.inf


@dataclass(frozen=True)
class Held:
    """A parameter of the fitted model, and where the truth lies.

    off: distance of the truth from the value over the half width of its interval. given: whether
    the interval was given.
    """

    label: str
    off: float
    given: bool


@dataclass(frozen=True)
class TrialResult:
    """The result of a trial.

    answers: the findings. ratio, left: error over noise floor before and after, on the training
    logs. tested: error after on the test log over what the machine's own laws leave there.
    depends_on: of an unexplained residual. coordinates: the right ones, from the planted force.
    held: the parameters of the fit that the diagnosis starts from. shown: whether the effect could
    reach its strength on this motion. seconds: of one processor.
    """

    case: Case
    verdict: str = ""
    answers: tuple[Answer, ...] = ()
    ranking: tuple[tuple[str, float], ...] = ()
    ratio: float = np.nan
    left: float = np.nan
    tested: float = np.nan
    depends_on: str | None = None
    coordinates: tuple[str, ...] = ()
    held: tuple[Held, ...] = ()
    seconds: float = 0.0
    shown: bool = True

    @property
    def named(self) -> bool:
        """Whether each planted effect is in an answer of its own, as missing or much like it."""
        missing = [a.names for a in self.answers if a.kind is not FindingKind.WRONG_SHAPE]
        return any(
            all(name in answer for name, answer in zip(self.case.effects, order, strict=True))
            for order in permutations(missing, len(self.case.effects))
        )

    @property
    def named_coordinates(self) -> frozenset[str | None]:
        """Those of an unexplained residual and of the curves shown."""
        return frozenset((self.depends_on, *(a.coordinate for a in self.answers)))

    @property
    def wrong(self) -> tuple[Answer, ...]:
        """The answers that are not right."""
        return tuple(a for a in self.answers if not a.right)

    @property
    def right(self) -> bool:
        """Whether each planted effect is named, and nothing wrong beside."""
        return self.named and not self.wrong


def run(case: Case, setting: Setting | None = None) -> TrialResult:
    """Make the machine, diagnose it with one thread, and compare with what was planted."""
    begun = process_time()
    setting = setting or Setting.standard()
    try:
        made, dataset, base = _fitted(case, setting)
    except NotShown:
        return TrialResult(case, shown=False, seconds=process_time() - begun)
    offered = [e for e in setting.catalogue.values() if case.known or e.name not in case.effects]
    found = diagnose_axis(base, dataset, Catalogue(offered))
    return TrialResult(
        case=case,
        verdict=found.verdict.name,
        answers=tuple(answer_of(f, made, case) for f in found.findings),
        ranking=tuple((c.effect.name, c.delta_bic) for c in found.ranking[:4]),
        ratio=base.ratio,
        left=found.final.ratio,
        tested=_tested(found, made),
        depends_on=found.unexplained.depends_on if found.unexplained else None,
        coordinates=_right_coordinates(made, base, dataset),
        held=held(made, base),
        seconds=process_time() - begun,
    )


def fitted(case: Case) -> TrialResult:
    """Make the machine and fit its model, without a diagnosis: where the truth of it lies."""
    try:
        made, _, base = _fitted(case, Setting.standard())
    except NotShown:
        return TrialResult(case, shown=False)
    return TrialResult(case, ratio=base.ratio, held=held(made, base))


def _fitted(case: Case, setting: Setting) -> tuple[Machine, Dataset, Fit]:
    """A machine and the fit that its diagnosis starts from. Raises NotShown."""
    made = machine_of(case, setting)
    dataset, base = fit_aligned(made.model.axes[AXIS], prepared(made, case.strength))
    return made, dataset, base


def answer_of(finding: Finding, made: Machine, case: Case) -> Answer:
    """A finding as an answer.

    Right is a wrong shape where the machine's law has another, and so over the coordinate of what
    is planted where that is a friction in place of the model's or the catalogue has no name for it;
    and that a missing effect only resembles one of the catalogue where what is planted is none, or
    is that one with another value of what a fit holds, such as an exponent.
    """
    names = (finding.effect, *finding.tied)
    match finding.kind:
        case FindingKind.MISSING | FindingKind.WRONG_VALUE:
            right = not {*case.effects, *made.right}.isdisjoint(names)
            right |= not {*made.reshaped}.isdisjoint(finding.tied)
        case FindingKind.WRONG_SHAPE:
            right = not {*made.reshaped}.isdisjoint(names)
            right |= any(_is_shape_of(f.effect, finding, made, case) for f in made.planted)
            right |= not {*case.effects}.isdisjoint(finding.tied)
        case FindingKind.RESEMBLES:
            right = any(e in OUTSIDE for e in case.effects)
            right |= any(f.effect.name in names and _is_another(f) for f in made.planted)
    over = OVER[finding.shape.over] if finding.shape else None
    sure = np.nan if finding.confidence is None else finding.confidence
    return Answer(names, finding.kind, right, finding.score.part, sure, over, finding.score.t)


def _is_another(planted: Fitted) -> bool:
    """Whether the planted law has another shape value than the catalogue's that a fit holds."""
    held = [p for p in planted.effect.parameters if p.fixed and not p.strength]
    return any(p.start_rule is None and planted.values[p.name] != p.start for p in held)


def _is_shape_of(planted: Effect, finding: Finding, made: Machine, case: Case) -> bool:
    """Whether another shape of a law that the model has is a right thing to say of an effect.

    Of one with no name in the catalogue, over its own coordinate; of a friction, where the friction
    that the model has in its place is told another curve over speed.
    """
    over = finding.shape.over if finding.shape else None
    if planted.name in OUTSIDE or not case.known:
        return over in {c.over for c in planted.curves}
    axis = made.model.axes[AXIS]
    told = finding.effect in axis.names and axis[finding.effect].effect.kind is Kind.FRICTION
    return planted.kind is Kind.FRICTION and told and over is Coordinate.SPEED


def _tested(found: AxisDiagnosis, made: Machine) -> float:
    """Error of what was found on a log that decided nothing, over what noise leaves there."""
    own = own_error(made.true.axes[AXIS], found.dataset.test)
    return error_in(Role.TEST, found.final, found.dataset) / own


def _right_coordinates(made: Machine, base: Fit, dataset: Dataset) -> tuple[str, ...]:
    """Coordinates that the planted force depends on about as much as on the best of them."""
    if not made.planted:
        return ()
    force = _planted_force(made.planted, base, dataset)
    if not force.any():  # noise alone
        return ()
    shares = dependences(force, base, dataset)
    return tuple(name for name, s in shares.items() if s >= NEARLY * max(shares.values()))


def _planted_force(planted: tuple[Fitted, ...], base: Fit, dataset: Dataset) -> np.ndarray:
    axis = base.axis
    for fitted in planted:
        axis = axis.with_effect(fitted)
    force = base.residual - residual(axis, dataset.training)[base.kept]
    return unabsorbed(force, base.basis)


def held(made: Machine, fit: Fit) -> tuple[Held, ...]:
    """Where the truth lies of the parameters whose law the machine has too."""
    true = made.true.axes[AXIS]
    where = [
        c
        for c in fit.scaling.where
        if not c.effect or (c.effect in true.names and c.effect not in made.reshaped)
    ]
    truth = dict(zip([c.label for c in where], read(true, where), strict=True))
    half = dict(zip([c.label for c in fit.scaling.where], half_widths(fit), strict=True))
    return tuple(
        Held(e.label, float(abs(truth[e.label] - e.value) / half[e.label]), e.low is not None)
        for e in estimates(fit)
        if e.label in truth and np.isfinite(half[e.label])
    )
