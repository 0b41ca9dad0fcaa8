"""A self-test in words, as text and as a JSON object: a sentence for each rate and each trial."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.output.machine import pick
from identify.selection.findings import FindingKind
from identify.selftest import (
    TrialResult,
    by_stratum,
    confusion,
    coverage_by_parameter,
    failures,
    rates,
    reliability,
)
from identify.selftest.calibration import Tenth
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


def target_in_words(rate: Rate) -> str:
    """E.g. "at least 95 %"; "" where no target is set."""
    if rate.asked is None:
        return ""
    low, high = rate.asked
    if high == 1.0:
        return f"at least {100 * low:g} %"
    return f"at most {100 * high:g} %" if low == 0.0 else f"{100 * low:g} to {100 * high:g} %"


def rate_in_words(rate: Rate) -> str:
    """E.g. "named at 5: 30 of 31 (97 %, 95 % interval 83 to 100 %), target: ..."."""
    target = f", target: {target_in_words(rate)}" if rate.asked else ""
    if not rate.trials:
        return f"{rate.what}: 0 of 0{target}"
    low, high = (100.0 * end for end in rate.interval)
    share = f"{100 * rate.value:.0f} %, 95 % interval {low:.0f} to {high:.0f} %"
    return f"{rate.what}: {rate.count} of {rate.trials} ({share}){target}"


def tenth_in_words(tenth: Tenth) -> str:
    """E.g. "stated 94 % on average in 90 to 100 %: right 30 of 31 (...)"."""
    return f"stated {100 * tenth.stated:.0f} % on average, right {rate_in_words(tenth.right)}"


def trial_in_words(result: TrialResult) -> str:
    """One line: the machine by its name, and what the diagnosis answered."""
    case = result.case
    if not result.shown:
        return (
            f"{case}: cannot reach {case.strength:g} times the noise floor within its bounds on "
            "this stage's motion"
        )
    kinds = {
        FindingKind.MISSING: "{}",
        FindingKind.WRONG_SHAPE: "{} of another shape",
        FindingKind.RESEMBLES: "something like {}",
    }
    answers = [
        f"{kinds[a.kind].format(' or '.join(a.names))} ({100 * a.confidence:.0f} %)"
        for a in result.answers
    ]
    return f"{case}: {' and '.join(answers) or result.verdict.lower().replace('_', ' ')}"


def failure_in_words(result: TrialResult) -> str:
    """One line: the command that makes the machine again, and what was answered."""
    what = "wrong" if result.wrong else "missed"
    return f"{what}: twin selftest --case {trial_in_words(result)}"


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
    told = pick(rate, "what", "count", "trials")
    return {**told, "low": low, "high": high, "asked": target_in_words(rate)}


def _trial(o: TrialResult) -> dict[str, Any]:
    answers = [pick(a, "names", "kind", "right", "confidence", left="part") for a in o.answers]
    return {
        "case": str(o.case),
        **pick(o.case, "strength", "variation", "seed", planted="effects", in_catalogue="known"),
        **pick(o, "shown", "depends_on", "seconds", ratio_before="ratio", ratio_after="left"),
        "test_ratio": o.tested,
        "verdict": o.verdict.lower(),
        "answers": answers,
    }
