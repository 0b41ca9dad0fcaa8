"""The self-test: machines with planted effects, and how often the diagnosis names them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.selftest.design import FULL, QUICK, Design, run_all
from identify.selftest.picture import draw
from identify.selftest.tally import confusion, coverage, rates
from identify.selftest.trial import Case, Outcome


def selftest_json(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Rates, coverage, confusion matrix and every trial."""
    return {
        "rates": [
            {"what": r.what, "count": r.count, "trials": r.trials, "asked": r.target}
            for r in rates(outcomes)
        ],
        "coverage": {
            k: {"count": r.count, "trials": r.trials} for k, r in coverage(outcomes).items()
        },
        "confusion": confusion(outcomes),
        "trials": [
            {
                "planted": list(o.case.effects), "strength": o.case.strength, "seed": o.case.seed,
                "in_catalogue": o.case.known, "shown": o.shown, "verdict": o.verdict.lower(),
                "answers": [list(a) for a in o.answers], "ratio_before": o.ratio,
                "ratio_after": o.left, "depends_on": o.depends_on,
            }
            for o in outcomes
        ],
    }  # fmt: skip


__all__ = [
    "FULL",
    "QUICK",
    "Case",
    "Design",
    "Outcome",
    "confusion",
    "coverage",
    "draw",
    "rates",
    "run_all",
    "selftest_json",
]
