"""A conclusion without a log that disagrees with the others.

One spoiled log raises the floor of all and hides what the others prove. But what a model lacks may
look like a log that disagrees, until it is found. So a log that stands out goes, the diagnosis is
made of the others, and the log is asked again beside what was found: only one that still disagrees
is named, any other comes back. One that alone shows what the model lacks seems odd as well: where
nothing was found without it, all logs are asked together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

from identify.dataset.dataset import Dataset
from identify.dataset.odd_log import Disagreement
from identify.estimation.alignment import realigned
from identify.estimation.disagreement import odd_in, odd_in_all, suspect
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, fit_axis
from identify.selection.doubts import Conclusion, laws_of

MOST_TURNS = 3  # of leaving out and asking again


def without_odd_log(
    base: Fit, dataset: Dataset, conclude: Callable[[Fit, Dataset], Conclusion]
) -> tuple[Conclusion, Disagreement | None]:
    """What the logs come to but one that disagrees with the others, and that one.

    conclude: what a fit of some logs comes to.
    """

    @cache  # in turns this log and that, each set of logs is asked once
    def without(log: str | None) -> Conclusion:
        return conclude(*_others(base, dataset, log))

    odd = odd_in(base.axis, dataset)
    for _ in range(MOST_TURNS):
        left_out = _spoiling(odd, dataset)
        ended = without(left_out)
        odd = _odd_beside(ended, dataset)
        if left_out == _spoiling(odd, dataset):
            break
    else:
        ended, odd = without(None), None  # in turns this log and that: it is no log
    unexplained = _is_unexplained(ended)
    if odd is None or _spoiling(odd, dataset) is None:
        if not unexplained:
            return ended, odd
        if _may_be_all(odd):
            return ended, None
        return _without_suspect(base, dataset, without) or (ended, odd)
    if (ended.findings and ended.found.final.at_floor) or (odd.is_sure and not unexplained):
        return ended, odd
    # The others are as they were, or not explained: it may be the one that shows what is missing.
    whole = without(None)
    beside = _odd_beside(whole, dataset)
    if whole.findings and _spoiling(beside, dataset) is None and _is_as_good(whole, ended):
        return whole, beside
    return (whole, None) if unexplained and _may_be_all(odd) else (ended, odd)


def _may_be_all(odd: Disagreement | None) -> bool:
    """Whether it may be no log's: what all of them lack looks like some delay or gain of one."""
    return odd is not None and odd.is_of_recording and not odd.is_sure


def _spoiling(odd: Disagreement | None, dataset: Dataset) -> str | None:
    """The log that is left out for how it disagrees.

    What happens at rest spoils nothing; nor does a test log, as it decides nothing.
    """
    if odd is None or odd.at_rest or dataset.is_test(odd.log):
        return None
    return odd.log


def _is_unexplained(ended: Conclusion) -> bool:
    """Whether something is left, and nothing was found that explains any of it."""
    final = ended.found.final
    return not ended.findings and not (final.fit.at_floor or final.other_at_floor)


def _is_as_good(whole: Conclusion, ended: Conclusion) -> bool:
    """Whether all logs come to what explains those without the odd one as well as they do.

    So it is where these came to nothing.
    """
    if not ended.findings:
        return True
    names = {log.motion.name for log in ended.found.dataset.logs}

    def left(each: Conclusion) -> float:
        dataset = each.found.dataset
        deciding = (*dataset.training, *dataset.selection)
        logs = [log for log in deciding if log.motion.name in names]
        return rms(error_on(each.found.final.fit.axis, logs))

    # a hundredth less or more is a fit of one log more
    return left(whole) < 1.01 * left(ended)


def _without_suspect(
    base: Fit, dataset: Dataset, without: Callable[[str | None], Conclusion]
) -> tuple[Conclusion, Disagreement] | None:
    """What the logs but the worst of them come to, where it disagrees beside what they prove.

    Where all that is left is of one log, nothing is proved with it, and beside so much it does not
    stand out: both are seen only at once. But the log that refutes a wrong law is left out as well
    by this. So it must be otherwise in a part of its time, or in one value that is no matter of
    what was found without it.
    """
    if (name := suspect(base.axis, dataset)) is None:
        return None
    ended = without(name)
    odd = _odd_beside(ended, dataset)
    if not ended.findings or odd is None or odd.log != name:
        return None
    return (ended, odd) if odd.is_sure_beside(laws_of(ended.found)) else None


def _others(base: Fit, dataset: Dataset, odd: str | None) -> tuple[Fit, Dataset]:
    """The fit of the logs but an odd one, and these."""
    if odd is None:
        return base, dataset
    rest = dataset.without(odd)
    if [*rest.training] == [*dataset.training]:
        return base, rest
    return replace(fit_axis(base.axis, rest.training), begun=base.begun), rest


def surely_odd(ended: Conclusion, dataset: Dataset) -> Disagreement | None:
    """The log that surely disagrees with all others beside all that was found."""
    return odd_in_all(ended.found.final.fit.axis, _as_found(ended, dataset))


def _odd_beside(ended: Conclusion, dataset: Dataset) -> Disagreement | None:
    """The log that disagrees with the others beside all that was found."""
    return odd_in(ended.found.final.fit.axis, _as_found(ended, dataset))


def _as_found(ended: Conclusion, dataset: Dataset) -> Dataset:
    """All logs as those that were concluded from: so late, and by test functions of that length."""
    found = ended.found.dataset
    there = realigned(dataset, found.channel_delay)
    return there if found.length == dataset.length else there.at_length(found.length)
