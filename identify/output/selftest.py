"""A self-test as text and as a JSON object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.output.words.selftest import rate_in_words, target_in_words
from identify.selftest import TrialResult, confusion, coverage, rates


def selftest_text(results: Sequence[TrialResult]) -> str:
    """The rates, then the coverage of the intervals by parameter, one a line."""
    lines = [rate_in_words(rate) for rate in rates(results)]
    lines += [f"  interval of {rate_in_words(r)}" for r in coverage(results).values()]
    return "\n".join(lines)


def selftest_json(results: Sequence[TrialResult]) -> dict[str, Any]:
    """Rates, coverage, confusion matrix and every trial."""
    return {
        "rates": [
            {"what": r.what, "count": r.count, "trials": r.trials, "asked": target_in_words(r)}
            for r in rates(results)
        ],
        "coverage": {
            k: {"count": r.count, "trials": r.trials} for k, r in coverage(results).items()
        },
        "confusion": confusion(results),
        "trials": [
            {
                "planted": list(o.case.effects), "strength": o.case.strength, "seed": o.case.seed,
                "in_catalogue": o.case.known, "shown": o.shown, "verdict": o.verdict.lower(),
                "answers": [list(a) for a in o.answers], "ratio_before": o.ratio,
                "ratio_after": o.left, "depends_on": o.depends_on,
            }
            for o in results
        ],
    }  # fmt: skip
