"""Which machines a self-test makes, and running them side by side."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, cycle, islice
from typing import TypeVar

import numpy as np

from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import AXIS, STAGE, Case
from benchmarks.selftest.trial import TrialResult, run
from benchmarks.selftest.variations import VARIATIONS
from twin.effect import Kind
from twin.effects import Catalogue, load_catalogue
from twin.engine import engine, outcomes
from twin.logs.writer import software_version
from twin.model.file import load_model
from twin.numbers import require_seed

T = TypeVar("T")

DEVELOPMENT = 1  # the seed with which the product is developed
FIRST_RELEASE = 1000  # releases are judged with seeds from here on
WEAK, STRONG = 2.0, 5.0  # times the noise floor


@dataclass(frozen=True)
class Design:
    """How many machines a self-test makes of each sort.

    empty: with nothing planted. weak, strong: with one effect, at WEAK and at STRONG; outside: with
    one of no catalogue, pairs: with two effects, left_out: with one that is taken out of the
    catalogue, all at STRONG.
    """

    empty: int = 3
    strong: int = 4
    weak: int = 2
    outside: int = 1
    pairs: int = 0
    left_out: int = 0

    def cases(self, seed: int, names: Sequence[str] | None = None) -> list[Case]:
        """All machines; the same seed makes the same.

        Effects and variations come in turn, each in an order that the seed draws, so that every one
        is met about as often.
        """
        require_seed(seed)
        rng = np.random.default_rng(seed)
        hidden = list(names or plantable(load_catalogue()))
        pairs = _pairs(hidden)
        sorts = (
            ([()], self.empty, 0.0, True),
            ([(n,) for n in hidden], self.strong, STRONG, True),
            ([(n,) for n in hidden], self.weak, WEAK, True),
            ([(n,) for n in OUTSIDE], self.outside, STRONG, True),
            (pairs, self.pairs if pairs else 0, STRONG, True),
            ([(n,) for n in hidden], self.left_out, STRONG, False),
        )
        out = []
        for effects, count, strength, known in sorts:
            turns = zip(_in_turn(effects, rng), _in_turn(list(VARIATIONS), rng), strict=False)
            for planted, variation in islice(turns, count):
                drawn = int(rng.integers(1, 1 << 31))
                out.append(Case(planted, strength, drawn, variation, known))
        return out


QUICK = Design()
FULL = Design(empty=80, strong=72, weak=48, outside=64, pairs=16, left_out=12)


def release_seed() -> int:
    """The seed with which this version is judged: another for each version."""
    return FIRST_RELEASE + zlib.crc32(software_version().encode())


def plantable(catalogue: Catalogue) -> list[str]:
    """Physical effects that the stage of the self-test lacks, under the names that fit it."""
    axis = load_model(STAGE, catalogue).axes[AXIS]
    absent = (e for e in catalogue.values() if e.name not in axis.names and axis.can_have(e))
    return [e.name for e in absent if not (e.is_nonparametric or e.channels)]


def _pairs(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Two effects of which one at most is a friction; two dead times are one in every log."""
    catalogue = load_catalogue()
    kinds = {p: [catalogue[name] for name in p] for p in combinations(names, 2)}
    return [
        p
        for p, both in kinds.items()
        if any(e.kind is not Kind.FRICTION for e in both) and not all(e.dead_time for e in both)
    ]


def _in_turn(items: Sequence[T], rng: np.random.Generator) -> Iterator[T]:
    return cycle([items[i] for i in rng.permutation(len(items))])


def run_all(
    cases: Sequence[Case],
    workers: int | None = None,
    progress: Callable[[TrialResult, int, int], None] | None = None,
) -> list[TrialResult]:
    """Run cases in as many processes as there are cores; in the order given.

    Raises RuntimeError, with the machine named, where a diagnosis fails; no other is begun then.
    """
    found: dict[Case, TrialResult] = {}
    with engine(workers=workers) as (executor, count):
        for result in outcomes(executor, count, _named, cases):
            found[result.case] = result
            if progress:
                progress(result, len(found), len(cases))
    return [found[case] for case in cases]


def _named(case: Case) -> TrialResult:
    """A trial; what it raises names its machine."""
    try:
        return run(case)
    except Exception as error:
        raise RuntimeError(f"{case}: {error!r}") from error
