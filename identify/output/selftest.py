"""A self-test as text and as a JSON object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.output.words.selftest import (
    failure_in_words,
    rate_in_words,
    target_in_words,
    tenth_in_words,
)
from identify.selftest import (
    TrialResult,
    by_stratum,
    confusion,
    coverage_by_parameter,
    failures,
    rates,
    reliability,
)
from identify.selftest.tally import Rate


def selftest_text(results: Sequence[TrialResult], seed: int) -> str:
    """The rates; by variation; confidence; and the machines that failed."""
    lines = [f"seed {seed}, {len(results)} machines"]
    lines += [rate_in_words(rate) for rate in rates(results)]
    lines += [f"  interval of {rate_in_words(r)}" for r in coverage_by_parameter(results).values()]
    lines += [
        f"  {name}, {rate_in_words(rate)}"
        for name, own in by_stratum(results).items()
        for rate in own
    ]
    lines += [f"  confidence: {tenth_in_words(tenth)}" for tenth in reliability(results)]
    lines += [f"  {failure_in_words(o)}" for o in failures(results)]
    return "\n".join(lines)


def selftest_json(results: Sequence[TrialResult], seed: int) -> dict[str, Any]:
    """Seed, rates, strata, coverage, reliability, confusion matrix and every trial."""
    return {
        "seed": seed,
        "rates": [_rate(r) for r in rates(results)],
        "by_variation": {k: [_rate(r) for r in own] for k, own in by_stratum(results).items()},
        "coverage": {k: _rate(r) for k, r in coverage_by_parameter(results).items()},
        "reliability": [{"stated": t.stated, **_rate(t.right)} for t in reliability(results)],
        "confusion": confusion(results),
        "trials": [_trial(o) for o in results],
    }


def _rate(rate: Rate) -> dict[str, Any]:
    low, high = rate.interval
    return {
        "what": rate.what, "count": rate.count, "trials": rate.trials, "low": low, "high": high,
        "asked": target_in_words(rate),
    }  # fmt: skip


def _trial(o: TrialResult) -> dict[str, Any]:
    return {
        "case": str(o.case), "planted": list(o.case.effects), "strength": o.case.strength,
        "variation": o.case.variation, "seed": o.case.seed, "in_catalogue": o.case.known,
        "shown": o.shown, "verdict": o.verdict.lower(),
        "answers": [
            {"names": list(a.names), "kind": a.kind.value, "right": a.right,
             "confidence": a.confidence, "left": a.part}
            for a in o.answers
        ],
        "ratio_before": o.ratio, "ratio_after": o.left, "test_ratio": o.tested,
        "depends_on": o.depends_on, "seconds": o.seconds,
    }  # fmt: skip
