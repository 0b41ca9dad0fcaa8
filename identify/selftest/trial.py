"""One trial: a machine with planted effects, and the answer of the diagnosis."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from itertools import permutations
from time import perf_counter

import numpy as np

from identify.dataset.dataset import Dataset, datasets
from identify.estimation.channel_delay import fit_aligned
from identify.estimation.fit import Fit
from identify.estimation.force_balance import residual
from identify.estimation.intervals import estimates
from identify.estimation.subspace import unabsorbed
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.forward_selection import diagnose_axis
from identify.selection.residual_dependence import dependences
from identify.selftest.cases import AXIS, Machine, NotShown, machine
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model
from twin.model.machine import Fitted
from twin.model.parameters import read

STAGE = "proton_xy"
NEARLY = 0.8  # part of the strongest dependence from which a coordinate counts as right


@dataclass(frozen=True)
class Case:
    """What is planted: effect names, their force over the noise floor, and the seed.

    known: whether the planted effects stay in the catalogue of the analysis.
    """

    effects: tuple[str, ...]
    strength: float
    seed: int
    known: bool = True


@dataclass(frozen=True)
class TrialResult:
    """The result of a trial.

    answers: for each effect that was named, in order, its name and those declared as ambiguous
    with it. ratio, left: error over noise floor before and after. depends_on: of an unexplained
    residual. coordinates: the right ones, from the planted force. covered: with nothing planted,
    for each parameter with an interval whether it holds the truth. shown: whether the effect
    could reach its strength on this motion.
    """

    case: Case
    verdict: str = ""
    answers: tuple[tuple[str, ...], ...] = ()
    ranking: tuple[tuple[str, float], ...] = ()
    ratio: float = np.nan
    left: float = np.nan
    depends_on: str | None = None
    coordinates: tuple[str, ...] = ()
    covered: tuple[tuple[str, bool], ...] = ()
    seconds: float = 0.0
    shown: bool = True

    @property
    def named(self) -> tuple[str, ...]:
        """The effect named first in each answer."""
        return tuple(answer[0] for answer in self.answers)

    @property
    def right(self) -> bool:
        """Whether each planted effect is in an answer of its own, and there are no others."""
        return len(self.answers) == len(self.case.effects) and any(
            all(name in answer for name, answer in zip(order, self.answers, strict=True))
            for order in permutations(self.case.effects)
        )

    @property
    def quiet(self) -> bool:
        """Whether no name was given."""
        return not self.answers

    @property
    def honest(self) -> bool:
        """Of an effect outside the catalogue: floor reached, or unexplained with its coordinate."""
        if self.verdict == Verdict.UNEXPLAINED.name:
            return self.depends_on in self.coordinates
        return self.left < FLOOR


FLOOR = 1.3  # error over noise floor below which the error counts as noise


def run(case: Case) -> TrialResult:
    """Make the machine, diagnose it with one thread, and compare with what was planted."""
    catalogue = load_catalogue()
    stage = load_model(STAGE, catalogue)
    rng = np.random.default_rng([case.seed, *(zlib.crc32(e.encode()) for e in case.effects)])
    try:
        built = machine(stage, [catalogue[e] for e in case.effects], case.strength, rng)
    except NotShown:
        return TrialResult(case, shown=False)
    known = [e for e in catalogue.values() if case.known or e.name not in case.effects]
    begun = perf_counter()
    dataset = datasets(built.model, built.logs, built.holdout)[AXIS]
    dataset, base = fit_aligned(built.model.axes[AXIS], dataset)
    found = diagnose_axis(base, dataset, Catalogue(known), workers=1)
    return TrialResult(
        case=case,
        verdict=found.verdict.name,
        answers=found.answers,
        ranking=tuple((c.effect.name, c.delta_bic) for c in found.ranking[:4]),
        ratio=base.ratio,
        left=found.final.ratio,
        depends_on=found.unexplained.depends_on if found.unexplained else None,
        coordinates=_right_coordinates(built, base, dataset),
        covered=_covered(built, found) if not case.effects else (),
        seconds=perf_counter() - begun,
    )


def _right_coordinates(built: Machine, base: Fit, dataset: Dataset) -> tuple[str, ...]:
    """Coordinates that the planted force depends on about as much as on the best of them."""
    if not built.planted:
        return ()
    force = _planted_force(built.planted, base, dataset)
    if not force.any():  # noise alone
        return ()
    shares = dependences(force, base, dataset)
    return tuple(name for name, s in shares.items() if s >= NEARLY * max(shares.values()))


def _planted_force(planted: tuple[Fitted, ...], base: Fit, dataset: Dataset) -> np.ndarray:
    axis = base.axis
    for fitted in planted:
        axis = axis.with_effect(fitted)
    force = base.residual - residual(axis, dataset.fit)[base.kept]
    return unabsorbed(force, base.basis)


def _covered(built: Machine, found: AxisDiagnosis) -> tuple[tuple[str, bool], ...]:
    """Whether the 90 % intervals of a fit hold the machine's true values."""
    fit = found.base
    truth = read(built.true.axes[AXIS], fit.scaling.where)
    out = []
    for estimate, true in zip(estimates(fit), truth, strict=False):
        if estimate.low is not None and estimate.high is not None:
            out.append((estimate.label, bool(estimate.low <= true <= estimate.high)))
    return tuple(out)
