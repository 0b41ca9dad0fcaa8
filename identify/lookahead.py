"""Two effects at once, where neither has evidence without the other.

What is missing beside a candidate colours the residual and bends the base: its evidence is then
counted on few independent samples, and it may do harm on held-out logs. Together the two can
bring the error to the noise floor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identify.candidates import Candidate, score
from identify.fit import AT_FLOOR, Fit, error_on, rms
from identify.ranking import less
from identify.study import Study

FIRSTS = 3  # candidates beside which a second is sought
LEAST_PART = 0.1  # of the squared error, that the first must explain alone


@dataclass(frozen=True, eq=False)
class Pair:
    """Two effects that were found beside each other.

    first: its fit without the second, its evidence and gain beside the second. second: beside the
    first. together: both against the base.
    """

    first: Candidate
    second: Candidate
    together: Candidate

    @property
    def names(self) -> frozenset[str]:
        """Names of both."""
        return frozenset((self.first.effect.name, self.second.effect.name))


def look_ahead(
    base: Fit,
    study: Study,
    ranking: Sequence[Candidate],
    ranked: Callable[[Fit, Study], tuple[Fit, tuple[Candidate, ...]]],
) -> list[Pair]:
    """Pairs that bring the error to the noise floor, best first.

    ranked: every absent effect tried beside a fit. Fit and held-out logs must ask for both
    together, and for each beside the other.
    """
    pairs: list[Pair] = []
    for first in sorted(ranking, key=lambda c: -c.evidence.log_gain)[:FIRSTS]:
        if 1.0 - (first.fit.error / base.error) ** 2 < LEAST_PART:
            break
        beside, seconds = ranked(first.fit, study)
        if not (seconds and seconds[0].supported):
            continue
        pair = _pair(base, study, replace(first, fit=beside), seconds[0])
        if pair is not None and all(p.names != pair.names for p in pairs):
            pairs.append(pair)
    return sorted(pairs, key=lambda p: -p.together.delta_bic)


def _pair(base: Fit, study: Study, first: Candidate, second: Candidate) -> Pair | None:
    """The two as a pair where they explain all but noise and each is needed, else None."""
    both = second.fit
    if not (both.at_floor or held_at_floor(both, study)):
        return None
    together = score(base, both, study, second.effect)
    needed = score(less(first.effect, both, base, study), both, study, first.effect)
    if not (together.supported and needed.supported):
        return None
    return Pair(replace(needed, fit=first.fit), second, together)


def held_at_floor(fit: Fit, study: Study) -> bool:
    """Whether the logs that the fit did not see are explained down to noise."""
    return bool(study.holdout) and rms(error_on(fit.axis, study.holdout)) < AT_FLOOR * fit.floor
