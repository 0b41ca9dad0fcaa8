"""A conclusion asked again at another length of the test functions.

A long test function averages out what is fast, such as the cogging of a motor at speed; a short one
passes so much noise that what is slow and small drowns in it. So no length shows all. Where what
was found leaves a force at another length that its own hides, the same is asked there. Which of the
two conclusions stands, the logs tell at both lengths: the other one must explain clearly more at
its own, and not less at that of the first. Whoever looks twice finds more by chance: what is asked
of a change rises with the lengths that were looked at (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from identify.dataset.dataset import Dataset
from identify.dataset.preparation import is_informative
from identify.dataset.prepared_log import moving, sticks
from identify.dataset.time_scale import AtLength
from identify.estimation.alignment import fit_aligned, realigned
from identify.estimation.fit import finished, fit_axis
from identify.estimation.offered import fitted_count
from identify.selection.acceptance import Judged, prefers
from identify.selection.doubts import Conclusion, concluded
from identify.selection.search import Found
from identify.selection.trying import refitted_on
from twin.effects import Catalogue
from twin.errors import InputError
from twin.parallel import Progress, silent, within


def at_another_length(
    ended: Conclusion, lengths: Sequence[float], catalogue: Catalogue, progress: Progress = silent
) -> Conclusion:
    """The conclusion that stands, at its own length or at that (s) which shows most beyond it."""
    showing = [*_showing(ended.found, lengths, catalogue)]
    if not showing:
        return ended
    length = max(showing, key=lambda judged: _shown(judged).information).dataset.length
    asked = within(progress, f"at {1e3 * length:.3g} ms")
    rival = _asked(length, ended.found.base, catalogue, asked)
    return rival if _stands(rival, ended) else ended


def _showing(found: Found, lengths: Sequence[float], catalogue: Catalogue) -> Iterator[Judged]:
    """What was found at each length (s) at which it leaves a force that its own length hides.

    A longer test function leaves less of any force: what leaves more there is the averaging of the
    model itself, as that of the load which a friction bears.
    """
    own = _shown(found.final)
    most = [_at_most(found.final)]
    for length in sorted(lengths):
        # A longer one averages out what hides a force here; a shorter one shows what is fast.
        if length > own.length and found.steps and not found.final.at_floor:
            continue
        if (dataset := _telling(length, found, catalogue)) is None:
            continue
        there = _at_its_length(found, dataset)
        shown = _shown(there)
        is_force = all(shown.structure <= m.structure for m in most if m.length < length)
        most.append(_at_most(there))
        shows = length > own.length or shown.shows_more_than(own)
        if is_force and not there.at_floor and (shows or not found.steps):
            yield there


def _at_its_length(found: Found, dataset: Dataset) -> Judged:
    """What was found on a dataset of another length; fitted, unless it is at the floor without."""
    fit = found.final.fit
    there = Judged(finished(fit.axis, fit.begun, dataset.training, fit.outcome), dataset)
    return there if there.at_floor else Judged(fit_axis(fit.axis, dataset.training), dataset)


def _shown(judged: Judged) -> AtLength:
    fit = judged.fit
    return AtLength(judged.dataset.test_function_length, fit.error, fit.floor)


def _at_most(judged: Judged) -> AtLength:
    """The same, with no more of it taken for noise than is sure."""
    return replace(_shown(judged), floor=judged.fit.noise.low)


def _telling(length: float, found: Found, catalogue: Catalogue) -> Dataset | None:
    """The dataset at another length (s), where all of its logs say something there."""
    alike = 1.5  # times a length, within which another shows the same
    own = found.dataset.test_function_length
    if max(length, own) < alike * min(length, own):
        return None
    axis = found.final.fit.axis
    try:
        dataset = found.dataset.at_length(length)
    except InputError:
        return None
    still = sticks(axis) or any(e.sticks for e in catalogue.values())
    each = all(moving([log], still).any() for log in dataset.logs)
    return dataset if each and is_informative(dataset, still, fitted_count(axis)) else None


def _asked(length: float, base: Judged, catalogue: Catalogue, progress: Progress) -> Conclusion:
    """What a search of a fit comes to at another length (s)."""
    dataset = realigned(base.dataset.at_length(length), 0.0)
    dataset, fit = fit_aligned(base.fit.axis, dataset)
    return concluded(replace(fit, begun=base.fit.begun), dataset, catalogue, progress)


def _stands(rival: Conclusion, ended: Conclusion) -> bool:
    """Whether a conclusion at another length stands in the place of the first."""
    first, final = ended.found.final, rival.found.final
    laws = [{s.change.name for s in c.found.steps} for c in (ended, rival)]
    if laws[0] == laws[1]:
        return False
    without = refitted_on(first.fit.axis, final)
    return prefers(final, without) and not prefers(first, refitted_on(final.fit.axis, first))
