"""Pair search: two effects that have evidence only together.

While another effect is missing, the residual is coloured and the base distorted, so a candidate has
a small effective sample size and may raise the held-out error. With both effects the error can
reach the noise floor, or come near what noise leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identify.dataset.dataset import Dataset
from identify.dataset.noise_floor import floor_of
from identify.estimation.decision import RULE
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, error_on
from identify.selection.ranking import less, part_explained
from identify.selection.scoring import Candidate, score

FIRSTS = 3  # candidates for the first effect of a pair


@dataclass(frozen=True, eq=False)
class Pair:
    """Two effects that were found beside each other.

    first: its fit without the second, its evidence and gain beside the second. second: beside the
    first. together: both against the base. seconds: all that were ranked beside the first.
    """

    first: Candidate
    second: Candidate
    together: Candidate
    seconds: tuple[Candidate, ...]

    @property
    def names(self) -> frozenset[str]:
        """Names of both."""
        return frozenset((self.first.effect.name, self.second.effect.name))


def search_pairs(
    base: Fit,
    dataset: Dataset,
    ranking: Sequence[Candidate],
    ranked: Callable[[Fit, Dataset], tuple[Fit, tuple[Candidate, ...]]],
) -> list[Pair]:
    """Pairs that bring the error to the noise floor or explain nearly all of it, best first.

    ranked: ranks every absent effect beside a fit. Fit and held-out logs must support both effects
    together, and each beside the other.
    """
    pairs: list[Pair] = []
    for first in sorted(ranking, key=lambda c: -c.evidence.log_gain)[:FIRSTS]:
        if 1.0 - (first.fit.error / base.error) ** 2 < RULE.pair_first:
            break
        beside, seconds = ranked(first.fit, dataset)
        if not (seconds and seconds[0].supported):
            continue
        pair = _pair(base, dataset, replace(first, fit=beside), seconds)
        if pair is not None and all(p.names != pair.names for p in pairs):
            pairs.append(pair)
    return sorted(pairs, key=lambda p: -p.together.delta_bic)


def _pair(
    base: Fit, dataset: Dataset, first: Candidate, seconds: tuple[Candidate, ...]
) -> Pair | None:
    """The pair, if both together explain enough and each is needed; else None.

    seconds: ranked beside the first.
    """
    second = seconds[0]
    both = second.fit
    if first.effect.name not in both.axis.names:  # a friction that the second replaced
        return None
    nearly_all = part_explained(base, both) > RULE.nearly_all  # beside noise that has no model
    if not (nearly_all or both.at_floor or held_at_floor(both, dataset)):
        return None
    together = score(base, both, dataset, second.effect)
    needed = score(less(first.effect, both, base, dataset), both, dataset, first.effect)
    if not (together.supported and needed.supported):
        return None
    return Pair(replace(needed, fit=first.fit), second, together, seconds)


def held_at_floor(fit: Fit, dataset: Dataset) -> bool:
    """Whether the error on the held-out logs is at their noise floor."""
    return bool(dataset.holdout) and rms(
        error_on(fit.axis, dataset.holdout)
    ) < RULE.at_floor * floor_of(fit.axis, dataset.holdout)
