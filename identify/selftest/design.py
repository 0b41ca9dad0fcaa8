"""Which machines a self-test makes, and running them side by side."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from identify.selftest.cases import AXIS
from identify.selftest.trial import STAGE, Case, TrialResult, run
from twin.effect import Kind
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model

PAIR_STRENGTH = 5.0  # times the noise floor, of each of two planted effects


@dataclass(frozen=True)
class Design:
    """The size of a self-test: strengths (times the noise floor), and machines of each sort.

    each: of every effect and strength. empty: with nothing planted. pairs: with two effects.
    left_out: of every effect, at PAIR_STRENGTH, with the effect taken out of the catalogue.
    """

    strengths: tuple[float, ...] = (5.0,)
    each: int = 1
    empty: int = 10
    pairs: int = 10
    left_out: int = 1

    def cases(self, seed: int, names: Sequence[str] | None = None) -> list[Case]:
        """All machines; the same seed makes the same."""
        catalogue = load_catalogue()
        hidden = list(names or plantable(catalogue))
        rng = np.random.default_rng(seed)
        out = [Case((), 0.0, seed + i) for i in range(self.empty)]
        for i in range(self.each):
            out += [Case((n,), s, seed + i) for s in self.strengths for n in hidden]
        together = [
            pair
            for pair in combinations(hidden, 2)
            if any(catalogue[name].kind is not Kind.FRICTION for name in pair)
        ]
        for i in range(self.pairs if together else 0):
            out.append(Case(together[rng.integers(len(together))], PAIR_STRENGTH, seed + i))
        for i in range(self.left_out):
            out += [Case((n,), PAIR_STRENGTH, seed + 1000 + i, known=False) for n in hidden]
        return out


QUICK = Design()
FULL = Design(strengths=(2.0, 5.0, 20.0), each=3, empty=200, pairs=60, left_out=2)


def plantable(catalogue: Catalogue) -> list[str]:
    """Physical effects that the stage of the self-test lacks."""
    own = load_model(STAGE, catalogue).axes[AXIS].names
    return [e.name for e in catalogue.values() if e.name not in own and not e.is_nonparametric]


def run_all(
    cases: Sequence[Case],
    workers: int | None = None,
    progress: Callable[[TrialResult, int, int], None] | None = None,
) -> list[TrialResult]:
    """Run cases in as many processes as there are cores; in the order given.

    Raises RuntimeError, with the machine named, where a diagnosis fails; no other is begun then.
    """
    found: dict[Case, TrialResult] = {}
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers or os.cpu_count(), mp_context=context) as pool:
        jobs = {pool.submit(run, case): case for case in cases}
        for done in as_completed(jobs):
            if error := done.exception():
                pool.shutdown(cancel_futures=True)
                raise RuntimeError(f"{jobs[done]}: {error!r}") from error
            result = done.result()
            found[result.case] = result
            if progress:
                progress(result, len(found), len(cases))
    return [found[case] for case in cases]
