"""Sentences about a self-test: one for each rate, one for each trial."""

from __future__ import annotations

from identify.selection.findings import FindingKind
from identify.selftest.calibration import Tenth
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
