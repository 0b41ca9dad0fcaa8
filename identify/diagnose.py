"""Which physical effect is missing: every absent effect is added in turn, refitted and judged."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.candidates import Candidate, absent_effects, levelled, try_effect
from identify.evidence import held_out_gain
from identify.fit import Fit, sticks
from identify.residual import moving, residual
from identify.structure import Structure, find_structure
from identify.study import Study
from twin.effects import Catalogue

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

TIE = 2.0  # |t| of the held-out difference below which two explanations cannot be told apart


class Verdict(Enum):
    """The answer of a diagnosis, as a sentence."""

    MISSING_EFFECT = "One effect explains what the model lacks, on the fit logs and held out."
    NOTHING_MISSING = "Nothing is missing: the force error is at its noise floor."
    AMBIGUOUS = "Several effects explain the error equally well; this data cannot tell them apart."
    UNEXPLAINED = (
        "The error stands above the noise floor, and no effect of the catalogue explains it."
    )


@dataclass(frozen=True, eq=False)
class AxisDiagnosis:
    """Diagnosis of one axis: the fitted base, candidates by falling evidence, and the answer."""

    study: Study
    base: Fit
    ranking: tuple[Candidate, ...]
    verdict: Verdict
    ambiguous_with: tuple[str, ...]
    unexplained: Structure | None

    @property
    def best(self) -> Candidate | None:
        """The candidate that is named, where one is supported."""
        named = self.verdict in (Verdict.MISSING_EFFECT, Verdict.AMBIGUOUS)
        return self.ranking[0] if named else None


def diagnose_axis(
    base: Fit, study: Study, catalogue: Catalogue, progress: Progress | None = None
) -> AxisDiagnosis:
    """Try every absent effect on one fitted axis and decide."""
    effects = absent_effects(base.axis, catalogue)
    candidates = []
    # The laws run outside Python's lock, so candidates go side by side.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for candidate in pool.map(partial(try_effect, base, study), effects):
            candidates.append(candidate)
            if progress:
                progress(len(candidates), len(effects))
    ranking = _ranked(levelled(candidates))
    return decide(base, study, ranking)


def _ranked(candidates: list[Candidate]) -> tuple[Candidate, ...]:
    """By falling merit; those within no evidence of the best come in the catalogue's order."""
    ranking = sorted(candidates, key=_merit)
    if not ranking or not ranking[0].supported:
        return tuple(ranking)
    best = ranking[0].evidence
    level = [c for c in ranking if c.supported and best.over(c.evidence) < NO_EVIDENCE]
    rest = [c for c in ranking if c not in level]
    return (*sorted(level, key=lambda c: c.effect.name), *rest)


def _merit(c: Candidate) -> tuple[bool, float]:
    """Supported first, then by evidence."""
    return (not c.supported, -c.delta_bic)


def decide(base: Fit, study: Study, ranking: tuple[Candidate, ...]) -> AxisDiagnosis:
    """The verdict from the ranked candidates."""
    supported = [c for c in ranking if c.supported]
    tied = tuple(c.effect.name for c in supported[1:] if _tie(study, supported[0], c))
    structure = None
    if supported:
        verdict = Verdict.AMBIGUOUS if tied else Verdict.MISSING_EFFECT
    elif base.at_floor:
        verdict = Verdict.NOTHING_MISSING
    else:
        verdict = Verdict.UNEXPLAINED
        structure = find_structure(base, study)
    return AxisDiagnosis(study, base, ranking, verdict, tied, structure)


def _tie(study: Study, best: Candidate, other: Candidate) -> bool:
    """Whether the evidence and the held-out error both fail to separate two candidates."""
    if best.evidence.over(other.evidence) > LEAST_SEPARATION:
        return False
    logs = study.holdout or study.fit
    either = sticks(best.fit.axis) or sticks(other.fit.axis)
    kept = moving(logs, either)
    pair = [residual(c.fit.axis, logs)[kept] for c in (other, best)]
    return abs(held_out_gain(pair[0], pair[1], best.fit.floor).t) < TIE


NO_EVIDENCE = 2.0  # difference of BIC "not worth more than a bare mention" (Kass, Raftery 1995)
LEAST_SEPARATION = 10.0  # difference of BIC that separates two explanations
