"""Sentences about a self-test: one for each rate, one for each trial."""

from __future__ import annotations

from identify.selftest.tally import Rate
from identify.selftest.trial import TrialResult


def target_in_words(rate: Rate) -> str:
    """E.g. "at least 95 %"; "" where no target is set."""
    if rate.asked is None:
        return ""
    low, high = rate.asked
    if high == 1.0:
        return f"at least {100 * low:g} %"
    return f"at most {100 * high:g} %" if low == 0.0 else f"{100 * low:g} to {100 * high:g} %"


def rate_in_words(rate: Rate) -> str:
    """E.g. "named, force 5 times the noise floor: 30 of 31 (97 %), target: at least 95 %"."""
    target = f", target: {target_in_words(rate)}" if rate.asked else ""
    share = f" ({100 * rate.value:.0f} %)" if rate.trials else ""
    return f"{rate.what}: {rate.count} of {rate.trials}{share}{target}"


def trial_in_words(result: TrialResult) -> str:
    """One line: what was planted, and what the diagnosis answered."""
    case = result.case
    planted = " and ".join(case.effects) or "nothing"
    if not result.shown:
        return (
            f"{planted} cannot reach {case.strength:g} times the noise floor within its bounds on "
            "this stage's motion"
        )
    level = f" at {case.strength:g} times the noise floor" if case.effects else ""
    known = "" if case.known else ", left out of the catalogue"
    answer = " and ".join(" or ".join(answer) for answer in result.answers)
    return f"{planted}{level}{known}: {answer or result.verdict.lower().replace('_', ' ')}"
